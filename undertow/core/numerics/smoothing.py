"""The switching function of the robust terms, discontinuous or smooth (Remark 5)."""

import jax.numpy as jnp
from jaxtyping import Array, Float

SWITCHES = ("tanh", "sign")


def switch(value: Float[Array, "..."], layer: Float[Array, "..."] | float, kind: str) -> Float[Array, "..."]:
    """sign(value), or tanh(value / layer) with boundary layer `layer` (unit of `value`)."""
    return jnp.sign(value) if kind == "sign" else jnp.tanh(value * (1 / layer))

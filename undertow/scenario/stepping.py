"""Whether steps of fixed length are short enough for the thrusters, the fastest thing there is in a vehicle."""

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree

from undertow.scenario.schema import Loop
from undertow.thrusters.thruster import AbstractThruster

# Largest step times decay rate at which a method is stable.
_LIMITS = {"rk4": 2.785, "euler": 2.0}


def step_advice(thruster: AbstractThruster, loop: Loop) -> tuple[str, ...]:
    """A sentence when steps are too long for thrusters at rest, where only their linear part counts."""
    if loop.method not in _LIMITS:
        return ()
    rate, step = fastest_decay(thruster), loop.dt / loop.substeps
    longest = _LIMITS[loop.method] / rate if rate else np.inf
    if step <= longest:
        return ()
    remedy = (
        f"loop.substeps: {int(np.ceil(loop.dt / longest))} or more," if loop.kind == "sampled" else "a shorter loop.dt,"
    )
    return (
        f"the thrusters settle in {1e3 / rate:.3g} ms, but steps of {1e3 * step:g} ms are unstable beyond "
        f"{1e3 * longest:.3g} ms: the run will diverge by its steps alone. Take {remedy} or another rung",
    )


def fastest_decay(thruster: AbstractThruster) -> float:
    """Fastest decay of a thruster at rest, 1/s; 0 for one without a state."""
    rest, tree = ravel_pytree(thruster.initial_state(1))
    if not rest.size:
        return 0.0
    rates = lambda x: ravel_pytree(thruster.dynamics(tree(x), jnp.zeros(1)))[0]
    return float(np.abs(np.linalg.eigvals(np.asarray(jax.jit(jax.jacfwd(rates))(rest)))).max())

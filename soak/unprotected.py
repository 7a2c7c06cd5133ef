"""Parts without protection, for negative controls: the quotient of Gaussians as the paper prints it, and a glitch.

Scenarios name them by this file, as parts of a user's own.
"""

import dataclasses
from typing import Any, cast

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.control.controllers.composite_law import RCAF
from undertow.control.controllers.presets.paper import paper
from undertow.core.contracts import AbstractNavigation, Measurement, Model
from undertow.core.measurement import with_outputs
from undertow.core.param import Param, param


class PlainFuzzySystem(eqx.Module):
    """Eq. (37) as it is printed: products of Gaussians over their sum, 0/0 where the input lies far from every set."""

    centres: Float[Param, "p M"] = param("unit of the input", "centres of the sets", symbol="c")
    widths: Float[Param, "p M"] = param("unit of the input", "widths of the sets", symbol="sigma")

    @property
    def inputs(self) -> int:
        """Number p of inputs."""
        return self.centres.shape[0]

    @property
    def rules(self) -> int:
        """Number M^p of rules."""
        return self.centres.shape[1] ** self.inputs

    def basis(self, inputs: Float[Array, "n p"]) -> Float[Array, "n rules"]:
        """Fuzzy basis functions xi of each axis."""
        products = jnp.ones((inputs.shape[0], 1))
        for j in range(self.inputs):
            distance = (inputs[:, j, None] - self.centres[j][None, :]) / self.widths[j][None, :]
            degrees = jnp.exp(-(distance**2))
            products = (products[:, :, None] * degrees[:, None, :]).reshape(inputs.shape[0], -1)
        return products / products.sum(-1, keepdims=True)

    def output(self, weights: Float[Array, "n rules"], basis: Float[Array, "n rules"]) -> Float[Array, " n"]:
        """theta^T xi."""
        return (weights * basis).sum(-1)


class VelocityGlitch(AbstractNavigation):
    """Exact measurements, but for a time all velocities are wrong by the same amount."""

    size: Float[Param, ""] = param("m/s, rad/s", "error of the velocities")
    start: Float[Param, ""] = param("s", "when it begins")
    duration: Float[Param, ""] = param("s", "how long it lasts")
    smooth: bool = eqx.field(static=True, default=False)

    def realize(self, key):
        return ()

    def init(self, realization, truth: Measurement):
        return ()

    def measure(self, realization, state, t, truth: Measurement):
        present = (t >= self.start) & (t < self.start + self.duration)
        velocity = truth.velocity + jnp.where(present, self.size, 0.0)
        return with_outputs(truth, truth.position, velocity), state


def plain_basis(model: Model, fuzzy_input: str = "state", reach: tuple[float, ...] | None = None) -> RCAF:
    """The paper's law with the quotient of Eq. (37) as it is printed.

    Args:
        model: nominal model.
        fuzzy_input, reach: as of the preset `paper`.
    """
    law = cast(RCAF, paper(model, fuzzy_input=fuzzy_input, reach=reach))
    plain: Any = PlainFuzzySystem(centres=law.fuzzy.centres, widths=law.fuzzy.widths)
    return dataclasses.replace(law, fuzzy=plain)


def glitch(size: float = 5.0, start: float = 5.0, duration: float = 0.01) -> VelocityGlitch:
    """Velocities that are wrong for a moment.

    Args:
        size: error of all velocities, m/s and rad/s.
        start: when it begins, s.
        duration: how long it lasts, s.
    """
    return VelocityGlitch(size=jnp.asarray(size), start=jnp.asarray(start), duration=jnp.asarray(duration))

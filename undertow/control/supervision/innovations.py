"""Sequences of readings of which each is plausible, and the sequence is not.

The gate judges one reading at a time against a prediction that begins anew at every reading that it accepts, so that a
position can run away in steps, and a velocity can change its sign at every step. Two tests of the accepted innovations
see that: their sum, which is the way of a position that the measured velocity does not explain (Page's test with a
forgetting factor in place of a drift), and the mean of their sizes.
"""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.control.supervision.motion import MonitoredMotion, length, split
from undertow.core import checks
from undertow.core.numerics.rotations import attitude_error
from undertow.core.param import Param, param

Scalar = Float[Array, ""]

_MOST = 2.0  # limits that a sum reaches at most, so that it decays in a known time


class InnovationState(NamedTuple):
    """Innovations until now, relative to the limits of a jump."""

    moved: Array  # sum of a position, of each coordinate
    turned: Array  # the same of the attitude, body axes; empty for a plant that is no vehicle
    of_velocity: Array  # of the velocity, the last one
    sizes: Float[Array, "4"]  # mean size of position, attitude, velocity and angular velocity


class InnovationMonitor(eqx.Module):
    """Tests of the innovations of readings that the gate has accepted.

    Raises:
        BadInput: a time or a share is not positive.
    """

    memory: Float[Param, ""] = param("s", "in which a sum of innovations is forgotten", default=2.0)
    averaged: Float[Param, ""] = param("s", "over which the size of innovations is averaged", default=1.0)
    noise: Float[Param, ""] = param("", "largest mean size, as a share of the limit of a jump", default=0.1)

    def __check_init__(self):
        for name in ("memory", "averaged", "noise"):
            checks.positive(name, getattr(self, name))

    def init(self, y: MonitoredMotion) -> InnovationState:
        """State before the first innovation."""
        turned = jnp.zeros(3 if y.attitude.shape[0] else 0)
        return InnovationState(jnp.zeros_like(y.position), turned, jnp.zeros_like(y.velocity), jnp.zeros(4))

    def after(
        self,
        state: InnovationState,
        accepted: MonitoredMotion,
        expected: MonitoredMotion,
        jumps: "JumpLimits",
        believe,
        dt: Scalar,
    ) -> InnovationState:
        """State with one more measurement.

        Args:
            state: before.
            accepted: the measurement that the gate lets through; where it is a prediction there is no innovation.
            expected: the prediction for it.
            jumps: limits of a jump.
            believe: whether a jump is taken as the truth; it then is no innovation.
            dt: time since the measurement before, s.
        """
        moved = (accepted.position - expected.position) / jumps.position
        turned = jnp.zeros(0)
        if accepted.attitude.shape[0]:
            turned = attitude_error(accepted.attitude, expected.attitude) / jumps.angle
        # An acceleration that the model does not know is no noise: what is the same again and again counts as nothing.
        of_velocity = accepted.velocity - expected.velocity
        straight, turning = split((of_velocity - state.of_velocity) / 2)
        parts = moved, turned, straight / jumps.velocity, turning / jumps.rate
        without_jumps = lambda part: jnp.where(believe & (jnp.abs(part) > 1), 0.0, part)
        moved, turned, *_ = parts = tuple(map(without_jumps, parts))
        sizes = jnp.stack([jnp.abs(part).max(initial=0.0) for part in parts])
        decay = jnp.maximum(1 - dt / self.memory, 0.0)
        summed = lambda before, part: jnp.clip(decay * before + part, -_MOST, _MOST)
        share = jnp.minimum(dt / self.averaged, 1.0)
        return InnovationState(
            moved=summed(state.moved, moved),
            turned=summed(state.turned, turned),
            of_velocity=of_velocity,
            sizes=state.sizes + share * (sizes - state.sizes),
        )

    def contradiction(self, state: InnovationState) -> Scalar:
        """Way, relative to the limit of a jump, that position and velocity contradict each other by."""
        turned = length(state.turned) if state.turned.shape[0] else jnp.zeros(())
        return jnp.maximum(jnp.abs(state.moved).max(), turned)

    def noise_ratio(self, state: InnovationState) -> Scalar:
        """Mean size of the innovations relative to the largest one."""
        return state.sizes.max() / self.noise


class JumpLimits(NamedTuple):
    """Largest plausible innovations."""

    position: Scalar  # m
    angle: Scalar  # rad
    velocity: Scalar  # m/s
    rate: Scalar  # rad/s

"""The place that is held after readings have jumped.

A position that has jumped may be right: a filter was reset, a beacon was moved. The old target is then somewhere else
than it was, and the law would go there with all that the thrusters give. It holds the present place instead, until the
operator agrees: by a request, or by giving another target.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from undertow.core.contracts import AbstractCoordinates, Measurement, Target

Flag = Bool[Array, ""]

_ELSEWHERE = 0.25  # m or rad from where a target would be by now, of another target


class PlaceState(NamedTuple):
    """What the law pursues, and why."""

    pursued: Target  # the reference, or a place at rest
    held: Int[Array, ""]  # 1 where it is a place
    jumped: Int[Array, ""]  # 1 where control has ended because of readings that have jumped


def no_place(r: Target) -> PlaceState:
    """The state in which the reference is pursued."""
    none = jnp.zeros((), dtype=int)
    return PlaceState(r, none, none)


def target(state: PlaceState, r: Target) -> Target:
    """What the law pursues now."""
    return jax.tree.map(lambda held, new: jnp.where(state.held > 0, held, new), state.pursued, r)


def after_jump(
    state: PlaceState, waits: Flag, safe: Flag, jumps: Flag, begins: Flag, y: Measurement, r: Target
) -> PlaceState:
    """The state with one more step.

    Args:
        state: before.
        waits: whether nobody controls after this step.
        safe: whether the supervisor is in SAFE then.
        jumps: whether readings that have jumped ask for that.
        begins: whether control begins with the next step.
        y: measurement, as the gate lets it through.
        r: the reference.
    """
    stays = begins & (state.jumped > 0)
    present, ahead = _place(y, r), target(state, r)
    pursued = jax.tree.map(lambda held, new: jnp.where(stays, held, new), present, ahead)
    jumped = waits & ((state.jumped > 0) | (safe & jumps))
    return PlaceState(pursued, jnp.where(stays, 1, state.held).astype(int), jumped.astype(int))


def released(state: PlaceState, agreed: Flag) -> PlaceState:
    """The state after the operator has agreed to go on, or has not."""
    return state._replace(held=jnp.where(agreed, 0, state.held).astype(int))


def is_another(before: Target, r: Target, coordinates: AbstractCoordinates, elapsed: Float[Array, ""]) -> Flag:
    """Whether a reference is not the one from before, elapsed (s) later; who gives another one agrees to go there."""
    away = coordinates.difference(r.position, before.position) - elapsed * before.velocity
    return jnp.abs(away).max() > _ELSEWHERE


def _place(y: Measurement, r: Target) -> Target:
    """The present place as a target at rest; a vehicle is held with roll and pitch of its reference."""
    position = y.position if y.body is None else jnp.concatenate([y.position[:3], r.position[3:5], y.position[5:]])
    return Target(position, jnp.zeros_like(position), jnp.zeros_like(position))

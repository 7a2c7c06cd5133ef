"""What a replay shows and a result file does not hold: thrust, water at the vehicle and the fuzzy basis functions."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, PRNGKeyArray

from undertow.control.estimation.fuzzy_system import FuzzySystem
from undertow.core.contracts import AbstractController, Pose
from undertow.core.kept_programs import briefly_compiled
from undertow.core.numerics.random_keys import key_of_seed
from undertow.core.numerics.rotations import quaternion_from_euler, rotation_from_quaternion
from undertow.physics.thrusters.thruster import AbstractThruster
from undertow.simulation.loop.closed_loop import ClosedLoop

Series = np.ndarray

# Records per compiled call, so that runs of any length share one program; and steps of the thrusters per record.
_CHUNK, _SUBSTEPS = 256, 2
_LONG = 20.0  # s, after which every thruster is steady


def thrust_along(thruster: AbstractThruster, inputs: Series, step: float) -> Series:
    """Thrust of each thruster, N, from its recorded input: the thruster's own dynamics, from rest.

    Between records the input is interpolated, so thrust that changes faster than the records is smoothed.

    Args:
        thruster: what turns the input into thrust.
        inputs: applied, shape (records, N).
        step: time between records, s.
    """
    state = thruster.initial_state(inputs.shape[1])
    dt = jax.device_put(inputs.dtype.type(step))
    parts = []
    padded = np.concatenate([inputs, np.repeat(inputs[-1:], -(len(inputs) - 1) % _CHUNK, axis=0)])
    for first in range(0, len(padded) - 1, _CHUNK):
        block = padded[first : first + _CHUNK + 1]
        state, thrust = _thrust_of_chunk(thruster, state, *jax.device_put((block[:-1], block[1:])), dt)
        parts.append(np.asarray(thrust))
    last = np.asarray(_thrust(thruster, state, jax.device_put(padded[-1])))
    return np.concatenate([*parts, last[None]])[: len(inputs)]


@briefly_compiled
def _thrust_of_chunk(thruster: AbstractThruster, state: Any, inputs: Array, next_inputs: Array, dt: Array) -> Any:
    """State after the records, and thrust at each: linearly implicit Euler, stable for windings far faster than dt."""
    start, unravel = ravel_pytree(state)
    rate = lambda flat, u: ravel_pytree(thruster.dynamics(unravel(flat), u))[0]
    h = dt / _SUBSTEPS

    def substep(flat, u):
        slope = jax.jacfwd(rate)(flat, u)
        return flat + h * jnp.linalg.solve(jnp.eye(flat.size, dtype=flat.dtype) - h * slope, rate(flat, u)), None

    def record(flat, between):
        u, after = between
        shares = (jnp.arange(_SUBSTEPS, dtype=u.dtype) + 0.5) / _SUBSTEPS
        thrust = _thrust(thruster, unravel(flat), u)
        if flat.size:
            flat, _ = jax.lax.scan(substep, flat, u[None, :] + shares[:, None] * (after - u)[None, :])
        return flat, thrust

    final, thrust = jax.lax.scan(record, start, (inputs, next_inputs))
    return unravel(final), thrust


@briefly_compiled
def _thrust(thruster: AbstractThruster, state: Any, u: Array) -> Array:
    return jnp.broadcast_to(thruster.thrust(state, u), u.shape).astype(u.dtype)


def thrust_limits(thruster: AbstractThruster, count: int) -> Series:
    """Steady thrust at the limits of the input, N, shape (N, 2): reverse and forward; infinite without a limit."""
    limits = []
    for limit in thruster.limits():
        volts = np.broadcast_to(np.asarray(limit), (count,)).astype(np.asarray(limit).dtype)
        held = np.tile(np.where(np.isfinite(volts), volts, 0.0), (_CHUNK + 1, 1))
        steady = thrust_along(thruster, held, _LONG / _CHUNK)[-1]
        limits.append(np.where(np.isfinite(volts), steady, volts))
    return np.stack(limits, axis=-1)


class Environment(NamedTuple):
    """What disturbance and faults do at the vehicle, one entry per record; None where they do nothing of the kind."""

    water: Series | None  # velocity of the water over ground, m/s: north, east, down
    thrust_share: Series | None  # share of its thrust that each thruster gives


def environment(loop: ClosedLoop, seed: int, time: Series, position: Series, velocity: Series) -> Environment:
    """Water and thrust losses at the vehicle along a run; what is random in disturbance and faults is that of the run.

    Args:
        loop: the closed loop that was run.
        seed: of the run.
        time: s.
        position: outputs, shape (records, 6).
        velocity: their rates, shape (records, 6).
    """
    histories = _environment(loop, key_of_seed(seed), *jax.device_put((time, position, velocity)))
    return Environment(*(None if series is None else np.asarray(series) for series in histories))


@briefly_compiled
def _environment(
    loop: ClosedLoop, key: PRNGKeyArray, time: Array, position: Array, velocity: Array
) -> tuple[Array | None, Array | None]:
    realization = loop.realize(key)

    def at(t, outputs, rates):
        pose = Pose(outputs[:3], rotation_from_quaternion(quaternion_from_euler(outputs[3:])), rates[:3])
        load = realization.load_at(t, pose)
        water = None if load.water is None else load.water.velocity
        share = None if load.scaling is None else jnp.broadcast_to(load.scaling.thrust, (loop.plant.inputs(),))
        return water, share

    return jax.vmap(at)(time, position, velocity)


def firing_along(controller: AbstractController, run: xr.Dataset) -> Series | None:
    """Fuzzy basis functions xi of Eq. (37), shape (records, axes, rules); None for a law without a fuzzy system."""
    fuzzy = getattr(controller, "fuzzy", None)
    if fuzzy is None or not {"weights", "modelling_error"} <= set(run.variables):
        return None
    if getattr(controller, "fuzzy_input", "error") == "state":
        inputs = np.stack([run["measured_position"].values, run["measured_velocity"].values], axis=-1)
    else:
        inputs = run["modelling_error"].values[..., None]
    basis = _basis(fuzzy, jax.device_put(inputs.reshape(-1, inputs.shape[-1])))
    return np.asarray(basis).reshape(*inputs.shape[:2], -1)


@briefly_compiled
def _basis(fuzzy: FuzzySystem, inputs: Array) -> Array:
    return fuzzy.basis(inputs)

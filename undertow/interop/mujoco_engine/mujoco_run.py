"""A sampled closed loop of an undertow controller and a vehicle in MuJoCo."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike, NDArray

from undertow.core import checks
from undertow.core.contracts import AbstractController, AbstractReference, Measurement, starting_at
from undertow.core.errors import BadInput
from undertow.core.measurement import measurement_of_outputs
from undertow.core.runtime import double_outside_runs
from undertow.core.status import Status
from undertow.interop.mujoco_engine.propellers import Propellers
from undertow.interop.mujoco_engine.submerged import Submerged
from undertow.thrusters.thruster import AbstractThruster, PropellerReport


class MujocoRun(NamedTuple):
    """What happened, at each sampling time of the controller; rows as in an undertow dataset."""

    time: NDArray  # s, shape (K,)
    position: NDArray  # m, rad, shape (K, 6)
    velocity: NDArray  # m/s, rad/s, shape (K, 6)
    target: NDArray  # m, rad, shape (K, 6)
    voltage: NDArray  # applied, V, shape (K, N)
    status: Status  # of the end; series end with the last valid state


@double_outside_runs
def run_in_mujoco(
    body: Submerged,
    thruster: AbstractThruster,
    controller: AbstractController,
    reference: AbstractReference,
    *,
    duration: float = 20.0,
    dt: float = 1e-2,
    position: ArrayLike | None = None,
) -> MujocoRun:
    """Run a sampled closed loop with MuJoCo as the plant: command, move with the volts held, then adapt.

    Args:
        body: the vehicle in MuJoCo.
        thruster: on fidelity `shaft` or `static`.
        controller: any, made from the model of an undertow plant.
        reference: what to follow.
        duration: s, rounded to whole sampling times.
        dt: sampling time of the controller, s; a whole number of the engine's steps.
        position: north, east, down (m), roll, pitch, yaw (rad) at t = 0, at rest; None for zero.

    Returns:
        MujocoRun. One that fails says so in its status; nothing is raised.

    Raises:
        BadInput: times that do not go together, or another kind of thruster.
    """
    checks.positive("duration", duration, "s")
    checks.positive("dt", dt, "s")
    timestep = body.model.opt.timestep
    per_step = round(dt / timestep)
    if per_step < 1 or abs(per_step * timestep - dt) > 1e-9 * dt:
        raise BadInput("dt", f"be a whole number of the engine's steps ({timestep:g} s)", f"{dt:g} s")
    propellers = Propellers(thruster, body.model.nu)
    start = np.zeros(6) if position is None else np.asarray(position, dtype=float)
    body.place(start, np.zeros(6))
    reference = starting_at(reference, jnp.asarray(start))
    command, advance, desired = map(eqx.filter_jit, (controller.command, controller.advance, reference.at))
    z, rows, control_steps, status = None, [], round(duration / dt), Status.OK
    for step in range(control_steps + 1):
        t = step * dt
        y, r = _measured(body, propellers), desired(jnp.asarray(t))
        z = controller.init(y, r) if z is None else z
        volts, _ = command(z, y, r)
        applied = propellers.admissible(np.asarray(volts))
        status = body.status() if np.isfinite(volts).all() else Status.COMMAND_NOT_FINITE
        if status != Status.OK:
            break
        rows.append((t, body.position(), body.velocity(), np.asarray(r.position), applied))
        if step < control_steps:
            thrusts = propellers.turn(applied, dt, 2 * per_step)
            # Runge-Kutta asks at the ends and in the middle of each step.
            body.advance(lambda now, t=t, thrusts=thrusts: thrusts[round(2 * (now - t) / timestep)], per_step)
            z = advance(z, y, r, jnp.asarray(applied), jnp.asarray(dt))
    return MujocoRun(*map(np.array, zip(*rows, strict=True)), status=status)


def _measured(body: Submerged, propellers: Propellers) -> Measurement:
    turning = PropellerReport(jnp.asarray(propellers.speed), None)
    return measurement_of_outputs(jnp.asarray(body.position()), jnp.asarray(body.velocity()), turning)

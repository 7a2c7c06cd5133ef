"""Loads and measurement errors along the reference, before a run."""

import dataclasses
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, PRNGKeyArray

from undertow.analysis.linearization.equilibrium import Equilibrium
from undertow.analysis.linearization.jacobians import Parts
from undertow.core.arrays import as_array
from undertow.core.contracts import Load, Outputs, Pose
from undertow.core.kept_programs import briefly_compiled
from undertow.core.numerics.linear_algebra import matvec
from undertow.simulation.loop.closed_loop import ClosedLoop

_BRIEF = 0.1  # share of the time for which the flow may be faster: too short for errors to grow


class OperatingConditions(NamedTuple):
    """What acts at one operating point."""

    where: str
    load: np.ndarray  # acceleration of the outputs, m/s^2, rad/s^2
    flow: np.ndarray | None  # velocity of the water past the vehicle, m/s; None for other plants


class DisturbanceProfile(NamedTuple):
    """Along the reference, one row per step.

    Attributes:
        time: s.
        load: what the model does not know of the acceleration, as an acceleration of the outputs where the loop
            rests, m/s^2 and rad/s^2: disturbances, and what moving along the reference takes beyond the model.
        noise: measured minus true position and velocity, m, rad, m/s, rad/s.
        flow: velocity of the water past the vehicle, m/s, world axes where the loop rests; None for other plants.
        start: states of plant and law at t = 0 as vectors of `Parts`, where the outputs there were given.
    """

    time: np.ndarray
    load: np.ndarray
    noise: np.ndarray
    flow: np.ndarray | None
    start: tuple[np.ndarray, np.ndarray] | None = None

    def operating_points(self, shares: tuple[float, ...]) -> list[OperatingConditions]:
        """Where the load is larger than given shares of all, and for a vehicle the flow faster than nine tenths of all.

        Sizes of loads are in units of each axis' rms.
        """
        scale = np.sqrt((self.load**2).mean(axis=0))
        size = np.linalg.norm(self.load / np.where(scale > 0, scale, 1.0), axis=1)
        order = np.argsort(size, kind="stable")
        rows = {f"{100 * share:.0f} % quantile of the load": order[round(share * (len(order) - 1))] for share in shares}
        if self.flow is None:
            return [OperatingConditions(where, self.load[row], None) for where, row in rows.items()]
        fastest_first = np.argsort(-np.linalg.norm(self.flow, axis=1), kind="stable")
        rows["fast flow"] = fastest_first[round(_BRIEF * (len(fastest_first) - 1))]
        return [OperatingConditions(where, self.load[row], self.flow[row]) for where, row in rows.items()]


def disturbance_profile(
    loop: ClosedLoop,
    at: Equilibrium,
    key: PRNGKeyArray,
    steps: int,
    dt: float,
    outputs: tuple[Outputs, Outputs] | None = None,
) -> DisturbanceProfile:
    """What acts along the reference, with the same chances as in a run with this key.

    Args:
        loop: the five roles.
        at: the loop at rest; unknown quantities are relative to it.
        key: of everything random in the run.
        steps: how many, from t = 0.
        dt: s.
        outputs: position and velocity at t = 0, for the states of a run there; None for none.
    """
    x, u = as_array(at.at["plant"]), as_array(at.at["u"])
    unknown, noise, flow, start = _along(loop, at.parts, key, x, u, as_array(dt), steps, outputs)
    flow = None if flow is None else np.asarray(flow)
    start = None if start is None else (np.asarray(start[0]), np.asarray(start[1]))
    return DisturbanceProfile(np.arange(steps) * dt, np.asarray(unknown), np.asarray(noise), flow, start)


@briefly_compiled
def _along(loop: ClosedLoop, parts: Parts, key: PRNGKeyArray, x_rest, u, dt, steps: int, at_start):
    realization, x_rest = loop.realize(key), parts.plant_state(x_rest)
    plant = loop.plant
    zero = jnp.zeros(())
    dynamics, coordinates, actuators = loop.controller.model
    held = actuators.quasi_static()
    forces = held.force(held.init(), u)

    def unknown(t, x, load):
        y = plant.output(t, x)
        moved = coordinates.acceleration(y, plant.acceleration(t, x, u, load))
        return moved - dynamics.drift(y) - dynamics.gain(y) @ forces

    y_rest = plant.output(zero, x_rest)
    zero_outputs = jnp.zeros_like(y_rest.position)
    # With actuators as they are along the reference, where they begin to turn: their thrust is no part of the load.
    at_rest = unknown(zero, plant.initial_state(y_rest.position, zero_outputs), plant.no_load())
    # From accelerations of the outputs to those along the axes of the law, at rest.
    scale = jax.jacfwd(lambda a: coordinates.acceleration(y_rest, a))(zero_outputs)

    times = jnp.arange(steps, dtype=float) * dt
    resting = plant.pose(x_rest)

    def along(t):
        r = loop.reference.at(t)
        x = plant.initial_state(r.position, r.velocity)
        load = realization.load(t, x)
        return (
            plant.output(t, x),
            jnp.linalg.solve(scale, unknown(t, x, load) - at_rest),
            _flow(load, plant.pose(x), resting),
        )

    outputs, loads, flow = jax.vmap(along)(times)

    def look(measuring, instant):
        t, truth = instant
        y, measuring = loop.navigation.measure(realization.navigation_realization, measuring, t, truth)
        position_error = coordinates.difference(y.position, truth.position)
        errors = jnp.concatenate([position_error, y.velocity - truth.velocity])
        return measuring, jnp.where(jnp.isfinite(errors), errors, 0.0)  # the law is given what it expects

    start = loop.reference.at(zero)
    measuring = loop.navigation.init(
        realization.navigation_realization, plant.output(zero, plant.initial_state(start.position, start.velocity))
    )
    noise = jax.lax.scan(look, measuring, (times, outputs))[1]
    if at_start is None:
        return loads, noise, flow, None
    # Of the law as it is linearised; what is random is the same.
    begun = dataclasses.replace(loop, controller=parts.loop.controller).realize(key).start(*at_start)
    return loads, noise, flow, [ravel_pytree(state)[0] for state in begun]


def _flow(load: Load, pose: Pose | None, resting: Pose | None) -> Array | None:
    """Velocity of the water past a vehicle, m/s, as it is past one that rests and has the same in body axes."""
    if pose is None or resting is None:
        return None
    water = jnp.zeros(3) if load.water is None else load.water.velocity
    return matvec(resting.rotation, matvec(pose.rotation.T, water - pose.velocity))

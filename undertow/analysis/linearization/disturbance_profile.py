"""Loads and measurement errors along the reference, before a run."""

import dataclasses
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree
from jaxtyping import Array, PRNGKeyArray

from undertow.analysis.linearization.equilibrium import Equilibrium
from undertow.analysis.linearization.jacobians import Parts
from undertow.core.arrays import as_array
from undertow.core.contracts import Load, Measurement, Outputs, Pose, Time
from undertow.core.kept_functions import Recursion, along_steps
from undertow.core.numerics.linear_algebra import matvec
from undertow.simulation.loop.closed_loop import ClosedLoop, Realization
from undertow.simulation.loop.recording import instant

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
    subject = _Subject(loop, at.parts, key, x, u, as_array(dt), outputs)
    (_, start), (load, noise, flow) = along_steps(_ALONG, subject, steps)
    return DisturbanceProfile(np.arange(steps) * dt, load, noise, flow, start)


class _Subject(NamedTuple):
    """What a profile follows from: arguments of `disturbance_profile`, and state and input of the loop at rest."""

    loop: ClosedLoop
    parts: Parts
    key: PRNGKeyArray
    x_rest: Array
    u: Array
    dt: Array
    at_start: tuple[Outputs, Outputs] | None


_Sampled = tuple[_Subject, Realization]  # with everything random


def _prepare(subject: _Subject) -> _Sampled:
    return subject, subject.loop.realize(subject.key)


def _start(sampled: _Sampled) -> tuple[Any, list[Array] | None]:
    """State of the navigation; and those of plant and law at t = 0, as vectors."""
    (subject, realization), zero = sampled, jnp.zeros(())
    _, truth = _on_reference(subject.loop, zero)
    measuring = subject.loop.navigation.init(realization.navigation_realization, truth)
    if subject.at_start is None:
        return measuring, None
    # Of the law as it is linearised; what is random is the same.
    linearised = dataclasses.replace(subject.loop, controller=subject.parts.loop.controller)
    begun = realization._replace(loop=linearised).start(*subject.at_start)
    return measuring, [ravel_pytree(state)[0] for state in begun]


def _step(sampled: _Sampled, carry: tuple[Any, Any], k: Array) -> tuple[Any, Any]:
    (subject, realization), (measuring, begun) = sampled, carry
    t = instant(k, subject.dt)
    _, truth = _on_reference(subject.loop, t)
    return subject.loop.navigation.measure(realization.navigation_realization, measuring, t, truth)[1], begun


def _record(sampled: _Sampled, carry: tuple[Any, Any], k: Array) -> tuple[Array, Array, Array | None]:
    """Load, noise and flow of a `DisturbanceProfile`."""
    subject, realization = sampled
    t, loop, plant = instant(k, subject.dt), subject.loop, subject.loop.plant
    x, truth = _on_reference(loop, t)
    load = realization.load(t, x)
    y, _ = loop.navigation.measure(realization.navigation_realization, carry[0], t, truth)
    position_error = loop.controller.model.coordinates.difference(y.position, truth.position)
    errors = jnp.concatenate([position_error, y.velocity - truth.velocity])
    noise = jnp.where(jnp.isfinite(errors), errors, 0.0)  # the law is given what it expects
    x_rest = subject.parts.plant_state(subject.x_rest)
    return _load_at_rest(subject, x_rest, t, x, load), noise, _flow(load, plant.pose(x), plant.pose(x_rest))


def _on_reference(loop: ClosedLoop, t: Time) -> tuple[Any, Measurement]:
    """State of the plant on the reference, and its outputs."""
    r = loop.reference.at(t)
    x = loop.plant.initial_state(r.position, r.velocity)
    return x, loop.plant.output(t, x)


def _load_at_rest(subject: _Subject, x_rest: Any, t: Time, x: Any, load: Load) -> Array:
    """What the model does not know at a state, as an acceleration of the outputs where the loop rests."""
    (dynamics, coordinates, actuators), plant, zero = subject.loop.controller.model, subject.loop.plant, jnp.zeros(())
    held, y_rest = actuators.quasi_static(), plant.output(zero, x_rest)
    forces, still = held.force(held.init(), subject.u), jnp.zeros_like(y_rest.position)

    def unknown(t: Time, x: Any, load: Load) -> Array:
        y = plant.output(t, x)
        moved = coordinates.acceleration(y, plant.acceleration(t, x, subject.u, load))
        return moved - dynamics.drift(y) - dynamics.gain(y) @ forces

    # With actuators as they are along the reference, where they begin to turn: their thrust is no part of the load.
    at_rest = unknown(zero, plant.initial_state(y_rest.position, still), plant.no_load())
    # From accelerations of the outputs to those along the axes of the law, at rest.
    scale = jax.jacfwd(lambda a: coordinates.acceleration(y_rest, a))(still)
    return jnp.linalg.solve(scale, unknown(t, x, load) - at_rest)


_ALONG = Recursion(_prepare, _start, _step, _record)


def _flow(load: Load, pose: Pose | None, resting: Pose | None) -> Array | None:
    """Velocity of the water past a vehicle, m/s, as it is past one that rests and has the same in body axes."""
    if pose is None or resting is None:
        return None
    water = jnp.zeros(3) if load.water is None else load.water.velocity
    return matvec(resting.rotation, matvec(pose.rotation.T, water - pose.velocity))

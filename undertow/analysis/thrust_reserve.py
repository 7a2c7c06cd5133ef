"""Forces and moments that thrusters can hold, before and after a loss, and whether a reference needs more.

Host side: linear programmes by SciPy, nothing of the loop.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from undertow.control.supervision.reduced_model import VEHICLE_PRIORITY, attained_share
from undertow.core.arrays import as_array
from undertow.core.contracts import AbstractReference, Model
from undertow.core.errors import BadInput
from undertow.core.kept_programs import briefly_compiled, kept_program
from undertow.core.runtime import double_outside_runs

# Share of an acceleration demanded of one axis that makes it one that the actuators control.
_CONTROLLED = 0.85
_NOTHING = 1e-9  # m/s^2, rad/s^2
_ENOUGH = 1e3  # times the demand; a larger reserve is not searched for


class AttainableWrench(NamedTuple):
    """Least and largest force or moment along each axis, (n, 2), N and N m (or acceleration, of a gain)."""

    alone: np.ndarray  # with the other controlled axes at zero; NaN for an axis that is not controlled
    free: np.ndarray  # whatever happens along the others


class Reserve(NamedTuple):
    """How much of what a reference demands the actuators can give."""

    share: float  # largest factor on the demand that stays within limits, at the worst time; feasible from 1 on
    time: float  # of the worst, s
    missing: tuple[int, ...]  # axes that are no longer controlled, although all actuators together do

    @property
    def feasible(self) -> bool:
        """Whether the reference can be followed, as far as the model knows."""
        return self.share >= 1 and not self.missing


def attainable_wrench(
    matrix: Any, low: Any, high: Any, lost: Sequence[int] = (), axes: Sequence[int] | None = None
) -> AttainableWrench:
    """Largest steady forces and moments of a set of thrusters.

    Args:
        matrix: force and moment per thrust, (n, N), such as `plant.thruster_matrix`.
        low, high: limits of the thrusts, N; one number or one per thruster.
        lost: numbers, from 0, of thrusters that give nothing.
        axes: those that count as controlled; None: those that the thrusters that are left control.

    Raises:
        BadInput: a thruster that does not exist, or limits without 0 between them.
    """
    matrix, low, high = _checked(matrix, low, high, lost)
    working = np.delete(np.arange(matrix.shape[1]), list(lost))
    controlled = list(controlled_axes(matrix, lost) if axes is None else axes)
    matrix, low, high = matrix[:, working], low[working], high[working]
    ends = np.stack([matrix * low, matrix * high])
    free = np.stack([ends.min(0).sum(-1), ends.max(0).sum(-1)], axis=-1)
    alone = np.full((len(matrix), 2), np.nan)
    for axis in controlled:
        other_axes = [other_axis for other_axis in controlled if other_axis != axis]
        for side, sign in enumerate((-1.0, 1.0)):
            alone[axis, side] = sign * _most(sign * matrix[axis], matrix[other_axes], low, high)
    return AttainableWrench(alone, free)


@double_outside_runs
def controlled_axes(matrix: Any, lost: Sequence[int] = ()) -> tuple[int, ...]:
    """Axes, numbered from 0, on which actuators meet a demand at least to 85 %; of little priority give way first.

    Args:
        matrix: force, moment or acceleration per actuator, (n, N); with six axes, those of a vehicle.
        lost: numbers, from 0, of actuators that give nothing.
    """
    matrix = np.asarray(matrix, dtype=float)
    used = np.ones(matrix.shape[1])
    used[list(lost)] = 0.0
    priority = VEHICLE_PRIORITY if len(matrix) == len(VEHICLE_PRIORITY) else (1.0,) * len(matrix)
    share = _attained_share(as_array(matrix), as_array(used), as_array(priority))
    return tuple(int(axis) for axis in np.flatnonzero(np.asarray(share) > _CONTROLLED))


@double_outside_runs
def reference_reserve(
    model: Model,
    reference: AbstractReference,
    duration: float,
    water: Any = (0.0, 0.0, 0.0),
    lost: Sequence[int] = (),
    samples: int = 200,
    enough: float = _ENOUGH,
) -> Reserve:
    """Whether the actuators that are left can follow a reference, by the nominal model.

    The demand is the acceleration of the target less the drift F at its velocity through the water: weight, buoyancy,
    drag and Coriolis forces, on the axes that are still controlled. Feedback, loads and errors of the model need a
    reserve beyond 1.

    Args:
        model: from `plant.model()`.
        reference: given from its start.
        duration: s.
        water: its velocity, m/s: north, east, down; for a vehicle only.
        lost: numbers, from 0, of actuators that give nothing.
        samples: number of times at which the demand is computed.
        enough: a reserve beyond which no larger one is searched for; a small one is found sooner.

    Raises:
        BadInput: an actuator that does not exist.
    """
    times = np.linspace(0.0, duration, samples)
    demands_and_limits = _demands(model, reference, as_array(times), as_array(water))
    demands, gains, least, largest = (np.asarray(value) for value in demands_and_limits)
    _, low, high = _checked(gains[0], least, largest, lost)
    controlled = controlled_axes(gains[0], lost)
    share = lambda required, effect: _share(effect, required, low, high, lost, controlled, enough)
    worst, time = min((share(*both), float(t)) for *both, t in zip(demands, gains, times, strict=True))
    return Reserve(worst, time, tuple(sorted(set(controlled_axes(gains[0])) - set(controlled))))


@briefly_compiled
def _demands(model: Model, reference: AbstractReference, times, water):
    """Acceleration that the actuators have to give and the gain, at each time; least and largest steady forces."""
    dynamics, coordinates, actuators = model.in_body_axes()
    held = actuators.quasi_static()

    def demand(t):
        target = reference.at(t)
        ground = coordinates.measurement(target.position, target.velocity)
        flow = jnp.zeros_like(target.velocity)
        flow = flow.at[:3].set(water) if flow.shape[0] == 6 else flow
        relative_measurement = coordinates.measurement(target.position, target.velocity - flow)
        required = coordinates.tracking_error(ground, target).acceleration - dynamics.drift(relative_measurement)
        return required, dynamics.gain(ground)

    return *jax.vmap(demand)(times), *held.range(held.init(), jnp.ones(()))


_attained_share = kept_program(attained_share)


def _share(effect, required, low, high, lost, axes, enough) -> float:
    """Largest s with E f = s times the demand along the axes, and f within its limits; at most `enough`."""
    working = np.delete(np.arange(effect.shape[1]), list(lost))
    rows, required = effect[np.ix_(list(axes), working)], required[list(axes)]
    low, high = low[working], high[working]
    if np.linalg.norm(required) < _NOTHING:
        return enough
    least = np.linalg.lstsq(rows, enough * required)[0]
    meets = np.linalg.norm(rows @ least - enough * required) < _NOTHING
    if meets and ((low <= least) & (least <= high)).all():
        return enough
    extended = np.concatenate([rows, -required[:, None]], axis=1)
    low, high = np.append(low, 0.0), np.append(high, enough)
    return _most(np.append(np.zeros(len(working)), 1.0), extended, low, high)


def _most(gain: np.ndarray, zero: np.ndarray, low: np.ndarray, high: np.ndarray) -> float:
    """Largest gain . f with `zero` f = 0 and f between its limits."""
    from scipy.optimize import linprog  # a third of a second, which scenarios far from their limits need not wait for

    bounds = list(zip(low, high, strict=True))
    rows = {"A_eq": zero, "b_eq": np.zeros(len(zero))} if len(zero) else {}
    optimum = linprog(-gain, bounds=bounds, **rows)
    return float("inf") if optimum.status == 3 else -float(optimum.fun)


def _checked(matrix, low, high, lost) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Arrays of a matrix and of limits per actuator."""
    matrix = np.asarray(matrix, dtype=float)
    count = matrix.shape[1]
    low, high = (np.broadcast_to(np.asarray(end, dtype=float), (count,)) for end in (low, high))
    for actuator in lost:
        if not 0 <= actuator < count:
            raise BadInput("lost", f"have numbers from 0 to {count - 1}, one per actuator", actuator)
    if not ((low <= 0) & (high >= 0)).all():
        raise BadInput("low, high", "have 0 between them", f"{low.tolist()}, {high.tolist()}")
    return matrix, low, high

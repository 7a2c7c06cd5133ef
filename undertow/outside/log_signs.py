"""Whether the thrusters of a log are mapped in the right directions, by the motion that they cause in half a second.

The model predicts windows of the log without any input, and with the input of one thruster alone, as it is mapped and
turned. By superposition these tell which set of thrusters to turn; then the model is asked whether it is right. Errors
are those of the velocities after half a second, weighted by the mass matrix: their kinetic energy.
"""

import itertools

import numpy as np

from undertow.logs.log_signals import Series
from undertow.logs.motion import LoggedMotion
from undertow.outside.log_prediction import logged, predict, starts_of
from undertow.scenario.build import Built
from undertow.scenario.scenario_vehicle import vehicle_of

_HORIZON = 0.5  # s
_WINDOWS = 40  # at most
_MOST = 12  # thrusters of which every set is tried; of more, each one and all of them

_BETTER = 4.0  # factor by which the energy of the error falls with a set of thrusters turned: half the error
_WORSE = 1.25  # factor by which it is larger with the inputs than without any
_SPARE = 0.05  # share of an improvement that is not worth another turned thruster


def warnings_of_signs(built: Built, motion: LoggedMotion, inputs: Series, limited: bool) -> tuple[str, ...]:
    """A sentence if thrusters seem to be turned, or the inputs to belong to something else; none if all is well.

    Args:
        built: scenario, of a vehicle with thrusters.
        motion: of the log.
        inputs: of the thrusters.
        limited: as in `predict`.
    """
    dt = built.scenario.loop.dt
    number = inputs.values.shape[1]
    steps = max(1, round(_HORIZON / dt))
    starts = starts_of(motion, inputs, dt * steps, _HORIZON)
    if 6 * len(starts) < 4 * number:  # too few numbers to tell sets of thrusters apart
        return ()
    starts = starts[:: -(-len(starts) // _WINDOWS)]
    truth = logged(motion, starts + dt * steps)[:, 6:]
    root = np.linalg.cholesky(np.asarray(vehicle_of(built).body.mass_matrix)).T

    def errors(rows: np.ndarray) -> np.ndarray:
        predicted = predict(built, motion, inputs, starts, steps, steps, limited, rows).motion[:, :, 0, 6:]
        return ((predicted - truth) @ root.T).reshape(len(rows), -1)

    alone = np.eye(number)
    residuals = errors(np.vstack([np.ones(number), np.zeros(number), alone, -alone]))
    if not np.isfinite(residuals).all():
        return ()
    mapped, without = (residuals[:2] ** 2).sum(axis=1)
    # Effects of single thrusters, as mapped and turned. Over so short a time they nearly add up: the errors of all sets
    # follow from them, and only the best ones are predicted again.
    as_mapped, turned = residuals[2:].reshape(2, number, -1) - residuals[1]
    to_turn = _best_set(residuals[1] + as_mapped.sum(axis=0), turned - as_mapped)
    if to_turn.any():
        signs = np.where(to_turn, -1.0, 1.0)
        rows = np.vstack([signs, -np.ones(number), signs * (1.0 - 2.0 * alone), np.broadcast_to(signs, alone.shape)])
        energies = (errors(rows) ** 2).sum(axis=1)
        best = int(np.argmin(np.where(np.isfinite(energies), energies, np.inf)))
        if energies[best] * _BETTER < mapped:
            return (_sentence(rows[best] < 0, np.sqrt(mapped / energies[best])),)
    if mapped > _WORSE * without:
        return (
            "With the inputs of the log the model is farther from its velocities after half a second than without "
            "any: check the order, the unit and the directions of the columns of the thrusters, and the drag of the "
            "model",
        )
    return ()


def _best_set(error: np.ndarray, changes: np.ndarray) -> np.ndarray:
    """Which thrusters to turn so that the error is smallest, shape (N,); the fewest of sets that are about as good.

    Args:
        error: as mapped, shape (numbers,).
        changes: of the error when each thruster is turned, shape (N, numbers).
    """
    number = len(changes)
    sets = np.vstack([np.zeros(number), np.eye(number), np.ones(number)])
    if number <= _MOST:
        sets = np.array(list(itertools.product((0.0, 1.0), repeat=number)))
    energy = error @ error + 2 * sets @ (changes @ error) + np.einsum("ki,ij,kj->k", sets, changes @ changes.T, sets)
    enough = energy.min() + _SPARE * (error @ error - energy.min())
    good_sets = np.flatnonzero(energy <= enough)
    fewest = good_sets[np.lexsort((energy[good_sets], sets[good_sets].sum(axis=1)))[0]]
    return sets[fewest] > 0


def _sentence(thrusters: np.ndarray, factor: float) -> str:
    """The sentence on thrusters that seem to be turned, and the factor by which the error falls."""
    numbers = np.flatnonzero(thrusters) + 1
    names = "all thrusters" if thrusters.all() else ", ".join(f"T{number}" for number in numbers)
    return (
        f"With the input of {names} turned, the error of the velocities after half a second is {factor:.2g} times "
        "smaller. Check the directions: map `-C1` instead of C1, or give the `frame` of ArduSub"
    )

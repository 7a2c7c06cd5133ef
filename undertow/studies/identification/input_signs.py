"""Which way each input pushes, whether two are swapped, and which do nothing.

Output error cannot find a thruster that pushes the other way: its gain is positive there. In the weak form the gains
are linear, so that their signs are seen at once, and how well the dive would be explained if two inputs were swapped.
"""

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from undertow.core.measurement import BODY_AXES
from undertow.studies.identification.clock_offset import ClockOffset, offset_of
from undertow.studies.identification.dive import Dive
from undertow.studies.identification.finding import LogFinding
from undertow.studies.identification.free_parameters import FreeParameter
from undertow.studies.identification.identified_vehicle import AxisActuation, PriorVehicle
from undertow.studies.identification.input_regression import GainSolution, InputRegression, Order, regression_of, solved

_SURE = 4.0  # standard errors
_NOTHING = 0.1  # of the gain that the file gives
_MUCH_BETTER = 0.6  # factor on what remains unexplained
_BETTER = 0.85  # on some axis
# Clocks that differ by some tenths of a second turn the sign of what a quick pilot does: the best offset is taken.
_OFFSETS = 0.1 * np.arange(-6, 7)  # s
_WORTH_SAYING = 0.05  # s
# Of the thrust of the file that all inputs together seem to give. Less is what a controller looks like that holds the
# vehicle against moving water: it pushes against an acceleration that it did not cause, and later. Then the best offset
# is that of the controller, not of a clock.
_PLAUSIBLE_GAIN = 0.5


class InputGains(NamedTuple):
    """Gains of inputs along the forces that the file gives them.

    Attributes:
        names: of the inputs.
        gains: over those of the file.
        deviations: their standard errors.
        swapped: pairs of inputs that explain the dives much better the other way round.
        offset: of the inputs, behind the motion that they cause according to the lags of the file; its deviation is
            infinite where they cause little of the motion.
        effect: on each axis, size of the acceleration that is unexplained without inputs over that with them; NaN where
            no motion is measured.
        findings: in words.
    """

    names: tuple[str, ...]
    gains: np.ndarray
    deviations: np.ndarray
    swapped: tuple[tuple[int, int], ...]
    offset: ClockOffset
    effect: np.ndarray
    findings: tuple[LogFinding, ...]


def input_gains(
    prior: PriorVehicle, parameters: Sequence[FreeParameter], dives: Sequence[Dive], names: Sequence[str] = ()
) -> InputGains:
    """The gain of each input by the weak form, free of sign, and what is strange about it.

    Args:
        prior: vehicle before any dive.
        parameters: what is free; all gains are.
        dives: with equal steps.
        names: of the inputs; () for T1, T2, ... or the axes.
    """
    names = tuple(names) or _usual_names(prior, dives[0].inputs.shape[1])
    regressions = [regression_of(prior, parameters, [_later(dive, offset) for dive in dives]) for offset in _OFFSETS]
    order = tuple(range(len(names)))
    swapped: list[tuple[int, int]] = []
    free = [solved(regression, order) for regression in regressions]
    while better := _better_pair(regressions, order, swapped, free):
        swapped.append(better)
        order = _swap(order, better)
        free = [solved(regression, order) for regression in regressions]
    # Signs are only believed to be wrong where no offset explains the motion nearly as well with right ones.
    right = [_with_positive_gains(regression, order) for regression in regressions]
    are_wrong = bool((free[_best(free)].error < _BETTER * right[_best(right)].error).any())
    solutions = free if are_wrong else right
    best = _best(solutions)
    solution = free[best]
    matters = [are_wrong and _matters(regressions[best], order, solution, j) for j in range(len(names))]
    # Inputs that agree best when they are made earlier come later in the log. Every other window is independent.
    shift = offset_of([each.mean_error for each in solutions], _OFFSETS, regressions[best].usable.sum() / 2)
    offset = shift._replace(delay=-shift.delay)
    has_known_gains = not isinstance(prior.actuation, AxisActuation)
    findings = _findings(names, solution, matters, swapped, has_known_gains)
    overall = _overall_gain(regressions[best], order)
    if has_known_gains and overall < _PLAUSIBLE_GAIN and not are_wrong:
        offset = ClockOffset(0.0, math.inf)
        findings.append(_little_thrust(overall))
    if offset.is_worth_saying(_WORTH_SAYING):
        findings.append(_offset_finding(offset))
    effect = np.array([_effect(regressions[best], order, axis) for axis in range(len(BODY_AXES))])
    return InputGains(names, solution.gains, solution.deviations, tuple(swapped), offset, effect, tuple(findings))


def _better_pair(
    regressions: Sequence[InputRegression],
    order: Order,
    swapped: Sequence[tuple[int, int]],
    free: Sequence[GainSolution],
) -> tuple[int, int] | None:
    """The two inputs that explain the motion best the other way round, if much better than as they are."""
    used = {index for pair in swapped for index in pair}
    pairs = list(itertools.combinations([j for j in range(len(order)) if j not in used], 2))
    offsets = {_best(free), len(_OFFSETS) // 2}
    trials = {pair: min(solved(regressions[k], _swap(order, pair)).mean_error for k in offsets) for pair in pairs}
    best = min(trials, key=lambda pair: trials[pair], default=None)
    return best if best and trials[best] < _MUCH_BETTER * free[_best(free)].mean_error else None


def _swap(order: Order, pair: tuple[int, int]) -> Order:
    swapped = list(order)
    swapped[pair[0]], swapped[pair[1]] = order[pair[1]], order[pair[0]]
    return tuple(swapped)


def _best(solutions: Sequence[GainSolution]) -> int:
    return int(np.argmin([solution.mean_error for solution in solutions]))


def _overall_gain(regression: InputRegression, order: Order) -> float:
    """The gain that all inputs have together, over those of the file."""
    together = regression.of_inputs[:, list(order), range(len(order))].sum(axis=1)
    return float(solved(regression._replace(of_inputs=together[:, None, None]), (0,)).gains[0])


def _little_thrust(overall: float) -> LogFinding:
    sentence = f"All inputs together seem to give {max(overall, 0.0):.2f} of the thrust that the file says"
    remedy = (
        "A controller that holds the vehicle against moving water looks like that: identify from dives whose inputs "
        "move the vehicle. Otherwise look at supply, unit and clock of the inputs, and whether it is this vehicle"
    )
    return LogFinding("input", "", "note", sentence, remedy)


def _offset_finding(offset: ClockOffset) -> LogFinding:
    if offset.delay > 0:
        sentence = f"The inputs come {offset} later in the log than the motion that they cause"
        return LogFinding("input", "", "note", sentence, "Make the times of the inputs that much earlier in the log")
    sentence = f"The motion follows the inputs {offset} later than the thrusters of the file explain"
    return LogFinding(
        "input", "", "note", sentence, "Free `command_delay`, or make the times of the inputs that much later"
    )


def _usual_names(prior: PriorVehicle, count: int) -> tuple[str, ...]:
    return BODY_AXES if isinstance(prior.actuation, AxisActuation) else tuple(f"T{j + 1}" for j in range(count))


def _later(dive: Dive, offset: float) -> Dive:
    """The same dive with inputs that come later, or earlier where the offset is negative."""
    steps = np.arange(len(dive.inputs)) - round(offset / dive.step)
    return dive._replace(inputs=dive.inputs[np.clip(steps, 0, len(steps) - 1)])


def _with_positive_gains(regression: InputRegression, order: Order) -> GainSolution:
    """With the inputs left out whose gains would be negative."""
    left_out: tuple[int, ...] = ()
    while True:
        solution = solved(regression, order, left_out)
        negative = tuple(j for j in range(len(order)) if solution.gains[j] < 0 and j not in left_out)
        if not negative:
            return solution
        left_out += negative


def _effect(regression: InputRegression, order: Order, axis: int) -> float:
    """Size of the acceleration along an axis that is unexplained without inputs over that with them."""
    usable = regression.usable & (np.arange(len(BODY_AXES)) == axis)
    of_axis = regression._replace(usable=usable)
    inputs_freedom, freedom = len(order), int(usable.sum())
    if freedom <= 2 * inputs_freedom:
        return np.nan
    remaining, without = solved(of_axis, order).error[axis], solved(of_axis, order, left_out=order).error[axis]
    return float(without / max(remaining, 1e-12) * np.sqrt(1 - inputs_freedom / freedom))


def _matters(regression: InputRegression, order: Order, solution: GainSolution, index: int) -> bool:
    """Whether the dive is explained worse, on some axis, when an input is left out."""
    without = solved(regression, order, left_out=(index,)).error
    with np.errstate(invalid="ignore"):
        return bool((solution.error < _BETTER * without).any())


# Of inputs along the axes, whose gains are not known: a controller that holds the vehicle against something looks like
# that, too, so that only the axis is not identified.
_MAP_OR_MOVE = "Look at the order and the signs of the columns of the input, or move the vehicle more on that axis"


def _findings(
    names: Sequence[str],
    solution: GainSolution,
    matters: Sequence[bool],
    swapped: list[tuple[int, int]],
    has_known_gains: bool,
) -> list[LogFinding]:
    findings = []
    for first, second in swapped:
        pair = f"{names[first]} and {names[second]}"
        sentence = f"{pair} are swapped: the motion follows each of them as the file says of the other"
        remedy = "Swap their columns in the mapping of the input, or the two thrusters in the vehicle file"
        if has_known_gains:
            findings.append(LogFinding("input", pair, "refused", sentence, remedy))
        else:
            findings += [LogFinding("axis", names[j], "refused", sentence, _MAP_OR_MOVE) for j in (first, second)]
    for j, name in enumerate(names):
        gain, deviation = float(solution.gains[j]), float(solution.deviations[j])
        is_negative = gain < -max(_SURE * deviation, _NOTHING)
        if is_negative and matters[j]:
            sentence = f"{name} pushes the other way than the file says: {gain:.2f} +- {deviation:.2f} of its thrust"
            remedy = "Write its column with a minus in the mapping of the input, or turn it round in the vehicle file"
            if has_known_gains:
                findings.append(LogFinding("input", name, "refused", sentence, remedy))
            else:
                sentence = f"The vehicle moves against the input in {name}: gain {gain:.2f} +- {deviation:.2f}"
                findings.append(LogFinding("axis", name, "refused", sentence, _MAP_OR_MOVE))
        elif is_negative:
            sentence = f"{name} may push the other way than the file says ({gain:.2f} +- {deviation:.2f} of its thrust)"
            sentence += ", but explains little of the motion"
            findings.append(LogFinding("input", name, "note", sentence, "Move it alone in a short dive to be sure"))
        elif has_known_gains and abs(gain) + 2 * deviation < _NOTHING:
            sentence = f"{name} has no effect that can be seen: {gain:.3f} +- {deviation:.3f} of what the file says"
            remedy = "Check its plug, its propeller, and which column of the log is its command"
            findings.append(LogFinding("input", name, "note", sentence, remedy))
    return findings

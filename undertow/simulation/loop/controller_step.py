"""One step of a controller by itself, as `sampled.control_step` takes it in the closed loop.

There the law advances as soon as its input is applied. Here that is known at the next step, which therefore begins with
what the last one left to do: a run that is stepped so has the bits of one that is simulated.
"""

from typing import Any, NamedTuple

from jaxtyping import PyTree

from undertow.core.contracts import AbstractController, Inputs, Measurement, Target, Time
from undertow.core.expected_measurement import Expected, at_start


class ControllerMemory(NamedTuple):
    """What a controller remembers of a step.

    Attributes:
        law: state of the law before it has advanced.
        y, r: measurement and target.
        estimate: the law's estimate of d; () where it has none.
        expected: of the measurement of this step.
    """

    law: PyTree
    y: Measurement
    r: Target
    estimate: Any
    expected: Expected


class Answer(NamedTuple):
    """Command of a step, and the signals that the law declares."""

    command: Inputs
    signals: dict[str, Any]


def first_step(law: AbstractController, y: Measurement, r: Target) -> tuple[ControllerMemory, Answer]:
    """The step with which control begins; every entry of the measurement is finite."""
    return _decided(law, law.init(y, r), y, r, at_start(law.model.coordinates, y, y))


def next_step(
    law: AbstractController, memory: ControllerMemory, y: Measurement, r: Target, applied: Inputs, dt: Time
) -> tuple[ControllerMemory, Answer]:
    """The step `dt` after the last one, since when `applied` was applied.

    Entries of the measurement that are not finite are replaced by those that the law's model expects, unless the law
    gets them as they are.
    """
    state, before, _, estimate, expected = memory
    advanced = law.advance(state, before, memory.r, applied, dt)
    if not law.takes_raw_readings:
        expected = expected.after(law, state, before, None if isinstance(estimate, tuple) else estimate, applied, dt)
        y, expected = expected.repaired(law.model.coordinates, y)
    return _decided(law, advanced, y, r, expected)


def _decided(law: AbstractController, state: PyTree, y: Measurement, r: Target, expected: Expected):
    command, signals = law.command(state, y, r)
    return ControllerMemory(state, y, r, signals.get("estimate", ()), expected), Answer(command, signals)

"""A log that was checked, on its grid, without what must not be used and with its inputs at the right time."""

from typing import NamedTuple

import numpy as np

from undertow.core.errors import BadInput
from undertow.core.measurement import BODY_AXES
from undertow.logs.log_signals import LogSignals
from undertow.logs.motion import inputs_of
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.studies.identification.dive import SENSORS, Dive, dive_of
from undertow.studies.identification.log_check import check_dive

_SMALLEST_OFFSET = 0.05  # s; less is taken for a lag


class PreparedDive(NamedTuple):
    """A dive that can be used.

    Attributes:
        dive: see there.
        refused_axes: that it cannot identify.
        findings: sentences for people.
    """

    dive: Dive
    refused_axes: tuple[str, ...]
    findings: tuple[str, ...]


def prepared_dive(plant: HybridVehicle, log: LogSignals, per_axis: bool, step: float) -> PreparedDive:
    """Check a log and put it on a grid.

    Args:
        plant: the vehicle that dived.
        log: see there.
        per_axis: whether the inputs push along the six axes.
        step: of the grid, s.

    Raises:
        BadInput: the log cannot be used, or has inputs of another number than thrusters or axes.
    """
    inputs = inputs_of(log, ("input", "commanded_input"), None if per_axis else np.asarray(plant.thruster_matrix))
    expected = len(BODY_AXES) if per_axis else plant.inputs()
    count = inputs.flat().shape[1]
    if count != expected:
        whose = "axes" if per_axis else "thrusters"
        raise BadInput("log", f"have {expected} inputs, one for each of the {whose}", f"{log.source} with {count}")
    check = check_dive(log, inputs, plant, per_axis)
    for error in check.errors():
        raise BadInput("log", "be of a dive of this vehicle", f"{log.source}: {error.sentence}", hint=error.remedy)
    sentences = [str(finding) for finding in check.findings]
    offset = check.offsets.get("inputs")
    if offset is not None and offset.is_worth_saying(_SMALLEST_OFFSET):
        inputs = inputs._replace(time=inputs.time - offset.delay)
        sentences.append(f"The inputs were moved by {-offset.delay:.2f} s, to where they agree with the motion.")
    dive = _without(dive_of(log, inputs, step), check.left_out())
    return PreparedDive(dive, tuple(check.refused_axes()), tuple(sentences))


def _without(dive: Dive, left_out: list[str]) -> Dive:
    """A dive without some of its sensors."""
    counts = dive.counts.copy()
    for name in left_out:
        counts[:, SENSORS.index(name.partition(".")[0])] = 0
    return dive._replace(counts=counts)

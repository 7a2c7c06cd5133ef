"""What an experiment is designed for, and what is expected of it."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from undertow.scenario.uncertain_number import UncertainNumber
from undertow.studies.identification.excitation_blocks import ExcitationBlock
from undertow.studies.identification.experiment_scenario import ExperimentLimits
from undertow.studies.identification.free_parameters import FreeParameter
from undertow.studies.identification.model import IdentificationModel
from undertow.studies.identification.rehearsal import Rehearsal
from undertow.studies.identification.uncertainty import Combination


class ExpectedDeviation(NamedTuple):
    """What is expected of a parameter.

    Attributes:
        parameter: with its deviation beforehand.
        share: deviation afterwards as a share of that beforehand.
        is_of_interest: whether the experiment is for it.
    """

    parameter: FreeParameter
    share: float
    is_of_interest: bool

    @property
    def before(self) -> float:
        """Deviation beforehand, in the unit of the parameter."""
        return self.parameter.deviation * (self.parameter.prior if self.parameter.is_ratio else 1.0)

    @property
    def after(self) -> float:
        """Deviation afterwards, in the unit of the parameter."""
        return self.share * self.before


class Design(NamedTuple):
    """An experiment.

    Attributes:
        scenario: as plain data, with script and limits.
        blocks: of the script.
        scale: factor on their forces.
        limits: that end it.
        expected: of each free parameter.
        undetermined: combinations that it leaves undetermined.
        rehearsal: with the vehicle of the file.
        use: share of the limits that each rehearsed vehicle uses, that of the file first.
        model: of the identification.
        notes: sentences for people.
    """

    scenario: dict[str, Any]
    blocks: tuple[ExcitationBlock, ...]
    scale: float
    limits: ExperimentLimits
    expected: tuple[ExpectedDeviation, ...]
    undetermined: tuple[Combination, ...]
    rehearsal: Rehearsal
    use: tuple[float, ...]
    model: IdentificationModel
    notes: tuple[str, ...]


class DesignRequest(NamedTuple):
    """What an experiment has to keep to, and what it is for.

    Attributes:
        room: m, along the heading, across, vertical.
        duration: s.
        of_interest: names, groups or patterns of free parameters; () for all.
        free: parameters that the identification will estimate; () for the usual ones.
        priors: deviations beforehand that are not in the vehicle file.
        depth: of the station, m; None for that of the reference, or less deep a room below the surface.
        max_rate: rad/s.
        max_angle: roll, pitch, and departure from the heading, rad.
        max_input: of a thruster, in its unit; None for 90 % of its limit.
    """

    room: tuple[float, float, float]
    duration: float = 300.0
    of_interest: tuple[str, ...] = ()
    free: tuple[str, ...] = ()
    priors: Mapping[str, UncertainNumber] = {}
    depth: float | None = None
    max_rate: float = 2.0
    max_angle: float = 0.6
    max_input: float | None = None

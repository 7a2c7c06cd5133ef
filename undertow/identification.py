"""An identification from Python: what `undertow identify` does, one level down."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from undertow.core.errors import BadInput
from undertow.logs.log import Log
from undertow.report.answers.identification_answer import answer_of_identification
from undertow.report.identification_page import identification_plots, in_notebook_of
from undertow.scenario.build import Built, build
from undertow.scenario.log_file import read_log
from undertow.scenario.reading import from_data, read
from undertow.scenario.scenario_vehicle import with_reference
from undertow.scenario.uncertain_number import UncertainNumber, uncertain_number
from undertow.studies.identification import identify as identifying
from undertow.studies.identification.identified_files import write_files
from undertow.studies.identification.result_data import as_data
from undertow.studies.identification.uncertainty import ParameterInterval

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclasses.dataclass(frozen=True, repr=False)
class IdentifiedModel:
    """A vehicle identified from logs of its dives.

    Attributes:
        result: all that is known of it.
        scenario: whose vehicle it is.
        logs: files that it is from; () where the logs were given as data.
    """

    result: identifying.Identification
    scenario: Built
    logs: tuple[Path, ...]

    @property
    def parameters(self) -> dict[str, ParameterInterval]:
        """Value, 95 % interval and standard deviation of each parameter that was free, by name."""
        return {interval.parameter.name: interval for interval in self.result.intervals}

    @property
    def data(self) -> dict[str, Any]:
        """Contents of identification.json."""
        return as_data(self.result)

    def write(self, folder: str | Path) -> None:
        """Write `vehicle.yaml`, with deviations and correlation, and `identified.yaml`, the scenario with that vehicle.

        Args:
            folder: that exists.

        Raises:
            OSError: it cannot be written.
        """
        write_files(self.scenario, self.result, self.logs, Path(folder))

    def plot(self) -> "dict[str, Figure]":
        """Figures of the identification, by name."""
        return {name: make() for name, make in identification_plots(self.result, self.data).items()}

    def _repr_html_(self) -> str:
        """What a notebook shows: the answer and how the model predicts a dive that it has not seen."""
        return in_notebook_of(self.result, self.data)

    def __repr__(self) -> str:
        return "\n".join(answer_of_identification(self.data).text)


def identify(
    scenario: str | Path | Mapping[str, Any],
    logs: str | Path | Log | Sequence[str | Path | Log],
    mapping: str | Path | None = None,
    *,
    unseen: Sequence[str | Path | Log] = (),
    free: Sequence[str] = (),
    priors: Mapping[str, str] | None = None,
    per_axis: bool = False,
    method: str = "output_error",
    profile: Sequence[str] = (),
    step: float = 0.05,
    segment: float = 10.0,
    watch: Callable[[str], None] = lambda stage: None,
) -> IdentifiedModel:
    """Identify the numbers of a vehicle from logs of its dives, with 95 % intervals.

    What `undertow identify` does, with the same numbers, and without its files.

    Args:
        scenario: a scenario file or a scenario as data; its vehicle and thrusters are what is known beforehand.
        logs: files, or logs that were read with `ut.read_log`; several dives of one vehicle.
        mapping: which columns of the files are which signal.
        unseen: further logs, which are only predicted, to judge the result.
        free: names, groups or patterns of parameters; () for the usual ones.
        priors: such as `{"mass": "11.5 +- 0.2"}`.
        per_axis: whether the inputs push along the six axes instead of driving the thrusters.
        method: `output_error`, or `prediction_error` for dives that unknown forces disturb (a tether, eddies): a Kalman
            filter follows the motion, and estimates what pushes the vehicle besides its thrusters.
        profile: names, groups or patterns of free parameters whose intervals are also found by the profile of the
            likelihood, for those that the log hardly determines.
        step: of the integration, s.
        segment: length of the segments whose begin is estimated, too, s.
        watch: called with the current stage.

    Raises:
        BadInput: anything wrong with the scenario, or a log that cannot be used.
    """
    several = [logs] if isinstance(logs, str | Path | Log) else list(logs)
    columns = None if mapping is None else Path(mapping)
    built = build(with_reference(from_data(scenario) if isinstance(scenario, Mapping) else read(Path(scenario))))
    opened = lambda given: [log if isinstance(log, Log) else read_log(Path(log), columns) for log in given]
    result = identifying.identify(
        built,
        opened(several),
        unseen=opened(unseen),
        free=free,
        priors={name: _prior(name, text) for name, text in (priors or {}).items()},
        per_axis=per_axis,
        method=method,
        profile=profile,
        step=step,
        segment=segment,
        say=watch,
    )
    return IdentifiedModel(result, built, tuple(Path(log) for log in several if not isinstance(log, Log)))


def _prior(name: str, text: str) -> UncertainNumber:
    number = uncertain_number(f"priors.{name}", text)
    if number is None:
        raise BadInput(f"priors.{name}", "be text such as `11.5 +- 0.2`", repr(text))
    return number

"""A comparison from Python: what `undertow compare` does, one level down."""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from undertow.core import checks
from undertow.report.answers.comparison_answer import answer_of_comparison
from undertow.report.comparison_page import in_notebook_of, noun_of
from undertow.report.figures.comparison import comparison_plots
from undertow.studies.comparison.comparison import ComparisonResult, run_comparison
from undertow.studies.comparison.findings import Findings
from undertow.studies.comparison.paired import PairedDifference
from undertow.studies.comparison.sentences import sentences
from undertow.studies.comparison.tables import STYLES, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclasses.dataclass(frozen=True, repr=False)
class Comparison:
    """A finished comparison.

    Attributes:
        result: all that is known of it.
    """

    result: ComparisonResult

    @property
    def dataset(self) -> xr.Dataset:
        """A column for every metric, seed, status and series.

        Its dimensions are `controller` (or `scenario`, or the swept key of a campaign file) and `sample`.
        """
        return self.result.dataset

    @property
    def findings(self) -> Findings:
        """Medians, paired differences, failures, and how the gains came about."""
        return self.result.findings

    @property
    def differences(self) -> tuple[PairedDifference, ...]:
        """Every two candidates in every metric."""
        return self.findings.differences

    def table(self, style: str = "markdown") -> str:
        """Metrics and differences as a table.

        Args:
            style: `markdown`; `latex`, which needs the packages booktabs and tabularx; or `csv`, a line per metric and
                candidate.

        Raises:
            BadInput: another style.
        """
        checks.choice("style", style, tuple(STYLES))
        return table(self.findings, style)

    def plot(self) -> "dict[str, Figure]":
        """Figures of the comparison, by name."""
        return {name: make() for name, make in comparison_plots(self.dataset, self.findings).items()}

    def _repr_html_(self) -> str:
        """What a notebook shows: how every candidate did, what is established, and one picture."""
        return in_notebook_of(self.result)

    def __repr__(self) -> str:
        findings = self.findings
        names = ", ".join(findings.names)
        answer = answer_of_comparison(findings, noun_of(findings))
        heading = f"Comparison of {names}, {findings.trials} trials each."
        return "\n".join([heading, *answer.text, *sentences(findings)])


def compare(
    scenario: str | Path | Mapping[str, Any] | Sequence[str | Path],
    controllers: Sequence[str] | Mapping[str, Any] | None = None,
    trials: int | None = None,
    *,
    tune: int | None = None,
    workers: int | None = None,
    allow_code: bool = False,
) -> Comparison:
    """Compare controllers on one scenario, or several scenarios, trial by trial with the same samples and seeds.

    What `undertow compare` does, with the same numbers, and without its files.

    Args:
        scenario: a scenario file or a scenario as data; several scenario files; or a campaign file.
        controllers: such as `["robust", "pid", "./mine.py:smc", "runs/heavy-tuned/tuned.yaml"]`, or name -> entry,
            where an entry may also be a mapping such as `{"kind": "pid", "frequency": 2}`.
        trials: samples for each; None for 20, or the number of the campaign file. One where nothing is random.
        tune: evaluations with which the gains of every controller are tuned first; None to compare them as they are.
        workers: number of threads; None for all cores.
        allow_code: whether the Python code that an earlier run.nc names may run; that of a .yaml file may.

    Raises:
        BadInput: anything wrong with the scenario, the controllers or the number of trials.
    """
    return Comparison(run_comparison(scenario, controllers, trials, tune=tune, workers=workers, allow_code=allow_code))

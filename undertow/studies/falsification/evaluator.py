"""Robustness of the requirements at departures from the nominal scenario: many runs at once."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from undertow.analysis.temporal.requirements import Requirement, contiguous, evaluate_requirements, needed_signals
from undertow.core import runtime
from undertow.core.errors import BadInput
from undertow.scenario.build import Built, build
from undertow.scenario.consistency import record_period
from undertow.scenario.part_cache import PartCache
from undertow.scenario.reading import Text
from undertow.simulation.prepared_run import PreparedRun
from undertow.simulation.programs import ProgramCache
from undertow.studies.campaign.campaign_schema import RecordedSignals
from undertow.studies.campaign.trial_results import prepare_trial, run_prepared
from undertow.studies.falsification.box import Box, scenario_at

# Runs that are computed at once: their records are in memory together.
_AT_ONCE = 128
_PROBES = 3  # departures inside the box that show which numbers vary
_INVALID = np.inf  # robustness of a departure whose scenario cannot be built: no counter-example


class Evaluator:
    """Runs of one scenario at departures within a box.

    Args:
        text: the scenario.
        built: the same, built.
        box: what varies.
        requirements: to be broken, any of them.
    """

    def __init__(self, text: Text, built: Built, box: Box, requirements: Sequence[Requirement]):
        self.text, self.nominal, self.box, self.requirements = text, built, box, tuple(requirements)
        settings = built.scenario.falsify
        seed = built.scenario.seed
        self.seeds = [(seed + number) % 2**32 for number in range(settings.seeds)]
        self._part_cache = PartCache()
        loop = built.scenario.loop
        self.period = record_period(loop)
        self._names = needed_signals(requirements)
        self._series = RecordedSignals(signals=list(self._names), every=loop.record) if self._names else None
        self._programs = ProgramCache(lambda: self._probes(), gpu=True)

    def _probes(self) -> list[PreparedRun]:
        chance = np.random.default_rng(0)
        inside = self.box.lower + chance.random((_PROBES, len(self.box.axes))) * (self.box.upper - self.box.lower)
        valid = [built for departure in inside if (built := self.built(departure)) is not None]
        return [prepare_trial(built, self._series) for built in (self.nominal, *valid)]

    def built(self, departure: Float[np.ndarray, " k"], seed: int | None = None) -> Built | None:
        """The scenario at a departure, with its own seed unless another is given; None where it cannot be built."""
        seed_entry = {} if seed is None else {"seed": seed}
        try:
            return build(scenario_at(self.text, self.box.values(departure) | seed_entry), self._part_cache)
        except BadInput:
            return None

    def robustness(self, departures: Float[np.ndarray, "p k"], seeds: Sequence[int]) -> Float[np.ndarray, " p"]:
        """Smallest robustness of all requirements at every departure, each with its seed."""
        return self.each(departures, seeds).min(axis=1)

    def each(
        self, departures: Float[np.ndarray, "p k"], seeds: Sequence[int] | None = None
    ) -> Float[np.ndarray, "p r"]:
        """Robustness of every requirement at every departure; infinite where the scenario cannot be built.

        Args:
            departures: where.
            seeds: of the runs; None for that of the scenario.
        """
        every = list(zip(departures, seeds or [None] * len(departures), strict=True))
        return np.concatenate([self._some(every[i : i + _AT_ONCE]) for i in range(0, len(every), _AT_ONCE)])

    def _some(self, every: Sequence[tuple[np.ndarray, int | None]]) -> np.ndarray:
        robustness = np.full((len(every), len(self.requirements)), _INVALID)
        builts = [
            (i, built)
            for i, (departure, seed) in enumerate(every)
            if (built := self.built(departure, seed)) is not None
        ]
        if not builts:
            return robustness
        with runtime.on_processor():
            result = run_prepared((prepare_trial(built, self._series) for _, built in builts), self._programs)
        assert result is not None
        for row, (i, built) in enumerate(builts):
            signals = contiguous({name: result.series[name][row] for name in self._names}, self._names)
            metrics = {name: float(values[row]) for name, values in result.metrics.items()}
            status, ended, duration = int(result.status[row]), float(result.ended[row]), built.scenario.loop.duration
            verdicts = evaluate_requirements(self.requirements, signals, self.period, metrics, status, ended, duration)
            robustness[i] = [verdicts[requirement.name].robustness for requirement in self.requirements]
        return robustness

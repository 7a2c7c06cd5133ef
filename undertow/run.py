"""One closed loop from Python: what `undertow simulate` does, one level down."""

import copy
import dataclasses
import math
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import xarray as xr
from pydantic import ValidationError

from undertow.analysis.metrics import meanings
from undertow.analysis.success import Success, criterion_of
from undertow.control.navigation.perfect import perfect
from undertow.core import checks, runtime
from undertow.core.arrays import in_present_precision
from undertow.core.contracts import (
    AbstractController,
    AbstractDisturbance,
    AbstractFaults,
    AbstractNavigation,
    AbstractPlant,
    AbstractReference,
)
from undertow.core.errors import BadInput, error_location
from undertow.core.number_text import display_units, infinite
from undertow.core.status import Status
from undertow.logs.log import Log
from undertow.logs.run_log import log_of_run
from undertow.physics.disturbances.loads import SumOfDisturbances
from undertow.physics.disturbances.none import none
from undertow.physics.faults.mode import AbstractFault, name_of
from undertow.physics.vehicles.vehicle import VehicleModel
from undertow.report import figures
from undertow.report.answers.run_answer import answer_of_run
from undertow.report.run_page import page_contents, run_in_notebook, shown_of, write_run_page
from undertow.scenario import factory
from undertow.scenario.build import Built, build, velocity_noise_of
from undertow.scenario.changed_values import put_value
from undertow.scenario.consistency import check_fit, check_start, check_times, rounded_times
from undertow.scenario.fault_injection import with_faults
from undertow.scenario.part_cache import PartCache
from undertow.scenario.plausibility import start_and_angles
from undertow.scenario.reading import from_data, read
from undertow.scenario.results.netcdf import save
from undertow.scenario.results.run_result import MetricsSettings, Origin, RunResult, ScenarioResult, make_result
from undertow.scenario.results.run_scenario import run_loop, run_scenario
from undertow.scenario.schema import ClosedLoopSettings, Fault, Initial, Window
from undertow.scenario.step_size import step_failure
from undertow.scenario.validation import complaint
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.outcome import Outcome

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class _ByWindow(dict[str, dict[str, Any] | None]):
    """Metrics of both windows."""

    def __missing__(self, name: str) -> Any:
        hint = f'Write run.metrics["steady"]["{name}"], or "whole" for the whole run'
        raise BadInput(f'metrics["{name}"]', "name a window, steady or whole", "none", hint=hint)


@dataclasses.dataclass(frozen=True, repr=False)
class Run:
    """One finished run.

    Attributes:
        result: all that is known of it.
    """

    result: RunResult
    _part_cache: PartCache = dataclasses.field(default_factory=PartCache, compare=False)

    def again(self, **values: Any) -> "Run":
        """Run its scenario again with other values, as if they stood in the file: the base of a slider in a notebook.

            run.again(controller__bandwidth=1.2, disturbance__0__velocity=[0.4, 0, 0], seed=3)

        While parts and shapes stay as they are, nothing is compiled: 20 s of a vehicle at sea take some hundredths of a
        second. A number that becomes exactly 0 or 1, or was, may need another program, once.

        Args:
            values: by key path, with two underscores for each dot, and entries of lists by their number.

        Raises:
            BadInput: the run is not one of a scenario, or a key path or a value is wrong.
        """
        return Run(run_scenario(self.built_with(values)), self._part_cache)

    def built_with(self, values: Mapping[str, Any]) -> Built:
        """Its scenario with other values, as `again` runs it, built and not run.

        Args:
            values: as those of `again`.

        Raises:
            BadInput: the run is not one of a scenario, or a key path or a value is wrong.
        """
        if not isinstance(self.result, ScenarioResult):
            hint = "Write it as a scenario, and run that by `ut.simulate_scenario`"
            raise BadInput("again", "be of a run of a scenario", "of one of a closed loop made of objects", hint=hint)
        text, data = self.result.built.text, self.scenario
        for name, value in values.items():
            put_value(data, name.replace("__", "."), value)
        return build(text._replace(data=from_data(data).data), self._part_cache)

    @property
    def scenario(self) -> dict[str, Any]:
        """The scenario as it was given, a copy; empty for a closed loop made of objects."""
        return copy.deepcopy(self.result.built.text.data) if isinstance(self.result, ScenarioResult) else {}

    @property
    def dataset(self) -> xr.Dataset:
        """Recorded series with names and units, metrics, versions, seed and content hash."""
        return self.result.dataset

    @property
    def metrics(self) -> dict[str, dict[str, Any] | None]:
        """Metrics `steady` (over the steady window; None when the run did not last) and `whole`.

        Numbers by name, per-axis values as lists named `<name>_axes`; see `undertow describe metrics`.
        """
        steady = self.result.steady
        return _ByWindow(steady=None if steady is None else dict(steady), whole=dict(self.result.whole))

    @property
    def status(self) -> Status:
        """How it ended."""
        return self.result.status

    @property
    def outcome(self) -> Outcome:
        """The same series as arrays, and the final states."""
        return self.result.outcome

    @property
    def success(self) -> Success | None:
        """Whether control succeeded, by the scenario's criterion or the default one; None without one.

        It is true where the run kept to its criterion, false where it did not.
        """
        return self.result.success

    @property
    def loop(self) -> ClosedLoop:
        """The closed loop that was run."""
        return self.result.loop

    @property
    def certificate(self) -> Mapping[str, Any] | None:
        """Lyapunov function in numbers, and for how long each hypothesis of the proof held; None without a proof."""
        return self.result.facts.certificate

    def plot(self) -> "dict[str, Figure]":
        """Figures of the run, by name."""
        return figures.run_figures(shown_of(self.result))

    def _repr_html_(self) -> str:
        """What a notebook shows: whether it went well, by what, and one picture."""
        summary = figures.run_plots(shown_of(self.result))["summary"]()
        return run_in_notebook(self.result, figures.small_png(summary))

    def page(self, path: str | Path) -> None:
        """Write one HTML page with metrics, certificate, figures and, for a vehicle, a replay in three dimensions.

        Raises:
            OSError: the file cannot be written.
        """
        parts = page_contents(self.result, lambda: figures.plot_run(shown_of(self.result)))
        write_run_page(Path(path), self.result, parts)
        for sentence in parts.failures:
            warnings.warn(sentence, stacklevel=2)

    def log(self) -> Log:
        """The series as a log, which can be saved as .mcap or .csv, and scored."""
        return log_of_run(self.dataset)

    def save(self, path: str | Path) -> None:
        """Write the dataset as netCDF; the file appears whole or not at all.

        Raises:
            OSError: the folder cannot be written.
        """
        save(self.dataset, Path(path))

    def __repr__(self) -> str:
        facts = self.result.facts
        answer = answer_of_run(self.result)
        lines = [f"Run: {facts.status.word} at {facts.ended:g} s. {answer.verdict}", *answer.lines]
        lines.append(f"  {'metric':<20}{'steady':>12}{'whole':>12}  unit")
        for name, metric in facts.meanings.items():
            if name not in facts.whole:
                continue
            steady_value, whole_value = (
                _shown(metrics.get(name), metric.unit) for metrics in (facts.steady or {}, facts.whole)
            )
            lines.append(
                f"  {name:<20}{steady_value:>12}{whole_value:>12}  {display_units(0.0, metric.unit)[1]}".rstrip()
            )
        return "\n".join(lines)


def _shown(value: float | None, unit: str) -> str:
    """A metric in four digits as people read it; a dash for one that is not defined."""
    if value is None:
        return "-"
    return infinite(unit) if math.isinf(value) else f"{display_units(value, unit)[0]:.4g}"


def simulate(
    plant: AbstractPlant,
    controller: AbstractController | str | Mapping[str, Any],
    reference: AbstractReference,
    *,
    disturbance: AbstractDisturbance | Sequence[AbstractDisturbance] | None = None,
    navigation: AbstractNavigation | None = None,
    faults: Sequence[Mapping[str, Any]] | AbstractFaults | None = None,
    duration: float = 20.0,
    loop: Literal["sampled", "continuous"] = "sampled",
    dt: float = 1e-3,
    record: float | None = None,
    seed: int = 0,
    position: Any = None,
    velocity: Any = None,
    precision: Literal["float64", "float32"] = "float64",
) -> Run:
    """Run a plant under a controller. A run that fails says so in its status; nothing is raised.

    Args:
        plant: what is controlled.
        controller: the law, made from `plant.model()`; or its name or a mapping, as under `controller` of a scenario:
            `"robust"`, `{"kind": "pid", "bandwidth": 2.0}`.
        reference: what to follow.
        disturbance: what the surroundings do; several as a list, None for nothing.
        navigation: filter that estimates position and velocity from measurements; None for the true ones.
        faults: entries as those of the key `faults` of a scenario, whose mode may be an object; None for none.
        duration: s. The steady metrics are taken over its second half.
        loop: `sampled` (input held over each dt) or `continuous` (one ODE, the paper's setting).
        dt: sampling time of the controller, or step of the ODE, s.
        record: time between records, s; None for 0.01 s, or the next whole number of `dt`.
        seed: of everything random.
        position: outputs at t = 0, shape (n,), m and rad; None for zero.
        velocity: their rates, shape (n,), m/s and rad/s; None for zero.
        precision: of all numbers of the run, whatever `jax_enable_x64` is; that stays as it was.

    Raises:
        BadInput: something given cannot be used, or does not fit the rest.
    """
    if isinstance(plant, VehicleModel):
        hint = "Give it thrusters: `ut.HybridVehicle(vehicle, ut.thrusters.t200())`"
        raise BadInput("plant", "be an AbstractPlant", "a VehicleModel", hint=hint)
    if isinstance(disturbance, list | tuple):
        disturbance = SumOfDisturbances(tuple(disturbance))
    acting: Any = none() if disturbance is None else disturbance
    navigation = perfect() if navigation is None else navigation
    described_controller = isinstance(controller, str | Mapping)
    for name, part, contract in (
        ("plant", plant, AbstractPlant),
        ("controller", controller, str | Mapping if described_controller else AbstractController),
        ("reference", reference, AbstractReference),
        ("disturbance", acting, AbstractDisturbance),
        ("navigation", navigation, AbstractNavigation),
    ):
        if not isinstance(part, contract):
            raise BadInput(name, f"be an {contract.__name__}", f"a {type(part).__name__}")
    checks.choice("precision", precision, ("float64", "float32"))
    with runtime.in_precision(precision):
        law = _named_law(controller, plant, navigation, dt) if described_controller else controller
        closed_loop = ClosedLoop(plant, law, reference, acting, navigation)
        closed_loop = in_present_precision(_with_faults(closed_loop, faults, dt))
        return _simulate(closed_loop, loop, (duration, dt, record), seed, position, velocity)


def _named_law(
    controller: str | Mapping[str, Any], plant: AbstractPlant, navigation: AbstractNavigation, dt: float
) -> AbstractController:
    """The law that a scenario with this `controller` has."""
    noise = np.asarray(velocity_noise_of(navigation, dt), dtype=float).tolist()
    with error_location("controller"):
        context = {"sampling_time": dt, "velocity_noise": noise}
        return factory.make("controllers", controller, Path(), (plant.model(),), context)[0]


def _with_faults(
    loop: ClosedLoop, faults: Sequence[Mapping[str, Any]] | AbstractFaults | None, dt: float
) -> ClosedLoop:
    """The loop with faults that are entries of a scenario, or a part of the loop already."""
    if faults is None or isinstance(faults, AbstractFaults):
        return dataclasses.replace(loop, faults=faults)
    if not isinstance(faults, list | tuple) or not all(isinstance(entry, Mapping) for entry in faults):
        raise BadInput("faults", "be a list of mappings", faults)
    mode_objects = {
        index: entry["mode"] for index, entry in enumerate(faults) if isinstance(entry.get("mode"), AbstractFault)
    }
    mode_names = {index: {"mode": name_of(mode)} for index, mode in mode_objects.items()}
    entries = []
    for index, entry in enumerate(faults):
        with error_location(f"faults[{index}]"):
            try:
                entries.append(Fault.model_validate({**entry, **mode_names.get(index, {})}))
            except ValidationError as errors:
                raise complaint(errors, from_data({}), Fault) from None
    with error_location("faults"):
        return with_faults(loop, entries, sampling_time=dt, made=mode_objects)[0]


def _simulate(closed_loop: ClosedLoop, kind: str, times: tuple[Any, Any, Any], seed: int, position, velocity) -> Run:
    nowhere = from_data({})
    try:
        given = zip(("duration", "dt", "record"), map(_plain, times), strict=True)
        plain = {name: value for name, value in given if value is not None}
        settings = ClosedLoopSettings.model_validate({"kind": kind, **plain})
        start = Initial(position=_plain(position), velocity=_plain(velocity))
        window = Window()
    except ValidationError as errors:
        bad_input = complaint(errors, nowhere)
        raise BadInput("loop" if bad_input.name == "kind" else bad_input.name, bad_input.must, bad_input.got) from None
    check_times(settings)
    check_start(closed_loop, start)
    check_fit(closed_loop)
    for advice in (*rounded_times(settings), *start_and_angles(closed_loop, settings.duration, start.position)):
        warnings.warn(advice.sentence, stacklevel=3)
    outcome, left_to_xla = run_loop(closed_loop, settings, start, seed)
    criterion = criterion_of(None, meanings(closed_loop))
    metrics_settings = MetricsSettings(window.of_run(settings.duration), settings.dt, criterion=criterion)
    why = step_failure(closed_loop, settings, outcome) or ""
    origin = Origin("a closed loop run by undertow", seed, left_to_xla=left_to_xla, why=why)
    return Run(make_result(closed_loop, outcome, metrics_settings, origin))


def simulate_scenario(scenario: str | Path | Mapping[str, Any], allow_code: bool = False) -> Run:
    """Run a scenario: a .yaml file, an earlier run.nc, or the same as a mapping.

    Args:
        scenario: what to run.
        allow_code: whether the Python code that an earlier run.nc names may run; that of a .yaml file may.

    Raises:
        BadInput: anything wrong with it, with key path and line.
    """
    text = from_data(scenario) if isinstance(scenario, Mapping) else read(Path(scenario), allow_code=allow_code)
    part_cache = PartCache()
    return Run(run_scenario(build(text, part_cache)), part_cache)


def _plain(value: Any) -> Any:
    """Arrays and numpy numbers as lists and numbers."""
    return value if value is None or isinstance(value, str) else np.asarray(value).tolist()

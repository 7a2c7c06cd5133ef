"""Build the closed loop of a scenario."""

import dataclasses
import functools
import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple, ParamSpec, TypeVar

import jax.numpy as jnp
import numpy as np

from undertow.analysis.metrics import meanings
from undertow.analysis.success import criterion_of
from undertow.analysis.temporal.requirements import Requirement, requirements_of
from undertow.control.navigation.from_sensors import SensorNavigation
from undertow.control.supervision.supervised_controller import unsupervised
from undertow.core import checks, runtime
from undertow.core.arrays import as_array, in_numbers, in_present_precision
from undertow.core.authority import authority_of
from undertow.core.catalogue import KIND_OF, is_user_code
from undertow.core.contracts import (
    AbstractController,
    AbstractDisturbance,
    AbstractInformedNavigation,
    AbstractNavigation,
    AbstractPlant,
    AbstractReference,
    Model,
)
from undertow.core.errors import Advice, BadInput, advice, error_location
from undertow.core.kept_programs import kept_program, kept_result
from undertow.core.metric import AbstractMetric, Metric
from undertow.core.numerics.rounding import three_digits
from undertow.physics.disturbances.loads import SumOfDisturbances
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.scenario import factory
from undertow.scenario.consistency import (
    check_fit,
    check_noise,
    check_nominal_plant,
    check_start,
    check_times,
    check_window,
    rounded_times,
)
from undertow.scenario.fault_injection import with_faults, without_faults
from undertow.scenario.foreign_code import code_hashes
from undertow.scenario.part_cache import PartCache
from undertow.scenario.plausibility import plausibility
from undertow.scenario.reading import Text, from_data
from undertow.scenario.schema import Part, Scenario
from undertow.scenario.step_size import step_advice
from undertow.scenario.validation import validate
from undertow.simulation.loop import continuous
from undertow.simulation.loop.closed_loop import ClosedLoop

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


_EXACT_INTEGERS = 2**24  # consecutive whole numbers that float32 represents


def in_its_precision(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Decorator: compute a function of a scenario (its first argument, read or built) in the scenario's precision."""

    @functools.wraps(function)
    def computed(*arguments: Arguments.args, **options: Arguments.kwargs) -> Result:
        source: Any = arguments[0]
        scenario = source.scenario if isinstance(source, Built) else validate(source)
        with runtime.in_precision(scenario.precision):
            return function(*arguments, **options)

    return computed


class Built(NamedTuple):
    """A scenario turned into objects."""

    closed_loop: ClosedLoop
    scenario: Scenario
    resolved: dict[str, Any]  # the scenario with every default filled in
    metrics: tuple[AbstractMetric, ...]  # the scenario's own
    text: Text  # of the scenario, whose lines advice names
    reference: AbstractReference  # as the scenario gives it: that of the loop begins where its plant does
    code: str  # hashes of the user's code files as they were read, see `code_hashes`
    requirements: tuple[Requirement, ...] = ()

    @in_its_precision
    def advice(self) -> tuple[Advice, ...]:
        """Warnings about a scenario that can be run."""
        with error_location(location=self.text.location):
            return tuple(self._advised())

    def _advised(self) -> Iterator[Advice]:
        loop, plant, navigation = self.scenario.loop, self.closed_loop.plant, self.closed_loop.navigation
        of_thruster = plant.thruster.advice() if isinstance(plant, HybridVehicle) else ()
        for sentence in plant.advice():
            yield advice("plant.thruster" if sentence in of_thruster else "plant", sentence.rstrip("."))
        if isinstance(plant, HybridVehicle):
            yield from step_advice(plant, loop)
        yield from rounded_times(loop)
        if self.scenario.precision == "float32" and loop.method != "adaptive":
            if loop.duration / loop.dt > _EXACT_INTEGERS:
                limit = f"{_EXACT_INTEGERS} steps, {_EXACT_INTEGERS * loop.dt:.6g} s"
                yield advice("precision", f"float32 cannot distinguish instants beyond {limit}")
        (start, _), end = self.window(), loop.duration
        if start >= end:
            window = f"the steady window starts at {start:g} s, and the run ends at {end:g} s"
            yield advice("steady.start", f"there are no steady metrics: {window}")
        if isinstance(navigation, SensorNavigation):
            yield from (advice("navigation", sentence) for sentence in navigation.advice(end))
        if self.resolved["model"].get("speed_sensor") is False:
            for index, entry in enumerate(self.resolved.get("faults", ())):
                if entry["target"].endswith("propeller_speed"):
                    message = f"`faults[{index}]` has no effect: the controller does not use measured propeller speeds"
                    yield advice(f"faults[{index}]", message, hint="Write `model: {speed_sensor: true}`")
        for index, entry in enumerate(self.resolved.get("faults", ())):
            first = min(entry["onset"]) if isinstance(entry["onset"], list) else entry["onset"]
            if first >= end:
                message = f"the fault begins at {first:g} s, and the run ends at {end:g} s: it has no effect"
                yield advice(f"faults[{index}].onset", message)
        yield from plausibility(self.closed_loop, end, self.scenario.initial.position)

    def of_the_law(self) -> "Built":
        """The same without faults and supervision, for what concerns the law by itself: prediction, tuning."""
        faultless = self.without_faults()
        loop = faultless.closed_loop
        law = unsupervised(loop.controller)
        return faultless._replace(closed_loop=dataclasses.replace(loop, controller=law))

    def without_faults(self) -> "Built":
        """The same scenario before any fault: predictions, tuning and exports are about that."""
        return self._replace(closed_loop=without_faults(self.closed_loop))

    def known_metrics(self) -> dict[str, Metric]:
        """Metrics that its runs may have, by name, with their units."""
        return meanings(self.closed_loop, self.metrics)

    def criterion(self) -> dict[str, float]:
        """What success is judged by: metric -> what it must stay below in the steady window."""
        return self.resolved["success"]

    def window(self) -> tuple[float, float]:
        """Start and stop of the steady metrics, s."""
        return self.resolved["steady"]["start"], self.resolved["steady"]["stop"]


def build(source: Text | Mapping[str, Any], part_cache: PartCache | None = None) -> Built:
    """Build the objects of a scenario on the CPU, so that the result does not depend on a GPU.

    They are made in double precision and then converted to the one that the scenario names.

    Args:
        source: a scenario as read from a file, or as Python data.
        part_cache: cache of parts that several similar scenarios share.

    Raises:
        BadInput: the scenario is invalid; the error names key path and location.
    """
    text = source if isinstance(source, Text) else from_data(source)
    return build_scenario(validate(text), text, part_cache)


def build_scenario(scenario: Scenario, text: Text, part_cache: PartCache | None = None) -> Built:
    """`build` of a scenario that was validated; `text` is what it was read from. Some of its numbers may be traced.

    Raises:
        BadInput: the scenario is invalid; the error names key path and location.
    """
    with runtime.on_processor(), error_location(location=text.location, written=text.as_written):
        with runtime.in_precision("float64"):
            built = _build(text, scenario, part_cache or PartCache())
        with runtime.in_precision(scenario.precision):
            return built._replace(closed_loop=in_present_precision(built.closed_loop))


def own_parts(scenario: Scenario, folder: Path) -> dict[str, str]:
    """Parts that the user wrote: key -> ./file.py:function as `undertow check` takes it in the current folder."""
    parts = {key: getattr(scenario, key) for key in KIND_OF}
    kinds = {key: part.kind for key, part in parts.items() if isinstance(part, Part) and is_user_code(part.kind)}
    return {key: os.path.relpath(folder / kind) for key, kind in kinds.items()}


def _build(text: Text, scenario: Scenario, part_cache: PartCache) -> Built:
    included = {"description", "loop", "initial", "seed", "precision"}
    resolved = scenario.model_dump(include=included, warnings=False)  # traced numbers are no floats

    start, stop = scenario.steady.of_run(scenario.loop.duration)
    resolved["steady"] = {"start": start, "stop": stop, "every_step": scenario.steady.every_step}

    context: dict[str, Any] = {"sampling_time": scenario.loop.dt}

    def make(key: str, leading_arguments: tuple = ()) -> Any:
        part, resolved[key] = make_part(key, key, getattr(scenario, key), leading_arguments)
        return part

    def make_part(key: str, where: str, part: Part, leading_arguments: tuple = ()) -> tuple[Any, dict[str, Any]]:
        described = {"part": part.model_dump(), "context": context}
        new = lambda: factory.make(KIND_OF[key], described["part"], text.folder, leading_arguments, context)
        with error_location(where):
            return part_cache.part(where, described, leading_arguments, new)

    def disturbance() -> AbstractDisturbance:
        if isinstance(scenario.disturbance, Part):
            return make("disturbance")
        pairs = [make_part("disturbance", f"disturbance[{i}]", part) for i, part in enumerate(scenario.disturbance)]
        resolved["disturbance"] = [description for _, description in pairs]
        return SumOfDisturbances(tuple(member for member, _ in pairs))

    def supervised(part: Part, law: AbstractController) -> AbstractController:
        """The law under supervision, with the fallback that takes its place."""
        options, fallback, described = part.model_dump(), None, {}
        fallback_options = options.pop("fallback", None)
        fallback_options = {"kind": fallback_options} if isinstance(fallback_options, str) else fallback_options
        if fallback_options not in (None, {"kind": "none"}):
            if not (isinstance(fallback_options, Mapping) and isinstance(fallback_options.get("kind"), str)):
                raise BadInput(
                    "supervisor.fallback", "be a controller by name, or a mapping with `kind`", fallback_options
                )
            fallback, fallback_description = make_part(
                "controller", "supervisor.fallback", Part(**fallback_options), (model,)
            )
            described = {"fallback": fallback_description}
        supervisor, resolved["supervisor"] = make_part(
            "supervisor", "supervisor", Part(**options), (law, plant, fallback)
        )
        resolved["supervisor"] |= described
        return supervisor

    plant = make("plant")
    nominal, described = plant, {}
    if scenario.model.plant is not None:
        nominal, described["plant"] = make_part("plant", "model.plant", scenario.model.plant)
        check_nominal_plant(nominal, plant)
    if scenario.model.follow:
        described["follow"] = True
    options = scenario.model.options
    make_model = lambda: factory.call(nominal.model, options, folder=text.folder)
    with error_location("model"):
        model, of_model = part_cache.part("model", options, (nominal,), make_model)
    resolved["model"] = of_model | described
    if "sensors" in (scenario.navigation.model_extra or {}):  # a filter of readings
        context["authority"] = _authority(nominal, model)
    navigation = make("navigation")
    noise = velocity_noise_of(navigation, scenario.loop.dt)
    check_noise(navigation, noise, plant, own_parts(scenario, text.folder))
    context["velocity_noise"] = np.asarray(noise, dtype=float).tolist()
    controller = make("controller", (model,))
    if scenario.supervisor is not None:
        controller = supervised(scenario.supervisor, controller)
    loop = ClosedLoop(plant, controller, make("reference"), disturbance(), navigation)
    resolved["navigation"] = resolved.pop("navigation")  # in the order of the scenario
    with error_location("faults"):
        loop, entries = with_faults(loop, scenario.faults, text.folder, scenario.loop.dt)
    if entries:
        resolved["faults"] = entries
    with error_location("loop"):
        if scenario.loop.kind == "continuous":
            continuous.check(loop)
        check_times(scenario.loop)
    with error_location("steady"):
        check_window(scenario.steady, scenario.loop)
    with error_location("initial"):
        check_start(loop, scenario.initial)
    fits = lambda: check_fit(loop, own_parts(scenario, text.folder))
    part_cache.check_once(loop, lambda: kept_result("fit", loop, fits))
    described_metrics = [make_part("metrics", f"metrics[{i}]", part) for i, part in enumerate(scenario.metrics)]
    if described_metrics:
        resolved["metrics"] = [description for _, description in described_metrics]
    metrics = tuple(part for part, _ in described_metrics)
    placed = loop.starting_at(scenario.initial.position)
    code = code_hashes(resolved, Path())  # its paths are absolute
    built = Built(placed, scenario, resolved, metrics, text, loop.reference, code)
    with error_location("controller.signals"):
        loop.signals()
    with error_location("success"):
        criterion = criterion_of(scenario.success, built.known_metrics())
    resolved["success"] = criterion
    if not scenario.requirements:
        return built
    resolved["requirements"] = {
        name: requirement.model_dump(exclude_none=True) for name, requirement in scenario.requirements.items()
    }
    with error_location("requirements"):
        return built._replace(requirements=_required(built))


def _required(built: Built) -> tuple[Requirement, ...]:
    """The requirements of a scenario."""
    declared = built.scenario.requirements
    formulas = {name: requirement.formula for name, requirement in declared.items() if requirement.formula is not None}
    bounds = {name: requirement.below for name, requirement in declared.items() if requirement.below is not None}
    requirements = requirements_of(
        formulas, bounds, built.closed_loop, built.known_metrics(), built.scenario.loop.duration
    )
    return tuple(sorted(requirements, key=lambda requirement: list(declared).index(requirement.name)))


def _authority(plant: AbstractPlant, model: Model) -> Any:
    """Acceleration that the actuators of a nominal vehicle give it, m/s^2 and rad/s^2, for gates of navigation.

    It is zero where it is unknown, and has three digits, so that a finished run states the same number in either
    precision; None for what is no vehicle.
    """
    with in_numbers():  # a number even where a scenario is built inside a compiled function
        acceleration = _largest_acceleration(plant, model)
    if not len(acceleration):
        return None
    return acceleration if checks.traced(acceleration) else [float(f"{value:.3g}") for value in acceleration.tolist()]


@kept_program
def _largest_acceleration(plant: AbstractPlant, model: Model):
    start = plant.output(jnp.zeros(()), plant.initial_state())
    if start.body is None:
        return jnp.zeros(0)
    acceleration = authority_of(model.in_body_axes(), plant)
    return three_digits(jnp.where(jnp.isfinite(acceleration), acceleration, 0.0))


def velocity_noise_of(navigation: AbstractNavigation, dt: float) -> Any:
    """Standard deviation of the measured velocities at each step of dt (s), for gains; zero where it is not known."""
    return _velocity_noise(navigation, as_array(dt)) if isinstance(navigation, AbstractInformedNavigation) else 0.0


@kept_program
def _velocity_noise(navigation: AbstractInformedNavigation, dt):
    return navigation.velocity_noise(dt)

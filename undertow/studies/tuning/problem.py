"""The tuning problem of a scenario: tunable parameters, controllers, training runs and cost."""

import inspect
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from undertow.core import catalogue
from undertow.core.contracts import AbstractController, AbstractPlant
from undertow.core.errors import BadInput, did_you_mean, error_location
from undertow.core.measurement import BODY_AXES
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.scenario.build import Built, build
from undertow.scenario.reading import Text
from undertow.scenario.unactuated_attitude import unactuated_axes
from undertow.studies.tuning import tunable_parameters as tunable_parameters
from undertow.studies.tuning.cost import CostSums
from undertow.studies.tuning.evaluator import TrainingLoop
from undertow.studies.tuning.training_runs import PlantVariants, training_and_held_out
from undertow.studies.tuning.tunable_parameters import SHARED, TunableParameter, TunableParameters, law_of

_LONGEST = 20.0  # s, default limit of the duration of a run
_DIGITS = 5  # of a tuned gain
_FAR = 1e9  # an input beyond every limit


# Options with one number that are no gains, but what a controller is designed for.
_NO_GAINS = ("sampling_time", "velocity_noise", "load_rate", "delay", "direction")


class Problem(NamedTuple):
    """A tuning problem."""

    built: Built
    parameters: list[TunableParameter]
    law: Callable[[Mapping[str, Any]], AbstractController]  # from tuned options
    start: np.ndarray  # the given gains as a point, moved to the nearest bound where they are outside
    training_loop: TrainingLoop
    train: PlantVariants
    held_out: PlantVariants

    def options(self, point: Any) -> dict[str, Any]:
        """Options at a point."""
        return tunable_parameters.options(
            self.parameters, point, len(self.built.closed_loop.controller.model.coordinates.angles)
        )

    def rounded(self, point: np.ndarray) -> dict[str, Any]:
        """Options at a point, rounded, as written in a scenario."""
        listed = {name: np.asarray(value) for name, value in self.options(point).items()}
        return {name: _rounded(value).tolist() for name, value in listed.items()}

    def gains(self, options: Mapping[str, Any]) -> dict[str, Any]:
        """Options as a scenario has them: None for those that are equivalent to one of them."""
        return _left_out(_law_of(self.built), options) | dict(options)

    def scenario(self, options: Mapping[str, Any]) -> dict[str, Any]:
        """The resolved scenario with these options of the controller."""
        return self.built.resolved | {"controller": self.built.resolved["controller"] | self.gains(options)}


def is_tunable(built: Built) -> bool:
    """Whether there are gains to tune: those of the section `tune`, or those that the controller has itself."""
    scenario, law = built.scenario, built.of_the_law()
    function, _ = _controller(law.text, law)
    return bool(scenario.tune.parameters or _own_ranges(_law_of(law), function, scenario.loop.dt))


def gains_in_force(built: Built, option: str) -> np.ndarray | None:
    """Gains of the controller, also where a rule sets them, one for all axes or one each; None where they are unknown.

    Args:
        built: scenario.
        option: of the controller.
    """
    built = built.of_the_law()
    value_in = _law_of(built).now.get(option)
    return None if value_in is None else np.asarray(value_in(built.closed_loop.controller), dtype=float)


def problem(text: Text) -> Problem:
    """A scenario as a tuning problem.

    Raises:
        BadInput: the scenario, or its section `tune`, cannot be used.
    """
    with error_location(location=text.location):
        return _problem(text, build(text).of_the_law())


def _problem(text: Text, built: Built) -> Problem:
    loop, scenario, tune = built.closed_loop, built.scenario, built.scenario.tune
    if scenario.loop.kind != "sampled":
        raise BadInput("loop.kind", "be sampled, for gains to be used on a vehicle", scenario.loop.kind)
    tunable = _law_of(built)
    dt = scenario.loop.dt
    angles = loop.controller.model.coordinates.angles
    function, base_options = _controller(text, built)
    chosen = _parameters(tunable, function, base_options, tune, dt, angles)
    train, held_out = training_and_held_out(text, built)
    duration = min(scenario.loop.duration, _LONGEST) if tune.duration is None else tune.duration
    start = duration / 2 if tune.start is None else tune.start
    if not start < duration or round(duration / dt) < 2:
        raise BadInput("tune.start", f"be earlier than the end of a run ({duration:g} s)", f"{start:g} s")
    scales = np.where(angles, tune.angle_scale, tune.position_scale)
    scales[list(_uncontrolled(loop.plant))] = np.inf
    sums = CostSums(tuple(angles), start, scales, _input_scale(loop.plant, loop.controller))
    as_floats = lambda values: None if values is None else np.asarray(values, dtype=float)
    places = as_floats(scenario.initial.position), as_floats(scenario.initial.velocity)
    training_loop = TrainingLoop(loop, scenario.loop, duration, places, sums, tune.weights)
    model = loop.controller.model
    law = lambda options: function(model, **(base_options | _left_out(tunable, options) | dict(options)))
    begin = [parameter.share(_mean(tunable, loop.controller, base_options, parameter)) for parameter in chosen]
    tuning_problem = Problem(built, chosen, law, np.array(begin), training_loop, train, held_out)
    try:
        with error_location("controller"):
            tuning_problem.law(tuning_problem.options(tuning_problem.start))
            jax.eval_shape(
                lambda point: eqx.filter(law(tuning_problem.options(point)), eqx.is_array), tuning_problem.start
            )
    except TypeError as error:
        must = "be options that the controller takes as arrays of JAX, one number for each axis"
        hint = "Compute with jax.numpy, without float() and without `if` on a gain"
        raise BadInput("tune.parameters", must, str(error).partition("\n")[0], hint=hint) from None
    _check_gains_are_arrays(tuning_problem)
    return tuning_problem


def _check_gains_are_arrays(tuning_problem: Problem) -> None:
    """Raise where a gain is a plain number of the given controller, and an array of those that are tried."""
    tried = tuning_problem.law(tuning_problem.options(tuning_problem.start))
    is_array = {path: eqx.is_array(leaf) for path, leaf in jax.tree_util.tree_flatten_with_path(tried)[0]}
    for path, leaf in jax.tree_util.tree_flatten_with_path(tuning_problem.built.closed_loop.controller)[0]:
        if not eqx.is_array(leaf) and is_array.get(path, False):
            field = jax.tree_util.keystr(path).lstrip(".")
            hint = f'Declare it as `{field}: Float[Param, "..."] = param("1/s", "what it is")`'
            raise BadInput("tune.parameters", "be gains that the controller has as arrays", f"`{field}`", hint=hint)


def _uncontrolled(plant: AbstractPlant) -> tuple[int, ...]:
    """Angles that no gain of a controller improves: those about axes of a vehicle that no thruster turns it about."""
    if not isinstance(plant, HybridVehicle):
        return ()
    unactuated = unactuated_axes(plant.thruster_matrix)
    return tuple(i for i, axis in enumerate(BODY_AXES) if i >= 3 and axis in unactuated)


def _law_of(built: Built) -> TunableParameters:
    description = built.resolved["controller"]
    return law_of(description["kind"], description.get("preset"), built.closed_loop.controller)


def _controller(text: Text, built: Built) -> tuple[Callable[..., AbstractController], dict[str, Any]]:
    """The function that makes the controller, and its options."""
    options = dict(built.resolved["controller"])
    function = catalogue.find("controllers", options.pop("kind"), text.folder)
    preset = options.pop("preset", None)
    return (function if preset is None else catalogue.presets_of(function)[preset]), options


def _parameters(
    tunable: TunableParameters,
    function: Callable[..., Any],
    base_options: Mapping[str, Any],
    tune: Any,
    dt: float,
    angles: tuple[bool, ...],
) -> list[TunableParameter]:
    ranges = tune.parameters or _own_ranges(tunable, function, dt)
    options = _options_of(function)
    if not ranges:
        raise BadInput(
            "tune.parameters",
            "be given: the options of this controller, or of its preset, have no ranges of their own",
            hint=_example(base_options),
        )
    for name in ranges:
        if name.partition("[")[0] not in options:
            hint = did_you_mean(name, options)
            raise BadInput(f"tune.parameters.{name}", "be an option of the controller", "unknown", hint=hint)
    return tunable_parameters.parameters(ranges, _groups(tune.per, angles), SHARED)


def _own_ranges(
    tunable: TunableParameters, function: Callable[..., Any], dt: float
) -> Mapping[str, tunable_parameters.Range]:
    """Ranges that a controller has itself, of gains that are options: those of a preset such as `ardusub` are fixed."""
    options = _options_of(function)
    return {name: ends for name, ends in tunable.ranges(dt).items() if name.partition("[")[0] in options}


def _options_of(function: Callable[..., Any]) -> list[str]:
    return list(inspect.signature(function).parameters)[1:]


def _example(options: Mapping[str, Any]) -> str:
    """How to give ranges: of an option of the controller with one number, around its value."""
    numbers = {
        name: value
        for name, value in options.items()
        if type(value) in (int, float) and value > 0 and name not in _NO_GAINS
    }
    if not numbers:
        return "Those of a preset such as `ardusub` are the autopilot's: tune another preset, or another controller"
    name, value = next(iter(numbers.items()))
    listing = f"; its options with one number are {', '.join(numbers)}" if len(numbers) > 1 else ""
    return f"For example `tune: {{parameters: {{{name}: [{value / 10:g}, {10 * value:g}]}}}}`{listing}"


def _groups(per: str, angles: tuple[bool, ...]) -> list[tuple[int, ...]]:
    """Groups of axes: translation and rotation of a plant with both; otherwise each axis, or all together."""
    axes = range(len(angles))
    if per == "all":
        return [tuple(axes)]
    if per == "group" and len(set(angles)) == 2:
        return [tuple(i for i in axes if angles[i] == turns) for turns in (False, True)]
    return [(i,) for i in axes]


def _left_out(tunable: TunableParameters, options: Mapping[str, Any]) -> dict[str, None]:
    """Options that are equivalent to tuned ones, set to None."""
    return {equivalent: None for option in options for equivalent in tunable.instead.get(option, ())}


def _mean(
    tunable: TunableParameters, law: AbstractController, base_options: Mapping[str, Any], parameter: TunableParameter
) -> float:
    """Value of a parameter in a controller: geometric mean over its axes, or of its bounds where unknown."""
    name = parameter.option if parameter.entry is None else f"{parameter.option}[{parameter.entry}]"
    value = tunable.now[name](law) if name in tunable.now else base_options.get(parameter.option)
    if value is None:
        return float(np.sqrt(parameter.low * parameter.high))
    numbers = np.asarray(value, dtype=float)
    if name not in tunable.now and parameter.entry is not None:
        numbers = numbers[..., parameter.entry]
    of_axes = numbers[list(parameter.axes)] if numbers.ndim and parameter.axes else numbers
    return float(np.exp(np.log(np.maximum(of_axes, parameter.low)).mean()))


def _input_scale(plant: AbstractPlant, law: AbstractController) -> float:
    """Largest input; without limits, the input that accelerates every axis by 1 m/s^2 or rad/s^2."""
    x = plant.initial_state()
    most = np.abs(np.asarray(plant.admissible(x, jnp.full(plant.inputs(), _FAR)))).max()
    if most < _FAR:
        return float(most)
    y = plant.output(jnp.zeros(()), x)
    held = law.model.actuators.quasi_static()
    forces = law.model.dynamics.invert(y, jnp.ones(len(plant.outputs)))
    size = np.abs(np.asarray(held.command(held.init(), forces, jnp.ones(())))).max()
    return float(size) if size > 0 else 1.0


def _rounded(value: np.ndarray) -> np.ndarray:
    return np.vectorize(lambda number: float(f"{number:.{_DIGITS}g}"), otypes=[float])(value)

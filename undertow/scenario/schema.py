"""Keys of a scenario file, their defaults and their checks. Validated before anything is built or compiled."""

import re
import typing
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BaseModel, BeforeValidator, ConfigDict, Discriminator, Field, Tag, ValidationError, model_validator

from undertow.core import catalogue
from undertow.core.errors import BadInput, joined, known_key
from undertow.scenario.reading import Text, wrong_file
from undertow.scenario.synonyms import hint_for
from undertow.scenario.values import remedy_of
from undertow.scenario.vehicle_schema import KEYS as VEHICLE_KEYS


def _named(default: str | None = None) -> BeforeValidator:
    """`odin` is short for `{kind: odin}`, and `kind` may have a default."""

    def complete(value: Any) -> Any:
        if isinstance(value, str):
            return {"kind": value}
        return {"kind": default, **value} if default and isinstance(value, dict) else value

    return BeforeValidator(complete)


def _law(value: Any) -> Any:
    """A law by its name or that of a preset, or a mapping; a mapping without `kind` has options of preset `robust`."""
    return named_law(value) if isinstance(value, str | dict) else value


def named_law(value: str | Mapping[str, Any]) -> dict[str, Any]:
    """The part that a value of the key `controller` stands for."""
    described = {"kind": value} if isinstance(value, str) else dict(value)
    if "preset" in described:
        return {"kind": "rcaf", **described}
    return catalogue.spelled_out("controllers", {"kind": "robust", **described})


_YES, _NO = ("true", "yes", "on"), ("false", "no", "off", "none")


def _switched(value: Any) -> Any:
    """The supervisor with its defaults for true, none for false; YAML 1.2 reads `yes` and `on` as words."""
    word = str(value).lower() if isinstance(value, bool | str) else ""
    return {"kind": "supervisor"} if word in _YES else None if word in _NO else value


class Part(BaseModel):
    """A part by name, with its options: checked against the part's own signature when it is built."""

    model_config = ConfigDict(extra="allow", strict=True)
    kind: str = Field(description="name of the part, see `undertow list`, or ./file.py:function")


NamedPart = Annotated[Part, _named()]
# Tags select one of the two for pydantic, so that it reports errors about that one only.
_ONE, _SEVERAL = "(one part)", "(several parts)"
OneOrMore = Annotated[
    Annotated[NamedPart, Tag(_ONE)] | Annotated[list[NamedPart], Tag(_SEVERAL)],
    Discriminator(lambda value: _SEVERAL if isinstance(value, list) else _ONE),
]
Numbers = list[float]
_LISTED = 5  # further wrong keys that a message names


class Strict(BaseModel):
    """A mapping that rejects unknown keys and values of other types."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class ClosedLoopSettings(Strict, title="Loop"):
    """Settings of the closed-loop simulation."""

    kind: Literal["sampled", "continuous"] = Field(
        "sampled",
        description="sampled: the controller runs every dt with the input held; continuous: plant and controller "
        "are one ordinary differential equation (ODE)",
    )
    duration: float = Field(20.0, gt=0, le=1e6, description="duration of the run, s")
    dt: float = Field(1e-3, gt=0, le=10, description="sampling time of the controller, or step of the ODE, s")
    record: float = Field(1e-2, gt=0, le=1e5, description="time between records, s")
    method: Literal["rk4", "euler", "adaptive"] = Field(
        "rk4",
        description="integration method: rk4; euler (sampled only); adaptive with rtol and atol (continuous only)",
    )
    substeps: int = Field(1, ge=1, le=100, description="integration steps of the plant per dt (sampled only)")
    backend: Literal["simd", "xla"] = Field(
        "simd",
        description="compiler of a loop with fixed steps: simd gives the same bits for single runs and batches; xla "
        "supports all parts and is used where simd does not, and for adaptive steps",
    )
    rtol: float = Field(1e-8, gt=0, lt=1, description="relative tolerance (adaptive only)")
    atol: float = Field(1e-9, gt=0, lt=1, description="absolute tolerance (adaptive only)")


class Initial(Strict):
    """State at t = 0; zero by default."""

    position: Numbers | None = Field(None, description="one entry per output, m and rad; default: zero")
    velocity: Numbers | None = Field(None, description="one entry per output, m/s and rad/s; default: zero")


class Window(Strict):
    """Part of the run over which the steady metrics are computed."""

    start: float | None = Field(default=None, ge=0, description="start, s; default: half of the duration")
    stop: float | None = Field(default=None, gt=0, description="end, s; default: the duration")
    every_step: bool = Field(
        default=False,
        description="whether to use every control step, as campaigns do, instead of the records (sampled only)",
    )

    def of_run(self, duration: float) -> "tuple[float, float]":
        """Start and stop, s."""
        start = duration / 2 if self.start is None else self.start
        return start, duration if self.stop is None else self.stop


Range = Annotated[
    Annotated[float | None, Tag(_ONE)] | Annotated[list[float], Tag(_SEVERAL)],
    Discriminator(lambda value: _SEVERAL if isinstance(value, list) else _ONE),
]
NumberOrRandom = Annotated[
    Annotated[int | None, Tag(_ONE)] | Annotated[Literal["random"], Tag(_SEVERAL)],
    Discriminator(lambda value: _SEVERAL if isinstance(value, str) else _ONE),
]


class Fault(BaseModel):
    """One fault. Further keys are options of its mode, checked against the mode's own signature when it is built."""

    model_config = ConfigDict(extra="allow", strict=True, allow_inf_nan=False)
    target: str = Field(
        description="what fails: a quantity that the controller receives (position, attitude, velocity, angular_rate, "
        "depth, propeller_speed), a sensor of the navigation (sensor dvl), thruster 3 or its name, bus, plant or "
        "computation"
    )
    mode: str = Field(description="how, see `undertow list faults`, or ./file.py:function")
    severity: Range = Field(
        None, description="how much; [lowest, highest] is sampled for every seed; default: that of the mode"
    )
    onset: Annotated[Range, Field(description="when it begins, s; [earliest, latest] is sampled for every seed")] = 0.0
    duration: float | None = Field(
        None, gt=0, description="how long it lasts, s; default: that of the mode, or to the end"
    )
    announced: bool = Field(False, description="whether the controller is informed that the thruster has failed")
    number: NumberOrRandom = Field(
        None, description="of the thruster or of the sensor of this name; random: any thruster"
    )
    axis: int | None = Field(None, description="the one entry of the signal that fails, from 1; default: all")


class TrainingRuns(Strict):
    """Runs for the evaluation of gains: every parameter set with every seed."""

    seeds: int = Field(2, ge=1, le=1000, description="number of seeds")
    sizes: Numbers = Field(
        [0.6, 1.2], description="factors on the disturbance, which alternate with the seeds; 1 leaves it unchanged"
    )
    sets: list[str] | None = Field(
        None, description="plant variants: parameter sets of the vehicle; default: every second published set"
    )


class Weights(Strict):
    """Weights of the dimensionless cost: errors relative to their scales, inputs relative to their limit."""

    tracking: float = Field(1.0, ge=0, description="weight of the rms tracking error")
    effort: float = Field(0.1, ge=0, description="weight of the rms input")
    variation: float = Field(0.05, ge=0, description="weight of the total variation of the input per second")
    failure: float = Field(100.0, ge=0, description="weight of the share of the duration that a failed run lacks")


class Tune(Strict):
    """Settings of `undertow tune`; other commands ignore them."""

    parameters: dict[str, Numbers] = Field(
        default_factory=dict,
        description="tunable parameters: option of the controller -> [low, high]; default: its main gains",
    )
    per: Literal["group", "axis", "all"] = Field(
        "group", description="separate gains for translation and rotation (group), for each axis, or one value for all"
    )
    duration: float | None = Field(
        None, gt=0, le=1e5, description="duration of every run, s; default: that of the scenario, at most 20"
    )
    start: float | None = Field(
        None, ge=0, description="start of the evaluated window, s; default: half of the duration"
    )
    position_scale: float = Field(0.05, gt=0, description="position error with a cost of one, m")
    angle_scale: float = Field(0.05, gt=0, description="angle error with a cost of one, rad")
    iterations: int = Field(100, ge=1, le=100_000, description="largest number of iterations")
    train: TrainingRuns = Field(default_factory=TrainingRuns, description="training runs")  # pyright: ignore[reportArgumentType] - pydantic knows the defaults
    held_out: TrainingRuns = Field(
        default_factory=lambda: TrainingRuns.model_validate({"seeds": 4}),
        description="held-out runs for the final evaluation",
    )
    weights: Weights = Field(default_factory=Weights, description="weights of the cost")  # pyright: ignore[reportArgumentType] - pydantic knows the defaults


class RunRequirement(Strict):
    """A requirement on a run: exactly one of these keys."""

    below: float | None = Field(None, description="upper bound of the metric of this name in the steady window")
    formula: str | None = Field(
        None, description="temporal formula on the records, such as `within 10 s always position_error < 0.1`"
    )

    @model_validator(mode="after")
    def _one(self) -> "RunRequirement":
        if (self.below is None) == (self.formula is None):
            raise ValueError("have one of below, formula")
        return self


class Bounds(Strict):
    """Bounds of a number that `undertow falsify` varies."""

    between: Annotated[list[float], Field(min_length=2, max_length=2)] = Field(description="low, high")
    nominal: float | None = Field(None, description="value of the intact loop; default: that of the scenario")
    integer: bool = Field(False, description="whether only whole numbers are allowed")

    @model_validator(mode="before")
    @classmethod
    def _mapping(cls, value: Any) -> Any:
        if not isinstance(value, dict):
            low, high = value if isinstance(value, list) and len(value) == 2 else ("low", "high")
            raise ValueError(f"be bounds, such as {{between: [{low}, {high}]}}")
        return value

    @model_validator(mode="after")
    def _ordered(self) -> "Bounds":
        low, high = self.between
        if not low < high:
            raise ValueError("have low below high")
        if self.nominal is not None and not low <= self.nominal <= high:
            raise ValueError("have the nominal value within its bounds")
        return self


class Falsify(Strict):
    """Settings of `undertow falsify`; other commands ignore them."""

    vary: dict[str, Bounds] = Field(default_factory=dict, description="key path of the scenario -> its bounds")
    requirements: list[str] | None = Field(
        None, min_length=1, description="names of the requirements to break any of; default: all"
    )
    seeds: int = Field(
        1, ge=1, le=100_000, description="number of seeds that the runs have in turn, from that of the scenario on"
    )


class NominalModel(BaseModel):
    """What the controller knows of the plant. Further keys are options of the plant's own method `model`."""

    model_config = ConfigDict(extra="allow", strict=True)
    plant: Annotated[Part, _named("hybrid_vehicle")] | None = Field(
        None, description="the plant of which the nominal model is made; default: the plant that is simulated"
    )
    follow: bool = Field(
        False,
        description="whether the nominal model has the numbers of the plant in each trial of a study that varies them; "
        "default: those of the scenario",
    )

    @property
    def options(self) -> dict[str, Any]:
        """Options of the plant's method `model`."""
        return dict(self.model_extra or {})


class Scenario(Strict):
    """One closed loop."""

    description: str = Field("", description="free text")
    plant: Annotated[Part, _named("hybrid_vehicle")] = Field(
        Part(kind="hybrid_vehicle"),
        description="the system that is controlled: for a vehicle with the options vehicle and thruster",
    )
    model: NominalModel = Field(
        default_factory=NominalModel,  # pyright: ignore[reportArgumentType] - pydantic knows the defaults
        description="options of the nominal model, which the controller uses; default: the plant",
    )
    controller: Annotated[Part, BeforeValidator(_law)] = Field(
        Part.model_validate({"kind": "rcaf", "preset": "robust"}), description="the control law"
    )
    reference: NamedPart = Field(description="the desired motion")
    disturbance: OneOrMore = Field(Part(kind="none"), description="the disturbance; several as a list")
    navigation: NamedPart = Field(
        Part(kind="perfect"), description="the navigation filter, which computes the measurement of the controller"
    )
    supervisor: Annotated[Annotated[Part, _named("supervisor")] | None, BeforeValidator(_switched)] = Field(
        None,
        description="supervision of the controller: true, or options of the supervisor; `fallback` is a controller "
        "that takes over when the law fails",
    )
    faults: list[Fault] = Field(default_factory=list, description="faults that are injected into the run")
    loop: ClosedLoopSettings = Field(default_factory=ClosedLoopSettings, description="settings of the simulation")  # pyright: ignore[reportArgumentType] - pydantic knows the defaults
    initial: Initial = Field(default_factory=Initial, description="state at t = 0")  # pyright: ignore[reportArgumentType] - pydantic knows the defaults
    steady: Window = Field(default_factory=Window, description="window of the steady metrics")
    metrics: list[NamedPart] = Field(
        default_factory=list, description="further metrics, each ./file.py:function that returns an AbstractMetric"
    )
    success: dict[str, float] | None = Field(
        None,
        description="metric -> what it must stay below in the steady window; default: position_rms 0.05 m, "
        "attitude_rms 0.05 rad and saturated_fraction 0.25",
    )
    requirements: dict[str, RunRequirement] = Field(
        default_factory=dict, description="what every run must keep: name -> a bound of a metric, or a temporal formula"
    )
    tune: Tune = Field(default_factory=Tune, description="settings of `undertow tune`")  # pyright: ignore[reportArgumentType] - pydantic knows the defaults
    falsify: Falsify = Field(default_factory=Falsify, description="settings of `undertow falsify`")  # pyright: ignore[reportArgumentType] - pydantic knows the defaults
    seed: int = Field(0, ge=0, le=2**32 - 1, description="seed of all random numbers")
    precision: Literal["float64", "float32"] = Field("float64", description="precision of all arithmetic")


_REMEDIES = {
    "campaign": "Run it: undertow campaign {name}",
    "vehicle file": "Name it in a scenario, as `plant: {{vehicle: {name}}}`; to check it alone: undertow check {name}",
}


def kind_of(data: Mapping[str, Any]) -> str:
    """What a file is by its keys: `campaign`, `vehicle file` or `scenario`; "" where it has no key of any."""
    if "scenario" in data:
        return "campaign"
    vehicle = sum(key in VEHICLE_KEYS for key in data)
    scenario = sum(key in Scenario.model_fields for key in data)
    return "vehicle file" if vehicle > scenario else "scenario" if scenario else ""


def validate(text: Text) -> Scenario:
    """Validate the contents of a scenario file.

    Raises:
        BadInput: unknown key, wrong type, value out of range; the error names key, location and nearest known word.
    """
    check_kind(text)
    try:
        return Scenario.model_validate(text.data)
    except ValidationError as errors:
        raise complaint(errors, text) from None


def check_kind(text: Text, key: str = "", where: str = "") -> None:
    """Check that a text is not another kind of file; `key` and `where` are the place that named it, if any.

    Raises:
        BadInput: it is.
    """
    if (kind := kind_of(text.data)) in _REMEDIES:
        name = text.name or "NAME.yaml"
        hint = _REMEDIES[kind].format(name=name)
        raise wrong_file(Path(name), key, "be a scenario", f"a {kind}", hint=hint, where=where)


def complaint(errors: ValidationError, text: Text, model: type[BaseModel] = Scenario) -> BadInput:
    """The first of pydantic's errors as BadInput, misspelt keys before others, and the names of the other keys."""
    first: Any
    line = lambda error: text.lines.get(_path_of(error), 0)
    first, *other_errors = sorted(errors.errors(), key=lambda error: (error["type"] != "extra_forbidden", line(error)))
    what, path, name = model.__name__.lower(), _path_of(first), _name_of(first)
    where, also = text.where(path), _also(first, other_errors, text)
    if first["type"] == "extra_forbidden":
        hint = _section_of(path, model) or hint_for(path, what) or known_key(str(path[-1]), _keys_beside(path, model))
        return BadInput(name, f"be a key of the {what}", "unknown", hint=joined(hint, also), where=where)
    if first["type"] == "missing":
        section, _, key = name.rpartition(".")
        parent = f"`{section}`" if section else f"the {what}"
        return BadInput(name, "be given", hint=joined(f"Add `{key}:` to {parent}", also), where=where)
    got = "empty" if first["input"] is None else _as_yaml(first["input"])
    return BadInput(name, _must(first), got, hint=joined(_remedy(first), also), where=where)


def _as_yaml(value: Any) -> str:
    """A value as a file has it, on one line."""
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key}: {_as_yaml(entry)}' for key, entry in value.items())}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(_as_yaml, value))}]"
    return repr(value)


def _path_of(error: Any) -> tuple[str | int, ...]:
    return tuple(step for step in error["loc"] if step not in (_ONE, _SEVERAL))


def _name_of(error: Any) -> str:
    name = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in _path_of(error)).lstrip(".")
    return " ".join(name.split())


def _also(first: Any, other_errors: Sequence[Any], text: Text) -> str:
    """Sentence with the other keys that are wrong; without those that a misspelt key leaves missing."""
    misspelt = {_path_of(error)[:-1] for error in (first, *other_errors) if error["type"] == "extra_forbidden"}
    other_errors = [
        error for error in other_errors if error["type"] != "missing" or _path_of(error)[:-1] not in misspelt
    ]
    lines = {_name_of(error): text.lines.get(_path_of(error)) for error in other_errors}
    named_keys = [
        f"`{name}`{f' (line {line})' if line else ''}" for name, line in lines.items() if name != _name_of(first)
    ]
    more = f" and {len(named_keys) - _LISTED} more" if len(named_keys) > _LISTED else ""
    return f"Also wrong: {', '.join(named_keys[:_LISTED])}{more}" if named_keys else ""


def _must(error: Any) -> str:
    """pydantic's 'Input should be ...' as the phrase after "must"."""
    message = error["msg"].replace("Input should be a valid ", "be a ").replace("Input should be ", "be ")
    message = message.replace("Value error, ", "").replace("Keys should be strings", "have words for keys")
    message = re.sub(r"\w+ should have at (\w+) (\d+) items?.*", r"have at \1 \2 entries", message)
    message = re.sub(r" or instance of \w+", "", message)
    return message.replace("be a integer", "be an integer").replace("a dictionary", "a mapping of keys to values")


def _remedy(error: Any) -> str:
    """How to write what was meant, where a number, true or false, or the space of `key: value` is missing."""
    kind, got = error["type"], error["input"]
    if "mapping" in _must(error) and isinstance(got, str) and re.fullmatch(r"[\w-]+:\S+", got):
        return "Write a space after the colon"
    return remedy_of(got, kind == "bool_type") if kind in ("float_type", "int_type", "bool_type") else ""


# Sections of parts whose names newcomers write at the top.
_INSIDE = {"vehicle": "plant", "thruster": "plant", "battery": "plant", "esc": "plant", "sensors": "navigation"}


def _section_of(path: tuple, model: type[BaseModel]) -> str:
    """Where a key at the top of a file belongs; "" for a key that no section has."""
    if len(path) == 1 and "scenario" in model.model_fields and path[0] in Scenario.model_fields:
        return "It is a key of the scenario"
    if model is not Scenario or len(path) != 1:
        return ""
    sections = [key.path.split(".") for key in keys()]
    inside = [steps[0] for steps in sections if len(steps) == 2 and steps[1] == path[0] != "kind"]
    section = next(iter(inside), _INSIDE.get(path[0]))
    kind = "kind: kalman, " if section == "navigation" else ""
    return f"It belongs to `{section}`: write `{section}: {{{kind}{path[0]}: ...}}`" if section else ""


def _keys_beside(path: tuple, model: Any) -> list[str]:
    for key in path[:-1]:
        if typing.get_origin(model) is dict:
            model = typing.get_args(model)[1]
            continue
        field = model.model_fields.get(key) if hasattr(model, "model_fields") else None
        model = _beside_none(field.annotation) if field is not None else None
    return list(model.model_fields) if hasattr(model, "model_fields") else []


def _beside_none(annotation: Any) -> Any:
    """The type of an optional value without None."""
    members = typing.get_args(annotation)
    types = [member for member in members if member is not type(None)]
    return types[0] if len(types) == 1 < len(members) else annotation


class Key(NamedTuple):
    """One key of a scenario file."""

    path: str
    type: str
    default: Any  # "required" when there is none
    meaning: str


def keys(model: type[BaseModel] = Scenario, prefix: str = "", defaults: BaseModel | None = None) -> Iterator[Key]:
    """Every key a scenario may have, nested ones included.

    Args:
        model: with the keys.
        prefix: goes before them.
        defaults: a section with default values, where these are not those of its class.
    """
    for name, field in model.model_fields.items():
        inner = field.annotation if isinstance(field.annotation, type) else None
        meaning, _, stated_default = (field.description or "").partition("; default: ")
        default = getattr(defaults, name) if defaults else field.get_default(call_default_factory=True)
        if inner is not None and issubclass(inner, Strict):
            yield Key(f"{prefix}{name}", "mapping", "see below", meaning)
            yield from keys(inner, f"{prefix}{name}.", default)
        else:
            default_text = default.kind if isinstance(default, Part) else "required" if field.is_required() else default
            yield Key(f"{prefix}{name}", _type_name(field.annotation), stated_default or default_text, meaning)


def _type_name(annotation: Any) -> str:
    if annotation is Part:
        return "part"
    if typing.get_origin(annotation) is Literal:
        return " or ".join(typing.get_args(annotation))
    annotation = _beside_none(annotation)
    if typing.get_origin(annotation) is Annotated:
        annotation = typing.get_args(annotation)[0]
    words = {
        float: "number",
        bool: "true or false",
        int: "integer",
        str: "text",
        Numbers: "list of numbers",
        list[str]: "list of names",
        list[Any]: "list of values",
        list[NamedPart]: "list of parts",
        list[Fault]: "list of faults",
        typing.get_args(OneOrMore)[0]: "part or list of parts",
        str | dict[str, Any]: "name of a file, or mapping",
    }
    return words.get(annotation, "mapping")

"""What a scenario file may say. Validated before anything is built or compiled."""

import re
import typing
from collections.abc import Iterator
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BaseModel, BeforeValidator, ConfigDict, Discriminator, Field, Tag, ValidationError

from undertow.core.errors import BadInput, did_you_mean
from undertow.scenario.reading import Text


def _named(default: str | None = None) -> BeforeValidator:
    """`odin` is short for `{kind: odin}`, and `kind` may have a default."""

    def complete(value: Any) -> Any:
        if isinstance(value, str):
            return {"kind": value}
        return {"kind": default, **value} if default and isinstance(value, dict) else value

    return BeforeValidator(complete)


class Part(BaseModel):
    """A part by name, with its options: checked against the part's own signature when it is built."""

    model_config = ConfigDict(extra="allow", strict=True)
    kind: str = Field(description="name of the part, see `undertow list`, or ./file.py:function")


NamedPart = Annotated[Part, _named()]
# Tags tell pydantic which of the two is meant, so that it complains about that one only.
_ONE, _SEVERAL = "(one part)", "(several parts)"
OneOrMore = Annotated[
    Annotated[NamedPart, Tag(_ONE)] | Annotated[list[NamedPart], Tag(_SEVERAL)],
    Discriminator(lambda given: _SEVERAL if isinstance(given, list) else _ONE),
]
Numbers = list[float]


class Strict(BaseModel):
    """Keys that are not known, and values of other types, are refused."""

    model_config = ConfigDict(extra="forbid", strict=True, allow_inf_nan=False)


class Loop(Strict):
    """How the closed loop is run."""

    kind: Literal["sampled", "continuous"] = Field("sampled", description="a scan at dt, or one ODE")
    duration: float = Field(20.0, gt=0, le=1e6, description="s")
    dt: float = Field(1e-3, gt=0, le=10, description="sampling time of the controller, or step of the ODE, s")
    record: float = Field(1e-2, gt=0, le=1e5, description="time between records, s")
    method: Literal["rk4", "euler", "adaptive"] = Field(
        "rk4", description="integration: rk4; euler (sampled); adaptive, to rtol and atol (continuous)"
    )
    substeps: int = Field(1, ge=1, le=100, description="plant steps per dt (sampled)")
    backend: Literal["simd", "xla"] = Field(
        "simd",
        description="what compiles it (sampled): lanes, the same bits everywhere; xla, also for what lanes lack",
    )
    rtol: float = Field(1e-8, gt=0, lt=1, description="relative tolerance (adaptive)")
    atol: float = Field(1e-9, gt=0, lt=1, description="absolute tolerance (adaptive)")


class Initial(Strict):
    """State at t = 0; zero where not given."""

    position: Numbers | None = Field(None, description="one entry per output, m and rad")
    velocity: Numbers | None = Field(None, description="one entry per output, m/s and rad/s")


class Window(Strict):
    """Part of the run that the metrics `steady` are taken over."""

    start: float | None = Field(default=None, ge=0, description="s; half of the duration unless given")
    stop: float | None = Field(default=None, gt=0, description="s; the end unless given")
    every_step: bool = Field(
        default=False, description="count every control step, as campaigns do, and not only the recorded ones (sampled)"
    )

    def of_run(self, duration: float) -> "tuple[float, float]":
        """Start and stop, s."""
        start = duration / 2 if self.start is None else self.start
        return start, duration if self.stop is None else self.stop


class TrainingRuns(Strict):
    """Runs that gains are tried on: every parameter set with every seed."""

    seeds: int = Field(2, ge=1, le=1000, description="number of seeds")
    sizes: Numbers = Field([0.6, 1.2], description="of the disturbance, in turn with the seeds; 1 as it is")
    sets: list[str] | None = Field(None, description="true parameter sets of the vehicle; every second unless given")


class Weights(Strict):
    """What a run costs, without unit: errors by their scales, inputs as a share of their limit."""

    tracking: float = Field(1.0, ge=0, description="of the rms of the error")
    effort: float = Field(0.1, ge=0, description="of the rms of the input")
    variation: float = Field(0.05, ge=0, description="of the total variation of the input per second")
    failure: float = Field(100.0, ge=0, description="of the share of the time that a failed run did not last")


class Tune(Strict):
    """What `undertow tune` does with this scenario; other commands do not look at it."""

    parameters: dict[str, Numbers] = Field(
        default_factory=dict, description="options of the controller: [low, high]; its main gains unless given"
    )
    per: Literal["group", "axis", "all"] = Field(
        "group", description="gains for translation and rotation of a vehicle, for each axis, or one for all"
    )
    duration: float | None = Field(None, gt=0, le=1e5, description="s, of every run; 20 or less unless given")
    start: float | None = Field(None, ge=0, description="s, from when on it counts; the second half unless given")
    position_scale: float = Field(0.05, gt=0, description="error that costs one, m")
    angle_scale: float = Field(0.05, gt=0, description="error that costs one, rad")
    iterations: int = Field(100, ge=1, le=100_000, description="at most")
    train: TrainingRuns = Field(default_factory=TrainingRuns, description="runs that the gains are found on")
    held_out: TrainingRuns = Field(
        default_factory=lambda: TrainingRuns.model_validate({"seeds": 4}),
        description="other runs that they are judged by; 4 seeds unless given",
    )
    weights: Weights = Field(default_factory=Weights, description="of the cost")


class Scenario(Strict):
    """One closed loop, start to finish."""

    description: str = Field("", description="free text")
    plant: Annotated[Part, _named("hybrid_vehicle")] = Field(
        Part(kind="hybrid_vehicle"), description="what is controlled"
    )
    model: dict[str, Any] = Field(default_factory=dict, description="what the controller may know of the plant")
    controller: Annotated[Part, _named("rcaf")] = Field(Part(kind="rcaf"), description="the law")
    reference: NamedPart = Field(description="what to follow")
    disturbance: OneOrMore = Field(Part(kind="none"), description="what the surroundings do; several as a list")
    navigation: NamedPart = Field(Part(kind="perfect"), description="what stands before the measurement")
    loop: Loop = Field(default_factory=Loop, description="how it is run")
    initial: Initial = Field(default_factory=Initial, description="state at t = 0")
    steady: Window = Field(default_factory=Window, description="window of the steady metrics")
    metrics: list[NamedPart] = Field(
        default_factory=list, description="further metrics, each ./file.py:function that returns an AbstractMetric"
    )
    success: dict[str, float] | None = Field(
        None,
        description="metric -> what it must stay below in the steady window; position_rms 0.05 m and attitude_rms "
        "0.05 rad unless given",
    )
    tune: Tune = Field(default_factory=Tune, description="what `undertow tune` does with it")
    seed: int = Field(0, ge=0, le=2**32 - 1, description="of everything random")
    precision: Literal["float64", "float32"] = Field("float64", description="of all arithmetic")


def validate(text: Text) -> Scenario:
    """The scenario, or the first complaint about it.

    Raises:
        BadInput: unknown key, wrong type, value out of range; names key, place and nearest known word.
    """
    if "scenario" in text.data:
        hint = "`undertow campaign` flies campaigns"
        raise BadInput("scenario", "be a key of campaigns only", hint=hint, where=text.where(("scenario",)))
    try:
        return Scenario.model_validate(text.data)
    except ValidationError as errors:
        raise complaint(errors, text) from None


def complaint(errors: ValidationError, text: Text, model: type[BaseModel] = Scenario) -> BadInput:
    """The first of pydantic's errors in the house grammar; a misspelt key before the key that it leaves missing."""
    what = model.__name__.lower()
    error: Any = min(errors.errors(), key=lambda each: each["type"] != "extra_forbidden")
    path = tuple(step for step in error["loc"] if step not in (_ONE, _SEVERAL))
    name = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in path).lstrip(".")
    name = " ".join(name.split())
    where = text.where(path)
    if error["type"] == "extra_forbidden":
        hint = did_you_mean(str(path[-1]), _keys_beside(path, model))
        return BadInput(name, f"be a key of the {what}", "unknown", hint=hint, where=where)
    if error["type"] == "missing":
        return BadInput(name, "be given", hint=f"Add `{path[-1]}:` to the {what}", where=where)
    got = error["input"]
    return BadInput(name, _must(error), "empty" if got is None else repr(got), where=where)


def _must(error: Any) -> str:
    """pydantic's 'Input should be ...' in the house grammar."""
    message = error["msg"].replace("Input should be a valid ", "be a ").replace("Input should be ", "be ")
    message = message.replace("Value error, ", "").replace("Keys should be strings", "have words for keys")
    message = re.sub(r"\w+ should have at (\w+) (\d+) items?.*", r"have at \1 \2 entries", message)
    message = re.sub(r" or instance of \w+", "", message)
    return message.replace("be a integer", "be an integer").replace("a dictionary", "a mapping of keys to values")


def _keys_beside(path: tuple, model: Any) -> list[str]:
    for key in path[:-1]:
        if typing.get_origin(model) is dict:
            model = typing.get_args(model)[1]
            continue
        field = model.model_fields.get(key) if hasattr(model, "model_fields") else None
        model = _beside_none(field.annotation) if field is not None else None
    return list(model.model_fields) if hasattr(model, "model_fields") else []


def _beside_none(annotation: Any) -> Any:
    """What an optional value is when it is there."""
    members = [one for one in typing.get_args(annotation) if one is not type(None)]
    return members[0] if len(members) == 1 else annotation


class Key(NamedTuple):
    """One key of a scenario file."""

    path: str
    type: str
    default: Any  # "required" when there is none
    meaning: str


def keys(model: type[BaseModel] = Scenario, prefix: str = "") -> Iterator[Key]:
    """Every key a scenario may have, nested ones included."""
    for name, field in model.model_fields.items():
        inner = field.annotation if isinstance(field.annotation, type) else None
        meaning = field.description or ""
        if inner is not None and issubclass(inner, Strict):
            yield Key(f"{prefix}{name}", "mapping", "see below", meaning)
            yield from keys(inner, f"{prefix}{name}.")
        else:
            default = field.get_default(call_default_factory=True)
            shown = default.kind if isinstance(default, Part) else "required" if field.is_required() else default
            yield Key(f"{prefix}{name}", _type_name(field.annotation), shown, meaning)


def _type_name(annotation: Any) -> str:
    if annotation is Part:
        return "part"
    if typing.get_origin(annotation) is Literal:
        return " or ".join(typing.get_args(annotation))
    words = {
        float: "number",
        bool: "true or false",
        int: "integer",
        str: "text",
        Numbers: "list of numbers",
        Numbers | None: "list of numbers",
        float | None: "number",
        list[str] | None: "list of names",
        list[NamedPart]: "list of parts",
        typing.get_args(OneOrMore)[0]: "part or list of parts",
    }
    return words.get(annotation, "mapping")

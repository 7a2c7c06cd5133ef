"""Keys of a scenario file, their defaults and their checks. Validated before anything is built or compiled."""

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Discriminator, Field, Tag, model_validator

from undertow.core import catalogue

LONG_STEP = 0.5  # s; few vehicles are stable with a controller that is sampled more slowly


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
ONE_PART, SEVERAL_PARTS = "(one part)", "(several parts)"
OneOrMore = Annotated[
    Annotated[NamedPart, Tag(ONE_PART)] | Annotated[list[NamedPart], Tag(SEVERAL_PARTS)],
    Discriminator(lambda value: SEVERAL_PARTS if isinstance(value, list) else ONE_PART),
]
Numbers = list[float]


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
    record: float = Field(
        1e-2,
        gt=0,
        le=1e5,
        description="time between records, s; where 0.01 is no whole number of `dt`, the default is the next one",
    )
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

    @model_validator(mode="after")
    def _record_whole_steps(self) -> "ClosedLoopSettings":
        steps = self.record / self.dt
        if "record" not in self.model_fields_set and self.method != "adaptive" and self.dt <= LONG_STEP:
            if abs(steps - round(steps)) > 1e-6 * steps:
                self.record = math.ceil(steps) * self.dt
        return self


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
    Annotated[float | None, Tag(ONE_PART)] | Annotated[list[float], Tag(SEVERAL_PARTS)],
    Discriminator(lambda value: SEVERAL_PARTS if isinstance(value, list) else ONE_PART),
]
NumberOrRandom = Annotated[
    Annotated[int | None, Tag(ONE_PART)] | Annotated[Literal["random"], Tag(SEVERAL_PARTS)],
    Discriminator(lambda value: SEVERAL_PARTS if isinstance(value, str) else ONE_PART),
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
    vehicles: int = Field(
        4,
        ge=0,
        le=1000,
        description="plant variants where the vehicle file has deviations: vehicles at random within them, beside the "
        "values of the file",
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

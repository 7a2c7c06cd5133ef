"""Contracts of modes: how a signal, the thrust, the plant or the computation of a controller fails."""

import abc
import functools
import inspect
import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray, PyTree

from undertow.core.contracts import AbstractController, Load, Measurement, Pose, Target
from undertow.core.errors import BadInput
from undertow.core.numerics.number import Number
from undertow.core.option_groups import set_signature
from undertow.core.return_checks import difference, form, not_two
from undertow.core.user_code import place_of

if TYPE_CHECKING:  # pyright takes an abstract variable of a class for an argument of each of its parts
    from typing import ClassVar as AbstractVar
else:
    from equinox import AbstractVar

# What a mode can be a mode of: a quantity that the controller receives, the readings of a sensor before the navigation
# filter, one input of the plant, all inputs together, the plant and its surroundings, the computer.
ROLES = ("quantity", "sensor", "thruster", "bus", "plant", "computation")
READINGS = ("quantity", "sensor")
INPUTS = ("thruster", "bus")

Signal = Float[Array, " width"]


class Severity(NamedTuple):
    """What the severity of a mode means, and its range.

    Attributes:
        meaning: a few words.
        unit: SI unit, "" for a pure number, TARGET for the unit of the target.
        default: value unless given; for the unit TARGET in units of the usual size of the target.
        lowest, highest: range.
    """

    meaning: str
    unit: str
    default: float
    lowest: float
    highest: float


TARGET = "unit of the target"
LARGE = 1e6  # as large as a severity may be
NO_SEVERITY = Severity("none", "", 1.0, 1.0, 1.0)


class Moment(NamedTuple):
    """The moment at which a fault acts."""

    active: Bool[Array, ""]  # whether it is present
    since: Number  # s since its onset; negative before
    elapsed: Number  # s since the previous control step
    severity: Number
    key: PRNGKeyArray  # of this fault, for `numbered`
    step: Int[Array, ""]  # number of the control step, from 0
    turn: Signal  # rad after which an entry repeats; 0 for entries that are no angles
    holds: bool  # whether a signal that is lost keeps its last value, as a reading does, instead of being zero

    def difference(self, new: Signal, old: Signal) -> Signal:
        """new - old; of angles the shorter way round."""
        raw, turn = new - old, jnp.where(self.turn > 0, self.turn, 1.0)
        return jnp.where(self.turn > 0, raw - turn * jnp.round(raw / turn), raw)


class Altered(NamedTuple):
    """A signal after a fault."""

    value: Signal
    present: Bool[Array, ""]  # whether it arrives at all; a sensor then delivers nothing


class AbstractFault(eqx.Module):
    """One way to fail: its parameters. Where and when is said beside it."""

    targets: AbstractVar[tuple[str, ...]]  # of ROLES
    severity: AbstractVar[Severity]


class AbstractMode(AbstractFault):
    """A fault of a signal: any vector, with memory. Inputs are in units of their largest value."""

    delays: ClassVar[bool] = False  # whether it moves a reading in time, and with it the news that it is new

    @abc.abstractmethod
    def init(self, value: Signal) -> PyTree:
        """Memory before the first step, for a signal of this shape."""

    @abc.abstractmethod
    def apply(self, memory: PyTree, moment: Moment, value: Signal) -> tuple[Altered, PyTree]:
        """The signal as it is where the fault is present, and the memory; called at every step, present or not."""


class MemorylessMode(AbstractMode):
    """A fault of a signal that follows from the present signal: a function, which `signal_mode` makes a part of."""

    # In other modes targets and severity belong to the class, as is declared for pyright.
    function: Callable[[Moment, Signal], Signal] = eqx.field(static=True)
    targets: tuple[str, ...] = eqx.field(static=True)  # pyright: ignore[reportIncompatibleVariableOverride]
    severity: Severity = eqx.field(static=True)  # pyright: ignore[reportIncompatibleVariableOverride]
    arrives: bool = eqx.field(static=True)  # whether a sensor delivers its reading

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        faulty_signal = self.function(moment, value)
        if jnp.shape(faulty_signal) != value.shape:
            name, location = self.function.__name__, place_of(self.function)
            raise BadInput(name, f"return a signal of shape {value.shape}", form(faulty_signal), where=location)
        return Altered(faulty_signal, jnp.asarray(self.arrives)), memory


def signal_mode(
    targets: tuple[str, ...], severity: Severity = NO_SEVERITY, arrives: bool = True
) -> Callable[[Callable[[Moment, Signal], Signal]], Callable[[], MemorylessMode]]:
    """Make a function of the moment and the signal a mode of the catalogue, whose name and description it keeps.

    Args:
        targets: what can fail so, of ROLES.
        severity: what the severity means.
        arrives: whether a sensor that fails so delivers its reading.
    """

    def part_from(signal_after: Callable[[Moment, Signal], Signal]) -> Callable[[], MemorylessMode]:
        mode = lambda: MemorylessMode(function=signal_after, targets=targets, severity=severity, arrives=arrives)
        return _without_options(signal_after, mode)

    return part_from


def _without_options(function: Callable[..., Any], make: Callable[[], Any]) -> Callable[[], Any]:
    """`make` with name and description of the function that the part computes, and without options."""
    part = functools.wraps(function)(make)
    set_signature(part, inspect.Signature())  # without this, the arguments of `function` would be taken for options
    return part


class AbstractThrustMode(AbstractFault):
    """A fault of the thrust, which leaves the input of the thruster as it is."""

    targets = ("thruster",)

    @abc.abstractmethod
    def factor(self, severity: Number) -> Number:
        """Factor on the thrust while the fault is present."""


class Presence(NamedTuple):
    """Whether a fault of the plant is present."""

    active: Bool[Array, ""]
    since: Number  # s since its onset; negative before
    severity: Number

    @property
    def size(self) -> Float[Array, ""]:
        """The severity; zero where the fault is not present."""
        return jnp.where(self.active, self.severity, 0.0)


class AbstractPlantFault(AbstractFault):
    """A fault of a body in water, or of its surroundings."""

    targets = ("plant",)
    default_duration: ClassVar[float] = math.inf  # s, unless given

    @abc.abstractmethod
    def load(self, presence: Presence, pose: Pose | None, load: Load) -> Load:
        """The load with that of the fault added; nothing is added where the fault is not present."""


class Instant(NamedTuple):
    """A control step, for a fault of the computation."""

    active: Bool[Array, ""]  # whether the fault is present
    number: Int[Array, ""]  # of this step among those with the fault, from 0
    severity: Number


class Execution(NamedTuple):
    """How the controller is computed in one control step."""

    runs: Bool[Array, ""]  # whether it is computed; otherwise the last input is held
    dt: Number  # s, sampling time that it is given
    twice: Bool[Array, ""] | None = None  # whether its state advances twice; None where it never does


class AbstractComputationFault(AbstractFault):
    """A fault of the computer that runs the controller."""

    targets = ("computation",)
    default_duration: ClassVar[float] = math.inf  # s, unless given

    @abc.abstractmethod
    def execution(self, instant: Instant, dt: Number) -> Execution:
        """How the step is computed while the fault is present; dt is the true sampling time, s."""

    @abc.abstractmethod
    def state(self, instant: Instant, law: AbstractController, z: PyTree, y: Measurement, r: Target) -> PyTree:
        """State of the law with which the step begins."""


class ExecutionMode(AbstractComputationFault):
    """A fault of when the controller is computed: a function, which `execution_mode` makes a part of."""

    function: Callable[[Instant, Number], Execution] = eqx.field(static=True)
    severity: Severity = eqx.field(static=True)  # pyright: ignore[reportIncompatibleVariableOverride]
    default_duration: float = eqx.field(static=True)  # pyright: ignore[reportIncompatibleVariableOverride]

    def execution(self, instant, dt):
        return self.function(instant, dt)

    def state(self, instant, law, z, y, r):
        return z


def execution_mode(
    severity: Severity = NO_SEVERITY, default_duration: float = math.inf
) -> Callable[[Callable[[Instant, Number], Execution]], Callable[[], ExecutionMode]]:
    """Make a function of the control step and the sampling time a mode of the catalogue.

    Args:
        severity: what the severity means.
        default_duration: s, unless a scenario gives one.
    """

    def part_from(execution_in: Callable[[Instant, Number], Execution]) -> Callable[[], ExecutionMode]:
        mode = lambda: ExecutionMode(function=execution_in, severity=severity, default_duration=default_duration)
        return _without_options(execution_in, mode)

    return part_from


def name_of(fault: AbstractFault) -> str:
    """Name of a mode in messages: that of the function that it is made of, or of its class."""
    return getattr(fault, "function", type(fault)).__name__


def apply_mode(mode: AbstractMode, memory: PyTree, moment: Moment, value: Signal) -> tuple[Altered, PyTree]:
    """What a mode makes of a signal, and its memory afterwards.

    Raises:
        BadInput: its `apply` does not return both in the form that is due.
    """
    answer = mode.apply(memory, moment, value)
    says = not_two("apply", answer, "the altered signal and the memory")
    if not says and not isinstance(answer[0], Altered):
        says = f"`apply` must return an Altered first, but returns {form(answer[0])}"
    if not says and jnp.shape(answer[0].value) != value.shape:
        says = f"`apply` must return a signal of shape {value.shape}, but returns {form(answer[0].value)}"
    if not says and (what := difference(answer[1], memory)):
        says = f"`apply` must return the memory in the form that `init` gives it, but returns {what}"
    if says:
        raise BadInput("", "", f"{type(mode).__name__}: {says}", where=place_of(mode, "apply"))
    return answer

"""Consistency of times and parts: only shapes are evaluated."""

import contextlib
import math
from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax.typing import ArrayLike

from undertow.core import checks
from undertow.core.contracts import AbstractNavigation, AbstractPlant, Load, Target
from undertow.core.errors import Advice, BadInput, advice, error_location, joined
from undertow.core.return_checks import check_state, form
from undertow.core.signals import check_declared
from undertow.core.user_code import RAISED, fault_of
from undertow.scenario.schema import LONG_STEP, ClosedLoopSettings, Initial, Window
from undertow.simulation.loop.closed_loop import ClosedLoop

# A record takes about a kilobyte, a control step some microseconds.
MOST_RECORDS = 1_000_000
MOST_STEPS = 2_000_000_000

# Relative tolerance for multiples of decimal steps.
_ROUNDING = 1e-9


def check_times(loop: ClosedLoopSettings) -> None:
    """Check that duration, records and sampling time are consistent.

    Raises:
        BadInput: they are not.
    """
    allowed = {"sampled": ("rk4", "euler"), "continuous": ("rk4", "adaptive")}[loop.kind]
    if loop.method not in allowed:
        raise BadInput("method", f"be {' or '.join(allowed)} when {loop.kind}", loop.method)
    stepped = loop.method != "adaptive"
    if stepped and loop.dt > max(LONG_STEP, loop.record * (1 + _ROUNDING)):
        hint = f"It is in seconds: {loop.dt:g} ms are {loop.dt / 1e3:g}"
        raise BadInput("dt", f"be at most `loop.record` ({loop.record:g} s)", f"{loop.dt:g} s", hint=hint)
    shortest = max(loop.record, loop.dt if stepped else 0.0)
    if loop.duration < shortest:
        raise BadInput("duration", f"be at least one record ({shortest:g} s)", f"{loop.duration:g} s")
    for key, most, what in (("record", MOST_RECORDS, "records"), ("dt", MOST_STEPS, "sampling times")):
        step = getattr(loop, key)
        if loop.duration / step > most and (stepped or key == "record"):
            must = f"be at least {loop.duration / most:g} s, so that the run has at most {most} {what}"
            raise BadInput(key, must, f"{step:g} s")
    if stepped and not whole_steps(loop.record, loop.dt):
        below = math.floor(loop.record / loop.dt)
        near = " or ".join(f"{steps * loop.dt:g}" for steps in (below, below + 1) if steps)
        must = f"be a whole number of steps of `loop.dt` ({loop.dt:g} s)"
        raise BadInput("record", must, f"{loop.record:g} s", hint=f"Take {near} s")


def check_window(window: Window, loop: ClosedLoopSettings) -> None:
    """Check that the steady window has a length, and that the loop has what it asks for.

    Raises:
        BadInput: one of them does not hold.
    """
    if window.every_step and loop.kind == "continuous":
        hint = "A continuous loop has no control steps: `loop.record` sets the times that count"
        raise BadInput("every_step", "be false when `loop.kind` is continuous", "true", hint=hint)
    start, stop = window.of_run(loop.duration)
    if not start < stop:
        raise BadInput("stop", f"be later than steady.start ({start:g} s)", f"{stop:g} s")


def rounded_times(loop: ClosedLoopSettings) -> tuple[Advice, ...]:
    """Advice where a run does not end at its duration, or its last record is not at its end."""
    stepped = loop.method != "adaptive"
    all_advice: list[Advice] = []
    dt = loop.dt if loop.kind == "sampled" else loop.record / round(loop.record / loop.dt) if stepped else 0.0
    end = round(loop.duration / dt) * dt if stepped else loop.duration
    if abs(end - loop.duration) > _ROUNDING * loop.duration:
        message = f"the run lasts {end:.9g} s, a whole number of steps of {dt:g} s, not {loop.duration:.9g} s"
        all_advice.append(advice("loop.duration", message))
    last = math.floor(end / loop.record * (1 + _ROUNDING)) * loop.record
    if end - last > _ROUNDING * end:
        message = (
            f"the last record is at {last:.9g} s, {end - last:.3g} s before the end: `loop.duration` is not a multiple "
            f"of `loop.record` ({loop.record:g} s)"
        )
        all_advice.append(advice("loop.record", message))
    return tuple(all_advice)


def whole_steps(interval: float, step: float) -> bool:
    """Whether an interval is a whole number of steps, at least one."""
    ratio = interval / step
    return round(ratio) >= 1 and abs(ratio - round(ratio)) <= 1e-6 * ratio


def check_start(loop: ClosedLoop, start: Initial) -> None:
    """Check that the initial motion has an entry per output.

    Raises:
        BadInput: it has not, or is not finite.
    """
    for key, value in start:
        if value is not None:
            checks.length(key, value, len(loop.plant.outputs), ", ".join(loop.plant.outputs))
            checks.finite(key, value)


def check_noise(
    navigation: AbstractNavigation, noise: ArrayLike, plant: AbstractPlant, user_parts: Mapping[str, str]
) -> None:
    """Check that the noise of measured velocities is one number or one per output, before a controller is made for it.

    Args:
        navigation: navigation filter.
        noise: its standard deviation of the velocities.
        plant: of the same loop.
        user_parts: as for `check_fit`.

    Raises:
        BadInput: it is not; the error names the option that is wrong where the filter checks its options.
    """
    axes = len(plant.outputs)
    if np.shape(noise) in ((), (axes,)):
        return
    with _part("navigation", user_parts) as traced:
        truth = traced(lambda: plant.output(jnp.zeros(()), plant.initial_state()))
        traced(navigation.init, traced(navigation.realize, jax.random.PRNGKey(0)), truth)
        checks.per_axis("velocity_noise", noise, axes)


def check_nominal_plant(nominal: AbstractPlant, plant: AbstractPlant) -> None:
    """Check that a plant of which the nominal model is made has the outputs and inputs of the one that is simulated.

    Raises:
        BadInput: it has others.
    """
    size = lambda candidate: f"{len(candidate.outputs)} outputs and {candidate.inputs()} inputs"
    if size(nominal) != size(plant):
        hint = "Write `model: {follow: true}` where a study varies them"
        raise BadInput("model.plant", f"have {size(plant)}, as the simulated plant has", size(nominal), hint=hint)


def check_fit(loop: ClosedLoop, user_parts: Mapping[str, str] = MappingProxyType({})) -> None:
    """Check that the parts agree on the number of outputs and can take a step together.

    Args:
        loop: closed loop.
        user_parts: key of the scenario -> ./file.py:function, for the parts that the user wrote.

    Raises:
        BadInput: they do not fit together.
    """
    axes, zero = len(loop.plant.outputs), jnp.zeros(())
    with _part("reference", user_parts) as traced:
        loop = loop.starting_at(None)  # as the run has it, which then need not be traced again
        target = traced(loop.reference.at, zero)
        if not isinstance(target, Target):
            raise BadInput("", "", f"`{type(loop.reference).__name__}.at` must give a Target, but is {form(target)}")
        if target.position.shape != (axes,):
            got = f"{len(target.position)} long" if target.position.ndim == 1 else f"of shape {target.position.shape}"
            raise BadInput("position", f"have {axes} entries ({', '.join(loop.plant.outputs)})", got)
    with _part("disturbance", user_parts) as traced:
        realization = traced(loop.realize, jax.random.PRNGKey(0))
    with _part("navigation", user_parts) as traced:
        x, y = traced(lambda realization: realization.measured_at_start(), realization)
    with _part("disturbance", user_parts) as traced:
        load = traced(lambda realization, x: realization.load(zero, x), realization, x)
        if not isinstance(load, Load):
            raise BadInput("", "give a Load", "something else")
        if any(signal.shape != (axes,) for signal in load[:2]):
            raise BadInput("", f"have {axes} axes", f"of shapes {[signal.shape for signal in load[:2]]}")
        zero_input = jnp.zeros(loop.plant.inputs())
        traced(lambda realization, x: realization.motion(zero, x, zero_input), realization, x)
    with _part("controller", user_parts) as traced:
        z = traced(loop.controller.init, y, target)
        decided = lambda realization, x, z: realization.decide(zero, x, z, realization.initial_measuring(x))
        decision = traced(decided, realization, x, z)
        check_declared(loop.controller, decision.signals, "command")
        if "controller" in user_parts:  # that of the catalogue is tested
            after = traced(loop.controller.advance, z, decision.y, decision.r, decision.applied, zero)
            check_state(loop.controller, after, z)


@contextlib.contextmanager
def _part(key: str, user_parts: Mapping[str, str]) -> Iterator[Callable[..., Any]]:
    """Inside are the errors of the part at a key; gives a function that traces one of it, for shapes of its result.

    Any exception there means that the part does not fit the others.
    """
    remedy = f"Try: undertow check {user_parts[key]}" if key in user_parts else ""

    def traced(function: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return jax.eval_shape(function, *arguments)
        except BadInput:
            raise
        except RAISED as error:
            fault = fault_of(error)
            message = (
                fault.says if fault.says.startswith("cannot") else f"it does not fit the other parts: {fault.says}"
            )
            raise BadInput("", "", message, hint=joined(fault.hint, remedy)) from error

    with error_location(key):
        yield traced


def record_period(loop: ClosedLoopSettings) -> float:
    """Time between records of a sampled loop, a whole number of control steps, s."""
    return round(loop.record / loop.dt) * loop.dt

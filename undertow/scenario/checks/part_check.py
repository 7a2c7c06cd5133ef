"""Checks of the contract of a part: it is used once as in the loop, and its results are compared."""

import contextlib
import io
import re
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from undertow.core.contracts import (
    AbstractController,
    AbstractDisturbance,
    AbstractNavigation,
    AbstractPlant,
    AbstractReference,
    Load,
    Measurement,
    Pose,
)
from undertow.core.errors import BadInput
from undertow.core.measurement import measurement_of_outputs
from undertow.core.user_code import RAISED, fault_of
from undertow.physics.faults.mode import (
    AbstractComputationFault,
    AbstractFault,
    AbstractMode,
    AbstractPlantFault,
    AbstractThrustMode,
    Altered,
    Execution,
    Instant,
    Moment,
    Presence,
)
from undertow.physics.sensors.motion import motion_of
from undertow.physics.sensors.sensor import AbstractSensor
from undertow.physics.thrusters.thruster import AbstractThruster, PropellerReport
from undertow.scenario.checks.controller_check import check_controller
from undertow.scenario.checks.finding import Finding, agree, error, is_a, same_structure, shaped, two_values
from undertow.scenario.checks.plant_check import check_plant
from undertow.scenario.checks.thruster_check import check_thruster

# What `print` shows of a value that is traced: `JitTracer(float64[6])`, `Traced<float64[6]>with<...>`.
_TRACED = re.compile(r"(\w*Tracer\([^)]*\)|Traced<[^>]*>)")

_TIMES = (0.37, 1.93, 7.1)  # s; no round numbers, at which references may have corners


class Surroundings(NamedTuple):
    """Plant around a part."""

    truth: Measurement
    pose: Pose | None


def _body_in_water() -> Surroundings:
    truth = measurement_of_outputs(jnp.linspace(0.1, 0.5, 6), jnp.linspace(0.2, -0.1, 6))
    return Surroundings(truth, Pose(jnp.zeros(3), jnp.eye(3), jnp.zeros(3)))


def of_plant(plant: AbstractPlant) -> Surroundings:
    """Surroundings of a part: a plant in its initial state."""
    x = plant.initial_state()
    return Surroundings(plant.output(jnp.zeros(()), x), plant.pose(x))


def check_contract(part: Any, around: Surroundings | None = None) -> tuple[Finding, ...]:
    """Violations of the contract of a part; none for kinds that are data only.

    Args:
        part: part to check.
        around: plant around it; None for a body in water.
    """
    around = _body_in_water() if around is None else around
    for kind, use in _USES.items():
        if isinstance(part, kind):
            with contextlib.redirect_stdout(io.StringIO()) as printed:
                try:
                    findings = tuple(use(part, around))
                except RAISED as complaint:
                    findings = (_failed(part, complaint),)
            return (*findings, *_printed(part, printed.getvalue()))
    return ()


def _printed(part: Any, text: str) -> Iterator[Finding]:
    """Advice where a part prints what it computes: it does so once, when it is compiled, and without numbers."""
    print(text, end="")
    if match := _TRACED.search(text):
        message = f"`{type(part).__name__}` prints `{match[0]}`, once, while it is compiled, and never again"
        yield Finding("advice", "print", type(part).__name__, message, 'Use `jax.debug.print("{}", value)`')


def _failed(part: Any, complaint: BaseException) -> Finding:
    """Finding for an exception in a part or in its use."""
    if isinstance(complaint, BadInput):  # worded already, with its place
        return Finding("error", "contract", "", str(complaint))
    message, hint = fault_of(complaint)
    if message.startswith("cannot"):
        return Finding("error", "contract", "", message[:1].upper() + message[1:], hint)
    return error("contract", type(part).__name__, "be usable as its contract says", f"not: {message}", hint)


def _disturbance(disturbance: AbstractDisturbance, around: Surroundings) -> Iterator[Finding]:
    n, pose = len(around.truth.position), around.pose
    zero_load = Load(jnp.zeros(n), jnp.zeros(n))
    other_load = Load(jnp.linspace(1.0, 2.0, n), jnp.linspace(3.0, 4.0, n))
    realization, repeated = (disturbance.realize(jax.random.PRNGKey(0)) for _ in range(2))
    yield from same_structure("realize", repeated, realization, "give the same realization for the same key")
    if not all(map(np.array_equal, jax.tree.leaves(realization), jax.tree.leaves(repeated))):
        yield error("contract", "realize", "give the same realization for the same key", "another one")
    at = jax.jit(lambda t, load: disturbance.at(realization, t, pose, load))
    form = jax.eval_shape(at, jnp.zeros(()), zero_load)
    findings = list(is_a("at", form, Load))
    findings = findings or [*shaped("at", form.acceleration, (n,)), *shaped("at", form.wrench, (n,))]
    if findings:
        yield from findings
        return
    for t in map(jnp.asarray, _TIMES):
        load, added_load = at(t, zero_load), at(t, other_load)
        yield from (finding for value in load[:2] for finding in shaped("at", value, (n,)))
        for name in ("acceleration", "wrench"):
            gained = getattr(added_load, name) - getattr(load, name)
            yield from agree("at", gained, getattr(other_load, name), f"what was there already: add to `load.{name}`")
    jumps = disturbance.jumps(10.0)
    if not isinstance(jumps, tuple) or not all(0 < jump < 10 for jump in jumps):
        yield error("contract", "jumps", "be a tuple of times between 0 and the duration", f"{jumps} for 10 s")


def _navigation(navigation: AbstractNavigation, around: Surroundings) -> Iterator[Finding]:
    realization = jax.eval_shape(navigation.realize, jax.random.PRNGKey(0))
    state = jax.eval_shape(navigation.init, realization, around.truth)
    answer = jax.eval_shape(navigation.measure, realization, state, jnp.zeros(()), around.truth)
    if unpaired := list(two_values("measure", answer, "the measurement and the state after it")):
        yield from unpaired
        return
    y, after = answer
    yield from same_structure("measure", after, state, "return the state in the form that `init` gives it", types=True)
    findings, shape = list(is_a("measure", y, Measurement)), np.shape(around.truth.position)
    yield from findings or [*shaped("measure", y.position, shape), *shaped("measure", y.velocity, shape)]


def _sensor(sensor: AbstractSensor, around: Surroundings) -> Iterator[Finding]:
    """Check of a sensor on a body that moves: what it reads, and how that changes with the motion."""
    report = PropellerReport(jnp.linspace(10.0, 80.0, 8), jnp.zeros(8))
    truth = measurement_of_outputs(around.truth.position, around.truth.velocity, report)
    motion = motion_of(truth, truth.velocity[:3], jnp.asarray(0.01))
    reading = sensor.reading(motion)
    if jnp.ndim(reading) != 1:
        yield error("contract", "reading", "give an array of one axis", f"of shape {jnp.shape(reading)}")
        return
    if wrong := list(shaped("reading", reading, reading.shape)):
        yield from wrong
        return
    for i in sensor.angles:
        if not 0 <= i < len(reading):
            yield error("contract", "angles", f"be entries of a reading, from 0 to {len(reading) - 1}", str(i))
    slopes = jnp.concatenate(
        [leaf.reshape(len(reading), -1) for leaf in jax.tree.leaves(jax.jacfwd(sensor.reading)(motion))], axis=1
    )
    if not jnp.isfinite(slopes).all():
        yield error("contract", "reading", "have finite derivatives, which a Kalman filter needs", "not differentiable")
    elif not slopes.any(axis=1).all():
        entry = int(jnp.argmin(slopes.any(axis=1))) + 1
        yield error("contract", "reading", "depend on the motion", f"constant in entry {entry}: no filter can use it")


def _reference(reference: AbstractReference, around: Surroundings) -> Iterator[Finding]:
    for t in map(jnp.asarray, _TIMES):
        target, rate = jax.jvp(lambda t: tuple(reference.at(t)), (t,), (jnp.ones(()),))
        for value in target:
            yield from shaped("at", value, target[0].shape)
        yield from agree("at", target[1], rate[0], f"the rate of the position at {t:g} s")
        yield from agree("at", target[2], rate[1], f"the rate of the velocity at {t:g} s")


def _mode(mode: AbstractMode, around: Surroundings) -> Iterator[Finding]:
    """Check of a mode on a signal of three entries: its memory and the signal keep their form."""
    yield from _roles(mode, ("quantity", "sensor", "thruster", "bus"))
    value = jnp.linspace(0.2, 0.4, 3)
    severity = jnp.asarray(float(mode.severity[2]))
    times = (jnp.asarray(True), jnp.asarray(0.3), jnp.asarray(0.01))
    moment = Moment(*times, severity, jax.random.PRNGKey(0), jnp.asarray(3), jnp.zeros(3), holds=True)
    memory = mode.init(value)
    answer = mode.apply(memory, moment, value)
    if unpaired := list(two_values("apply", answer, "the altered signal and the memory after it")):
        yield from unpaired
        return
    altered, after = answer
    yield from same_structure("apply", after, memory, "return the memory in the form that `init` gives it", types=True)
    wrong = list(is_a("apply", altered, Altered))
    yield from wrong or [*shaped("apply", altered.value, value.shape), *shaped("apply", altered.present, ())]


def _thrust_mode(mode: AbstractThrustMode, around: Surroundings) -> Iterator[Finding]:
    yield from _roles(mode, ("thruster",))
    yield from shaped("factor", mode.factor(jnp.asarray(float(mode.severity[2]))), ())


def _plant_fault(fault: AbstractPlantFault, around: Surroundings) -> Iterator[Finding]:
    """Check that nothing is added to the load while the fault is not present."""
    yield from _roles(fault, ("plant",))
    n, severity = len(around.truth.position), jnp.asarray(float(fault.severity[2]))
    before = Load(jnp.linspace(1.0, 2.0, n), jnp.linspace(3.0, 4.0, n))
    loads = [
        fault.load(Presence(jnp.asarray(active), jnp.asarray(0.3), severity), around.pose, before)
        for active in (False, True)
    ]
    for load in loads:
        if findings := list(is_a("load", load, Load)):
            yield from findings
            return
        yield from (finding for value in load[:2] for finding in shaped("load", value, (n,)))
    for name in ("acceleration", "wrench"):
        yield from agree("load", getattr(loads[0], name), getattr(before, name), "what it was where nothing has failed")


def _computation_fault(fault: AbstractComputationFault, around: Surroundings) -> Iterator[Finding]:
    yield from _roles(fault, ("computation",))
    instant = Instant(jnp.asarray(True), jnp.asarray(0), jnp.asarray(float(fault.severity[2])))
    yield from is_a("execution", fault.execution(instant, jnp.asarray(0.01)), Execution)


def _roles(fault: AbstractFault, allowed: tuple[str, ...]) -> Iterator[Finding]:
    """Check that a fault names targets, of which only some can fail in the way of its contract."""
    if not fault.targets or not set(fault.targets) <= set(allowed):
        yield error("contract", "targets", f"be some of {', '.join(allowed)}", f"{fault.targets}")
    if not fault.severity[3] <= fault.severity[2] <= fault.severity[4]:
        yield error("contract", "severity", "have a default within its range", f"{tuple(fault.severity)}")


_USES: dict[type, Callable[[Any, Surroundings], Iterator[Finding]]] = {
    AbstractPlant: lambda plant, around: check_plant(plant),
    AbstractController: lambda controller, around: check_controller(controller),
    AbstractDisturbance: _disturbance,
    AbstractReference: _reference,
    AbstractNavigation: _navigation,
    AbstractSensor: _sensor,
    AbstractMode: _mode,
    AbstractThrustMode: _thrust_mode,
    AbstractPlantFault: _plant_fault,
    AbstractComputationFault: _computation_fault,
    AbstractThruster: lambda thruster, around: check_thruster(thruster),
}

"""Every line of the supervisor's table: its condition leads to its state with its reason in its time, and is over again."""

import dataclasses
import functools
import math
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from recorded import is_as_recorded

import undertow as ut
from undertow.control.supervision.conditions import (
    CONDITIONS,
    HEAD,
    NAMES,
    Request,
    State,
    code_of,
    reason_of,
    state_of,
)
from undertow.control.supervision.supervisor import supervisor
from undertow.control.supervision.transition_log import transitions
from undertow.core.contracts import AbstractController, Model, Target
from undertow.core.coordinates import OutputCoordinates
from undertow.core.measurement import with_outputs
from undertow.core.numerics.integrators import METHODS
from undertow.core.signals import Signal
from undertow.physics.plants.double_integrator import DoubleIntegrator
from undertow.simulation.loop.sampled import integrate_plant

T = 0.02
BLOCK = 50  # steps of a call, at most: a call takes longer than a step


class Tampering(NamedTuple):
    """What happens to a step from outside."""

    add_position: np.ndarray = np.zeros(6)  # to the measured outputs
    add_velocity: np.ndarray = np.zeros(6)
    scale_position: float = 1.0
    hold: float = 0.0  # 1: the measurement keeps the bits of the first one
    hold_north: float = 0.0  # 1: the measured north does
    command: float = 0.0  # added to the command of the law
    spoil: float = 0.0  # 1: the command is NaN
    estimate: float = 0.0  # added to its estimate
    share: float = 0.0  # of the desired acceleration that it says it cannot give
    thrusters: float = 0.0  # that it says to be lost
    axes: float = 0.0
    target: np.ndarray = np.zeros(6)  # added to the target
    report: float = 0.0  # added to the reported speeds of the propellers
    dt: float = T  # that the controller is told
    replaced: float = 0.0  # 1: the applied input is another one
    applied: float = 0.0  # which
    request: float = 0.0  # of the operator


UNTOUCHED = Tampering()


def _of_law(how: Tampering) -> Tampering:
    """What the state of the law holds: only finite numbers."""
    zero, none = jnp.zeros(6), jnp.zeros(())
    return how._replace(add_position=zero, add_velocity=zero, target=zero, report=none, replaced=none, applied=none)


class Tampered(AbstractController):
    """A law whose answers are changed by its state, which the test writes."""

    law: AbstractController
    model: Model

    def init(self, y, r):
        return self.law.init(y, r), _of_law(jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype=float), UNTOUCHED))

    def command(self, z, y, r):
        law, how = z
        u, signals = self.law.command(law, y, r)
        more = {"estimate": signals["estimate"] + how.estimate, "attained_share": 1.0 - how.share}
        return jnp.where(how.spoil > 0, jnp.nan, u + how.command), signals | more | {
            "lost_thrusters": how.thrusters[None],
            "lost_axes": how.axes[None],
        }

    def advance(self, z, y, r, u_applied, dt):
        return self.law.advance(z[0], y, r, u_applied, dt), z[1]

    def known_acceleration(self, z, y, u_applied):
        return self.law.known_acceleration(z[0], y, u_applied)

    def signals(self):
        one = Signal((), "1", "of a test")
        return self.law.signals() | {"lost_thrusters": one, "lost_axes": one}


def vehicle(name: str):
    """A BlueROV2 Heavy, and a supervisor around a law; both in body axes, but for a law that is near the vertical."""
    euler, reporting = name == "near_vertical", name == "report_lost"
    thruster = ut.thrusters.paper_table3(fidelity="shaft") if reporting else ut.thrusters.t200()
    plant = ut.HybridVehicle(ut.vehicles.bluerov2_heavy(), thruster)
    law = ut.controllers.pid(plant.model(), sampling_time=T, frequency=2.8)
    made = supervisor(Tampered(law, law.model), plant, sampling_time=T, thruster_faults=False)
    return plant, dataclasses.replace(made, model=plant.model()) if euler else made


def on_axes(name: str):
    """Two axes in metres and four in radians that know nothing of each other, with the gates of a vehicle."""
    plant = DoubleIntegrator(20.0, outputs=tuple("abcdef"), output_units=("m",) * 3 + ("rad",) * 3)
    coordinates = OutputCoordinates(angles=(False,) * 3 + (True,) * 3)
    law = ut.controllers.pid(plant.model()._replace(coordinates=coordinates), sampling_time=T, frequency=4.8)
    made = supervisor(Tampered(law, law.model), plant, sampling_time=T)
    limits = {"max_distance": 1e4, "max_speed": 10.0, "max_rate": 10.0}
    limits |= dict.fromkeys(("jump_position", "jump_angle", "jump_velocity", "jump_rate"), 1.0)
    return plant, dataclasses.replace(made, gate=dataclasses.replace(made.gate, **limits))


class Stepped:
    """A supervised law that watches a plant which another law moves; what it is given can be tampered with."""

    def __init__(self, plant, supervised):
        mover = ut.controllers.pid(plant.model(), sampling_time=T, frequency=4.8)
        self.parts = (plant, mover, supervised)
        # With the parts inside, a call takes a third of the time that it takes with the parts as arguments.
        self.compiled = jax.jit(functools.partial(_steps, self.parts))
        # All outputs move: a reading that keeps its bits is stuck.
        start = plant.initial_state(0.01 * np.arange(6), np.array([0.3, 0, 0, 0, 0, 0]))
        # As NumPy arrays here and after every block: what JAX knows of the types of its own would be another program.
        self.first, *begun = jax.tree.map(np.asarray, _begun(self.parts, start))
        self.begun = (jax.tree.map(np.asarray, start), *begun)
        self.restart()

    def restart(self):
        self.k, self.now = 0, self.begun
        self.outputs, self.states = [], []

    @property
    def z(self):
        """State of the supervised law."""
        return self.now[2]

    @z.setter
    def z(self, value):
        self.now = (*self.now[:2], value)

    def states_and_reasons(self):
        """By their numbers."""
        return [(int(state), code_of(reason)) for state, reason in self.states]

    def step(self, how: Tampering = UNTOUCHED):
        self.steps(T, how)

    def steps(self, seconds: float, how=UNTOUCHED):
        ahead = [how(k) if callable(how) else how for k in range(round(seconds / T))]
        for first in range(0, len(ahead), BLOCK):
            self._block(ahead[first : first + BLOCK])

    def _block(self, ahead: list[Tampering]):
        count = len(ahead)
        padded = ahead + [UNTOUCHED] * (BLOCK - count)
        rows = jax.tree.map(lambda *values: np.array(values, dtype=float), *padded)
        times = T * (self.k + np.arange(BLOCK))
        found = self.compiled(np.asarray(count), times, (*self.now, self.first), rows)
        self.now, found = jax.tree.map(np.asarray, found)
        outputs, states, reasons = (values[:count] for values in found)
        self.k += count
        self.outputs.extend(outputs)
        self.states.extend(
            (State(int(state)), reason_of(int(reason))) for state, reason in zip(states, reasons, strict=True)
        )


@eqx.filter_jit
def _begun(parts, x):
    """First measurement and states of both laws, in one program instead of an operation after the other."""
    plant, mover, supervised = parts
    first, r = _reporting(plant.output(jnp.zeros(()), x)), _target(jnp.zeros(()), UNTOUCHED)
    return first, mover.init(first, r), supervised.init(first, r)


def _reporting(y):
    """The measurement with a report of a propeller, which only some vehicles have of their own."""
    return y if y.body is not None else y._replace(actuator=jnp.full(1, 20.0))


def _target(t, how):
    speed = jnp.zeros(6).at[0].set(0.3)
    return Target(speed * t + how.target, speed, jnp.zeros(6))


def _steps(parts, count, times, now, rows):
    """As many steps as are counted, each with its row of tampering: states of the end, and what each step gave."""
    *begun, first = now
    none = jnp.zeros(BLOCK, dtype=int)
    found = (jnp.zeros((BLOCK, *parts[2].watch.high.shape)), none, none)

    def one(i, carried):
        now, found = carried
        how = jax.tree.map(lambda row: row[i], rows)
        now, given = _step(parts, times[i], first, now, how)
        return now, jax.tree.map(lambda values, value: values.at[i].set(value), found, given)

    return jax.lax.fori_loop(0, count, one, (tuple(begun), found))


def _step(parts, t, first, now, how):
    plant, mover, supervised = parts
    x, moving, z = now
    r, truth = _target(t, how), _reporting(plant.output(t, x))
    read = with_outputs(
        truth, truth.position * how.scale_position + how.add_position, truth.velocity + how.add_velocity
    )
    north = jnp.where(how.hold_north > 0, first.position[0], read.position[0])
    read = with_outputs(read, read.position.at[0].set(north), read.velocity)
    y = jax.tree.map(lambda kept, new: jnp.where(how.hold > 0, kept, new), first, read)
    y = y._replace(actuator=jax.tree.map(lambda speed: speed + how.report, y.actuator))
    z = z._replace(law=(z.law[0], _of_law(how)), request=how.request.astype(int))
    output, _ = supervised.command(z, y, r)
    reported = jnp.where(how.replaced > 0, how.applied, plant.admissible(x, output))
    z = supervised.advance(z, y, r, reported, how.dt)
    u, _ = mover.command(moving, truth, _target(t, Tampering()))
    applied = plant.admissible(x, u)
    motion = lambda t, x: plant.dynamics(t, x, applied, plant.no_load())
    new = integrate_plant(motion, t, x, jnp.asarray(T), METHODS["rk4"], 1)
    moving = mover.advance(moving, truth, _target(t, Tampering()), applied, jnp.asarray(T))
    return (new, moving, z), (output, z.state, z.reason)


def _only(axis: int, value: float) -> np.ndarray:
    return np.where(np.arange(6) == axis, value, 0.0)


# What brings about the condition of a line, as steps of it; `(k)` for what changes from step to step.
CAUSES = {
    "measurement_not_finite": Tampering(add_position=_only(1, np.nan)),
    "measurement_implausible": Tampering(add_velocity=_only(2, 40.0)),
    "measurement_jump": Tampering(add_position=_only(0, 5.0)),
    "measurement_inconsistent": lambda k: Tampering(add_position=_only(0, 0.05 * k)),
    "measurement_noisy": lambda k: Tampering(add_position=_only(1, 0.2 * (-1) ** k)),
    "measurement_stuck": Tampering(hold=1.0),
    "report_lost": Tampering(report=np.nan),
    "applied_contradicted": Tampering(replaced=1.0, applied=15.0),
    "reference_rejected": Tampering(target=_only(3, np.inf)),
    "place_held": Tampering(add_position=_only(0, 5.0)),
    "output_not_finite": Tampering(spoil=1.0),
    "estimator_diverged": Tampering(estimate=1e3),
    "restarts_exhausted": Tampering(estimate=1e3),
    "saturated": Tampering(command=1e3),
    "chattering": lambda k: Tampering(command=4.2 * (-1) ** k),
    "reference_infeasible": Tampering(share=0.5),
    "thruster_lost": Tampering(thrusters=1.0),
    "axes_lost": Tampering(axes=1.0),
    "position_error": lambda k: Tampering(add_position=_only(1, 0.95 + 0.4 * T * k)),
    "attitude_error": lambda k: Tampering(add_position=_only(5, 0.9 * T * k), add_velocity=_only(5, 0.9)),
    "near_vertical": lambda k: Tampering(add_position=_only(4, 0.7 * T * k), add_velocity=_only(4, 0.7)),
    "overrun": Tampering(dt=2 * T),
    "clock_fault": Tampering(dt=-1.0),
}
# Time, s, that a condition takes to come about: a drift has to reach its limit, an average to rise.
BUILT_UP = {"measurement_stuck": 10 * T, "chattering": 1.8, "position_error": 0.4, "attitude_error": 1.2}
BUILT_UP |= {"near_vertical": 2.0, "restarts_exhausted": 1.0, "measurement_inconsistent": 0.6, "measurement_noisy": 0.4}
BUILT_UP |= {"applied_contradicted": 1.0, "place_held": 1.6}


@functools.cache
def stepped(make, name: str) -> Stepped:
    return Stepped(*make(name))


ON_BOTH = pytest.mark.parametrize("make", [on_axes, pytest.param(vehicle, marks=pytest.mark.full)])


def test_every_line_of_the_table_has_a_cause():
    assert set(CAUSES) == set(NAMES)


@pytest.mark.parametrize(
    ("make", "name"),
    [
        *((on_axes, name) for name in NAMES if name != "near_vertical"),
        *(pytest.param(vehicle, name, marks=pytest.mark.full) for name in NAMES),
    ],
)
def test_a_condition_leads_to_its_state_in_its_time(make, name):
    own = make is vehicle and name in ("near_vertical", "report_lost")
    line, run = CONDITIONS[NAMES.index(name)], stepped(make, name if own else "")
    run.restart()
    run.steps(0.2)
    assert set(run.states) == {(State.ACTIVE, "")}
    until = line.safe_after if math.isfinite(line.safe_after) else line.degraded_after
    run.steps(until + BUILT_UP.get(name, 0.0) + 3 * T, CAUSES[name])
    found = run.states[10:]
    with_reason = [k for k, (state, reason) in enumerate(found) if reason == name]
    assert with_reason, set(found)
    for state, after in ((State.DEGRADED, line.degraded_after), (State.SAFE, line.safe_after)):
        if math.isfinite(after) and (state is State.SAFE or line.safe_after > after):
            first = found.index((state, name)) * T
            assert after - 1.01 * T <= first <= after + BUILT_UP.get(name, 0.0) + 1.01 * T
    if not math.isfinite(line.safe_after) and name != "place_held":  # which comes after SAFE
        assert State.SAFE not in {state for state, _ in found}
    if run.z.state == int(State.SAFE):
        assert (run.outputs[-1] == 0.0).all()
    assert np.isfinite(run.outputs).all()
    entry = next(one for one in transitions(run.z.log) if one.reason == name)
    assert not entry.value <= entry.limit
    if make is on_axes:
        is_as_recorded(f"supervisor: {name}", (run.outputs, run.states_and_reasons(), run.z))
    worst = State.SAFE if math.isfinite(line.safe_after) else State.DEGRADED
    reached = run.states.index((worst, name))
    for _ in range(50):
        run.steps(0.1)
        place = run.z.place
        if place.held:  # the readings have jumped back, and the operator agrees to that
            run.z = run.z._replace(place=place._replace(held=np.zeros_like(place.held)))
    if math.isfinite(line.recovers_after):
        assert run.states[-1] == (State.ACTIVE, "")
        left = next(k for k in range(reached, len(run.states)) if run.states[k][1] in {"", "place_held"} - {name})
        assert (left - reached) * T > line.recovers_after - 1.01 * T
    else:
        assert run.states[-1][1] == name


def test_slow_swings_from_limit_to_limit_are_chattering():
    """Every 0.4 s, which is a quarter of the variation that counts; every 2 s is what large waves do."""
    run = stepped(on_axes, "")
    for seconds, chatters in ((0.4, True), (2.0, False)):
        run.restart()
        run.steps(0.2)
        run.steps(12.0, lambda k: Tampering(command=1e3 * (-1) ** int(k * T // seconds)))  # noqa: B023 - used at once
        assert run.z.variation < 5
        assert ((State.SAFE, "chattering") in run.states) is chatters


@ON_BOTH
def test_output_that_is_not_finite_never_leaves(make):
    run = stepped(make, "")
    run.restart()
    run.steps(0.1)
    run.steps(0.1, Tampering(spoil=1.0))
    assert (np.array(run.outputs[5:]) == 0.0).all()


def test_the_table_of_the_documentation_has_a_line_for_each_condition():
    lines = [condition.cells() for condition in CONDITIONS]
    assert [line[0] for line in lines] == list(NAMES)
    assert {len(line) for line in lines} == {len(HEAD)}
    assert lines[NAMES.index("saturated")][3:6] == ("1 s", "never", "1 s")
    times = [(line.degraded_after, line.safe_after, line.recovers_after) for line in CONDITIONS]
    is_as_recorded("times of the supervisor's conditions", times)


@pytest.mark.parametrize("reason", ["", *NAMES, "operator", "memory_damaged"])
def test_codes_of_reasons(reason):
    assert reason_of(code_of(reason)) == reason


@ON_BOTH
def test_one_stuck_entry_is_found(make):
    run = stepped(make, "")
    run.restart()
    run.steps(0.6, Tampering(hold_north=1.0))
    assert run.states[-1] == (State.DEGRADED, "measurement_stuck")
    assert set(run.states[:8]) == {(State.ACTIVE, "")}


@ON_BOTH
def test_a_reference_that_nothing_can_follow_is_rejected(make):
    """A target 9999 m away for one step leaves no allowance behind; one beyond 10 km is rejected."""
    run = stepped(make, "")
    run.restart()
    run.steps(0.2)
    run.step(Tampering(target=_only(1, 9999.0)))
    run.steps(0.2)
    assert float(run.z.allowance.position) < 0.1
    run.step(Tampering(target=_only(1, 1e5)))
    assert run.states[-1] == (State.DEGRADED, "reference_rejected")


@ON_BOTH
def test_whatever_was_applied_the_output_keeps_to_its_limits(make):
    run = stepped(make, "")
    run.restart()
    high = np.asarray(run.parts[2].watch.high)
    for request, applied in ((0, 1e6), (1, 1e6), (1, -1e300), (0, np.inf), (0, np.nan), (0, 1e30)):
        run.step(Tampering(request=request, replaced=1.0, applied=applied))
        run.step(Tampering(request=request))
    assert np.isfinite(high).all() and (np.abs(run.outputs) <= high).all()


def test_requests_of_the_operator():
    """The safe output, no faster than `slew`, and back; what is stopped stays stopped."""
    run = stepped(on_axes, "")
    run.restart()
    run.steps(0.2, Tampering(command=3.0))
    starts = []
    for request, state in (
        (Request.HOLD, State.READY),
        (Request.RUN, State.ACTIVE),
        (Request.FALLBACK, State.ACTIVE),
        (Request.LAW, State.ACTIVE),
        (Request.STOP, State.STOPPED),
        (Request.RUN, State.STOPPED),
    ):
        starts.append(len(run.outputs))
        run.steps(0.5, Tampering(request=request, command=3.0))
        assert run.states[-1][0] is state
    assert run.states[-1] == (State.STOPPED, "operator") and (run.outputs[-1] == 0.0).all()
    supervised = run.parts[2]
    most = float(supervised.slew) * T * np.asarray(supervised.watch.high - supervised.watch.low)
    at_first = np.array([np.abs(run.outputs[k + 1] - run.outputs[k]) for k in starts])
    assert (at_first <= most * (1 + 1e-12)).all()
    on_hold = run.outputs[starts[0] : starts[1]]
    assert (np.abs(np.diff(on_hold, axis=0)) <= most * (1 + 1e-12)).all()
    is_as_recorded("supervisor: requests", (run.outputs, run.states_and_reasons(), run.z))


def test_codes_of_a_damaged_memory():
    assert (reason_of(1234), reason_of(-7), state_of(99)) == ("", "", State.INIT)


@ON_BOTH
@pytest.mark.parametrize(
    "field", ["time", "output", "variation", "restarts", "cause", "safe_for", "gate", "conditions", "law"]
)
def test_damage_to_the_memory_never_leaves_and_is_mended(make, field):
    run = stepped(make, "")
    run.restart()
    run.steps(0.2)
    spoilt = jax.tree.map(lambda leaf: jnp.full_like(leaf, jnp.nan) if leaf.dtype == float else leaf, run.z)
    run.z = run.z._replace(**{field: getattr(spoilt, field)})
    run.steps(0.2)
    assert np.isfinite(run.outputs).all()
    assert run.states[-1] == (State.ACTIVE, "")
    assert "memory_damaged" in {one.reason for one in transitions(run.z.log)}
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(run.z))
    assert 1 <= run.z.restarted <= 2  # a law that begins from what a damaged gate lets through begins twice


@pytest.mark.parametrize("request_, state", [(Request.STOP, State.STOPPED), (Request.HOLD, State.READY)])
def test_damage_to_the_memory_forgets_no_request(request_, state):
    run = stepped(on_axes, "")
    run.restart()
    run.steps(0.2)
    run.steps(0.2, Tampering(request=request_))
    run.z = run.z._replace(output=np.full_like(run.z.output, np.nan))
    run.steps(0.2, Tampering(request=request_))
    assert run.states[-1] == (state, "operator")
    assert all((output == 0.0).all() for output in run.outputs[20:])


def test_damage_to_the_memory_again_and_again_ends_in_safe():
    """Each time is a restart, as of a law that fails."""
    run = stepped(on_axes, "")
    run.restart()
    for _ in range(5):
        run.steps(0.2)
        run.z = run.z._replace(variation=np.full_like(run.z.variation, np.nan))
    run.steps(0.2)
    assert run.states[-1] == (State.SAFE, "restarts_exhausted")

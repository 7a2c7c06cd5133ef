"""Every target and every mode, by the methods of the faults themselves: altered while present, bit for bit as it was
before and afterwards. A mode never sees its target: every pair of both would find the same."""

import dataclasses
import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from recorded import is_as_recorded

from undertow.control.navigation.kalman import kalman
from undertow.core.contracts import Measurement, Pose, Target
from undertow.core.measurement import measurement_of_outputs
from undertow.physics import sensors
from undertow.physics.faults.kinds import list_kinds
from undertow.physics.faults.quantities import quantities_of
from undertow.physics.sensors.received import Received
from undertow.physics.thrusters.thruster import PropellerReport
from undertow.scenario.build import build
from undertow.scenario.fault_injection import with_faults
from undertow.scenario.schema import Fault

DT, FIRST, STOP, STEPS = 0.01, 3, 8, 11
SENSORS = ["imu", "dvl", "depth", "compass", "position_fix", "propeller_speed"]
WIDTHS = (8, 3, 1, 1, 2, 8)  # of their readings
TIMES = DT * np.arange(STEPS)
KINDS = list_kinds()
# Severities with which a short fault is sure to show.
SHOWN = {"intermittent": 1.0, "overrun": 2.0, "dropped_step": 2.0, "duplicated_step": 2.0, "sag": 0.9}


@functools.cache
def loop():
    healthy = build(
        {
            "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "fidelity": "shaft", "supply": 16}},
            "controller": "pid",
            "reference": {"kind": "setpoint", "position": [1, 0, 1, 0, 0, 0.5]},
            "loop": {"dt": DT},
        }
    ).closed_loop
    return dataclasses.replace(healthy, navigation=kalman([getattr(sensors, name)() for name in SENSORS]))


@functools.cache
def small_loop():
    """A loop of one axis, whose controller is quickly computed."""
    return build(
        {"plant": "double_integrator", "controller": "pid", "reference": {"kind": "setpoint", "position": [1]}}
    ).closed_loop


def with_fault(kind, healthy=loop):
    target = "thruster 2" if kind.target == "thruster" else kind.target
    entry = {"target": target, "mode": kind.mode, "onset": FIRST * DT, "duration": (STOP - FIRST) * DT}
    if kind.mode in SHOWN:
        entry["severity"] = SHOWN[kind.mode]
    return with_faults(healthy(), [Fault.model_validate(entry)], sampling_time=DT)[0]


def kinds_of(*targets):
    """Kinds with these targets in which each target and each mode is met; the first of each target is a quick test.

    So is one whose fault acts on the thrust rather than the input, and one in which a step is computed twice.
    """
    chosen, seen = [], set()
    for kind in KINDS:
        if kind.target.startswith(targets) and not {kind.target, kind.mode} <= seen:
            quick = kind.target not in seen or kind.mode in ("fraction", "duplicated_step")
            chosen.append(pytest.param(kind, marks=() if quick else pytest.mark.full))
            seen |= {kind.target, kind.mode}
    return pytest.mark.parametrize("kind", chosen, ids=lambda kind: f"{kind.target}-{kind.mode}".replace(" ", "_"))


def measured(k):
    """A vehicle that moves."""
    t = 0.3 + 0.07 * k
    position, rate = (
        jnp.asarray([t, -t, 2 * t, 0.3 * t, 0.2 * t, -t]),
        jnp.asarray([0.4, -0.3, 0.2, 0.1, -0.2, 0.3 + t]),
    )
    return measurement_of_outputs(position, rate, PropellerReport(20 + 10 * t * jnp.arange(8.0), None))


def same(one, other):
    return all(map(np.array_equal, jax.tree.leaves(one), jax.tree.leaves(other)))


def altered(steps):
    """Checks which steps differ: some while the fault is present, none before and after."""
    assert not any(steps[:FIRST]) and not any(steps[STOP:]) and any(steps[FIRST:STOP])


def row(k, tree):
    """One instant of a series."""
    return jax.tree.map(lambda leaf: leaf[k], tree)


MEASURED = jax.tree.map(np.asarray, jax.jit(jax.vmap(measured))(np.arange(float(STEPS))))
POSE = Pose(np.array([0.5, 0.2, 1.0]), row(0, MEASURED.body).rotation, np.array([0.3, 0.1, 0.0]))
INPUTS = 3 + 0.3 * np.arange(STEPS)[:, None] + 0.5 * np.arange(8.0)


@eqx.filter_jit
def read_through(faults, readings):
    """Measurements as the faults leave them, and whether one is active, of a vehicle whose input is 0."""
    rest, limits = jnp.zeros(8), (-jnp.ones(8), jnp.ones(8))
    realization = faults.realize(jax.random.PRNGKey(1))

    def step(state, instant):
        t, y = instant
        found, state = faults.measurement(realization, state, t, y)
        _, state = faults.input(realization, state, t, rest, limits)
        return state, (found, faults.active(realization, t))

    start = faults.init(realization, row(0, readings), rest)
    return jax.lax.scan(step, start, (jnp.asarray(TIMES), readings))[1]


@kinds_of("position", "attitude", "velocity", "angular_rate", "depth", "propeller_speed")
def test_quantity(kind):
    found, active = jax.tree.map(np.asarray, read_through(with_fault(kind).faults, MEASURED))
    altered([not same(row(k, found), row(k, MEASURED)) for k in range(STEPS)])
    others = {"position": ("depth",), "depth": ("position",)}.get(kind.target, ())
    for name, quantity in quantities_of(MEASURED).items():
        if name != kind.target and name not in others:
            read = jax.vmap(quantity.read)
            np.testing.assert_allclose(read(found), read(MEASURED), rtol=0, atol=1e-12, err_msg=name)
    np.testing.assert_array_equal(active, [FIRST <= k < STOP for k in range(STEPS)])


@eqx.filter_jit
def delivered(faults, received):
    """What the sensors deliver, as the faults leave it."""
    key = jax.random.PRNGKey(2)
    step = lambda state, instant: faults.received(key, state, *instant)[::-1]
    return jax.lax.scan(step, faults.init([one.reading[0] for one in received]), (jnp.asarray(TIMES), received))[1]


@kinds_of("sensor")
def test_sensor(kind):
    place = [f"sensor {name}" for name in SENSORS].index(kind.target)
    ks = np.arange(STEPS)
    received = tuple(
        Received(0.3 + 0.07 * ks[:, None] + np.arange(width, dtype=float), ks % 2 == 1, np.zeros(STEPS))
        for width in WIDTHS
    )
    found = jax.tree.map(np.asarray, delivered(with_fault(kind).navigation.faults, received))
    for index in range(len(SENSORS)):
        if index != place:
            assert same(found[index], received[index]), SENSORS[index]
    altered([not same(row(k, found[place]), row(k, received[place])) for k in range(STEPS)])


def test_a_lagging_sensor_follows_by_implicit_euler():
    """dv/dt = (reading - v) / tau from the onset on, with the time since the last control step."""
    (kind,) = [kind for kind in KINDS if (kind.target, kind.mode) == ("sensor dvl", "slow")]
    place, tau = SENSORS.index("dvl"), 0.5
    readings = np.outer(np.arange(STEPS) + 1, [0.3, -0.2, 0.1])
    received = [Received(np.zeros((STEPS, width)), np.zeros(STEPS, bool), np.zeros(STEPS)) for width in WIDTHS]
    received[place] = received[place]._replace(reading=readings)
    found = delivered(with_fault(kind).navigation.faults, tuple(received))[place].reading
    lagging = readings[0]
    for k in range(STEPS):
        share = DT / (DT + tau) if FIRST <= k < STOP else 1.0
        lagging = lagging + share * (readings[k] - lagging)
        np.testing.assert_allclose(found[k], lagging, rtol=1e-9)


@eqx.filter_jit
def actuated(faults, none):
    """Health of the measurement, acting inputs and loads of the faults, of a vehicle without other loads."""
    high = jnp.full(8, 16.0)
    realization = faults.realize(jax.random.PRNGKey(1))

    def step(state, instant):
        t, y, u = instant
        y, state = faults.measurement(realization, state, t, y)
        acting, state = faults.input(realization, state, t, u, (-high, high))
        return state, (y.health, acting, faults.load(realization, t, POSE, none))

    start = faults.init(realization, row(0, MEASURED), jnp.zeros(8))
    return jax.lax.scan(step, start, (jnp.asarray(TIMES), MEASURED, jnp.asarray(INPUTS)))[1]


@kinds_of("thruster", "bus")
def test_input(kind):
    faulty = with_fault(kind)
    health, acting, load = jax.tree.map(np.asarray, actuated(faulty.faults, faulty.plant.no_load()))
    failing = slice(1, 2) if kind.target == "thruster" else slice(0, 8)
    healthy = np.delete(np.arange(8), failing)
    thrust = np.ones((STEPS, 8)) if load.scaling is None else load.scaling.thrust * np.ones((STEPS, 8))
    assert (health == 1).all() and (np.abs(acting) <= 16.0).all()
    np.testing.assert_array_equal(acting[:, healthy], INPUTS[:, healthy])
    assert (thrust[:, healthy] == 1).all()
    altered([(acting[k] != INPUTS[k]).any() or (thrust[k] != 1).any() for k in range(STEPS)])


@eqx.filter_jit
def accelerations(plant, faults):
    """With the loads of the faults at all times, and without load."""
    realization = faults.realize(jax.random.PRNGKey(1))
    x, u, none = plant.initial_state(*row(0, MEASURED)[:2]), jnp.full(8, 2.0), plant.no_load()
    loaded = lambda t: plant.acceleration(t, x, u, faults.load(realization, t, POSE, none))
    return jax.vmap(loaded)(jnp.asarray(TIMES)), plant.acceleration(jnp.zeros(()), x, u, none)


@kinds_of("plant")
def test_plant(kind):
    faulty = with_fault(kind)
    found, free = map(np.asarray, accelerations(faulty.plant, faulty.faults))
    np.testing.assert_allclose(found[0], free, rtol=1e-9, atol=1e-12)
    altered([not np.array_equal(acceleration, found[0]) for acceleration in found])


@eqx.filter_jit
def controlled(law, readings):
    """Inputs, and states of the law after each control step."""
    r = Target(jnp.ones(1), jnp.zeros(1), jnp.zeros(1))

    def step(z, y):
        u, _ = law.command(z, y, r)
        z = law.advance(z, y, r, u, jnp.asarray(DT))
        return z, (u, z)

    return jax.lax.scan(step, law.init(row(0, readings), r), readings)[1]


@pytest.mark.full
@kinds_of("computation")
def test_computation(kind):
    ks = np.arange(float(STEPS))[:, None]
    readings = Measurement(0.3 + 0.1 * ks, 0.4 - 0.05 * ks)
    inputs, states = controlled(with_fault(kind, small_loop).controller, readings)
    expected, own = controlled(small_loop().controller, readings)
    differs = [not same(row(k, (inputs, states.law)), row(k, (expected, own))) for k in range(STEPS)]
    assert not any(differs[:FIRST]) and any(differs[FIRST:])
    assert float(states.time[-1]) == pytest.approx(STEPS * DT) and int(states.counts[0][-1]) == STOP - FIRST


def test_there_are_at_least_a_hundred_kinds_and_no_two_alike():
    assert len(KINDS) >= 100 and len({(kind.target, kind.mode) for kind in KINDS}) == len(KINDS)
    for kind in KINDS:
        if kind.default is not None:
            assert kind.lowest <= kind.default <= kind.highest, kind
            assert kind.meaning not in ("", "none")
    severities = [(kind.default, kind.lowest, kind.highest) for kind in KINDS if kind.default is not None]
    is_as_recorded("severities of faults", severities)

"""Every target and every mode, by the methods of the faults themselves: altered while present, bit for bit as it was
before and afterwards. A mode never sees its target: every pair of both would find the same."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core.contracts import Measurement, Pose, Target
from undertow.core.measurement import measurement_of_outputs
from undertow.faults.kinds import list_kinds
from undertow.faults.quantities import quantities_of
from undertow.navigation.from_sensors import Received
from undertow.scenario.build import build
from undertow.scenario.faulted import faulted
from undertow.scenario.schema import Fault
from undertow.thrusters.thruster import PropellerReport

DT, FIRST, STOP, STEPS = 0.01, 3, 8, 11
SENSORS = ["imu", "dvl", "depth", "compass", "position_fix", "propeller_speed"]
KINDS = list_kinds()
# Severities with which a short fault is sure to show.
SHOWN = {"intermittent": 1.0, "overrun": 2.0, "dropped_step": 2.0, "duplicated_step": 2.0, "sag": 0.9}


@functools.cache
def loop():
    return build(
        {
            "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "fidelity": "shaft", "supply": 16}},
            "controller": "pid",
            "reference": {"kind": "setpoint", "position": [1, 0, 1, 0, 0, 0.5]},
            "navigation": {"kind": "kalman", "sensors": SENSORS},
            "loop": {"dt": DT},
        }
    ).closed_loop


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
    return faulted(healthy(), [Fault.model_validate(entry)], sampling_time=DT)[0]


def kinds_of(*targets):
    """Kinds with these targets in which each target and each mode is met; the first of each target is a quick test."""
    chosen, seen = [], set()
    for kind in KINDS:
        if kind.target.startswith(targets) and not {kind.target, kind.mode} <= seen:
            chosen.append(pytest.param(kind, marks=pytest.mark.full if kind.target in seen else ()))
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


@kinds_of("position", "attitude", "velocity", "angular_rate", "depth", "propeller_speed")
def test_quantity(kind):
    faults = with_fault(kind).faults
    realization = faults.realize(jax.random.PRNGKey(1))
    state, differs = faults.init(realization, measured(0), jnp.zeros(8)), []
    for k in range(STEPS):
        t, y = jnp.asarray(k * DT), measured(k)
        found, state = faults.measurement(realization, state, t, y)
        _, state = faults.input(realization, state, t, jnp.zeros(8), (-jnp.ones(8), jnp.ones(8)))
        differs.append(not same(found, y))
        for name, quantity in quantities_of(y).items():
            other = {"position": ("depth",), "depth": ("position",)}.get(kind.target, ())
            if name != kind.target and name not in other:
                assert np.allclose(quantity.read(found), quantity.read(y), rtol=0, atol=1e-12), name
        assert int(faults.active(realization, t)) == (FIRST <= k < STOP)
    altered(differs)


@kinds_of("sensor")
def test_sensor(kind):
    navigation = with_fault(kind).navigation
    place = [f"sensor {name}" for name in SENSORS].index(kind.target)
    widths, key = (8, 3, 1, 1, 2, 8), jax.random.PRNGKey(2)
    received = lambda k: tuple(
        Received(0.3 + 0.07 * k + jnp.arange(width, dtype=float), jnp.asarray(k % 2 == 1), 0.0) for width in widths
    )
    faults = navigation.faults
    state, differs = faults.init([one.reading for one in received(0)]), []
    for k in range(STEPS):
        found, state = faults.received(key, state, jnp.asarray(k * DT), received(k))
        others = [(a, b) for i, (a, b) in enumerate(zip(found, received(k), strict=True)) if i != place]
        assert all(same(a, b) for a, b in others)
        differs.append(not same(found[place], received(k)[place]))
    altered(differs)


def test_a_lagging_sensor_follows_by_implicit_euler():
    """dv/dt = (reading - v) / tau from the onset on, with the time since the last control step."""
    (kind,) = [kind for kind in KINDS if (kind.target, kind.mode) == ("sensor dvl", "slow")]
    navigation = with_fault(kind).navigation
    place, tau = SENSORS.index("dvl"), 0.5
    readings = [np.array([0.3, -0.2, 0.1]) * (k + 1) for k in range(STEPS)]
    silent = [Received(jnp.zeros(width), jnp.asarray(False), 0.0) for width in (8, 3, 1, 1, 2, 8)]
    received = lambda k: (
        *silent[:place],
        silent[place]._replace(reading=jnp.asarray(readings[k])),
        *silent[place + 1 :],
    )
    state, lagging = navigation.faults.init([one.reading for one in received(0)]), readings[0]
    for k in range(STEPS):
        found, state = navigation.faults.received(jax.random.PRNGKey(2), state, jnp.asarray(k * DT), received(k))
        share = DT / (DT + tau) if FIRST <= k < STOP else 1.0
        lagging = lagging + share * (readings[k] - lagging)
        np.testing.assert_allclose(found[place].reading, lagging, rtol=1e-9)


@kinds_of("thruster", "bus")
def test_input(kind):
    faults = with_fault(kind).faults
    realization = faults.realize(jax.random.PRNGKey(1))
    high, failing = jnp.full(8, 16.0), slice(1, 2) if kind.target == "thruster" else slice(0, 8)
    state, differs = faults.init(realization, measured(0), jnp.zeros(8)), []
    for k in range(STEPS):
        t, u = jnp.asarray(k * DT), 3 + 0.3 * k + 0.5 * jnp.arange(8.0)
        y, state = faults.measurement(realization, state, t, measured(k))
        acting, state = faults.input(realization, state, t, u, (-high, high))
        load = faults.load(realization, t, POSE, loop().plant.no_load())
        assert same(y.health, jnp.ones(8)) and (jnp.abs(acting) <= high).all()
        healthy = np.delete(np.arange(8), failing)
        assert np.array_equal(acting[healthy], u[healthy])
        thrust = np.ones(8) if load.scaling is None else np.asarray(load.scaling.thrust)
        assert (thrust[healthy] == 1).all()
        differs.append(not np.array_equal(acting, u) or (thrust != 1).any())
    altered(differs)


POSE = Pose(jnp.asarray([0.5, 0.2, 1.0]), measured(0).body.rotation, jnp.asarray([0.3, 0.1, 0.0]))


@kinds_of("plant")
def test_plant(kind):
    faulty = with_fault(kind)
    plant, faults = faulty.plant, faulty.faults
    realization = faults.realize(jax.random.PRNGKey(1))
    x, u = plant.initial_state(measured(0).position, measured(0).velocity), jnp.full(8, 2.0)
    moved = lambda t: plant.acceleration(
        jnp.asarray(t), x, u, faults.load(realization, jnp.asarray(t), POSE, plant.no_load())
    )
    free = moved(0.0)
    assert np.allclose(free, plant.acceleration(jnp.zeros(()), x, u, plant.no_load()), rtol=1e-9, atol=1e-12)
    changed = [not np.array_equal(moved(k * DT), free) for k in range(STEPS)]
    altered(changed)


@eqx.filter_jit
def stepped(law, z, y, r):
    """Input of a control step, and the state after it."""
    u, _ = law.command(z, y, r)
    return u, law.advance(z, y, r, u, jnp.asarray(DT))


@kinds_of("computation")
def test_computation(kind):
    law, clean = with_fault(kind, small_loop).controller, small_loop().controller
    r = Target(jnp.ones(1), jnp.zeros(1), jnp.zeros(1))
    readings = [Measurement(jnp.asarray([0.3 + 0.1 * k]), jnp.asarray([0.4 - 0.05 * k])) for k in range(STEPS)]
    z, own, differs, inputs = law.init(readings[0], r), clean.init(readings[0], r), [], []
    for y in readings:
        u, z = stepped(law, z, y, r)
        expected, own = stepped(clean, own, y, r)
        inputs.append(not np.array_equal(u, expected))
        differs.append(not same(z.law, own))
    assert not any(inputs[:FIRST]) and not any(differs[:FIRST])
    assert any(inputs[FIRST:]) or any(differs[FIRST:])
    assert float(z.time) == pytest.approx(STEPS * DT) and int(z.counts[0]) == STOP - FIRST


def test_there_are_at_least_a_hundred_kinds_and_no_two_alike():
    assert len(KINDS) >= 100 and len({(kind.target, kind.mode) for kind in KINDS}) == len(KINDS)
    for kind in KINDS:
        if kind.default is not None:
            assert kind.lowest <= kind.default <= kind.highest, kind
            assert kind.meaning not in ("", "none")

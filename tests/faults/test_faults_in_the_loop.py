"""Faults in a closed loop: both compilers agree, both precisions work, random ones differ from seed to seed."""

import functools

import jax
import numpy as np
import pytest

import undertow as ut
from undertow.core import runtime
from undertow.core.errors import BadInput
from undertow.scenario.build import build
from undertow.simulation.loop import sampled, simd_batch

DT = 0.01
ODIN = {
    "plant": {"vehicle": "odin", "thruster": {"kind": "linear_voltage"}},
    "controller": "pid",
    "reference": {"kind": "setpoint", "position": [0.5, 0.2, 0.5, 0, 0, 0.5], "settling": 0.5},
    "loop": {"duration": 1.0, "dt": DT, "record": DT},
}
# One fault of every group, and every way of ending.
MIXED = [
    {"target": "thruster 3", "mode": "off", "onset": 0.2, "duration": 0.3, "announced": True},
    {"target": "thruster 5", "mode": "fraction", "severity": -1, "onset": 0.4},
    {"target": "velocity", "mode": "noise", "severity": 0.05, "onset": 0.3, "axis": 2},
    {"target": "attitude", "mode": "slow", "severity": 0.1, "onset": 0.5},
    {"target": "bus", "mode": "intermittent", "period": 0.05, "onset": 0.6},
    {"target": "plant", "mode": "current_step", "severity": 0.3, "onset": 0.7},
    {"target": "computation", "mode": "overrun", "onset": 0.8},
]


def signals_of(outcome):
    return {name: np.asarray(one) for name, one in outcome.signals.items()}


@functools.cache
def with_mixed(precision="float64", simulate=sampled.simulate, seed=0):
    built = build(ODIN | {"faults": MIXED, "precision": precision})
    with runtime.in_precision(precision):
        outcome = simulate(built.closed_loop, duration=1.0, dt=DT, record_every=1, key=jax.random.PRNGKey(seed))
    assert int(outcome.status) == 0
    return signals_of(outcome)


@pytest.mark.full
def test_both_compilers_agree():
    xla, simd = with_mixed(), with_mixed(simulate=simd_batch.simulate)
    for name in ("position", "input", "acting_input", "active_faults"):
        np.testing.assert_allclose(simd[name], xla[name], rtol=1e-7, atol=1e-9)


@pytest.mark.full
def test_single_precision():
    """The same run up to the first random number, which depends on the precision; the same faults at the same steps."""
    single, double = with_mixed("float32"), with_mixed()
    assert single["position"].dtype == single["acting_input"].dtype == np.float32
    assert np.array_equal(single["active_faults"], double["active_faults"])
    np.testing.assert_allclose(single["position"][:31], double["position"][:31], atol=1e-4)
    assert np.isfinite(single["position"]).all() and not np.array_equal(
        single["position"][31:], double["position"][31:]
    )


@pytest.mark.full
def test_faults_begin_and_end_on_their_steps():
    """At a step boundary, in both precisions: a fault is present from the step of its onset to that before its end."""
    for precision in ("float64", "float32"):
        active = with_mixed(precision)["active_faults"]
        step = np.arange(101)
        intervals = [(20, 50), (40, 200), (30, 200), (50, 200), (60, 200), (70, 200), (80, 200)]
        assert np.array_equal(active, sum((step >= first) & (step < stop) for first, stop in intervals))


@pytest.mark.full
def test_only_the_failed_thruster_gets_another_input():
    signals = with_mixed()
    applied, acting, step = signals["input"], signals["acting_input"], np.arange(101)
    off = (step >= 20) & (step < 50)
    assert (acting[off, 2] == 0).all() and (applied[off, 2] != 0).all()
    assert np.array_equal(acting[:60, [0, 1, 3, 4, 5, 6, 7]], applied[:60, [0, 1, 3, 4, 5, 6, 7]])
    assert np.array_equal(acting[50:60], applied[50:60])
    dark = (acting[60:80] == 0).all(axis=1)
    assert dark.any() and not dark.all()


@pytest.mark.full
def test_a_controller_that_overruns_holds_its_input():
    applied = with_mixed()["input"][80:95]
    held = (np.diff(applied, axis=0) == 0).all(axis=1)
    assert held.tolist() == [place % 3 != 2 for place in range(14)]


@pytest.mark.full
def test_a_random_thruster_with_random_onset_and_severity():
    """Different for every seed, and different thrusters within one run."""
    entry = {"target": "thruster", "number": "random", "mode": "scale", "severity": [0.1, 0.9], "onset": [2.0, 4.0]}
    loop = build(ODIN | {"faults": [entry, entry]}).closed_loop
    realized = jax.jit(jax.vmap(lambda key: loop.faults.realize(key)))(jax.random.split(jax.random.PRNGKey(0), 400))
    (first, second), chosen = realized[1], np.asarray(realized[1][0].chosen)
    assert (chosen.sum(1) == 1).all() and not (chosen * np.asarray(second.chosen)).any()
    counts = chosen.sum(0)
    assert counts.min() > 25 and counts.max() < 80  # 50 expected; 3.7 and 4.5 standard deviations
    for values, low, high in ((first.timing.onset, 2, 4), (first.timing.severity, 0.1, 0.9)):
        values = np.asarray(values)
        assert (
            values.min() >= low
            and values.max() <= high
            and values.std() == pytest.approx((high - low) / 12**0.5, rel=0.1)
        )
    assert loop.faults.jumps(10.0) == ()


@pytest.mark.full
def test_from_python_with_names_and_objects():
    plant = ut.HybridVehicle(ut.vehicles.odin(), ut.thrusters.linear_voltage())
    law = ut.controllers.pid(plant.model())
    reference = ut.references.setpoint([0.5, 0, 0, 0, 0, 0])
    run = lambda faults: ut.simulate(plant, law, reference, faults=faults, duration=0.3, dt=DT)
    by_name = run([{"target": "depth", "mode": "bias", "severity": 0.2, "onset": 0.1}])
    by_object = run([{"target": "depth", "mode": ut.faults.bias(), "severity": 0.2, "onset": 0.1}])
    assert np.array_equal(by_name.dataset["position"], by_object.dataset["position"])
    off = by_name.dataset["measured_position"] - by_name.dataset["position"]
    assert np.allclose(off[:, 2], np.where(np.arange(31) >= 10, 0.2, 0.0), atol=1e-12) and np.allclose(off[:, :2], 0)
    with pytest.raises(BadInput, match=r"`faults\[0\].mode` must be a mode of `depth`"):
        run([{"target": "depth", "mode": "reversed"}])


@pytest.mark.full
def test_a_pendulum_has_inputs_and_outputs():
    scenario = {
        "plant": "inverted_pendulum",
        "controller": "pid",
        "reference": {"kind": "setpoint", "position": [0.1]},
        "loop": {"duration": 0.3, "dt": DT, "record": DT},
        "faults": [
            {"target": "input 1", "mode": "off", "onset": 0.1},
            {"target": "velocity", "mode": "stuck", "onset": 0.2},
        ],
    }
    signals = signals_of(sampled.simulate(build(scenario).closed_loop, duration=0.3, dt=DT, record_every=1))
    assert (signals["acting_input"][10:] == 0).all() and (signals["input"][10:] != 0).all()
    assert (signals["measured_velocity"][20:] == signals["measured_velocity"][19]).all()
    with pytest.raises(BadInput, match="This scenario has: position, velocity, input, computation"):
        build(scenario | {"faults": [{"target": "thruster 1", "mode": "off"}]})
    with pytest.raises(BadInput, match=r"`faults\[0\].mode` must be a mode of `input`"):
        build(scenario | {"faults": [{"target": "input 1", "mode": "fraction"}]})

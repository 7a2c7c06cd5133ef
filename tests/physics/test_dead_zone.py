"""The dead zone of a thruster: outside it the whole voltage turns the motor (`pass`), or what is beyond (`subtract`)."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from simdjit import Loop
from undertow.analysis.metrics import Metrics, results
from undertow.control.controllers import pid, rcaf
from undertow.control.navigation import perfect
from undertow.control.references import setpoint
from undertow.core import runtime
from undertow.core.errors import BadInput
from undertow.core.numerics.integrators import rk4
from undertow.physics.disturbances import sinusoid
from undertow.physics.plants import hybrid_vehicle
from undertow.physics.thrusters import first_order, linear_voltage, paper_table3, quadratic_voltage, t200, t500
from undertow.physics.vehicles import bluerov2_heavy
from undertow.simulation.loop import sampled, simd_batch
from undertow.simulation.loop.closed_loop import ClosedLoop

ZONE, SUPPLY = 1.5, 12.0  # V
KINDS = ("pass", "subtract")
MAKERS = {
    **{fidelity: lambda fidelity=fidelity, **zone: paper_table3(fidelity, **zone) for fidelity in ("ideal", "static")},
    **{
        fidelity: lambda fidelity=fidelity, **zone: paper_table3(fidelity, **zone)
        for fidelity in ("shaft", "electromechanical")
    },
    "linear": linear_voltage,
    "quadratic": quadratic_voltage,
    "first_order": lambda **zone: first_order(reverse_share=0.6, **zone),
    "t200": t200,
    "t500": t500,
}
# Every kind of thruster with a dead zone of its own.
QUICK = {("static", "pass"), ("quadratic", "subtract"), ("first_order", "pass"), ("t200", "subtract")}
VOLTS = jnp.array([-12.0, -4.0, -1.6, -1.5, -0.7, 0.0, 0.7, 1.5, 1.6, 4.0, 12.0])
TURNS = {
    "pass": jnp.array([-12.0, -4.0, -1.6, 0.0, 0.0, 0.0, 0.0, 0.0, 1.6, 4.0, 12.0]),
    "subtract": jnp.array([-10.5, -2.5, -0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 2.5, 10.5]),
}


def with_zone(name, kind, zone=ZONE):
    return MAKERS[name](supply=SUPPLY, dead_zone=zone, dead_zone_kind=kind)


@eqx.filter_jit
def all_of(thruster, state, volts):
    """What turns the motor, and all that depends on it."""
    rest = thruster.dynamics(state, volts), thruster.thrust(state, volts), thruster.electrical_power(state, volts)
    return thruster.terminal(volts), rest


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        (name, kind) if (name, kind) in QUICK else pytest.param(name, kind, marks=pytest.mark.full)
        for name in MAKERS
        for kind in KINDS
    ],
)
def test_what_turns_the_motor(name, kind):
    """It behaves as the same thruster without a dead zone at another voltage."""
    thruster, free = with_zone(name, kind), with_zone(name, kind, zone=0.0)
    state = jax.tree.map(lambda leaf: np.linspace(-3.0, 4.0, leaf.size), thruster.initial_state(11))
    turns, found = all_of(thruster, state, VOLTS)
    np.testing.assert_allclose(turns, TURNS[kind], rtol=0, atol=1e-15)
    np.testing.assert_array_equal(all_of(free, state, VOLTS)[0], VOLTS)
    _, expected = all_of(free, state, TURNS[kind])
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, rtol=1e-13, atol=1e-13), found, expected)


@pytest.mark.full
@pytest.mark.parametrize("kind", KINDS)
def test_a_voltage_that_is_not_a_number_does_not_become_zero_volts(kind):
    """Neither by XLA nor in the batch compiler."""
    thruster, volts = with_zone("static", kind), np.array([[np.nan], [0.3], [-6.0]])
    by_xla = np.asarray(jax.jit(jax.vmap(thruster.terminal))(volts))
    one, nothing = jnp.zeros(1), np.zeros(())
    program = Loop(
        lambda numbers: numbers,
        lambda numbers: nothing,
        lambda numbers, carry, k: carry,
        lambda numbers, carry, k: thruster.terminal(numbers[0]),
        (one,),
        [False],
        0,
    )
    _, batched = program.run((volts,), steps=1, every=1)
    for found in (by_xla, np.asarray(batched)[:, 0]):
        assert np.isnan(found[0, 0])
        np.testing.assert_allclose(found[1:, 0], [0.0, -6.0 if kind == "pass" else -4.5], rtol=1e-15)
    assert np.isnan(thruster.thrust((), jnp.array([jnp.nan]))).all()


@pytest.mark.parametrize("kind", KINDS)
def test_slope_and_precision(kind):
    """Slope 1 outside and 0 inside; float32 stays float32."""
    thruster = with_zone("static", kind)
    slopes = jax.jit(jax.vmap(jax.grad(lambda volts: thruster.terminal(volts))))(np.array([-4.0, -1.0, 1.0, 4.0]))
    np.testing.assert_array_equal(slopes, [1.0, 0.0, 0.0, 1.0])
    with runtime.in_precision("float32"):
        single = with_zone("static", kind)
        found = jax.jit(lambda volts: single.terminal(volts))(np.asarray(VOLTS, dtype=np.float32))
    assert found.dtype == jnp.float32
    np.testing.assert_allclose(found, TURNS[kind], rtol=0, atol=2e-7)


@pytest.mark.full
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["ideal", "static", "linear", "quadratic"])
def test_without_a_zone_no_thruster_loses_its_slope_at_zero_volts(name, kind):
    """A loop at rest is linearised there: thrust per volt, and volts per newton, as on both sides of it."""
    thruster = with_zone(name, kind, zone=0.0)
    about_zero = np.array([-1e-9, 0.0, 1e-9])
    slopes = np.asarray(jax.jit(jax.vmap(jax.grad(lambda volts: thruster.thrust((), volts))))(about_zero))
    np.testing.assert_allclose(slopes[1], slopes[2], rtol=1e-6, atol=1e-7)
    if name in ("ideal", "linear"):
        np.testing.assert_allclose(slopes, thruster.voltage_gain(), rtol=1e-9)
        back = np.asarray(jax.jit(jax.vmap(jax.grad(lambda force: thruster.voltage_for(force))))(about_zero))
        np.testing.assert_allclose(back * slopes, 1.0, rtol=1e-9)


def there_and_back(thruster, newtons):
    """Voltages that the quasi-static drive gives for thrusts, and the thrusts of these voltages."""
    drive = thruster.actuator_model(newtons.size, False).quasi_static()
    return map(np.asarray, _there_and_back(drive, newtons))


@eqx.filter_jit
def _there_and_back(drive, newtons):
    volts = drive.command((), newtons, 1.0)
    return volts, drive.force((), volts)


@pytest.mark.parametrize("name", ["ideal", "static", "linear", "quadratic", "first_order"])
def test_voltage_for_a_thrust(name):
    """The curve of a drive and its inverse; `pass` cannot give the thrusts whose voltage is inside the zone."""
    newtons = np.array([-30.0, -8.0, -0.01, 0.0, 0.01, 8.0, 30.0])
    for kind in KINDS:
        volts, found = there_and_back(with_zone(name, kind), newtons)
        lost = np.abs(volts) <= ZONE
        np.testing.assert_array_equal(lost[2:5], [kind == "pass", True, kind == "pass"])
        np.testing.assert_allclose(found[~lost], newtons[~lost], rtol=1e-9)
        np.testing.assert_array_equal(found[lost], 0.0)


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("t200", "subtract"),
        *(
            pytest.param(name, kind, marks=pytest.mark.full)
            for name in ("shaft", "electromechanical", "t200")
            for kind in KINDS
            if (name, kind) != ("t200", "subtract")
        ),
    ],
)
def test_drive_of_a_motor(name, kind):
    """Its command aims where it was told to; its prediction turns as the true motor; its range ends at the supply."""
    thruster, rate = with_zone(name, kind), 40.0
    drive = thruster.actuator_model(4, False)
    resting = drive.init()
    state = jax.tree.map(lambda leaf: np.array([20.0, -30.0, 5.0, 0.5]), resting)
    wanted = np.array([9.0, -7.0, 15.0, -4.0])
    turning = SUPPLY - (ZONE if kind == "subtract" else 0.0)

    @jax.jit
    def aim(state, wanted):
        volts = drive.command(state, wanted, rate)
        ends = thruster.motor.thrust(jnp.array([-1.0, 1.0]) * turning / thruster.motor.k1 / 10)
        return volts, drive.target_of(state, volts, rate), drive.range(resting, 10.0), ends

    volts, target, limits, ends = jax.tree.map(np.asarray, aim(state, wanted))
    heard = np.abs(volts) > ZONE
    assert heard.sum() >= (3 if kind == "pass" else 4)
    np.testing.assert_allclose(target[heard], wanted[heard], rtol=1e-9)
    for limit, expected in zip(limits, ends, strict=True):
        np.testing.assert_allclose(limit, np.full(4, expected), rtol=1e-12)
    assert drive.quasi_static().thruster.dead_zone_kind == kind

    if name == "shaft":
        return  # the drive knows of the inductance that this fidelity leaves out
    dt, fine = 2e-3, 400

    @jax.jit
    def turned(volts):
        move = lambda _, x: rk4(lambda t, x: thruster.dynamics(x, volts), 0.0, x, dt / fine)
        truth = jax.lax.fori_loop(0, 25 * fine, move, thruster.initial_state(4))
        return truth, jax.lax.fori_loop(0, 25, lambda _, belief: drive.advance(belief, volts, dt), resting)

    truth, belief = jax.tree.map(np.asarray, turned(np.array([1.0, -2.0, 4.0, -9.0])))
    assert truth.speed[0] == belief.speed[0] == 0.0
    np.testing.assert_allclose(belief.speed[1:], truth.speed[1:], rtol=0.03)


def station(kind, law, **loads):
    """The Heavy, held where it is for 6 s."""
    plant = hybrid_vehicle(bluerov2_heavy(), t200(dead_zone_kind=kind))
    return ClosedLoop(plant, law(plant.model()), setpoint([0.0] * 6), sinusoid(0.3, 1.0, **loads), perfect())


# `pass` is that of every run of test_power.
@pytest.mark.slow
@pytest.mark.parametrize("kind", ["pass", "subtract"])
def test_energy_is_accounted_for(kind):
    """What the drives take goes into copper, water and rotors, to the error of the integrator."""
    law = lambda model: pid(model, sampling_time=0.02)
    run = sampled.simulate(station(kind, law, offset=0.2), duration=2.0, dt=0.02, record_every=10, substeps=8)
    found = {name: np.asarray(values) for name, values in run.signals.items() if name.startswith("energy_")}
    assert found["energy_source"][-1] > 5.0
    assert np.abs(found["energy_integration_error"]).max() < 1e-3 * found["energy_source"][-1]


@pytest.mark.full
@pytest.mark.parametrize("make", [t200, t500], ids=["t200", "t500"])
def test_a_law_that_knows_the_zone_loses_nothing_to_it(make):
    """Small forces: `subtract` gives them all, as its inverse adds the zone; `pass` none below its own."""
    newtons = np.linspace(-0.2, 0.2, 21)
    for kind, least in (("subtract", 0.0), ("pass", None)):
        _, given = there_and_back(make(dead_zone_kind=kind), newtons)
        if least is None:
            np.testing.assert_array_equal(given, 0.0)
        else:
            np.testing.assert_allclose(given, newtons, rtol=1e-9, atol=1e-15)


# By default the dead zone alone is compiled by both, above.
@pytest.mark.slow
@pytest.mark.parametrize("law", [rcaf, pid], ids=["robust", "pid"])
def test_batches_and_xla_agree_where_the_zone_subtracts(law):
    options = {"preset": "robust"} if law is rcaf else {}
    loop = station("subtract", lambda model: law(model, sampling_time=0.02, **options))
    how = dict(duration=0.6, dt=0.02, record_every=5, accumulators=(Metrics(0.0, 0.6),))
    found, wanted = simd_batch.simulate(loop, **how), sampled.simulate(loop, **how)
    for name in ("position", "input", "power"):
        here, there = found.signals[name], np.asarray(wanted.signals[name])
        np.testing.assert_allclose(here, there, rtol=0, atol=1e-9 * np.abs(there).max(), err_msg=name)
    assert np.abs(wanted.signals["input"][np.abs(wanted.signals["input"]) > 0]).min() > 1.2, "the zone is added"
    assert results(how["accumulators"], found.accumulated)["input_rms"] > 1.2


def test_what_cannot_be():
    with pytest.raises(BadInput, match="`dead_zone_kind` must be one of pass, subtract, but is substract"):
        t200(dead_zone_kind="substract")
    for make in (linear_voltage, first_order, paper_table3):
        with pytest.raises(BadInput, match="`dead_zone_kind` must be one of pass, subtract"):
            make(dead_zone_kind="none")
        with pytest.raises(BadInput, match="`dead_zone` must be zero or positive, but is -1 V"):
            make(dead_zone=-1.0)

"""I27, section 3.9: what the nonlinear loop does with a motor in it is what the rightmost eigenvalue says.

Twenty pairs of gains and propeller speeds from a nudge off their equilibrium; then the table of 1-DOF runs.
"""

import axis_forms
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from motor_rail import COUNT, MASS, InnerLoop, MotorRail, thrust_model

from undertow.analysis import motor_loop
from undertow.control.controllers.rcaf import rcaf
from undertow.control.navigation.perfect import perfect
from undertow.control.references.setpoint import setpoint
from undertow.core.contracts import Load, Target
from undertow.core.numerics.integrators import rk4
from undertow.core.status import Status
from undertow.physics.disturbances.sinusoid import sinusoid
from undertow.physics.thrusters.fidelity_levels import ElectromechanicalState
from undertow.physics.thrusters.paper_table3 import paper_table3
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

WHOLE = paper_table3()
SPEEDS = np.array([2.0, 10.0, 20.0, 40.0])  # rad/s


def observer(bandwidth):
    """A pure linear observer in Table 1's letters: no robust term, no share of s, critically damped."""
    nothing = {"robust_gain": 0.0, "compensation_gain": 0.0, "weight": np.eye(2) * 1e-9}
    rho = float(rcaf(thrust_model(), preset="paper", sets=3).fuzzy.basis_norm_squared())
    return nothing | {"sets": 3, "pole": 2 * bandwidth, "composite": bandwidth**2 / (100 * rho)}


GAINS = {
    "rcafc": {"sets": 3},
    "rafc": {"sets": 3, "composite": 0.0},
    "no robust term": {"sets": 3, "robust_gain": 0.0},
    "a tenth of the composite share": {"sets": 3, "composite": 50.0},
    "observer, 30 rad/s": observer(30.0),
}


def departure(law, speed):
    """Largest departure from equilibrium in each of 12 s, the motors turning at a speed (rad/s)."""
    plant, motor = MotorRail(WHOLE), WHOLE.motor
    speeds = jnp.full(COUNT, speed)
    current = motor.steady_current(speeds)
    volts = motor.resistance * current + motor.back_emf_constant * speeds
    load = Load(-motor.thrust(speeds).sum()[None] / MASS, jnp.zeros(1))
    start = plant.initial_state()._replace(thrusters=ElectromechanicalState(speeds, current))
    target = Target(*(jnp.zeros(1) for _ in range(3)))
    y = plant.output(0.0, start)
    z = law.init(y, target)
    held = -(law.model.dynamics.gain(y) @ volts)
    z = z._replace(weights=jnp.broadcast_to(held[:, None], z.weights.shape))

    def flow(t, state):
        x, z = state
        y = plant.output(t, x)
        u, _ = law.command(z, y, target)
        return plant.dynamics(t, x, u, load), law.flow(z, y, target, u)

    def second(state, _):
        def step(state, _):
            state = rk4(flow, 0.0, state, 1e-3)
            x, z = state
            away = [x.position, x.velocity, x.thrusters.speed - speeds, z.weights.mean(1) - held]
            away = jnp.abs(jnp.concatenate(away)).max()
            return state, jnp.where(jnp.isfinite(away), away, jnp.inf)

        state, away = jax.lax.scan(step, state, None, length=1000)
        return state, away.max()

    return jax.lax.scan(second, (start._replace(velocity=jnp.full(1, 1e-7)), z), None, length=12)[1]


@pytest.mark.slow
def test_sign_of_the_rightmost_eigenvalue_is_the_verdict_of_twenty_nonlinear_runs():
    laws = [rcaf(MotorRail(WHOLE).model(), preset="paper", **choices) for choices in GAINS.values()]
    stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *laws)
    each_speed = jax.vmap(departure, in_axes=(None, 0))
    runs = np.asarray(jax.jit(jax.vmap(each_speed, in_axes=(0, None)))(stacked, jnp.asarray(SPEEDS)))
    verdicts = []
    for name, law, of_law in zip(GAINS, laws, runs, strict=True):
        for speed, away in zip(SPEEDS, of_law, strict=True):
            predicted = motor_loop.rightmost(motor_loop.motor_matrix(law, WHOLE.motor, speed)).real
            grows = away[-1] > away[1] or away[1] == np.inf
            verdicts.append(grows)
            print(f"{name}, {speed:g} rad/s: {predicted:+.3g} 1/s, departure {away[1]:.2g} to {away[-1]:.2g}")
            assert abs(predicted) > 0.1, "too near to tell"
            assert grows == (predicted > 0)
    assert len(verdicts) == 20 and 5 <= sum(verdicts) <= 15


def test_a_linear_observer_is_stable_between_two_bandwidths():
    """20 to 60 rad/s at every speed from 1 rad/s; slower ones cannot hold motors that hardly turn."""
    rightmost = lambda law, speed: motor_loop.rightmost(motor_loop.motor_matrix(law, WHOLE.motor, speed)).real
    for bandwidth in (20.0, 30.0, 60.0):
        law = rcaf(thrust_model(), preset="paper", **observer(bandwidth))
        assert all(rightmost(law, speed) < 0 for speed in (1.0, 2.0, 5.0, 20.0, 40.0, 80.0))
    slow = rcaf(thrust_model(), preset="paper", **observer(10.0))
    assert rightmost(slow, 1.0) > 0.05 and rightmost(slow, 2.0) < 0


PERIOD = 2 * np.pi
ROWS = {
    "ideal": {"fidelity": "ideal"},
    "motor": {},
    "motor, 24 V": {"supply": 24.0},
    "speed sensor": {"speed_sensor": True},
    "speed navigation, 24 V": {"speed_sensor": True, "supply": 24.0},
    "rafc": {"composite": 0.0},
    "rafc, 24 V": {"composite": 0.0, "supply": 24.0},
    "inner loop, 24 V": {"inner": 60.0, "supply": 24.0},
    "observer 30, 1 ms": observer(30.0) | {"supply": 24.0},
    "observer 30, 5 ms": observer(30.0) | {"supply": 24.0, "dt": 5e-3},
    "observer 30, 20 ms": observer(30.0) | {"supply": 24.0, "dt": 20e-3},
    "observer 50": observer(50.0) | {"supply": 24.0},
}


@pytest.fixture(scope="module")
def rows():
    """Status, law, and over the last two periods of d: rms of e (m), rms and variation of V (V, V/s)."""
    table = {name: row(**choices) for name, choices in ROWS.items()}
    for name, (status, ended, found, _) in table.items():
        print(f"{name}: status {status} at {ended:.3g} s, " + ", ".join(f"{k} {v:.3g}" for k, v in found.items()))
    return table


def row(fidelity="electromechanical", supply=np.inf, speed_sensor=False, inner=None, dt=1e-3, **choices):
    thruster = paper_table3(fidelity, supply=supply)
    plant = MotorRail(thruster)
    law = rcaf(
        plant.model(speed_sensor=speed_sensor) if inner is None else thrust_model(),
        **({"preset": "paper", "sets": 3} | choices),
    )
    flown = law if inner is None else InnerLoop(law.model, law, thruster, inner)
    loop = ClosedLoop(plant, flown, setpoint([2.0]), sinusoid(0.5, 1.0, offset=0.5), perfect())
    duration = 15.0 + 2 * PERIOD
    run = sampled.simulate(loop, duration=duration, dt=dt, record_every=1, substeps=round(dt / 1e-3))
    late = np.asarray(run.time) > 15.0
    error, volts = np.asarray(run.signals["error"])[late, 0], np.asarray(run.signals["input"])[late, 0]
    rms = lambda series: float(np.sqrt((series**2).mean()))
    found = {"e": rms(error), "V": rms(volts), "variation": float(np.abs(np.diff(volts)).sum() / (2 * PERIOD))}
    return int(run.status), float(run.ended), found, law


@pytest.mark.slow
def test_ideal_thrusters(rows):
    status, _, found, law = rows["ideal"]
    assert status == int(Status.OK)
    assert found["e"] == pytest.approx(0.5 * abs(axis_forms.tracking_response(law, 1.0)) / np.sqrt(2), rel=0.02)
    assert found["e"] == pytest.approx(1.8e-5, rel=0.05)
    needed = MASS / COUNT * np.sqrt(0.25 + 0.125) / float(WHOLE.voltage_gain())
    assert found["V"] == pytest.approx(needed, rel=1e-3)


@pytest.mark.slow
def test_table_1_on_its_own_motor(rows):
    for name, seconds in (("motor", 3.0), ("speed sensor", 1.5)):
        status, ended, _, _ = rows[name]
        assert status != int(Status.OK) and ended < seconds, name
    for name, error in (("motor, 24 V", 16e-3), ("speed navigation, 24 V", 11e-3)):
        status, _, found, _ = rows[name]
        assert status == int(Status.OK), name
        assert found["V"] > 0.9 * 24.0 and found["variation"] > 500.0, "from stop to stop, for ever"
        assert found["e"] == pytest.approx(error, rel=0.3)


@pytest.mark.slow
def test_rafc_needs_no_less_than_all_the_voltage(rows):
    status, _, found, _ = rows["rafc"]
    assert status == int(Status.OK) and found["e"] == pytest.approx(1.8e-3, rel=0.1)
    status, _, found, _ = rows["rafc, 24 V"]
    assert status != int(Status.OK) or found["e"] > 10.0, "wound up"


@pytest.mark.slow
def test_what_does_work_on_that_motor(rows):
    status, _, found, _ = rows["inner loop, 24 V"]
    assert status == int(Status.OK) and found["e"] < 1e-4 and found["variation"] < 5.0
    slow = [rows[f"observer 30, {dt} ms"] for dt in (1, 5, 20)]
    for status, _, found, _ in slow:
        assert status == int(Status.OK)
        assert found["e"] == pytest.approx(slow[0][2]["e"], rel=0.02), "identical at any sampling time"
        assert found["e"] == pytest.approx(20e-3, rel=0.15) and found["variation"] < 5.0
    assert rows["observer 50"][2]["e"] == pytest.approx(12e-3, rel=0.15)

"""Section 3.9: Table 1 with the motor of Table 3 is unstable at every speed; the whole table, and the code itself.

The linear model is checked against the Jacobian of the closed loop as it is simulated: ODIN in heave, eight
thrusters, the four vertical ones turning at a given speed.
"""

import axis_forms
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree

from undertow.analysis import drift, motor_loop, small_signal
from undertow.control.controllers.rcaf import rcaf
from undertow.control.navigation.perfect import perfect
from undertow.control.references.setpoint import setpoint
from undertow.physics.disturbances.sinusoid import sinusoid
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.thrusters.fidelity_levels import ElectromechanicalState
from undertow.physics.thrusters.paper_table3 import paper_table3
from undertow.physics.vehicles.odin import odin
from undertow.simulation.loop.closed_loop import ClosedLoop

MOTOR = paper_table3().motor
LAWS = {"rcafc": {}, "rafc": {"composite": 0.0}, "no robust term": {"robust_gain": 0.0}}
RIGHTMOST = {
    2: {"rcafc": 9.6 + 21j, "rafc": -0.95, "no robust term": -0.97},
    10: {"rcafc": 17.0 + 36j, "rafc": -0.99, "no robust term": 0.5 + 24j},
    20: {"rcafc": 21.0 + 45j, "rafc": -0.99, "no robust term": 2.1 + 33j},
    40: {"rcafc": 25.1 + 56j, "rafc": -1.0, "no robust term": 4.0 + 44j},
}
LAGS = {0: (0, 0.140), 10: (0.39, 0.085), 20: (0.56, 0.061), 40: (0.72, 0.039), 60: (0.80, 0.029)}


@pytest.mark.parametrize("name", LAWS)
def test_rightmost_eigenvalues(table1, name):
    law = table1(**LAWS[name])
    for speed, expected in RIGHTMOST.items():
        value = motor_loop.rightmost(motor_loop.motor_matrix(law, MOTOR, speed, inductance=True))
        wanted = complex(expected[name])
        assert value.real == pytest.approx(wanted.real, abs=0.06 if abs(wanted.real) > 1 else 0.02)
        assert value.imag == pytest.approx(wanted.imag, abs=0.6)
        assert np.sign(value.real) == np.sign(wanted.real)


@pytest.mark.full
def test_unstable_at_every_speed_with_or_without_inductance(table1):
    law, robustless = table1(), table1(composite=0.0)
    for speed in np.linspace(2, 60, 30):
        for inductance in (True, False):
            matrix = motor_loop.motor_matrix(law, MOTOR, speed, inductance)
            assert motor_loop.rightmost(matrix).real > 8
            calm = motor_loop.motor_matrix(robustless, MOTOR, speed, inductance)
            assert motor_loop.rightmost(calm).real < -0.9


@pytest.mark.parametrize("speed", LAGS)
def test_motor_as_a_lag(table1, speed):
    gain, lag = axis_forms.motor_lag(MOTOR, speed)
    assert gain == pytest.approx(LAGS[speed][0], abs=0.006) and lag == pytest.approx(LAGS[speed][1], abs=6e-4)
    law = table1()
    as_lag = np.sort_complex(np.linalg.eigvals(motor_loop.lag_matrix(law, lag, gain)))
    as_motor = np.sort_complex(np.linalg.eigvals(motor_loop.motor_matrix(law, MOTOR, speed, inductance=False)))
    np.testing.assert_allclose(as_lag, as_motor, rtol=1e-8, atol=1e-8)


def test_critical_unity_gain_lags(table1):
    assert axis_forms.critical_lag(table1()) == pytest.approx(7.2e-3, rel=0.03)
    assert axis_forms.critical_lag(table1(sets=1)) == pytest.approx(3.0e-3, rel=0.03)
    third = (1 / 3) / float(table1().fuzzy.basis_norm_squared())
    assert axis_forms.critical_lag(table1(adaptation=100 * third)) == pytest.approx(9.1e-3, rel=0.03)
    assert axis_forms.critical_lag(table1(robust_gain=0.0)) == pytest.approx(45e-3, rel=0.03)
    assert axis_forms.critical_lag(table1(sets=1, robust_gain=0.0)) == pytest.approx(5e-3, rel=0.03)


def test_observer_alone_tolerates_any_lag_or_a_closed_form(table1):
    assert axis_forms.critical_observer_lag(table1()) == np.inf
    g = small_signal.gains(table1(sets=1))
    critical = axis_forms.critical_observer_lag(table1(sets=1))
    assert critical * (g.b2 - g.pole**2) == pytest.approx(g.pole)
    for factor, stable in ((0.99, True), (1.01, False)):
        lag = factor * critical
        roots = np.roots([lag, 1 + g.pole * lag, g.pole, g.b2])
        assert (roots.real.max() < 0) == stable


@pytest.mark.full
@pytest.mark.parametrize("skew", [0.0, 200.0])
def test_linear_model_is_the_jacobian_of_the_code(skew):
    """At equal weights, and at weights that drifted apart: these are damping, c = -xi'(0)^T theta."""
    speed = 20.0
    plant = hybrid_vehicle(odin(), paper_table3(), ledger=False)  # energies are never in equilibrium
    law = rcaf(plant.model(), preset="paper", sets=3)
    speeds = np.concatenate([np.zeros(4), np.full(4, speed)])
    current = MOTOR.steady_current(jnp.asarray(speeds))
    volts = MOTOR.resistance * current + MOTOR.back_emf_constant * speeds
    thrust = plant.body.accelerate(plant.thruster_matrix @ MOTOR.thrust(jnp.asarray(speeds)))
    x = plant.initial_state()._replace(thrusters=ElectromechanicalState(jnp.asarray(speeds), current))
    y = plant.output(0.0, x)
    held = -(thrust + law.model.dynamics.drift(y))  # the load that these speeds balance
    loop = ClosedLoop(plant, law, setpoint(np.zeros(6)), sinusoid(0.0, 1.0, offset=held), perfect())
    drawn = loop.realize(jax.random.PRNGKey(0))
    _, z = drawn.start()
    estimate = -(law.model.dynamics.drift(y) + law.model.dynamics.gain(y) @ volts)
    z = z._replace(weights=estimate[:, None] + skew * jnp.array([[1.0, 0.0, -1.0]]))
    drifted = drift.gain_of(law, np.asarray(z.weights))[0]
    assert drifted == pytest.approx(skew * 0.848, rel=1e-3)
    flat, restore = ravel_pytree((x, z))

    @jax.jit
    def flow(flat):
        x, z = restore(flat)
        seen = drawn.decide(jnp.zeros(()), x, z)
        moved = plant.dynamics(jnp.zeros(()), x, seen.applied, drawn.load(jnp.zeros(()), x))
        return ravel_pytree((moved, law.flow(z, seen.y, seen.r, seen.applied)))[0]

    assert np.abs(flow(flat)).max() < 1e-9, "this is an equilibrium"
    nudges = 1e-6 * np.eye(flat.size)
    found = np.linalg.eigvals(np.stack([(flow(flat + nudge) - flow(flat - nudge)) / 2e-6 for nudge in nudges], 1))
    for value in np.linalg.eigvals(motor_loop.motor_matrix(law, MOTOR, speed, drifted=drifted)):
        assert np.abs(found - value).min() < 1e-4 * max(1.0, abs(value)), (value, found)
    assert (found.real.max() > 20) == (skew == 0), "and so the simulated vehicle is unstable too"


def test_gains_between_which_a_lagged_loop_is_stable(table1):
    """Edges of the interval are where the rightmost eigenvalue changes its sign; a slow winding leaves no interval."""
    law = table1(sets=5)
    low, high = motor_loop.stable_gains(lambda c: motor_loop.lag_matrix(law, 0.05, drifted=c), 1000.0)
    assert high == 1000.0 and low == pytest.approx(453, abs=1)
    edge = [motor_loop.rightmost(motor_loop.lag_matrix(law, 0.05, drifted=low - back)).real for back in (1, 0)]
    assert edge[0] >= 0 > edge[1]
    assert motor_loop.stable_gains(lambda c: motor_loop.motor_matrix(law, MOTOR, 20.0, drifted=c), 3000.0) is None

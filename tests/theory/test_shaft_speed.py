"""Rung `shaft` tells its propeller speed: to the robust law's drive, not to Eq. (15)."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import undertow as ut
from undertow.core.contracts import Load
from undertow.physics.thrusters.paper_table3 import paper_table3
from undertow.physics.vehicles.odin import odin

pytestmark = pytest.mark.full


def plant(fidelity="shaft"):
    return ut.HybridVehicle(odin(), paper_table3(fidelity, supply=24.0))


def left_over(speed_sensor):
    """d of the robust law with propellers that turn, no load, and a drive that believes them at rest."""
    whole = plant()
    law = ut.rcaf(whole.model(speed_sensor=speed_sensor), preset="robust")
    speeds = jnp.linspace(-20.0, 30.0, whole.inputs())
    x = whole.initial_state(jnp.zeros(6), jnp.linspace(-0.3, 0.4, 6))
    x = x._replace(thrusters=x.thrusters._replace(speed=speeds))
    zero, volts = jnp.zeros(()), jnp.full(whole.inputs(), 3.0)
    y = whole.output(zero, x)
    np.testing.assert_array_equal(y.actuator.speed, speeds)
    r = ut.references.setpoint([0.0] * 6).at(zero)

    def d(z):
        acceleration = whole.acceleration(zero, x, volts, Load(jnp.zeros(6), jnp.zeros(6)))
        return law.model.coordinates.acceleration(y, acceleration) - law.known_acceleration(z, y, volts)

    return np.asarray(jax.jit(d)(law.init(y, r)))


def test_the_robust_law_knows_the_thrust_of_propellers_that_report_their_speed():
    np.testing.assert_allclose(left_over(True), 0.0, atol=1e-12)
    assert np.abs(left_over(False)).max() > 0.1  # negative control


def test_the_papers_term_is_refused():
    """Before anything is compiled, and with the way out."""
    model = plant().model(speed_sensor=True)
    with pytest.raises(ut.BadInput, match=r"speed_sensor` must be false on fidelity `shaft`.* preset: robust"):
        ut.simulate(plant(), ut.rcaf(model, preset="paper"), ut.references.setpoint([0.0] * 6), duration=0.1)


def test_where_there_is_no_speed_the_model_refuses():
    with pytest.raises(ut.BadInput, match="`speed_sensor` must be false on fidelity `static`"):
        plant("static").model(speed_sensor=True)

"""cascade with the presets of autopilots against steps of their code, written anew from ArduPilot and PX4.

Default gains: libraries/AC_AttitudeControl/AC_AttitudeControl_Sub.h and AC_PosControl.cpp, ArduSub/Parameters.h;
src/modules/uuv_att_control/ and uuv_pos_control/, parameters in the .yaml files beside the sources.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from textbook import rotation_from_euler

from undertow.control.controllers import cascade
from undertow.control.navigation import perfect
from undertow.control.references import setpoint
from undertow.core.contracts import Target
from undertow.physics.disturbances import none, sinusoid
from undertow.physics.plants import double_integrator, hybrid_vehicle
from undertow.physics.thrusters import t200
from undertow.physics.vehicles import bluerov2_heavy
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

pytestmark = pytest.mark.full

AUTHORITY = np.array([6.85, 6.60, 5.98, 119.2, 94.9, 61.4])  # m/s^2, rad/s^2 per demand of 1, BlueROV2 Heavy at 16 V
RATE = 400.0  # Hz, of ArduSub
VEHICLE = hybrid_vehicle(bluerov2_heavy(), t200("ideal", supply=16.0, dead_zone=0.0))


def attitude_of_ardusub(start, load, authority, gains, duration):
    """One axis: angle P, and AC_PID with its filters of target and derivative, at rest before; error in rad."""
    p, i, d, most, cutoff = gains
    dt, share = 1 / RATE, 1 / (1 + RATE / (2 * np.pi * cutoff))
    angle, rate, integral, target, slope, before, errors = start, 0.0, 0.0, 0.0, 0.0, None, []
    for _ in range(round(duration * RATE)):
        errors.append(-angle)
        target += share * (6.0 * -angle - target)  # ATC_ANG_*_P = 6, ATC_RAT_*_FLTT
        error = target - rate
        slope += share * ((0.0 if before is None else (error - before) / dt) - slope)  # ATC_RAT_*_FLTD
        before = error
        integral = np.clip(integral + i * error * dt, -most, most)
        given = authority * np.clip(p * error + integral + d * slope, -1, 1) + load
        angle, rate = angle + dt * rate + dt**2 / 2 * given, rate + dt * given
    return np.array(errors)


ROLL, YAW = (0.135, 0.090, 0.0036, 0.444, 30.0), (0.18, 0.018, 0.0, 0.222, 5.0)


@pytest.mark.parametrize(("axis", "gains"), [(3, ROLL), (4, ROLL), (5, YAW)])
@pytest.mark.parametrize(("start", "load"), [(0.2, 0.0), (0.0, 2.0)])
def test_attitude_of_ardusub(axis, gains, start, load):
    """An error of 0.2 rad and a constant load: the integral of the error is that of ArduSub, filters and all."""
    law = cascade(
        VEHICLE.model(), preset="ardusub", sampling_time=1 / RATE, authority=AUTHORITY, reference_frequency=0.0
    )
    law = eqx.tree_at(lambda law: law.model, law, double_integrator(6).model())
    one = np.eye(6)[axis]
    push = sinusoid(0.0, 1.0, offset=load * one) if load else none()
    loop = ClosedLoop(double_integrator(6), law, setpoint(np.zeros(6)), push, perfect())
    found = sampled.simulate(loop, duration=5.0, dt=1 / RATE, record_every=1, position=start * one)
    ours = np.asarray(found.signals["error"])[:-1, axis]
    theirs = attitude_of_ardusub(start, load, AUTHORITY[axis], gains, 5.0)
    np.testing.assert_allclose(np.abs(ours).sum(), np.abs(theirs).sum(), rtol=0.2)


def demand_of_px4(turn, place, velocity, rates):
    """Thrust and torque demanded by pose_controller_6dof and control_attitude_geo for a goal of zero, before limits."""
    into_body = turn.T
    thrust = into_body @ (1.0 * -place - 0.2 * velocity)  # UUV_GAIN_*_P, UUV_GAIN_*_D
    tilt = (turn - turn.T) / 2
    e_r = np.array([tilt[2, 1], tilt[0, 2], tilt[1, 0]])
    torque = -np.array([4.0, 4.0, 4.0]) * e_r - np.array([1.5, 2.0, 2.0]) * rates  # UUV_*_P, UUV_*_D
    return np.concatenate([thrust, torque])


@pytest.mark.parametrize("seed", range(5))
def test_demands_of_px4(seed):
    """Within 2 % at angles of up to 0.05 rad, where the sine of PX4 is the angle; both within UUV_*_SAT."""
    rng = np.random.default_rng(seed)
    model = VEHICLE.model().in_body_axes()
    law = cascade(VEHICLE.model(), preset="px4", sampling_time=1 / 250, authority=AUTHORITY, reference_frequency=0.0)
    place, angles = rng.uniform(-0.08, 0.08, 3), rng.uniform(-0.05, 0.05, 3)
    still = jnp.zeros(6)
    y = model.coordinates.measurement(jnp.asarray(np.concatenate([place, angles])), still)
    nu = np.concatenate([rng.uniform(-0.05, 0.05, 3), rng.uniform(-0.02, 0.02, 3)])
    y = model.coordinates.measurement(y.position, model.coordinates.output_velocity(y, jnp.asarray(nu)))
    turn = np.asarray(rotation_from_euler(jnp.asarray(angles)))
    off = model.coordinates.tracking_error(y, Target(still, still, still))
    found, _ = law.acceleration(law.init_law(y, Target(still, still, still)), y, off)
    most = np.repeat([0.1, 0.3], 3)
    expected = np.clip(demand_of_px4(turn, place, turn @ nu[:3], nu[3:]), -most, most)
    np.testing.assert_allclose(found / AUTHORITY, expected, rtol=0.02, atol=1e-3)

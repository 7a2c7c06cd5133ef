"""adrc, indi, disturbance_observer, l1_adaptive: numbers of their sources, and steps of public code, written anew."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.controllers import adrc, disturbance_observer, indi, l1_adaptive
from undertow.control.navigation import perfect
from undertow.control.references import setpoint, sine
from undertow.core.actuator_model import DirectActuator, LaggedActuator
from undertow.core.contracts import Load, Measurement, Target
from undertow.physics.disturbances import none, sinusoid
from undertow.physics.disturbances.loads import AbstractSmoothDisturbance
from undertow.physics.plants import double_integrator, linear_plant, two_link_arm
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

pytestmark = pytest.mark.full


def run(plant, law, reference, duration, dt, load=None, **start):
    loop = ClosedLoop(plant, law, reference, load or none(), perfect())
    found = sampled.simulate(loop, duration=duration, dt=dt, record_every=1, **start)
    assert int(found.status) == 0
    return {name: np.asarray(value) for name, value in found.signals.items()}


@pytest.mark.parametrize("settling", [1.0, 5.0])
def test_settling_time_of_adrc(settling):
    """Herbst (2013): s_CL = -6 / T_settle for a plant of second order; 2 % are reached at 0.972 T_settle.

    (1 + x) exp(-x) = 0.02 at x = 5.834.
    """
    w, dt = 6 / settling, settling / 2000
    law = adrc(double_integrator(1).model(), sampling_time=dt, bandwidth=10 * w, feedback=[w**2, 2 * w], motor="steady")
    position = run(double_integrator(1), law, setpoint([1.0]), 1.5 * settling, dt)["position"][:, 0]
    outside = np.flatnonzero(np.abs(position - 1) > 0.02)[-1]
    np.testing.assert_allclose(dt * (outside + 1), 5.834 / 6 * settling, rtol=2e-3)


# The Bebop of Smeur et al. (2016) in Paparazzi: 512 Hz, first-order actuators that move by 0.1 of the way in each step,
# a Butterworth filter of second order of 8 Hz (conf/airframes/tudelft/bebop_indi.xml).
RATE, SHARE, CUTOFF = 512.0, 0.1, 8.0


def acceleration_of_indi(effectiveness, load, steps=400):
    """Acceleration of one axis for a demanded 1 rad/s^2; the filter and the actuators are those of Paparazzi."""
    dt, tau = 1 / RATE, -1 / RATE / np.log(1 - SHARE)
    model = double_integrator(1).model()._replace(actuators=LaggedActuator(DirectActuator(1.0), tau, 1))
    law = indi(
        model,
        sampling_time=dt,
        bandwidth=2 * np.pi * CUTOFF,
        damping=np.sqrt(0.5),
        feedback=[1e-9, 1e-9],
        actuator_rate=1 / tau,
    )
    still = jnp.zeros(1)

    def step(state, _):
        velocity, force, z = state
        y, r = Measurement(still, velocity), Target(still, velocity, jnp.ones(1))
        u, _ = law.command(z, y, r)
        given = effectiveness * force + load
        return (velocity + dt * given, force + SHARE * (u - force), law.advance(z, y, r, u, jnp.asarray(dt))), given[0]

    start = (still, still, law.init(Measurement(still, still), Target(still, still, still)))
    return np.asarray(jax.jit(lambda: jax.lax.scan(step, start, None, steps)[1])())


def test_the_inner_loop_of_indi_is_the_actuator():
    """Smeur et al. (2016): from demanded to given acceleration it is A(z) = 0.1 / (z - 0.9), whatever the filter."""
    expected = 1 - (1 - SHARE) ** np.arange(400)
    np.testing.assert_allclose(acceleration_of_indi(1.0, 0.0), expected, atol=1e-12)


@pytest.mark.parametrize(("effectiveness", "load"), [(1.3, 0.0), (0.8, 0.0), (1.0, 0.5)])
def test_the_increments_of_paparazzi(effectiveness, load):
    """du = (nu - filtered acceleration) / G and u = filtered actuator state + du, as in stabilization_indi_simple.c.

    Its Butterworth filter is discretised by the bilinear transformation, undertow's by Euler's method, a step later.
    """
    pole = np.tan(np.pi * CUTOFF / RATE)
    scale = 1 + np.sqrt(2) * pole + pole**2
    gain, a1, a2 = pole**2 / scale, 2 * (pole**2 - 1) / scale, (1 - np.sqrt(2) * pole + pole**2) / scale
    inputs, outputs = np.zeros((3, 2)), np.zeros((3, 2))  # of velocity and actuator, the newest first
    velocity = force = actuator = 0.0
    theirs = []
    for _ in range(400):
        inputs, outputs = np.roll(inputs, 1, 0), np.roll(outputs, 1, 0)
        inputs[0] = velocity, actuator
        outputs[0] = gain * (inputs[0] + 2 * inputs[1] + inputs[2]) - a1 * outputs[1] - a2 * outputs[2]
        u = outputs[0, 1] + 1.0 - (outputs[0, 0] - outputs[1, 0]) * RATE
        actuator += SHARE * (u - actuator)
        theirs.append(effectiveness * force + load)
        velocity, force = velocity + theirs[-1] / RATE, force + SHARE * (u - force)
    ours, theirs = acceleration_of_indi(effectiveness, load), np.array(theirs)
    lost = lambda given: np.abs(given - 1).sum() / RATE
    np.testing.assert_allclose(lost(ours), lost(theirs), rtol=0.2)
    np.testing.assert_allclose(ours, theirs, atol=0.08)


# Friction of the first two joints, and the feedback, of the public code of Mohammadi et al. (2013), which extends the
# observer of Chen et al. (2000) to more joints: Coulomb, static and viscous friction, N m, and Stribeck's velocity.
COULOMB, STATIC, VISCOUS, STRIBECK = (np.array(p) for p in ([0.49, 0.31], [3.5, 2.8], [0.15, 0.12], [0.19, 0.15]))
K_P, K_V = 2.0, 1.5
SWING, TURN = np.array([0.5, 0.5]), np.array([1.0, 2.0])


def friction(rate, xp=np):
    """Torque against a motion, with a smooth sign."""
    near = xp.exp(-((rate / STRIBECK) ** 2))
    return xp.tanh(rate / 0.01) * (COULOMB * (1 - near) + STATIC * near) + VISCOUS * rate


class FrictionOfTheReference(AbstractSmoothDisturbance):
    """Friction at the velocity of the reference: a function of time, as loads are."""

    def at(self, realization, t, pose, load: Load) -> Load:
        return load._replace(wrench=load.wrench + friction(SWING * TURN * jnp.cos(TURN * t), jnp))


def errors_with_the_observer_in_torques(inverse_x, dt, steps):
    """Errors under tau = M (a_d + k_v e_dot + k_p e) + C v - (z + X^-1 v).

    z_dot = L (C v - tau - X^-1 v - z) with L = X^-1 M^-1.
    """
    q, v, z, errors = np.zeros(2), SWING * TURN, -inverse_x @ (SWING * TURN), []
    for k in range(steps):
        t = k * dt
        errors.append(SWING * np.sin(TURN * t) - q)
        rate = SWING * TURN * np.cos(TURN * t) - v
        coupling, h = 1.2 * np.cos(q[1] - np.pi / 6), 1.2 * np.sin(q[1] - np.pi / 6)
        mass = np.array([[3.34 + 2 * coupling, 0.97 + coupling], [0.97 + coupling, 0.97]])
        coriolis = np.array([-h * (2 * v[0] + v[1]) * v[1], h * v[0] ** 2])
        asked = -SWING * TURN**2 * np.sin(TURN * t) + K_V * rate + K_P * errors[-1]
        estimate = z + inverse_x @ v
        tau = mass @ asked + coriolis - estimate
        load = friction(SWING * TURN * np.cos(TURN * t))
        z = z + dt * inverse_x @ np.linalg.solve(mass, coriolis - tau - estimate)
        acceleration = np.linalg.solve(mass, tau - coriolis - load)
        q, v = q + dt * v + dt**2 / 2 * acceleration, v + dt * acceleration
    return np.array(errors)


def test_friction_of_two_joints_with_a_disturbance_observer():
    """Estimates of torques with X^-1 = l M(0) and of accelerations with l: errors within 20 %.

    Without an observer they are more than five times as large.
    """
    plant, dt, pole = two_link_arm(gravity=0.0), 1e-3, 16.0
    w = np.sqrt(K_P)
    reference = sine(amplitude=SWING, frequency=TURN)
    errors = []
    for bandwidth in (pole, 1e-6):
        law = disturbance_observer(
            plant.model(),
            sampling_time=dt,
            bandwidth=bandwidth,
            tracking=w,
            damping=K_V / (2 * w),
            motor="steady",
            reference_frequency=0.0,
        )
        found = run(plant, law, reference, 10.0, dt, FrictionOfTheReference(), velocity=SWING * TURN)
        errors.append(found["error"][:-1])
    inverse_x = pole * np.asarray(plant.model().dynamics.mass_matrix(jnp.zeros(2)))
    theirs = errors_with_the_observer_in_torques(inverse_x, dt, 10000)
    size = lambda error: np.sqrt((error[3000:] ** 2).mean(0))
    np.testing.assert_allclose(size(errors[0]), size(theirs), rtol=0.2)
    assert (size(errors[1]) > 5 * size(errors[0])).all()


def test_the_piecewise_constant_adaptation_of_l1quad():
    """Its predictor by Euler's method, sigma_hat = Phi^-1 mu v_tilde and its filter, for one axis of unit mass.

    A_s = -5, 35 rad/s, 5 ms and the gains 16 and 5.6 of its Python versions; a load that turns at 2 rad/s.
    """
    a_s, cutoff, dt, k_p, k_v, steps = -5.0, 35.0, 5e-3, 16.0, 5.6, 2000
    load = lambda t: 1.0 + np.sin(2 * t)
    x = v = v_hat = v_before = sigma = filtered = baseline = 0.0
    theirs = []
    for k in range(steps):
        theirs.append(-x)
        v_hat += dt * (baseline - filtered + sigma + a_s * (v_hat - v_before))
        decay = np.exp(a_s * dt)
        sigma = -(v_hat - v) / (decay - 1) * a_s * decay
        filtered += (1 - np.exp(-cutoff * dt)) * (sigma - filtered)
        baseline, v_before = -k_p * x - k_v * v, v
        given = baseline - filtered + load((k + 0.5) * dt)
        x, v = x + dt * v + dt**2 / 2 * given, v + dt * given
    law = l1_adaptive(
        double_integrator(1).model(),
        sampling_time=dt,
        predictor=-a_s,
        bandwidth=cutoff,
        tracking=np.sqrt(k_p),
        damping=k_v / 2 / np.sqrt(k_p),
        motor="steady",
        reference_frequency=0.0,
    )
    found = run(double_integrator(1), law, setpoint([0.0]), steps * dt, dt, sinusoid(1.0, 2.0, offset=1.0))
    ours, theirs = found["error"][:-1, 0], np.array(theirs)
    size = lambda error: np.sqrt((error[400:] ** 2).mean())
    np.testing.assert_allclose(size(ours), size(theirs), rtol=0.2)
    np.testing.assert_allclose(np.abs(ours).max(), np.abs(theirs).max(), rtol=0.2)


@pytest.mark.parametrize("size", [25.0, 100.0, 400.0])
def test_l1_responses_scale_with_the_step(size):
    """Cao and Hovakimyan (2006): in the transient, too, the output is that of a linear system, whatever is unknown.

    The model is a double integrator, the plant x_ddot = 3 x - 5.9 x_dot + u: a hundredth of the step from the response
    of w = 1 rad/s and zeta = 0.7, for every size of the step.
    """
    plant, dt, damping = linear_plant(gain=[[1.0]], position_term=[[3.0]], velocity_term=[[-5.9]]), 1e-3, 0.7
    law = l1_adaptive(
        plant.model(position_term=[[0.0]], velocity_term=[[0.0]]),
        sampling_time=dt,
        bandwidth=160.0,
        tracking=1.0,
        damping=damping,
        motor="steady",
        reference_frequency=0.0,
    )
    position = run(plant, law, setpoint([size]), 10.0, dt)["position"][:, 0]
    time, turn = dt * np.arange(10001), np.sqrt(1 - damping**2)
    wave = np.cos(turn * time) + damping / turn * np.sin(turn * time)
    off = np.abs(position / size - 1 + np.exp(-damping * time) * wave).max()
    np.testing.assert_allclose(off, 0.010887, rtol=1e-3)

"""Slotine and Li: the regressor against the model, passivity, the Lyapunov function, and a PID as its limit."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.controllers import pid, slotine_li
from undertow.control.controllers.slotine_li import DiagonalDynamics
from undertow.control.navigation import perfect
from undertow.control.references import setpoint, sine
from undertow.core.contracts import Measurement, Target
from undertow.core.errors import BadInput
from undertow.physics.disturbances import none, sinusoid
from undertow.physics.plants import double_integrator, hybrid_vehicle, inverted_pendulum, two_link_arm
from undertow.physics.thrusters import t200
from undertow.physics.vehicles import bluerov2_heavy, odin, remus100
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

ARM = two_link_arm(gravity=0.0)


def run(plant, law, reference, disturbance=None, duration=20.0, dt=1e-2, **start):
    loop = ClosedLoop(plant, law, reference, disturbance or none(), perfect())
    return sampled.simulate(loop, duration=duration, dt=dt, record_every=1, **start)


def vehicle(make):
    return hybrid_vehicle(make(), t200()).model().in_body_axes()


def pendulum():
    model = inverted_pendulum().model()
    return model._replace(dynamics=DiagonalDynamics(model.dynamics, 1))


MODELS = {
    "heavy": lambda: vehicle(bluerov2_heavy),
    "odin": lambda: vehicle(odin),
    "remus100": lambda: vehicle(remus100),
    "arm": lambda: two_link_arm().model(),
    "pendulum": pendulum,
}


class Regressor(NamedTuple):
    """What the parametrization of a model says at one motion."""

    nominal: Any  # acceleration that belongs to the force of the nominal parameters
    expected: Any  # the same by the model itself
    forces: Any  # of one and other parameters, and of 0.3 and 0.7 of them
    slope: Any  # of the force by the parameters


@eqx.filter_jit
def regressor_of(model, motion, parameters):
    coordinates, dynamics, (one, other) = model.coordinates, model.dynamics, parameters
    position, rate, wanted, velocity, acceleration = motion
    y = coordinates.measurement(position, rate)
    force = lambda parameters: dynamics.generalized_force(y, parameters, velocity, acceleration)
    forces = jax.vmap(force)(jnp.stack([one, other, 0.3 * one + 0.7 * other]))
    nominal = dynamics.generalized_force(y, dynamics.parametrization().nominal, coordinates.velocity(y), wanted)
    return Regressor(dynamics.accelerated_by(y, nominal), wanted - dynamics.drift(y), forces, jax.jacfwd(force)(one))


@eqx.filter_jit
def structure_of(dynamics):
    return dynamics.parametrization()


@pytest.fixture(
    scope="module",
    params=[pytest.param(name, marks=pytest.mark.full) if name == "remus100" else name for name in MODELS],
)
def regressor(request):
    """Name of a model, and what it says at a random motion."""
    model, rng = MODELS[request.param](), np.random.default_rng(1)
    n, structure = len(model.coordinates.angles), structure_of(model.dynamics)
    motion = [rng.uniform(-0.7, 0.7, n), rng.uniform(-0.7, 0.7, n), *rng.normal(size=(3, n))]
    spread = [np.asarray(structure.most) * rng.uniform(-1, 1, structure.nominal.size) for _ in range(2)]
    parameters = [np.asarray(structure.nominal) + one for one in spread]
    return request.param, regressor_of(model, *jax.tree.map(jnp.asarray, (motion, parameters)))


def test_nominal_regressor_is_the_model(regressor):
    """M^-1 Y theta = a - F at the nominal parameters and the measured velocity."""
    _, found = regressor
    np.testing.assert_allclose(found.nominal, found.expected, rtol=1e-10, atol=1e-10)


def test_force_is_affine_in_the_parameters(regressor):
    name, found = regressor
    one, other, both = found.forces
    np.testing.assert_allclose(both, 0.3 * np.asarray(one) + 0.7 * np.asarray(other), rtol=1e-9)
    assert (np.abs(found.slope).max(0) > 0).all() or name == "arm", "a parameter without effect"


def test_coriolis_matrix_of_the_arm_is_passive_for_any_parameters():
    """s^T (M_dot - 2 C) s = 0, with M_dot along the motion."""
    rng, dynamics = np.random.default_rng(3), two_link_arm().model().dynamics
    still = jnp.zeros(2)

    @jax.jit
    def powers(q, rate, s, parameters):
        force = lambda y, *motion: dynamics.generalized_force(y, parameters, *motion)
        at_rest = lambda q: s @ (force(Measurement(q, still), still, s) - force(Measurement(q, still), still, still))
        y = Measurement(q, rate)
        return jax.jvp(at_rest, (q,), (rate,))[1], 2 * s @ (force(y, s, still) - force(y, still, still))

    changed, twice = powers(*(jnp.asarray(rng.normal(size=k)) for k in (2, 2, 2, 5)))
    np.testing.assert_allclose(changed, twice, rtol=1e-10)


@pytest.mark.full
def test_coriolis_forces_of_a_vehicle_do_no_work_for_any_inertia():
    """What is left of s^T (force at s - force at 0) is drag, which does not depend on the inertia."""
    model, rng = vehicle(remus100), np.random.default_rng(4)
    dynamics, still = model.dynamics, jnp.zeros(6)
    motion, s = jnp.asarray(rng.uniform(-0.5, 0.5, (2, 6))), jnp.asarray(rng.normal(size=6))
    inertia = jnp.asarray(rng.uniform(0.5, 1.5, 6))

    @eqx.filter_jit
    def powers(dynamics, motion, s, inertia):
        y, nominal = model.coordinates.measurement(*motion), dynamics.parametrization().nominal
        force = lambda parameters, velocity: dynamics.generalized_force(y, parameters, velocity, still)
        power = lambda parameters: s @ (force(parameters, s) - force(parameters, still))
        body = dynamics.body
        drag = body.linear_damping @ s + body.quadratic_damping @ (jnp.abs(y.body.nu) * s)
        return power(nominal.at[:6].set(inertia)), power(nominal), s @ drag

    changed, nominal, drag = powers(dynamics, motion, s, inertia)
    np.testing.assert_allclose(changed, nominal, rtol=1e-10)
    np.testing.assert_allclose(nominal, drag)


@pytest.mark.full
def test_lyapunov_function_falls_as_in_the_theorem():
    """The arm of Slotine and Li (1991), section 9.2, with K_D = 100 I, l = 20 and Gamma = (0.03, 0.05, 0.1, 0.3).

    Nothing is known of the parameters at first. V = 1/2 s^T M s + 1/2 theta~^T Gamma^-1 theta~ falls by the integral of s^T K_D s.
    """
    true = ARM.model().dynamics
    wrong = ARM.model(outer_mass=0.5)
    inertia = wrong.dynamics.parametrization().inertia
    rates = jnp.array([0.03, 0.05, 0.1, 0.3, 1.0])
    law = slotine_li(
        wrong, sampling_time=1e-3, slope=20.0, gain=100.0 / inertia, adaptation_rate=rates, reference_frequency=0.0
    )
    swing = np.radians([30.0, 45.0])
    reference = sine(amplitude=swing, frequency=2 * np.pi, phase=-np.pi / 2, offset=swing)
    dt, y = 1e-3, Measurement(jnp.zeros(2), jnp.zeros(2))
    theta = true.parametrization().nominal[:4]

    def step(state, k):
        x, v, z = state
        y, r = Measurement(x, v), reference.at(k * dt)
        u, signals = law.command(z, y, r)
        s, off = signals["surface"], z.law[:4] - theta
        energy = s @ true.mass_matrix(x) @ s / 2 + (off**2 / rates[:4]).sum() / 2
        moved = lambda x, v: (v, true.drift(Measurement(x, v)) + true.gain(Measurement(x, v)) @ u)
        a1, b1 = moved(x, v)
        a2, b2 = moved(x + dt / 2 * a1, v + dt / 2 * b1)
        return (x + dt * a2, v + dt * b2, law.advance(z, y, r, u, dt)), (
            energy,
            100.0 * (s**2).sum(),
            off,
            r.position - x,
        )

    unknown = law.init(y, reference.at(jnp.zeros(())))._replace(law=jnp.zeros(5))
    start = (jnp.zeros(2), jnp.zeros(2), unknown)
    _, (energy, lost, off, error) = jax.lax.scan(step, start, jnp.arange(5000.0))
    energy, lost, error = np.asarray(energy), np.asarray(lost), np.degrees(np.asarray(error))
    fallen = energy[0] - energy
    np.testing.assert_allclose(fallen[1000::500], dt * np.cumsum(lost)[999::500][: fallen[1000::500].size], rtol=0.03)
    assert np.diff(energy).max() < 1e-3 * energy[0]
    first, last = np.abs(error[:1000]).max(0), np.abs(error[-1000:]).max(0)
    assert (last < first / 4).all(), (first, last)
    assert np.abs(off[-1]).sum() < np.abs(off[0]).sum()


@pytest.mark.full
def test_with_the_load_alone_it_is_a_pid():
    plant, slope, gain, gamma = double_integrator(1), 1.5, 2.5, 0.8
    law = slotine_li(
        plant.model(), slope=slope, gain=gain, adaptation_rate=jnp.array([0.0, 0.0, gamma]), reference_frequency=0.0
    )
    gains = [gain * slope + gamma, gamma * slope, slope + gain]
    same = pid(plant.model(), gains=gains, reference_frequency=0.0)
    load = sinusoid(0.3, 1.0, offset=0.2)
    ours, theirs = (run(plant, one, setpoint([0.0]), load, duration=10.0, dt=1e-3) for one in (law, same))
    np.testing.assert_allclose(ours.signals["error"], theirs.signals["error"], atol=2e-4)


@pytest.mark.slow
def test_vehicle_holds_its_place_under_constant_loads():
    """Without a dead zone of the thrusters; loads in world axes are found in those of the vehicle."""
    plant = hybrid_vehicle(bluerov2_heavy(), t200(dead_zone=0.0), ledger=False)
    law = slotine_li(plant.model(), sampling_time=0.02)
    load = sinusoid(0.0, 1.0, offset=[0.5, -0.3, 0.4, 1.0, 0.5, -0.5])
    found = run(plant, law, setpoint([1.0, -1.0, 0.5, 0.0, 0.0, 2.0]), load, duration=60.0, dt=0.02)
    assert int(found.status) == 0
    np.testing.assert_allclose(found.signals["error"][-1], 0.0, atol=0.01)
    surge, sway = 0.5 * np.cos(2.0) - 0.3 * np.sin(2.0), -0.5 * np.sin(2.0) - 0.3 * np.cos(2.0)
    np.testing.assert_allclose(found.signals["estimate"][-1], [surge, sway, 0.4, 1.0, 0.5, -0.5], atol=2e-3)


@pytest.mark.full
def test_parameters_wait_at_limits_and_stay_plausible():
    plant = double_integrator(1, limit=1.0)
    law = slotine_li(plant.model(), sampling_time=1e-2, slope=1.0, adaptation_rate=5.0, reference_frequency=0.0)
    y, r = Measurement(jnp.zeros(1), jnp.array([-3.0])), Target(jnp.array([5.0]), jnp.zeros(1), jnp.zeros(1))
    z = law.init(y, r)
    np.testing.assert_allclose(law.reach, 0.5)
    np.testing.assert_array_equal(law.advance(z, y, r, jnp.ones(1), 1e-2).law, z.law)
    structure = law.regressor.parametrization()
    whole = slotine_li(double_integrator(1).model(), slope=1.0, adaptation_rate=5.0, reference_frequency=0.0)
    near = z._replace(law=jnp.array([1.0, 1.0, structure.most[2] - 0.1]))
    still = Measurement(jnp.zeros(1), jnp.zeros(1))
    moved = whole.advance(near, still, r, whole.command(near, still, r)[0], 1.0)
    np.testing.assert_array_equal(moved.law - structure.nominal, [0.0, 0.0, structure.most[2]])


@pytest.mark.full
@pytest.mark.parametrize("rate", [1.0, 1e6])
def test_any_rate_of_adaptation_is_stable_when_sampled(rate):
    """The rate is slowed down to what feedback can take away in one sampling time."""
    plant = double_integrator(1)
    law = slotine_li(plant.model(), sampling_time=0.02, slope=3.0, adaptation_rate=rate, reference_frequency=0.0)
    found = run(plant, law, setpoint([0.0]), sinusoid(0.0, 1.0, offset=2.0), duration=60.0, dt=0.02)
    assert np.abs(found.signals["error"]).max() < 0.2
    np.testing.assert_allclose(found.signals["error"][-1], 0.0, atol=1e-6)


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        ({"slope": -1.0}, "slope"),
        ({"gain": 0.0}, "gain"),
        ({"adaptation_rate": -1.0}, "adaptation_rate"),
        ({"adaptation_rate": [1.0, 2.0]}, "adaptation_rate"),
    ],
)
def test_settings_that_cannot_be(wrong, name):
    with pytest.raises(BadInput, match=f"^`{name}"):
        slotine_li(double_integrator(1).model(), **wrong)

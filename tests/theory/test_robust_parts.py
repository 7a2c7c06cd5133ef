"""What preset `robust` is made of: estimator, allocation, reference filter, drives, body axes. Closed forms throughout."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import linprog

from undertow.analysis.drift import gain_bound
from undertow.control.controllers.presets.robust import robust
from undertow.control.controllers.reference_filter import ReferenceFilter
from undertow.control.controllers.robust.estimator import Estimator
from undertow.control.controllers.thruster_allocation import allocate, attained
from undertow.control.estimation.fuzzy_system import gaussian_sets
from undertow.core.contracts import Target
from undertow.core.errors import BadInput
from undertow.core.measurement import measurement_of_outputs
from undertow.core.numerics.integrators import rk4
from undertow.physics.plants import double_integrator, hybrid_vehicle
from undertow.physics.thrusters import linear_voltage, paper_table3, quadratic_voltage, t200
from undertow.physics.vehicles import bluerov2_heavy

RNG = np.random.default_rng(4)


@eqx.filter_jit
def estimator_matrix(estimator, dt):
    """Jacobian of one step on the rate and the weight of one axis with one rule."""

    def step(state):
        start = estimator.init(jnp.zeros(1))._replace(rates=state[:1], weights=state[1:, None])
        after = estimator.advance(start, estimator.estimate(start, jnp.zeros(1)), jnp.zeros(1), jnp.zeros(1), dt)
        return jnp.concatenate([after.rates, after.weights[:, 0]])

    return jax.jacfwd(step)(jnp.zeros(2))


@pytest.mark.full
@pytest.mark.parametrize("damping", [0.3, 1.0, 2.5])
@pytest.mark.parametrize("dt", [1e-4, 1e-2, 1.0])
def test_estimator_poles_are_those_of_continuous_time(damping, dt):
    """One rule: eps and d_til obey a matrix, and its eigenvalues are exp(p T)."""
    estimator = Estimator(gaussian_sets(1), bandwidth=20.0, damping=damping, bound=jnp.inf)
    matrix = np.asarray(estimator_matrix(estimator, jnp.asarray(dt)))
    poles = np.roots([1.0, 2 * damping * 20.0, 400.0])
    found = np.sort_complex(np.linalg.eigvals(matrix))
    # Two equal poles are known to the root of what each is known to.
    np.testing.assert_allclose(found, np.sort_complex(np.exp(poles * dt)), atol=1e-7)


@pytest.mark.full
def test_one_step_moves_the_estimate_by_a_given_amount_whatever_the_sets():
    moved = []
    for sets in (1, 3, 7):
        estimator = Estimator(gaussian_sets(sets), bandwidth=30.0, leakage=0.0)
        state = estimator.init(jnp.array([0.2]))
        seen = estimator.estimate(state, jnp.zeros(1))
        after = estimator.advance(state, seen, jnp.zeros(1), jnp.zeros(1), 1e-3)
        moved.append(float(estimator.fuzzy.output(after.weights, seen.basis)[0]))
    expected = -0.2 * (1 - np.exp(-0.03)) ** 2 / 1e-3
    np.testing.assert_allclose(moved, expected, rtol=1e-9)


def test_the_estimate_stays_in_its_box():
    estimator = Estimator(gaussian_sets(5), bandwidth=50.0, bound=3.0)

    def step(state, _):  # a body that stands still under 10 m/s^2: d = -10, more than the box holds
        seen = estimator.estimate(state, jnp.zeros(1))
        return estimator.advance(state, seen, jnp.full(1, 10.0), jnp.zeros(1), 1e-2), seen.uncertainty[0]

    found = jax.jit(lambda: jax.lax.scan(step, estimator.init(jnp.zeros(1)), None, length=200)[1])()
    assert (np.abs(found) <= 3.0 * (1 + 1e-15)).all()
    assert float(found[-1]) == pytest.approx(-3.0)


def test_letters_of_table_1_mean_the_same_estimator():
    """Section 3.3: five sets, c = sigma/2: w_o = 142.3 rad/s and damping 0.528 at reach 1 (spacing = width)."""
    model = double_integrator(1).model()
    law = robust(model, pole=150.2, adaptation=100.0, composite=500.0)
    np.testing.assert_allclose(law.estimator.bandwidth, 142.3, rtol=1e-3)
    np.testing.assert_allclose(law.estimator.damping, 0.528, rtol=1e-3)
    np.testing.assert_allclose(law.tracking_share, 1 / 500.0)


@pytest.mark.parametrize("bandwidth", [5.0, 20.0, 150.0])
def test_weights_in_their_box_add_little_damping(bandwidth):
    """Section 3.8: c <= theta_max sum |xi'| is at most a tenth of 2 zeta w_o with the sets as they come."""
    law = robust(double_integrator(1).model(), bandwidth=bandwidth)
    assert gain_bound(law) == pytest.approx(0.1 * 2 * bandwidth, rel=1e-9)
    narrow = robust(double_integrator(1).model(), bandwidth=bandwidth, reach=(1.0,))
    assert gain_bound(narrow) > 90
    assert float(law.estimator.fuzzy.basis_norm_squared()) == pytest.approx(
        float(narrow.estimator.fuzzy.basis_norm_squared())
    )


@pytest.mark.parametrize(
    "wrong, name",
    [
        ({"pole": 10.0}, "adaptation"),
        ({"pole": 10.0, "adaptation": 1.0, "composite": 0.0}, "composite"),
        ({"pole": 10.0, "adaptation": 1.0, "composite": 1.0, "bandwidth": 3.0}, "bandwidth"),
        ({"feedback": (1.0, 2.0), "tracking": 1.0}, "tracking"),
        ({"bandwidth": -1.0}, "bandwidth"),
        ({"sampling_time": 0.0}, "sampling_time"),
        ({"damping": 0.0}, "damping"),
    ],
)
def test_settings_that_contradict_each_other(wrong, name):
    with pytest.raises(BadInput, match=name):
        robust(double_integrator(1).model(), **wrong)


# Allocation.

EFFECT = np.asarray(hybrid_vehicle(bluerov2_heavy(), t200()).model().in_body_axes().dynamics.gain(None))
FULL = np.full(8, 30.0)


solve = jax.jit(allocate)


def demands(size):
    for _ in range(30):
        yield np.linalg.pinv(EFFECT) @ (size * RNG.normal(size=6) * [1, 1, 1, 3, 3, 3])


def test_what_fits_is_taken_as_it_is():
    for forces in demands(0.3):
        np.testing.assert_array_equal(solve(EFFECT, forces, -FULL, FULL, 1.0), forces)


def test_limits_hold_and_the_share_is_the_largest_in_that_direction():
    """Against linear programming: max s with effect f = s effect f_wanted within the limits."""
    for forces in demands(8.0):
        given = np.asarray(solve(EFFECT, forces, -FULL, FULL, 1e6))
        assert (np.abs(given) <= FULL).all()
        best = linprog(
            np.r_[np.zeros(8), -1.0],
            A_eq=np.c_[EFFECT, -EFFECT @ forces],
            b_eq=np.zeros(6),
            bounds=[(-30.0, 30.0)] * 8 + [(0.0, 1.0)],
        )
        share = float(attained(EFFECT, forces, given))
        assert abs(share + best.fun) < 1e-4
        aside = EFFECT @ given - share * EFFECT @ forces
        assert np.linalg.norm(aside) < 1e-3 * np.linalg.norm(EFFECT @ forces)


@pytest.mark.full
def test_giving_up_the_direction_gives_more():
    for forces in demands(8.0):
        loss = [np.linalg.norm(EFFECT @ (solve(EFFECT, forces, -FULL, FULL, w) - forces)) for w in (1e6, 1.0)]
        # Eight forces at their limits cost 8e-6 of the square of what is wanted.
        assert loss[1] <= loss[0] + np.sqrt(8e-6) * np.linalg.norm(EFFECT @ forces)


def test_one_sided_limits():
    """Two coils that can only pull: what one cannot give the other does not."""
    effect = np.array([[-1.0, 1.0]])
    given = allocate(effect, np.array([-2.0, 2.0]), np.array([0.1, 0.1]), np.array([5.0, 3.0]), 1.0)
    assert float(given[0]) == 0.1 and float(given[1]) == 3.0


# Reference filter.


def followed(chosen, at, start, dt, steps, share=1.0):
    """Filtered reference at every step."""
    coordinates = double_integrator(1).model().coordinates
    targets = jax.tree.map(lambda *values: np.stack(values), *(at(k * dt) for k in range(steps)))
    return np.asarray(_followed(chosen, targets, jnp.asarray([start]), coordinates, share, dt))


@eqx.filter_jit
def _followed(chosen, targets, start, coordinates, share, dt):
    def step(state, target):
        smoothed = jnp.concatenate(chosen.smoothed(state, target, coordinates))
        return chosen.advance(state, target, coordinates, share, dt), smoothed

    return jax.lax.scan(step, chosen.init(start), targets)[1]


def polynomial(*coefficients):
    """A reference a + b t + c t^2 + ..., with its derivatives."""
    p = np.polynomial.Polynomial(coefficients)
    return lambda t: Target(*(np.asarray([float(p.deriv(k)(t) if k else p(t))]) for k in range(3)))


def test_a_jump_dies_out_like_three_equal_poles():
    w, dt = 1.7, 0.05
    generator = np.array([[0, 1, 0], [0, 0, 1], [-(w**3), -3 * w**2, -3 * w]])
    found = followed(ReferenceFilter(w), polynomial(1.0), 0.4, dt, 60)
    expected = [expm(generator * dt * k) @ [-0.6, 0, 0] + [1.0, 0, 0] for k in range(60)]
    np.testing.assert_allclose(found, expected, atol=1e-12)


@pytest.mark.full
def test_a_smooth_reference_passes_as_it_is():
    """A cubic from rest: all that is known of it at a step leads to the next without error."""
    at = polynomial(0.3, 0.0, 1.0, 2.0)
    found = followed(ReferenceFilter(2.0), at, 0.3, 0.02, 100)
    np.testing.assert_allclose(found, [np.ravel(at(0.02 * k)) for k in range(100)], atol=1e-11)


@pytest.mark.full
def test_what_is_left_of_a_sinusoid_falls_with_the_square_of_the_sampling_time():
    """Once the start from rest has died out."""
    sine = lambda t: Target(*np.asarray([[np.sin(3 * t)], [3 * np.cos(3 * t)], [-9 * np.sin(3 * t)]]))
    left = []
    for dt in (0.02, 0.01):
        found = followed(ReferenceFilter(4.0), sine, 0.0, dt, round(8.0 / dt))
        late = [np.ravel(sine(dt * k)) for k in range(len(found))]
        left.append(np.abs(found - late)[len(found) // 2 :, 0].max())
    assert left[0] < 2e-3
    assert 3.5 < left[0] / left[1] < 4.5


@pytest.mark.full
def test_the_filter_waits_while_nothing_can_be_given():
    found = followed(ReferenceFilter(2.0), polynomial(1.0), 0.2, 0.1, 5, share=0.0)
    np.testing.assert_allclose(found, np.tile([0.2, 0.0, 0.0], (5, 1)), atol=1e-15)


# Drives.

THRUSTERS = {
    "ideal": paper_table3("ideal", supply=24.0),
    "static": paper_table3("static", supply=24.0),
    "shaft": t200("shaft"),
    "electromechanical": paper_table3("electromechanical", supply=24.0),
    "linear": linear_voltage(supply=24.0),
    "quadratic": quadratic_voltage(supply=24.0),
}


@pytest.mark.parametrize("name", THRUSTERS)
def test_a_drive_aims_where_it_was_told_to(name):
    drive = THRUSTERS[name].actuator_model(4, False)
    state = jax.tree.map(lambda leaf: jnp.asarray([20.0, -30.0, 5.0, 0.5]), drive.init())
    wanted = jnp.asarray([9.0, -7.0, 15.0, -4.0])
    volts = drive.command(state, wanted, 40.0)
    assert (jnp.abs(volts) > THRUSTERS[name].dead_zone).all()
    np.testing.assert_allclose(drive.target_of(state, volts, 40.0), wanted, rtol=1e-9)


@pytest.mark.parametrize("name", THRUSTERS)
def test_the_range_of_a_drive_is_where_the_supply_ends(name):
    """Without inductance, which the range leaves to the current loop."""
    thruster = THRUSTERS[name]
    if name == "electromechanical":
        thruster = paper_table3("shaft", supply=24.0)
    drive = thruster.actuator_model(4, False)
    state = jax.tree.map(lambda leaf: jnp.asarray([20.0, -30.0, 5.0, 0.0]), drive.init())
    if name in ("shaft", "electromechanical"):
        resting = thruster.motor.steady_current(state.speed)
        state = state._replace(current=resting)
    for limit, volts in zip(drive.range(state, 10.0), (-1.0, 1.0), strict=True):
        found = drive.command(state, limit, 10.0)
        boost = 0.0 if name not in ("shaft", "electromechanical") else float(drive._boost(10.0))
        assert boost == 0.0
        np.testing.assert_allclose(found, volts * float(thruster.supply), rtol=1e-9)


@pytest.mark.full
@pytest.mark.parametrize("make", [t200, paper_table3])
def test_a_predicted_motor_turns_as_the_true_one(make):
    """Against the electromechanical fidelity with steps 200 times smaller, over one second of changing voltage."""
    thruster = make("electromechanical")
    drive, dt, fine = thruster.actuator_model(1, False), 5e-3, 200
    belief, truth = drive.init(), thruster.initial_state(1)

    @jax.jit
    def both(belief, truth, volts):
        step = lambda _, s: rk4(lambda t, y: thruster.dynamics(y, volts), 0.0, s, dt / fine)
        return drive.advance(belief, volts, dt), jax.lax.fori_loop(0, fine, step, truth)

    apart = []
    for k in range(200):
        belief, truth = both(belief, truth, jnp.asarray([8.0 * np.sin(0.05 * k) + 3.0]))
        apart.append(float(jnp.abs(belief.speed - truth.speed)[0]))
    assert max(apart) < 0.03 * float(thruster.motor.steady_speed(11.0))


# Body axes.


def motion(t):
    """A smooth way through all six outputs, and its first three derivatives."""
    swing = lambda size, speed, phase: [size * speed**k * np.sin(speed * t + (phase + k) * np.pi / 2) for k in range(4)]
    ways = [
        swing(1.0, 1.0, 0),
        [0.5 * t**2, t, 1.0, 0.0],
        swing(1.0, 2.0, 1),
        swing(0.8, 1.0, 0),
        swing(0.9, 1.3, 1),
        [3 * t, 3.0, 0.0, 0.0],
    ]
    return np.transpose(ways)


@pytest.fixture(scope="module")
def body():
    return hybrid_vehicle(bluerov2_heavy(), t200()).model().in_body_axes()


@pytest.fixture(scope="module")
def ways(body):
    """What the coordinates say on the way, and derivatives along it: one program for all times."""
    coordinates, times = body.coordinates, (0.1, 0.7, 1.9)

    def rates(eta, rate, goal):
        y = measurement_of_outputs(eta, rate)
        velocity = coordinates.velocity(y)
        return velocity, coordinates.tracking_error(y, goal).rate + velocity

    def kinematics(case):
        way, ahead = case
        eta, rate, bend, _ = way
        y, goal = measurement_of_outputs(eta, rate), Target(*ahead[:3])
        slope, wanted_slope = jax.jvp(rates, (eta, rate, goal), (rate, bend, Target(*ahead[1:])))[1]
        return {
            "acceleration": coordinates.acceleration(y, bend),
            "slope": slope,
            "wanted": coordinates.tracking_error(y, goal).acceleration,
            "wanted slope": wanted_slope,
            "on target": coordinates.tracking_error(y, Target(eta, rate, bend)),
        }

    ahead = [motion(0.5 * t + 1.0) * 0.5 ** np.arange(4.0)[:, None] for t in times]
    cases = np.stack([motion(t) for t in times]), np.stack(ahead)
    found = jax.jit(lambda cases: jax.lax.map(kinematics, cases))(cases)
    return {t: jax.tree.map(lambda leaf, place=place: np.asarray(leaf)[place], found) for place, t in enumerate(times)}


@pytest.mark.parametrize("t", [0.1, 0.7, 1.9])
def test_rates_and_their_derivative(ways, t):
    np.testing.assert_allclose(ways[t]["acceleration"], ways[t]["slope"], atol=1e-10)


@pytest.mark.parametrize("t", [0.1, 0.7, 1.9])
def test_wanted_rates_and_their_derivative_seen_from_a_turning_vehicle(ways, t):
    """Both move: the target half as fast, along the same way."""
    np.testing.assert_allclose(ways[t]["wanted"], ways[t]["wanted slope"], atol=1e-9)


def test_on_target_nothing_is_wanted_but_its_own_motion(ways):
    error, rate, acceleration = ways[0.7]["on target"]
    np.testing.assert_allclose(error, 0, atol=1e-15)
    np.testing.assert_allclose(rate, 0, atol=1e-12)
    np.testing.assert_allclose(acceleration, ways[0.7]["acceleration"], atol=1e-11)


def test_attitude_errors_go_the_short_way(body):
    """I32: full turns do not matter, and 200 degrees to the right are 160 to the left."""
    still = jnp.zeros(6)
    target = lambda yaw: Target(still.at[5].set(yaw), still, still)
    error_at = lambda yaw: body.coordinates.tracking_error(measurement_of_outputs(still, still), target(yaw)).error
    error = jax.jit(error_at)
    for yaw in RNG.uniform(-3, 3, 20):
        once, more = error(yaw), error(yaw + 2 * np.pi)
        np.testing.assert_allclose(once, more, atol=1e-12)
        np.testing.assert_allclose(once[5], 2 * np.sin(yaw / 2), atol=1e-12)
    assert float(error(np.radians(200))[5]) < 0

"""From a demand to inputs within limits and back, and the laws that are no equations of their own: NMPC, policies, logs."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import solve_discrete_are
from scipy.optimize import lsq_linear
from two_axes import DRIFT, DT, F, G, H, V, X, Y

from undertow.control.controllers import nmpc, pid, policy, rcaf, replay
from undertow.control.controllers.actuation import ActuatedState, ActuationResult
from undertow.control.controllers.bandwidths import axes_of
from undertow.control.controllers.decentralised import decentralised
from undertow.control.controllers.law_signals import share_given
from undertow.control.controllers.options import DesignConditions
from undertow.control.controllers.reference_filter import FilterState
from undertow.core.actuator_model import LaggedActuator
from undertow.core.composite_model import composite_model
from undertow.core.contracts import Measurement, Target, TrackingError
from undertow.core.errors import BadInput
from undertow.physics.plants import double_integrator, linear_plant

TAU, LIMIT = 0.3, 1.5
MODEL = linear_plant(G, F, H, limit=LIMIT).model()
LAGGED = MODEL._replace(actuators=LaggedActuator(MODEL.actuators, TAU, 2))
GOAL = Target(np.array([1.4, -0.5]), np.array([0.2, -0.1]), np.array([0.1, -0.4]))
OWN, FORCE, APPLIED = np.array([0.3, -0.8]), np.array([0.5, 0.4]), np.array([1.5, -0.6])
K_P, K_I, K_D, RATE = 4.0, 1.5, 2.0, 7.0


def allocated(forces, limits, direction):
    """Exact minimum of the loss of direction, of size and, slightly, of the forces: bounded least squares."""
    desired = G @ forces
    size, unit = np.linalg.norm(desired), np.abs(limits).max(0)
    rows = [
        np.c_[np.sqrt(direction) * G / size, -np.sqrt(direction) * desired[:, None] / size],
        [[0.0, 0.0, 1.0]],
        np.c_[1e-3 * np.diag(1 / unit), np.zeros(2)],
    ]
    low, high = (np.append(one, share) for one, share in zip(limits, (0.0, 1.0), strict=True))
    return lsq_linear(np.vstack(rows), np.array([0.0, 0.0, 1.0, 0.0, 0.0]), bounds=(low, high), tol=1e-15).x[:2]


PATHS = {
    "steady": {"motor": "steady", "direction": 3.0},
    "without feedforward": {"motor": "steady", "feedforward": False},
    "computed": {"motor": "computed", "direction": 0.5},
}


@pytest.fixture(scope="module")
def paths():
    """Laws with their states, and what they command, learn and know: one program for all."""
    offset, expected = Target(*np.array([[0.3, -0.2], [0.1, 0.4], [-0.3, 0.2]])), GOAL
    laws = {
        name: pid(
            LAGGED, sampling_time=DT, gains=(K_P, K_I, K_D), actuator_rate=RATE, reference_frequency=1.5, **choices
        )
        for name, choices in PATHS.items()
    }
    states = {
        name: ActuatedState(OWN, FORCE if name == "computed" else (), FilterState(offset, expected, np.array(0.03)))
        for name in laws
    }

    def one(name, law, z):
        target = law.actuation.filter.smoothed(z.filter, GOAL, MODEL.coordinates)
        u, signals = law.command(z, Y, GOAL)
        after = law.advance(z, Y, GOAL, jnp.asarray(APPLIED), jnp.asarray(DT))
        moved = law.actuation.filter.advance(z.filter, GOAL, MODEL.coordinates, jnp.ones(()), jnp.asarray(DT))
        free = law.advance(z, Y, GOAL, 3 * u, jnp.asarray(DT)).filter if name == "steady" else None
        return target, u, signals, after, law.known_acceleration(z, Y, jnp.asarray(APPLIED)), moved, free

    step = eqx.filter_jit(lambda states: {name: one(name, law, states[name]) for name, law in laws.items()})
    return jax.tree.map(np.asarray, step(jax.tree.map(jnp.asarray, states)))


@pytest.mark.full
@pytest.mark.parametrize("name", PATHS)
def test_a_demand_beyond_the_limits(paths, name):
    """Forces by the inverse of the model, allocated; what limits took away returns to the integral."""
    target, u, signals, after, known, moved, free = paths[name]
    e, r = target.position - X, target.velocity - V
    demand = target.acceleration + K_P * e + K_D * r + OWN
    # Compensated at the velocity of the target, known at the measured one.
    drift, compensated = (0 * DRIFT, 0 * DRIFT) if "without" in name else (DRIFT, F @ X + H @ target.velocity)
    forces = np.linalg.solve(G, demand - compensated)
    limits, lead = np.array([[-LIMIT, -LIMIT], [LIMIT, LIMIT]]), TAU * RATE
    if name == "computed":
        limits = FORCE + (limits - FORCE) / lead
    assert (np.abs(forces) > limits[1]).any()
    given = allocated(forces, limits, PATHS[name].get("direction", 1.0))
    towards, acting = APPLIED, APPLIED
    expected = given
    if name == "computed":
        expected, towards, acting = FORCE + lead * (given - FORCE), FORCE + (APPLIED - FORCE) / lead, FORCE
        np.testing.assert_allclose(after.actuators, APPLIED + (FORCE - APPLIED) * np.exp(-DT / TAU), rtol=1e-12)
    np.testing.assert_allclose(u, expected, rtol=1e-6)
    desired = G @ forces
    share = lambda given: np.clip(desired @ (G @ given) / (desired @ desired), 0, 1)
    np.testing.assert_allclose(signals["attained_share"], share(given), rtol=1e-6)
    np.testing.assert_allclose(known, drift + G @ acting, rtol=1e-12)
    missing = G @ (towards - forces)
    np.testing.assert_allclose(after.law, OWN + DT * (K_I * e + np.sqrt(K_I / K_D) * missing), rtol=1e-11)
    # The filter waits while the input gives a part: after no time it is where it was, and goes on where all is given.
    slow = np.linalg.norm(after.filter.offset.position - (target.position - GOAL.position))
    assert slow < np.linalg.norm(moved.offset.position - (target.position - GOAL.position))
    if name == "steady":
        np.testing.assert_allclose(free.offset.position, moved.offset.position, rtol=1e-12)


def test_no_demand_is_attained_in_full():
    share = jax.jit(jax.vmap(share_given))
    nothing, opposite, part = share(
        np.array([[0.0, 0.0], [1, 1], [1, 1]]), np.array([[1.0, 1.0], [-1, -1], [0.7, -0.3]])
    )
    assert (nothing, opposite) == (1.0, 0.0)
    np.testing.assert_allclose(part, 0.2)


def test_data_of_the_axes_of_a_model():
    first, second = axes_of(LAGGED, DesignConditions(DT, [0.01, 0.02], 2.0, 0.1))
    assert (first.sampling_time, first.lag, first.max_bandwidth, first.delay) == (DT, TAU, 0.35 / DT, 0.1)
    assert (first.velocity_noise, second.velocity_noise, first.load_rate) == (0.01, 0.02, 2.0)
    np.testing.assert_allclose((first.authority, second.authority), np.abs(G).sum(1) * LIMIT)
    assert first.response_time == DT + 0.1 + TAU
    slow = axes_of(LAGGED, DesignConditions(2.0, load_rate=1.0))[0]
    np.testing.assert_allclose(slow.max_bandwidth, 1 / TAU)


# Model predictive control.

W, POLE = np.array([2.0, 1.5]), np.array([3.0, 5.0])
E, R, A = np.array([0.05, -0.03]), np.array([-0.02, 0.06]), np.array([0.1, -0.2])


def regulator_of_scipy(w, h):
    a, b = np.array([[1.0, h], [0.0, 1.0]]), np.array([[h**2 / 2], [h]])
    p = solve_discrete_are(a, b, np.diag([w**4, 2 * w**2]) * h, h * np.eye(1))
    return np.linalg.solve(h * np.eye(1) + b.T @ p @ b, b.T @ p @ a)[0]


@pytest.mark.full
def test_one_step_of_nmpc():
    """A plan in use, none yet, and one that is not finite; far from limits the new plan is that of the regulator."""
    model = linear_plant(G, limit=40.0).model()
    law = nmpc(
        model, sampling_time=DT, bandwidth=POLE, tracking=W, horizon=0.4, steps=4, iterations=2, reference_frequency=0.0
    )
    begun = law.init_law(Y, GOAL)
    plan = begun.plan._replace(
        forces=np.array([[0.4, -0.2], [0.3, 0.1], [0.2, 0.0], [39.0, 0.1]]),
        start=np.array([0.04, -0.02, 0.01, 0.03]),
        gain=np.array([[2.0, 0.3, 1.0, -0.5], [-0.4, 3.0, 0.2, 1.5]]),
    )
    held = begun._replace(
        plan=plan, acceleration=np.array([0.15, -0.1]), predicted=np.array([0.35, -0.6]),
        estimate=np.array([0.2, -0.3]), elapsed=np.array(DT),
    )  # fmt: skip
    beyond = held._replace(plan=plan._replace(forces=plan.forces + [[50.0, 0.0]]))
    broken = held._replace(plan=plan._replace(forces=np.full((4, 2), np.nan)))
    off, known = TrackingError(E, R, A), np.array([0.7, -1.1])
    given = ActuationResult(jnp.asarray(known), jnp.zeros(2), jnp.ones(()))

    def step(z):
        return law.acceleration(z, Y, off)[0], law.update(z, Y, off, given, jnp.asarray(DT))

    states = begun, held, beyond, broken
    stacked = jax.tree.map(lambda *each: np.stack(each), *states)
    demand, after = jax.jit(lambda states: jax.lax.map(step, states))(stacked)
    gains = np.array([regulator_of_scipy(w, 0.1) for w in W])
    estimate = held.estimate + (1 - np.exp(-POLE * DT)) / DT * (V - held.predicted)
    alone = lambda estimate: A + gains[:, 0] * E + gains[:, 1] * R - estimate
    new = (A - held.acceleration) - (estimate - held.estimate)
    planned = lambda forces: G @ np.minimum(forces, 40.0) + new
    moved = plan.gain @ (np.concatenate([E, R]) - plan.start)
    expected = (
        alone(0 * V),
        planned(plan.forces[0] + moved),
        planned(plan.forces[0] + [50.0, 0] + moved),
        alone(estimate),
    )
    np.testing.assert_allclose(demand, expected, rtol=1e-9)
    for place, d_hat in enumerate((0 * V, estimate, estimate, estimate)):
        np.testing.assert_allclose(after.estimate[place], d_hat, rtol=1e-12)
        np.testing.assert_allclose(after.predicted[place], V + DT * (known + d_hat), rtol=1e-12)
        np.testing.assert_allclose(G @ after.plan.forces[place][0], alone(d_hat), rtol=1e-6, atol=1e-6)
    np.testing.assert_array_equal(after.acceleration, np.tile(A, (4, 1)))
    np.testing.assert_array_equal(after.elapsed, DT)
    np.testing.assert_array_equal(after.plan.start, np.tile(np.concatenate([E, R]), (4, 1)))


def test_motion_that_nmpc_predicts():
    """The target goes on with its acceleration; the error is what the optimisation says."""
    law = nmpc(MODEL, sampling_time=DT, bandwidth=POLE, tracking=W)
    d_hat, off, t = np.array([0.2, -0.3]), TrackingError(E, R, A), 0.3
    error, rate = np.array([0.4, -0.1]), np.array([0.3, 0.2])
    bend, by_force = law._motion(Y, off, jnp.asarray(d_hat))(jnp.asarray(t), jnp.concatenate([error, rate]))
    position = X + E + t * (V + R) + t**2 / 2 * A - error
    velocity = V + R + t * A - rate
    np.testing.assert_allclose(bend, A - F @ position - H @ velocity - d_hat, rtol=1e-12)
    np.testing.assert_array_equal(by_force, -G)
    horizon = law._horizon(Y)
    np.testing.assert_allclose(horizon.step, 0.1)
    np.testing.assert_allclose((horizon.position, horizon.rate), (W**4, 2 * W**2))
    np.testing.assert_allclose((horizon.low, horizon.high), ([-LIMIT] * 2, [LIMIT] * 2))
    endless = nmpc(linear_plant(G).model(), sampling_time=DT, bandwidth=POLE, tracking=W)._horizon(Y)
    np.testing.assert_array_equal(endless.high, 1e6)


# Policies, logs and laws side by side.


def layers(path, **changed):
    chance = np.random.default_rng(8)
    arrays = {
        "weight_0": chance.normal(size=(3, 6)), "bias_0": chance.normal(size=3),
        "weight_1": chance.normal(size=(2, 3)), "bias_1": chance.normal(size=2),
    }  # fmt: skip
    np.savez(path, **(arrays | changed))
    return arrays


def test_a_network_acts_on_the_errors_and_its_last_action(tmp_path):
    """Within 100 m and 20 m/s; an action of 1 is the limit of the input, or `scale`."""
    arrays = layers(tmp_path / "net.npz")
    goal = Target(np.array([200.0, -0.5]), np.array([0.2, -30.0]), np.zeros(2))
    before = np.array([0.3, -0.9])
    seen = np.concatenate([[100.0, goal.position[1] - X[1]], [goal.velocity[0] - V[0], -20.0], before])
    hidden = np.tanh(arrays["weight_0"] @ seen + arrays["bias_0"])
    action = np.clip(arrays["weight_1"] @ hidden + arrays["bias_1"], -1, 1)
    make = lambda **choices: policy(MODEL, str(tmp_path / "net.npz"), **choices)
    limited, scaled, direct = make(scale=None), make(scale=4.0), make(action="input", scale=0.6)

    @jax.jit
    def evaluate(before):
        commands = [law.command(before, Y, goal) for law in (limited, scaled, direct)]
        return commands, scaled.advance(before, Y, goal, commands[1][0], DT)

    (*by_action, (u, _)), after = evaluate(before)
    for (given, signals), size in zip(by_action, (LIMIT, 4.0), strict=True):
        np.testing.assert_allclose(signals["action"], action, rtol=1e-12)
        np.testing.assert_allclose(given, size * action, rtol=1e-12)
    np.testing.assert_allclose(after, action)
    np.testing.assert_array_equal(scaled.init(Y, goal), [0.0, 0.0])
    np.testing.assert_allclose(u, np.clip(arrays["weight_1"] @ hidden + arrays["bias_1"], -0.6, 0.6))
    np.testing.assert_array_equal(direct.interface.action_bounds(), [[-0.6, -0.6], [0.6, 0.6]])


@pytest.mark.parametrize(
    "changed",
    [
        {"weight_0": np.ones((3, 5))},
        {"weight_1": np.ones((3, 3)), "bias_1": np.ones(3)},
        {"bias_0": np.ones(2)},
        {"bias_1": np.full(2, np.nan)},
        {"weight_2": np.ones((2, 2))},
        {"weight_1": np.array([["a", "b", "c"]] * 2)},
    ],
)
def test_networks_that_do_not_fit(tmp_path, changed):
    layers(tmp_path / "net.npz", **changed)
    with pytest.raises(BadInput, match=r"^`function"):
        policy(MODEL, str(tmp_path / "net.npz"))


def test_samples_of_a_log_are_held_or_joined():
    """A sample counts early by 1 % of the usual interval; sums of times are Kahan's."""
    rows = np.array([[0.0, 1.0, -1.0], [0.1, 2.0, 3.0], [0.2, 0.0, 5.0], [0.4, 4.0, 1.0]])
    held, joined = replay(MODEL, rows), replay(MODEL, rows, interpolation="linear")
    start = held.init(Y, GOAL)
    commands = jax.jit(jax.vmap(lambda t: [law.command(start._replace(time=t), Y, GOAL)[0] for law in (held, joined)]))
    times = np.array([-0.1, 0.0, 0.0985, 0.0995, 0.15, 0.3, 0.9])
    steps, lines = commands(times)
    np.testing.assert_array_equal(steps, rows[[0, 0, 0, 1, 1, 2, 3], 1:])
    expected = [np.interp(times, rows[:, 0], column) for column in rows[:, 1:].T]
    np.testing.assert_allclose(lines, np.transpose(expected), atol=1e-12)
    step = jax.jit(lambda z: jax.lax.fori_loop(0, 100_000, lambda _, z: held.advance(z, Y, GOAL, rows[0, 1:], 0.1), z))
    assert float(step(start).time) == 10_000.0
    for wrong in (rows[:1], rows[:, :2], rows[::-1], np.where(rows == 5, np.nan, rows)):
        with pytest.raises(BadInput, match=r"^`commands"):
            replay(MODEL, wrong)
    with pytest.raises(BadInput, match=r"^`commands` must have increasing times, but is row 3 too early"):
        replay(MODEL, rows[[0, 2, 1, 3]])


def test_laws_side_by_side_see_their_own_outputs():
    """Inputs and signals of two laws of one and two axes; the numbers of both become one."""
    parts = double_integrator(1).model(), MODEL
    model = composite_model(parts, (1, 2))
    alone = tuple(rcaf(part, preset="paper", weights_bound=0.5) for part in parts)
    both = decentralised(model, alone)
    y, goal = Measurement(np.append(0.5, X), np.append(-0.1, V)), Target(*(np.append(1.0, one) for one in GOAL))
    places = slice(0, 1), slice(1, 3)

    @jax.jit
    def step(weights):
        z = tuple(one._replace(weights=weight) for one, weight in zip(both.init(y, goal), weights, strict=True))
        u, signals = both.command(z, y, goal)
        own = [(Measurement(y.position[k], y.velocity[k]), Target(*(one[k] for one in goal))) for k in places]
        each = [law.command(one, *seen) for law, one, seen in zip(alone, z, own, strict=True)]
        after, given = (
            both.advance(z, y, goal, jnp.arange(3.0), jnp.asarray(DT)),
            both.known_acceleration(z, y, jnp.arange(3.0)),
        )
        later = [law.advance(one, *seen, u, jnp.asarray(DT)) for law, one, seen, u in zip(
            alone, z, own, (jnp.zeros(1), jnp.arange(1.0, 3.0)), strict=True)]  # fmt: skip
        return u, signals, each, after, later, given

    u, signals, each, after, later, known = step(
        [jnp.array([[0.5, 0.1, 0.2, -0.2, 0.0]]), jnp.array([[0.1] * 5, [0.3, 0.5, -0.5, 0.0, 0.2]])]
    )
    np.testing.assert_array_equal(u, np.concatenate([one for one, _ in each]))
    values = lambda name: [np.asarray(signals[name]) for _, signals in each]
    for name, joined in {
        "estimate": np.concatenate, "weights": np.concatenate, "attained_share": np.min, "weights_at_bound": np.mean,
        "lyapunov_tracking": np.sum, "lyapunov_decay": np.sum, "weights_peak": np.max, "weights_spread": np.max,
    }.items():  # fmt: skip
        np.testing.assert_allclose(signals[name], joined(values(name)), err_msg=name)
    for leaf, value in zip(jax.tree.leaves(after), jax.tree.leaves(later), strict=True):
        np.testing.assert_array_equal(leaf, value)
    np.testing.assert_allclose(known, np.concatenate([[0.0], DRIFT + G @ [1.0, 2.0]]))
    assert len(decentralised(model).laws) == 2
    with pytest.raises(BadInput, match=r"^`law"):
        decentralised(model, alone[:1])

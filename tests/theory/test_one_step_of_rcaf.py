"""One step of the paper's law, of the robust one and of its filter of jumps, against their equations written out in NumPy.

On two coupled axes with drift, so that neither F nor G may be left out; everything is traced into few programs.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm, solve_continuous_lyapunov
from two_axes import DRIFT, DT, GAINS, GOAL, THETA, A, E, F, G, H, R, V, X, Y, same

from undertow.control.controllers import rcaf
from undertow.control.controllers.composite_law import RCAFState, projected_rate
from undertow.control.controllers.reference_filter import FilterState, ReferenceFilter, Room
from undertow.control.controllers.robust.estimator import EstimatorState
from undertow.control.controllers.robust.robust_law import RobustState
from undertow.control.estimation.fuzzy_system import FuzzySystem, gaussian_sets
from undertow.core.contracts import Target
from undertow.physics.plants import double_integrator, linear_plant

MODEL = linear_plant(G, F, H).model()
APPLIED = np.array([0.3, -0.4])
WEIGHT = np.array([[10.0, 1.0], [1.0, 6.0]])
# What both laws have.
SHARED = {"feedback": GAINS, "weight": WEIGHT, "robust_gain": [1.2, 0.7], "layer": [2.0, 0.5]}


def lyapunov():
    """P of both axes."""
    system = [np.array([[0.0, 1.0], [-k1, -k2]]) for k1, k2 in GAINS]
    return np.stack([solve_continuous_lyapunov(a.T, -WEIGHT) for a in system])


P = lyapunov()
ERRORS = np.stack([E, R])
S = P[:, 0, 1] * E + P[:, 1, 1] * R
DECREASE = {
    "lyapunov_tracking": np.einsum("in,nij,jn->", ERRORS, P, ERRORS) / 2,
    "lyapunov_decay": np.einsum("in,ij,jn->", ERRORS, WEIGHT, ERRORS) / 2,
}


def basis_of(x, centres, widths):
    weights = np.exp(-(((x[:, None] - centres) / widths) ** 2))
    return weights / weights.sum(-1, keepdims=True)


# The paper's law.

GAMMA, SHARE, POLE, OMEGA, PHI_V = 4.0, 3.0, 15.0, np.array([0.2, 0.3]), np.array([0.05, 0.4])
CHOICES = SHARED | {
    "adaptation": GAMMA,
    "composite": SHARE,
    "pole": POLE,
    "compensation_gain": OMEGA,
    "compensation_layer": PHI_V,
}
MODIFIED = {"leakage": 0.2, "e_modification": 0.6, "dead_zone": [0.0, 0.5]}
BOX = 0.9
PREDICTED = RCAFState(np.array([0.25, -0.1]), np.array([0.9, -0.4]), THETA)


@pytest.fixture(scope="module")
def paper():
    """Command, rate and next state of the law with errors as fuzzy input, and of RAFC with the state as input."""
    tanh = rcaf(MODEL, preset="paper", **CHOICES, **MODIFIED, weights_bound=BOX, substeps=2)
    sign = rcaf(
        MODEL, preset="paper", **(CHOICES | {"composite": 0.0}), switching="sign", fuzzy_input="state", sets=2,
        identification_input="commanded", width=0.8,
    )  # fmt: skip
    wide = PREDICTED._replace(weights=np.asarray(THETA[:, :4]))

    @eqx.filter_jit
    def both(z, wide):
        run = lambda law, z: (*law.command(z, Y, GOAL), law.flow(z, Y, GOAL, jnp.asarray(APPLIED)))
        return (*run(tanh, z), tanh.advance(z, Y, GOAL, jnp.asarray(APPLIED), jnp.asarray(DT))), run(sign, wide)

    return both(*jax.tree.map(jnp.asarray, (PREDICTED, wide)))


def rate_of(velocity, theta):
    """Rate of the predicted velocity and of the weights by the composite law with its modifications."""
    eps = velocity - V
    xi = basis_of(eps, np.linspace(-1, 1, 5), 0.5)
    d_hat = (theta * xi).sum(-1)
    bend = -POLE * eps + DRIFT + G @ APPLIED + d_hat - OMEGA * np.tanh(eps / PHI_V)
    learnt = -GAMMA * (S + SHARE * eps)[:, None] * xi * (np.abs(eps) >= [0.0, 0.5])[:, None]
    learnt = learnt - GAMMA * (0.2 + 0.6 * np.abs(eps))[:, None] * theta
    return bend, np.where((np.abs(theta) >= BOX) & (theta * learnt > 0), 0.0, learnt)


def test_the_paper_law_commands_by_eq_23_and_learns_by_eq_44(paper):
    (u, signals, rate, after), _ = paper
    eps = PREDICTED.predicted_velocity - V
    d_hat = (THETA * basis_of(eps, np.linspace(-1, 1, 5), 0.5)).sum(-1)
    u_r = np.array([1.2, 0.7]) * np.tanh(S / [2.0, 0.5])
    desired = -DRIFT - d_hat + GAINS[:, 0] * E + GAINS[:, 1] * R + A + u_r
    same(u, np.linalg.solve(G, desired))
    expected = {
        "estimate": d_hat,
        "robust_term": u_r,
        "modelling_error": eps,
        "attained_share": 1.0,
        "weights": THETA,
        "weights_peak": 0.9,
        "weights_at_bound": 0.2,
        "weights_spread": 1.8,
        "predicted_position": PREDICTED.predicted_position,
        "predicted_velocity": PREDICTED.predicted_velocity,
    }
    assert set(signals) == set(expected | DECREASE)
    for name, value in (expected | DECREASE).items():
        same(signals[name], value)
    same(rate, (PREDICTED.predicted_velocity, *rate_of(PREDICTED.predicted_velocity, THETA)))
    position, velocity, theta = PREDICTED
    for _ in range(2):
        bend, learnt = rate_of(velocity, theta)
        position, velocity = position + DT / 2 * velocity, velocity + DT / 2 * bend
        theta = np.clip(theta + DT / 2 * learnt, -BOX, BOX)
    same(after, (position, velocity, theta))


def test_rafc_with_the_state_as_input_and_discontinuous_terms(paper):
    """Eq. (61); sets at -4 and 4 m, -2 and 2 m/s, of width 0.8 of these; the identification uses its own command."""
    _, (u, signals, rate) = paper
    theta, eps = THETA[:, :4], PREDICTED.predicted_velocity - V
    places, speeds = (basis_of(x, np.array([-far, far]), 0.8 * far) for x, far in ((X, 4.0), (V, 2.0)))
    xi = (places[:, :, None] * speeds[:, None, :]).reshape(2, 4)
    d_hat, u_r = (theta * xi).sum(-1), np.array([1.2, 0.7]) * np.sign(S)
    desired = -DRIFT - d_hat + GAINS[:, 0] * E + GAINS[:, 1] * R + A + u_r
    same((signals["estimate"], signals["robust_term"], u), (d_hat, u_r, np.linalg.solve(G, desired)))
    bend = -POLE * eps + DRIFT + desired + d_hat - OMEGA * np.sign(eps)
    same(rate, (PREDICTED.predicted_velocity, bend, -GAMMA * S[:, None] * xi))


def test_weights_at_their_bound_do_not_leave_and_return():
    """Whatever the speed; also a single weight inside."""
    value, rate = np.array([1.0, 1.0, -1.0, -1.0, 0.9, 0.0]), np.array([0.1, -0.1, -0.1, 3.0, 5.0, -2.0])
    np.testing.assert_array_equal(projected_rate(value, rate, 1.0), [0.0, -0.1, 0.0, 3.0, 5.0, -2.0])


def test_many_even_sets_and_uneven_ones_are_gaussians():
    """41 sets follow from every 12th one of them; where all weigh nothing, the nearest one counts."""
    x = np.array([-1.3, -0.91, 0.0, 0.024, 0.5, 1.0, 2.0])
    many, few = gaussian_sets(41, (1.0,)), FuzzySystem([[-1.0, 0.2, 1.0]], [[0.5, 0.3, 0.7]])
    assert many.evenly_spaced
    np.testing.assert_allclose(many.basis(x[:, None]), basis_of(x, np.linspace(-1, 1, 41), 0.05), rtol=1e-9, atol=1e-14)
    same(few.basis(x[:, None]), basis_of(x, np.array([-1.0, 0.2, 1.0]), np.array([0.5, 0.3, 0.7])))
    far = many.basis(np.array([[80.0], [-80.0]]))
    np.testing.assert_allclose((far[0, -1], far[1, 0]), 1.0)


# The robust law, without limits: the filter of jumps waits for nothing, and the target is not moved.

NATURAL, ZETA, LEAK, MU = np.array([8.0, 5.0]), 0.7, 0.4, np.array([0.02, 0.05])
ROBUST = SHARED | {
    "preset": "robust",
    "sampling_time": DT,
    "bandwidth": NATURAL,
    "damping": ZETA,
    "tracking_share": MU,
    "weights_bound": [0.905, 0.81],
    "leakage": LEAK,
    "reference_frequency": 0.0,
    "reach": (1.0,),
    "actuator_rate": 9.0,
}


def estimator_gains(w, zeta):
    """Poles at exp(p T): 2 less their sum, and (1 - p_1)(1 - p_2) / T."""
    poles = [np.exp(np.roots([1.0, 2 * zeta * one, one**2]) * DT) for one in w]
    total, product = np.real([one.sum() for one in poles]), np.real([one.prod() for one in poles])
    return 2 - total, (1 - total + product) / DT


def unseen(weights, xi):
    """Projection onto what is orthogonal to xi and to (1, ..., 1)."""
    rest = []
    for theta, one in zip(weights, xi, strict=True):
        seen = np.linalg.qr(np.stack([one, np.ones(5)], 1))[0]
        rest.append(theta - seen @ (seen.T @ theta))
    return np.array(rest)


def test_one_step_of_the_robust_law():
    law = rcaf(MODEL, **ROBUST)
    z = RobustState(EstimatorState(PREDICTED.predicted_velocity, THETA), (), None)

    @eqx.filter_jit
    def step(z):
        u, signals = law.command(z, Y, GOAL)
        back = [law.advance(z, Y, GOAL, one, jnp.asarray(DT)).estimator for one in (u, jnp.asarray(APPLIED))]
        return u, signals, back, law.known_acceleration(z, Y, jnp.asarray(APPLIED))

    u, signals, (free, limited), known = step(jax.tree.map(jnp.asarray, z))
    eps = PREDICTED.predicted_velocity - V
    xi = basis_of(eps, np.linspace(-1, 1, 5), 0.5)
    d_hat, u_r = (THETA * xi).sum(-1), np.array([1.2, 0.7]) * np.tanh(S / [2.0, 0.5])
    desired = A + GAINS[:, 0] * E + GAINS[:, 1] * R + u_r
    # Compensated at the velocity of the target, known at the measured one.
    compensated = d_hat + F @ X + H @ GOAL.velocity
    same(u, np.linalg.solve(G, desired - compensated))
    same(known, DRIFT + G @ APPLIED)
    expected = {"estimate": d_hat, "robust_term": u_r, "modelling_error": eps, "attained_share": 1.0} | DECREASE
    for name, value in expected.items():
        same(signals[name], value)
    same(signals["weights_at_bound"], 0.0)
    of_rates, of_estimate = estimator_gains(NATURAL, ZETA)
    wanted = desired - compensated
    assert (G @ APPLIED) @ wanted < 0.999 * wanted @ wanted
    for after, mu, force in ((free, MU, np.asarray(u)), (limited, 0 * MU, APPLIED)):
        moved = of_estimate * (eps + mu * S)
        theta = THETA - (moved / (xi**2).sum(-1))[:, None] * xi
        theta = theta - (1 - np.exp(-LEAK * DT)) * unseen(theta, xi)
        box = np.array([[0.905], [0.81]])
        assert (np.abs(theta) > box).any()
        rates = PREDICTED.predicted_velocity + DT * (DRIFT + G @ force + d_hat) - of_rates * eps
        same(after, (rates, np.clip(theta, -box, box)))


def test_a_damping_above_one_and_an_axis_with_double_poles():
    """cosh beyond, and the limit of both between."""
    estimator = rcaf(MODEL, **(ROBUST | {"damping": [1.6, 1.0]})).estimator
    found = estimator.gains(jnp.asarray(DT))
    of_rates, of_estimate = estimator_gains(NATURAL[:1], 1.6)
    double = 1 - np.exp(-NATURAL[1] * DT)
    same(found, (np.append(of_rates, 2 * double), np.append(of_estimate, double**2 / DT)))


# The filter of jumps, far from its goal.


def test_the_filter_is_slower_far_away_and_moved_towards_a_vehicle_that_drifted():
    """exp of the companion matrix of (p + w)^3; from far away half of the authority peaks at the limit."""
    chosen = ReferenceFilter([1.7, 2.5])
    coordinates = double_integrator(2).model().coordinates
    state = FilterState(
        Target(*np.array([[0.3, -0.2], [0.1, 0.4], [-0.3, 0.2]])),
        Target(*np.array([[0.7, 0.1], [0.2, -0.3], [0.05, 0.3]])),
        np.array(0.03),
    )
    room = Room(np.array([0.1, 9.0]), np.array([0.05, 0.0]), np.array([0.02, 0.01]))
    advance = eqx.filter_jit(
        lambda state, room: (
            chosen.smoothed(state, GOAL, coordinates),
            chosen.advance(state, GOAL, coordinates, jnp.asarray(0.7), jnp.asarray(DT), room),
        )
    )
    smoothed, after = advance(*jax.tree.map(jnp.asarray, (state, room)))
    before, seen, t = state.offset, state.expected, 0.03
    risen = GOAL.acceleration - seen.acceleration
    offset = np.stack(
        [
            before.position - (GOAL.position - seen.position - t**2 / 6 * risen),
            before.velocity - (GOAL.velocity - seen.velocity - t / 2 * risen),
            before.acceleration,
        ]
    )
    same(smoothed, tuple(np.stack(GOAL) + offset))
    peak = (np.sqrt(2) - 1) / np.exp(2 - np.sqrt(2))
    w = np.minimum([1.7, 2.5], np.sqrt(room.most / (2 * peak * np.abs(offset[0]))))
    assert w[0] < 1.7
    assert w[1] == 2.5
    flow = [np.array([[0, 1, 0], [0, 0, 1], [-(one**3), -3 * one**2, -3 * one]]) for one in w]
    left = np.stack([expm(one * 0.7 * DT) @ column for one, column in zip(flow, offset.T, strict=True)], 1)
    left = left - np.stack([room.excess, room.pace, np.zeros(2)])
    same(after.offset, tuple(left), rtol=1e-5)  # the peak is rounded to four digits
    at = GOAL.position + DT * GOAL.velocity + DT**2 / 2 * A
    same((after.expected, after.elapsed), ((at, GOAL.velocity + DT * A, A), DT))

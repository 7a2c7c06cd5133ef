"""I12: Moore-Penrose identities, the printed cases of Eq. (22), and what regularisation costs, Eqs. (24)-(27)."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from textbook import jacobian

from undertow.core.measurement import measurement_of_outputs
from undertow.core.numerics.linear_algebra import (
    partial_inverse,
    printed_inverse,
    pseudo_inverse,
    regularised_inverse,
    regularised_sharp,
)
from undertow.physics.plants import hybrid_vehicle
from undertow.physics.thrusters import t200
from undertow.physics.vehicles import bluerov2, odin

RNG = np.random.default_rng(5)
COUNT = 50
SQUARE, WIDE, TALL = RNG.normal(size=(COUNT, 6, 6)), RNG.normal(size=(COUNT, 6, 8)), RNG.normal(size=(COUNT, 6, 4))
WEAK = RNG.normal(size=(COUNT, 6, 3)) @ RNG.normal(size=(COUNT, 3, 8))  # rank 3
ODIN = np.asarray(odin().body().inverse_mass_matrix) @ np.asarray(odin().thruster_matrix())
ANGLES = RNG.uniform(-1, 1, (COUNT, 3)) * np.array([np.pi, 1.3, np.pi])
GAINS = np.asarray(jax.jit(jax.vmap(jacobian))(ANGLES)) @ ODIN * 17.11
SHAPES = {"square": SQUARE, "wide": WIDE, "tall": TALL, "rank 3": WEAK, "odin": GAINS}
FULL_RANK = ["square", "wide", "tall", "odin"]


@functools.cache
def each(function):
    return jax.jit(jax.vmap(function))


@functools.cache
def partial_inverses(rank):
    return jax.jit(jax.vmap(lambda gain: partial_inverse(gain, jnp.ones(6), rank)))


sharp = jax.jit(jax.vmap(regularised_sharp, in_axes=(0, None)))
outer = jax.jit(jax.vmap(regularised_inverse, in_axes=(0, None)))


def norms(matrices):
    return np.linalg.norm(matrices, ord=2, axis=(1, 2))


def condition(gains):
    """Largest over smallest singular value that is not zero."""
    s = np.linalg.svd(gains, compute_uv=False)
    return np.array([row.max() / row[row > 1e-10 * row.max()].min() for row in s])


@pytest.mark.parametrize("shape", SHAPES)
def test_four_moore_penrose_identities(shape):
    g = SHAPES[shape]
    p = np.asarray(each(pseudo_inverse)(g))
    allowed = 1e-9 * condition(g)
    assert (norms(g @ p @ g - g) <= allowed * norms(g)).all()
    assert (norms(p @ g @ p - p) <= allowed * norms(p)).all()
    assert (norms(g @ p - (g @ p).swapaxes(1, 2)) <= allowed).all()
    assert (norms(p @ g - (p @ g).swapaxes(1, 2)) <= allowed).all()


@pytest.mark.parametrize("shape", FULL_RANK)
def test_printed_inverse_is_the_pseudo_inverse_wherever_it_exists(shape):
    g = SHAPES[shape]
    expected = np.asarray(each(pseudo_inverse)(g))
    allowed = 1e-12 * condition(g) ** 2  # normal equations square the condition
    assert (norms(np.asarray(each(printed_inverse)(g)) - expected) <= allowed * norms(expected)).all()


@pytest.mark.parametrize("shape", ["square", "wide", "odin"])
@pytest.mark.parametrize("inverse", [printed_inverse, pseudo_inverse])
def test_rank_six_inverts_exactly(shape, inverse):
    """Eq. (25): G G# = I."""
    g = SHAPES[shape]
    assert norms(g @ np.asarray(each(inverse)(g)) - np.eye(6)).max() <= 1e-9


@pytest.mark.parametrize("delta", [1e-6, 1e-2, 1.0])
@pytest.mark.parametrize("shape", ["wide", "odin"])
def test_regularised_right_inverse_loses_the_fourth_power_share(shape, delta):
    """||I - G reg G#|| = delta / (delta + sigma_min^4): N > 6."""
    g = SHAPES[shape]
    smallest = np.linalg.svd(g, compute_uv=False).min(1)
    loss = norms(np.eye(6) - g @ np.asarray(sharp(g, delta)))
    np.testing.assert_allclose(loss, delta / (delta + smallest**4), rtol=0, atol=1e-8)


@pytest.mark.parametrize("delta", [1e-6, 1e-2, 1.0])
def test_regularised_square_inverse_loses_the_second_power_share(delta):
    """N = 6 regularises G itself, not G G^T: delta / (delta + sigma_min^2)."""
    smallest = np.linalg.svd(SQUARE, compute_uv=False).min(1)
    loss = norms(np.eye(6) - SQUARE @ np.asarray(sharp(SQUARE, delta)))
    np.testing.assert_allclose(loss, delta / (delta + smallest**2), rtol=0, atol=1e-8)


@pytest.mark.parametrize("delta", [1e-6, 1e-2, 1.0])
def test_fewer_than_six_inputs_make_the_outer_factor_a_mere_gain(delta):
    """N < 6, full column rank: G+ [G G+]^r = G+ / (1 + delta), whatever G (theory of Eq. (24))."""

    plus = np.asarray(each(printed_inverse)(TALL))
    found = plus @ np.asarray(outer(TALL @ plus, delta))
    expected = np.asarray(each(pseudo_inverse)(TALL)) / (1 + delta)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8)


@pytest.mark.parametrize("delta", [1e-6, 1e-3, 1.0])
def test_printed_regularisation_for_fewer_than_six_inputs_in_closed_form(delta):
    """Eq. (27) regularises twice: singular value s becomes (1/s) m^2 / (delta + m^2), m = s^4 / (delta + s^4)."""
    u, s, vt = np.linalg.svd(TALL, full_matrices=False)
    share = s**4 / (delta + s**4)
    expected = np.einsum("kji,kj,klj->kil", vt, share**2 / (delta + share**2) / s, u)
    found = sharp(TALL, delta)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8)


def test_printed_regularisation_tends_to_the_mere_gain():
    """Where delta is far below sigma^4 the two agree."""
    q = np.linalg.qr(TALL)[0] * np.array([1.0, 1.5, 2.0, 3.0])
    found = sharp(q, 1e-5)
    np.testing.assert_allclose(found, np.asarray(each(pseudo_inverse)(q)) / (1 + 1e-5), rtol=0, atol=1e-8)


def test_product_with_fewer_than_six_inputs_is_a_projector_that_nothing_inverts():
    """So [G G+]^-1 of Eq. (24) never exists: rank 4 of 6, in double precision a condition of 1e15 and more."""
    product = np.asarray(each(lambda g: g @ pseudo_inverse(g))(TALL))
    np.testing.assert_allclose(product @ product, product, atol=1e-12)
    np.testing.assert_allclose(product, product.swapaxes(1, 2), atol=1e-12)
    np.testing.assert_allclose(np.trace(product, axis1=1, axis2=2), 4.0, atol=1e-12)
    assert np.linalg.cond(product).min() > 1e14


def test_number_of_inputs_is_not_the_rank():
    """Four horizontal thrusters have rank 3: G^T G is singular, and the printed inverse with it; G+ is not."""
    g = np.asarray(odin().with_thrusters((1, 2, 3, 4)).thruster_matrix())
    assert np.linalg.matrix_rank(g) == 3
    assert np.linalg.cond(g.T @ g) > 1e15
    p = np.asarray(jax.jit(pseudo_inverse)(g))
    np.testing.assert_allclose(g @ p @ g, g, atol=1e-9)
    np.testing.assert_allclose(g @ p, np.diag([1.0, 1, 0, 0, 0, 1]), atol=1e-12)


@pytest.mark.parametrize("name", ["wide", "square", "odin"])
def test_at_full_rank_a_partial_inverse_is_the_whole_one(name):
    found = partial_inverses(6)(SHAPES[name])
    np.testing.assert_array_equal(found, each(pseudo_inverse)(SHAPES[name]))


@pytest.mark.parametrize("name, rank", [("tall", 4), ("rank 3", 3)])
def test_a_partial_inverse_serves_as_many_rows_as_the_rank_allows(name, rank):
    """Exactly, whatever is asked for in the others, and with the smallest input that does it."""
    inverses = np.asarray(partial_inverses(rank)(SHAPES[name]))
    for gain, inverse in zip(SHAPES[name], inverses, strict=True):
        given = gain @ inverse
        served = np.abs(given - np.eye(6)).max(axis=1) < 1e-9
        assert served.sum() == rank
        np.testing.assert_allclose(inverse[:, ~served], 0, atol=1e-9 * np.abs(inverse).max())
        np.testing.assert_allclose(inverse[:, served], np.linalg.pinv(gain[served]), rtol=1e-7, atol=1e-9)


@pytest.mark.full
def test_bluerov2_is_not_asked_to_pitch():
    """Its horizontal thrusters lie below its centre: G+ would have it surge for the sake of pitch."""
    model = hybrid_vehicle(bluerov2(), t200()).model().in_body_axes().dynamics
    reached, allocation = np.asarray(model.acceleration_per_thrust), np.asarray(model.allocation)
    given = reached @ allocation
    kept = [0, 1, 2, 3, 5]
    np.testing.assert_allclose(given[kept][:, kept], np.eye(5), atol=1e-12)
    np.testing.assert_allclose(given[:, 4], 0, atol=1e-12)
    spread = reached @ np.asarray(jax.jit(pseudo_inverse)(reached))
    assert abs(spread[0, 4]) > 0.1


def test_fewer_thrusters_than_outputs_share_a_demand_by_moore_and_penrose():
    """G# of a vehicle of rank five, in motion and tilted, by its closed form."""
    dynamics = hybrid_vehicle(bluerov2(), t200()).model().dynamics
    y = measurement_of_outputs(jnp.array([1.0, 2, 3, 0.3, -0.4, 0.8]), jnp.array([0.2, -0.1, 0.3, 0.1, 0.2, -0.3]))
    demand = jnp.array([0.3, -0.2, 0.5, 0.1, -0.4, 0.2])
    both = jax.jit(lambda y, demand: (dynamics.gain(y), dynamics.invert(y, demand)))
    gain, u = map(np.asarray, both(y, demand))
    assert np.linalg.matrix_rank(gain) == 5
    np.testing.assert_allclose(u, np.linalg.pinv(gain, rcond=1e-10) @ demand, rtol=1e-8)

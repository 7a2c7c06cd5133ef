"""Checks of constructors: of numbers at once, of traced values as conditions of the program."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core import checks
from undertow.core.errors import BadInput

GOOD = np.array([[2.0, 0.5], [0.5, 1.0]])


def holds(check, *values):
    """Whether a check of traced values holds, by the conditions that it records."""

    @jax.jit
    def conditions(values):
        with checks.recorded_conditions() as found:
            check(*values)
        return jnp.stack([jnp.asarray(one).all() for one in found]).all()

    return bool(conditions(tuple(map(jnp.asarray, values))))


DEFINITE = [
    (GOOD, True),
    (np.stack([GOOD, 3 * GOOD]), True),
    (-GOOD, False),
    (np.array([[1.0, 2.0], [2.0, 1.0]]), False),
    (np.array([[2.0, 0.5], [0.4, 1.0]]), False),
    (np.array([[2.0, 0.5], [0.5 + 1e-12, 1.0]]), True),
    (np.stack([GOOD, -GOOD]), False),
    (GOOD * np.nan, False),
]


@pytest.mark.parametrize(("matrix", "right"), DEFINITE)
def test_positive_definite(matrix, right):
    """A traced matrix is judged like one of numbers."""
    assert holds(lambda value: checks.positive_definite("inertia", value), matrix) == right
    if right:
        checks.positive_definite("inertia", matrix)
    else:
        with pytest.raises(BadInput, match=r"^`inertia"):
            checks.positive_definite("inertia", matrix)


@pytest.mark.parametrize(
    ("check", "good", "bad"),
    [
        (checks.positive, [1e-300, 2.0], [0.0, 2.0]),
        (checks.positive, [1.0], [np.inf]),
        (checks.not_negative, [0.0, 1.0], [-1e-300, 1.0]),
        (checks.finite, [-1e300, 0.0], [np.nan, 0.0]),
        (checks.hurwitz, [1.0, 2.0], [1.0, 0.0]),
        (checks.hurwitz, [[1.0, 2.0], [3.0, 4.0]], [[1.0, 2.0], [-3.0, 4.0]]),
    ],
)
def test_entries(check, good, bad):
    check("gain", np.array(good))
    with pytest.raises(BadInput, match=r"^`gain"):
        check("gain", np.array(bad))
    assert holds(lambda value: check("gain", value), good)
    assert not holds(lambda value: check("gain", value), bad)


def test_what_a_condition_of_traced_values_is():
    assert checks.assumed(lambda a, b: a < b, 1.0, 2.0) and not checks.assumed(lambda a, b: a < b, 2.0, 1.0)
    assert holds(lambda a, b: checks.assumed(lambda a, b: a < b, a, b), 1.0, 2.0)
    assert not holds(lambda a, b: checks.assumed(lambda a, b: a < b, a, b), 2.0, 1.0)
    # Unrecorded, a traced value is taken to be right.
    assert bool(jax.jit(lambda a: jnp.asarray(checks.assumed(lambda a: a < 0, a)))(1.0))


def test_numbers_that_a_constructor_looks_at():
    seen = []

    @jax.jit
    def program(value):
        seen.append(checks.known(value))
        seen.append(checks.known(1.0, [2.0, value]))
        seen.append(checks.known(1.0, [2.0]))
        with checks.recorded_conditions(), pytest.raises(checks.Unknown):
            checks.known(value)
        return value

    program(1.0)
    assert seen == [False, False, True]
    assert checks.traced(1.0, [2.0, (3.0,)]) is False


def test_conditions_of_a_function_that_is_traced_within_stay_its_own():
    """Its values are not those of the outer program, which could not return them."""

    @jax.jit
    def outer(value):
        def inner(x):
            checks.positive("x", x)
            return 2 * x

        with checks.recorded_conditions() as found:
            checks.positive("value", value)
            twice = jax.lax.map(inner, value[None])
        assert len(found) == 1
        return twice, found[0].all()

    twice, right = outer(jnp.asarray(3.0))
    assert float(twice[0]) == 6.0 and bool(right)


def test_lengths_words_and_numbers_per_axis():
    for call in (
        lambda: checks.length("r_g", np.ones(2), 3, "x, y, z"),
        lambda: checks.length("r_g", 1.0, 3, "x, y, z"),
        lambda: checks.per_axis("r_g", np.ones(2), 3),
        lambda: checks.choice("r_g", "three", ("one", "two")),
    ):
        with pytest.raises(BadInput, match=r"^`r_g"):
            call()
    checks.length("r_g", np.ones(3), 3, "x, y, z")
    checks.per_axis("gains", 1.0, 3)
    checks.per_axis("gains", np.ones(3), 3)
    checks.per_axis("gains", np.ones((3, 2)), 3, (2,))
    checks.choice("word", "one", ("one", "two"))

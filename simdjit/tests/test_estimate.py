"""What a program would cost, and when XLA is the better choice."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from simdjit import Loop, Unsupported, estimate

pytestmark = pytest.mark.compiler


def by_xla(function, *arguments):
    return estimate.compiled_by_xla(jax.make_jaxpr(function)(*arguments))


def functions(n, carry, k):
    return jnp.sin(carry * n) + 0.1 * jnp.exp(-carry * carry) * n


def program(size, **limits):
    numbers = np.linspace(0.1, 1.0, size)
    return Loop(lambda n: n, lambda n: n * 1.0, functions, lambda n, c, k: c[0], numbers, **limits)


def test_equations_numbers_functions_and_products_are_counted():
    cost = by_xla(lambda x, y: jnp.sin(x * y).sum(), *np.ones((2, 5)))  # three equations on five numbers each
    assert cost.compiling == pytest.approx(0.04 + 3 * 1.5e-3)
    assert cost.step == pytest.approx(3 * 0.6 + (5 + 5) * 0.1 + 5 * 2.0)
    assert by_xla(jnp.matmul, np.ones((3, 4)), np.ones((4, 2))).step == pytest.approx(0.6 + 24 * 0.05)


def test_inner_functions_are_counted_as_often_as_they_are_done():
    body = lambda carry, _: (carry * 2.0, None)
    once, often = (by_xla(lambda x, n=n: jax.lax.scan(body, x, None, n)[0], np.ones(7)) for n in (1, 10))
    assert often.compiling == once.compiling and often.step == pytest.approx(10 * once.step)
    whole = by_xla(jax.jit(lambda x: x + 1.0), np.ones(7))
    assert whole == by_xla(lambda x: x + 1.0, np.ones(7))


def test_long_programs_take_longer_per_operation():
    short, long = estimate.compiled_here(10_000), estimate.compiled_here(100_000)
    assert long.compiling > 20 * short.compiling and long.step > 15 * short.step
    assert long.total(10**6) == pytest.approx(long.compiling + long.step * 1e-3)


def test_a_program_that_xla_computes_sooner_is_left_to_it():
    """Two elementary functions of 1000 numbers: 12 s to compile here, no time there, and as quick as here."""
    step = jax.make_jaxpr(lambda n, c: functions(n, c, 0))(*np.ones((2, 1000)))
    why = estimate.reason_for_xla(70_000, step, 1_000_000)
    assert why == (
        "XLA takes less time by estimate: 0.052 s to compile and 4.6 us per step and run; "
        "batch code of 70 000 operations takes 18 s to compile and 4.4 us per step"
    )
    assert estimate.reason_for_xla(70_000, step, 10**9) == "", "many runs are worth the wait"
    assert estimate.reason_for_xla(5_620, step, 1_000_000) == ""


def test_a_loop_says_why_it_is_left_to_xla():
    with pytest.raises(Unsupported, match=r"XLA takes less time by estimate: .* batch code of 14 000 operations"):
        program(200, planned=1_000_000)
    assert program(20, planned=0).operations == 1400, "wanted whatever it costs"


def test_products_in_loops_are_not_written_out():
    """221 184 multiplications and additions of matrices with 48 rows compile in a few seconds."""
    numbers = np.ones((48, 48))
    step = lambda n, carry, k: jax.lax.fori_loop(0, 4, lambda i, x: n @ x * 0.01, carry)
    assert Loop(lambda n: n, lambda n: n, step, lambda n, c, k: c[0, 0], numbers).operations > 4 * 2 * 48**3


def test_a_program_that_would_take_minutes_says_so():
    with pytest.raises(Unsupported, match=r"^more than 1 000 operations, which would take more than 0 s to compile$"):
        program(200, most=1_000)

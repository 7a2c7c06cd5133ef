"""Numbers of three digits are those that Python prints."""

import jax.numpy as jnp
import numpy as np

from undertow.core.numerics.rounding import three_digits


def test_three_digits_are_those_that_python_prints():
    random = np.random.default_rng(0)
    values = 10 ** random.uniform(-8, 12, 2000) * random.choice([-1, 1], 2000)
    values[:8] = 0, 1, 9.996, 10, 999.6, 1000, 0.1, 0.001
    np.testing.assert_array_equal(three_digits(jnp.asarray(values)), [float(f"{value:.3g}") for value in values])

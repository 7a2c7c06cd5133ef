"""What `conftest.py` switches on does find mistakes, here and in the folders that it names."""

import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import TypeCheckError

from undertow.core.numerics.linear_algebra import matvec


@pytest.mark.full
@pytest.mark.parametrize("vector", [jnp.ones(2), jnp.ones(()), np.ones(3), jnp.ones((1, 3))])
def test_another_shape_or_kind_of_array_than_annotated_is_an_error(vector):
    np.testing.assert_array_equal(matvec(jnp.ones((2, 3)), jnp.ones(3)), [3.0, 3.0])
    with pytest.raises(TypeCheckError, match="vector"):
        matvec(jnp.ones((2, 3)), vector)


def test_arrays_of_different_rank_are_an_error():
    with pytest.raises(ValueError, match="rank_promotion"):
        jnp.ones((2, 3)) * jnp.ones(3)

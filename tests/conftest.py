"""Strict arithmetic for every test: double precision, no silent broadcasting of ranks, no silent promotion of types."""

from undertow.process import prepare  # isort: skip  (before JAX is imported)

prepare()

from undertow.core import runtime  # isort: skip  (sets up JAX before anything else touches it)

import jax
import pytest

assert runtime
jax.config.update("jax_numpy_dtype_promotion", "strict")


@pytest.fixture
def key():
    return jax.random.PRNGKey(20261121)

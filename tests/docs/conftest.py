import jax
import pytest


@pytest.fixture
def as_users_have_it():
    """JAX promotes types for users; tests are stricter."""
    jax.config.update("jax_numpy_dtype_promotion", "standard")
    yield
    jax.config.update("jax_numpy_dtype_promotion", "strict")

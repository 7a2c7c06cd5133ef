"""Motion reversed and motion mirrored: what a sign or an exponent gone wrong in a hydrodynamic term breaks."""

import importlib

import jax
import numpy as np
import pytest

from undertow.core import catalogue

pytestmark = pytest.mark.full

RNG = np.random.default_rng(5)
NU = RNG.normal(size=(200, 6))
DOWN = RNG.normal(size=(200, 3))
DOWN /= np.linalg.norm(DOWN, axis=1, keepdims=True)
MIRROR = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])  # the vertical plane fore and aft

# Whose printed products of inertia or added mass differ between port and starboard.
LOPSIDED = {("rexrov", "berg2012"), ("rexrov", "uuvsim_nominal"), ("bluerov2", "centrale_nantes")}
LOPSIDED |= {("npsauv2", "fossen_mss"), ("npsauv2", "antonelli_simurv")}


def bodies():
    for name, part in sorted(catalogue.names("vehicles").items()):
        module = importlib.import_module(f"undertow.physics.vehicles.{name}")
        for hull in getattr(module, "PARAMETERS", [None]):
            yield (name, hull), part(**({"parameters": hull} if hull else {})).body()


BODIES = dict(bodies())


def close(one, other):
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-12 * float(np.abs(other).max()))


@pytest.mark.parametrize("key", BODIES, ids=str)
def test_reversed_motion(key):
    """Drag turns round with the velocity; Coriolis forces, quadratic in it, stay."""
    body = BODIES[key]
    close(jax.vmap(body.damping)(-NU), -jax.vmap(body.damping)(NU))
    close(jax.vmap(body.coriolis)(-NU), jax.vmap(body.coriolis)(NU))


@pytest.mark.parametrize("key", BODIES, ids=str)
def test_mirrored_motion(key):
    """A vehicle alike on both sides accelerates in the mirror as its image does."""
    free = jax.jit(jax.vmap(BODIES[key].free_acceleration))
    image, expected = free(NU * MIRROR, DOWN * MIRROR[:3]), np.asarray(free(NU, DOWN)) * MIRROR
    if key in LOPSIDED:
        assert float(np.abs(image - expected).max()) > 1e-4 * float(np.abs(expected).max())
    else:
        close(image, expected)

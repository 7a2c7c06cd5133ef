"""A part made outside of any run holds double precision, whatever the caller's `jax_enable_x64` is; and it stays."""

import jax
import numpy as np

from undertow.core.arrays import in_present_precision
from undertow.core.runtime import in_precision


def bits(part):
    return [np.asarray(leaf) for leaf in jax.tree.leaves(part) if isinstance(leaf, jax.Array)]


def test_the_callers_setting_does_not_matter(part_name, made_anew):
    with jax.enable_x64(True):
        wanted = bits(made_anew(part_name))
    with jax.enable_x64(False):
        found = bits(made_anew(part_name))
        assert not jax.config.jax_enable_x64
    assert [leaf.dtype for leaf in found] == [leaf.dtype for leaf in wanted]
    for one, other in zip(found, wanted, strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_run_converts_its_parts(part):
    """To single precision, and back to nothing but what it can hold."""
    _, whole = part
    with in_precision("float32"):
        single = in_present_precision(whole)
    assert all(leaf.dtype != np.float64 for leaf in bits(single))
    for one, other in zip(bits(single), bits(whole), strict=True):
        np.testing.assert_array_equal(one, other.astype(one.dtype))

"""I22, first half: what smoothing the sign costs, and that it costs exactly that."""

import equinox as eqx
import jax
import numpy as np
import pytest

from undertow.control.estimation import SeriesParallel
from undertow.core.errors import BadInput
from undertow.core.numerics import smoothing

switch = jax.jit(smoothing.switch, static_argnames="kind")
compensation = eqx.filter_jit(SeriesParallel.compensation)


@pytest.mark.parametrize(("amplitude", "layer"), [(10.0, 0.5), (0.1, 0.5), (3.0, 1e-3), (1.0, 40.0)])
def test_residual_of_tanh_is_bounded_and_the_bound_is_reached(amplitude, layer):
    """w |s| - w s tanh(s / phi) <= 0.27847 phi w, for s of any size; the supremum is 0.278464... phi w."""
    s = layer * np.concatenate([np.linspace(-5, 5, 100001), np.logspace(1, 8, 200), -np.logspace(1, 8, 200)])
    residual = amplitude * (np.abs(s) - s * np.asarray(switch(s, layer, "tanh"))) / (amplitude * layer)
    assert residual.min() >= 0
    assert 0.278464 <= residual.max() <= 0.27847


def test_sign_leaves_no_residual():
    s = np.linspace(-3, 3, 1001)
    np.testing.assert_array_equal(s * np.asarray(switch(s, 0.5, "sign")), np.abs(s))


def test_smooth_switch_tends_to_the_sharp_one():
    s = np.concatenate([-np.logspace(-3, 2, 200), np.logspace(-3, 2, 200)])
    np.testing.assert_allclose(switch(s, 1e-5, "tanh"), switch(s, 1e-5, "sign"), rtol=0, atol=1e-15)


def test_smooth_switch_is_a_proportional_gain_of_one_over_the_layer_near_zero():
    s = np.linspace(-1e-4, 1e-4, 11)
    np.testing.assert_allclose(switch(s, 0.5, "tanh"), s / 0.5, rtol=2e-8)


def test_compensation_of_the_identification_model_is_this_switch():
    eps = np.linspace(-1, 1, 51)
    np.testing.assert_allclose(compensation(SeriesParallel(), eps), 0.1 * np.tanh(eps / 0.5), rtol=1e-14)
    sharp = SeriesParallel(compensation_gain=0.3, switching="sign")
    np.testing.assert_array_equal(compensation(sharp, eps), 0.3 * np.sign(eps))


def test_unknown_switch_is_refused():
    with pytest.raises(BadInput, match="`switching` must be one of tanh, sign, but is clip"):
        SeriesParallel(switching="clip")

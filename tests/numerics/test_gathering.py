"""I11, second half: rho = |xi(0)|^2, all that small signals see of the fuzzy design (theory, section 3.2)."""

import numpy as np
import pytest

from undertow.control.estimation import gaussian_sets

# spacing / width: rho of 3, 5 and 7 sets, and sigma^2 |xi'(0)|^2 of 3 and 5 sets, four digits.
TABLE = {
    0.5: (0.3383, 0.2290, 0.2041, 0.1854, 0.2117),
    0.75: (0.3603, 0.3026, 0.2994, 0.3191, 0.3007),
    1.0: (0.4217, 0.4047, 0.4046, 0.3594, 0.3481),
    1.5: (0.6973, 0.6970, 0.6970, 0.1364, 0.1363),
    2.0: (0.9312, 0.9312, 0.9312, 0.0100, 0.0100),
    3.0: (0.9995, 0.9995, 0.9995, 0.0, 0.0),
}


def sets(count, spacing_over_width, reach=1.0):
    spacing = 2 / (count - 1)
    return gaussian_sets(count, (reach,), spacing / spacing_over_width)


@pytest.mark.parametrize("ratio", TABLE)
@pytest.mark.parametrize(("column", "count"), [(0, 3), (1, 5), (2, 7)])
def test_gathering_is_the_table(ratio, column, count):
    np.testing.assert_allclose(sets(count, ratio).basis_norm_squared(), TABLE[ratio][column], rtol=0, atol=5e-5)


@pytest.mark.parametrize("ratio", TABLE)
@pytest.mark.parametrize("reach", [0.01, 1.0, 30.0])
def test_gathering_of_three_sets_in_closed_form_whatever_the_unit(ratio, reach):
    r = np.exp(-(ratio**2))
    np.testing.assert_allclose(
        sets(3, ratio, reach).basis_norm_squared(), (1 + 2 * r**2) / (1 + 2 * r) ** 2, rtol=1e-13
    )


@pytest.mark.parametrize("ratio", TABLE)
@pytest.mark.parametrize(("column", "count"), [(3, 3), (4, 5)])
def test_slope_of_the_basis_is_the_table(ratio, column, count):
    """sigma^2 |xi'(0)|^2, which drives the drift; by central differences of half-width 1e-5 sigma."""
    system = sets(count, ratio)
    width = float(np.asarray(system.widths)[0, 0])
    h = 1e-5 * width
    up, down = np.asarray(system.basis(np.array([[h], [-h]])))
    slope = width * (up - down) / (2 * h)
    np.testing.assert_allclose((slope**2).sum(), TABLE[ratio][column], rtol=0, atol=5.1e-5)
    if count == 3:
        r = np.exp(-(ratio**2))
        np.testing.assert_allclose((slope**2).sum(), 8 * ratio**2 * r**2 / (1 + 2 * r) ** 2, rtol=1e-7)


@pytest.mark.parametrize("inputs", [1, 2])
def test_gathering_runs_from_one_over_rules_to_one(inputs):
    wide = gaussian_sets(5, (1.0,) * inputs, 1e4)
    narrow = gaussian_sets(5, (1.0,) * inputs, 0.05)
    np.testing.assert_allclose(wide.basis_norm_squared(), 1 / 5**inputs, rtol=1e-6)
    np.testing.assert_allclose(narrow.basis_norm_squared(), 1.0, rtol=1e-6)
    np.testing.assert_allclose(gaussian_sets(1, (1.0,) * inputs).basis_norm_squared(), 1.0, rtol=0, atol=0)


def test_gathering_of_two_inputs_is_the_square_of_one():
    """5 x 5 rules at Table 2: 0.405 falls to 0.164."""
    two = gaussian_sets(5, (4.0, 2.0)).basis_norm_squared()
    np.testing.assert_allclose(two, float(gaussian_sets(5).basis_norm_squared()) ** 2, rtol=1e-13)
    np.testing.assert_allclose(two, 0.164, atol=5e-4)

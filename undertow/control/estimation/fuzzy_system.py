"""Zero-order Takagi-Sugeno-Kang fuzzy system with Gaussian sets: Eqs. (35)-(37), (39), (42)."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.core.param import Param, param

# Largest exponent that `even_memberships` may meet inside the grid; exp overflows at 709, in single precision at 88.
_LARGEST_EXPONENT, _LARGEST_SINGLE = 600.0, 75.0

# Sets up to which one exponential per input will do; with more of them, every 12th set has one of its own, and the
# 6 sets on either side of it follow. Widest spacing in widths for that: further out, weights below e^-300 are lost.
_FEW, _APART = 25, 12
_WIDEST = 2.0


def memberships(x: Float[Array, " n"], centres: Float[Array, " M"], widths: Float[Array, " M"]) -> Float[Array, "n M"]:
    """exp(-((x - c_l) / sigma_l)^2) / sum of the same; finite however far x lies from every set."""
    return jax.nn.softmax(-(((x[:, None] - centres[None, :]) / widths[None, :]) ** 2), axis=-1)


def even_memberships(
    x: Float[Array, " n"], centres: Float[Array, " M"], widths: Float[Array, " M"]
) -> Float[Array, "n M"]:
    """`memberships` for equal spacing h and width sigma, with few exponentials instead of M.

    Relative to the outermost set on the side of x, the set j steps further in weighs
    r^j exp(-(j h / sigma)^2) with r = exp(-2 h (distance beyond the outermost centre) / sigma^2).
    """
    if centres.shape[0] > _FEW:
        return _by_neighbours(x, centres, widths)
    count = centres.shape[0]
    middle, half = (centres[0] + centres[-1]) / 2, (centres[-1] - centres[0]) / 2
    spacing, width = 2 * half / (count - 1), widths[0]
    offset = x - middle
    ratio = jnp.exp(-2 * spacing / width**2 * (jnp.abs(offset) - half))
    inward = jnp.exp(-((jnp.arange(count, dtype=float) * spacing / width) ** 2))
    powers = [jnp.ones_like(ratio)]
    for _ in range(1, count):
        powers.append(powers[-1] * ratio)
    weights = jnp.stack(powers, -1) * inward[None, :]
    weights = weights * (1 / weights.sum(-1, keepdims=True))
    return jnp.where((offset >= 0)[:, None], weights[:, ::-1], weights)


def _by_neighbours(x, centres, widths):
    """`even_memberships` of many sets: those beside some of the sets, the anchors, follow from them.

    Relative to an anchor at distance u on either side of x, the set i steps further on weighs
    r^i exp(-(i h / sigma)^2) with r = exp(2 u h / sigma^2). All are divided by exp(-(d / sigma)^2), where d is the
    distance of x from the grid, so that the outermost set weighs 1 for x beyond it.
    """
    count, width = centres.shape[0], widths[0]
    anchors = np.round(np.linspace(0, count - 1, -(-(count - 1) // _APART) + 1)).astype(int)
    nearest = np.abs(np.arange(count)[:, None] - anchors).argmin(1)
    steps = np.arange(count) - anchors[nearest]
    reach = int(np.abs(steps).max())
    middle, half = (centres[0] + centres[-1]) / 2, (centres[-1] - centres[0]) / 2
    spacing, offset = 2 * half / (count - 1) / width, (x - middle) / width
    inside = jnp.clip(offset, -half / width, half / width)
    beyond = offset - inside
    away = inside[:, None] - ((centres[anchors] - middle) / width)[None, :]
    anchor = jnp.exp(-jnp.abs(away) * (jnp.abs(away) + 2 * jnp.abs(beyond)[:, None]))
    # Where the ratio is limited the anchor weighs nothing.
    limit = _LARGEST_EXPONENT / reach
    ratio = jnp.exp(jnp.clip(2 * spacing * (away + beyond[:, None]), -limit, limit))
    powers = [anchor] * (2 * reach + 1)
    inverse = 1 / ratio
    for i in range(1, reach + 1):
        powers[reach + i] = powers[reach + i - 1] * ratio
        powers[reach - i] = powers[reach - i + 1] * inverse
    falling = jnp.exp(-((jnp.asarray(steps, dtype=centres.dtype) * spacing) ** 2))
    weights = falling[None, :] * jnp.stack(powers, 0)[reach + steps, :, nearest].T
    return weights * (1 / weights.sum(-1, keepdims=True))


def is_even(centres: np.ndarray, widths: np.ndarray) -> bool:
    """Whether `even_memberships` applies: equal spacing and widths, and no overflow."""
    count = len(centres)
    if count < 2 or np.any(np.diff(centres) <= 0):
        return False
    steps = np.diff(centres)
    even = np.allclose(steps, steps[0], rtol=1e-12) and np.allclose(widths, widths[0], rtol=1e-12)
    spacing, double = steps[0] / widths[0], jnp.result_type(float) == jnp.float64
    if count > _FEW:
        return bool(even and double and spacing < _WIDEST)
    return bool(even and ((count - 1) * spacing) ** 2 < (_LARGEST_EXPONENT if double else _LARGEST_SINGLE))


class FuzzySystem(eqx.Module):
    """Rule base over p inputs with M Gaussian sets each: one rule per combination, M^p rules.

    The same sets serve every axis. Set l of input j is exp(-((x_j - centre_jl) / width_jl)^2). `evenly_spaced`
    asserts equal spacing and widths on every input, which makes the evaluation faster.

    Raises:
        BadInput: widths not positive, or shapes that do not match.
    """

    centres: Float[Param, "p M"] = param("unit of the input", "centres of the sets", symbol="c")
    widths: Float[Param, "p M"] = param("unit of the input", "widths of the sets", symbol="sigma")
    evenly_spaced: bool = eqx.field(static=True, default=False)

    def __check_init__(self):
        shapes = np.shape(self.centres), np.shape(self.widths)
        if len(shapes[0]) != 2 or shapes[0] != shapes[1] or 0 in shapes[0]:
            raise BadInput("centres", "have one row of sets per input, like widths", shapes)
        checks.finite("centres", self.centres)
        checks.positive("widths", self.widths)

    @property
    def inputs(self) -> int:
        """Number p of inputs."""
        return self.centres.shape[0]

    @property
    def rules(self) -> int:
        """Number M^p of rules."""
        return self.centres.shape[1] ** self.inputs

    @eqx.filter_jit
    def basis(self, inputs: Float[Array, "n p"]) -> Float[Array, "n rules"]:
        """Fuzzy basis functions xi of Eq. (37): positive, summing to one, for each of n axes.

        A product of Gaussians, normalised, is an outer product of normalised Gaussians: never 0/0, however far
        the input lies from every set.
        """
        degrees = even_memberships if self.evenly_spaced else memberships
        basis = degrees(inputs[:, 0], self.centres[0], self.widths[0])
        for j in range(1, self.inputs):
            degrees_of_input = degrees(inputs[:, j], self.centres[j], self.widths[j])
            basis = (basis[:, :, None] * degrees_of_input[:, None, :]).reshape(basis.shape[0], -1)
        return basis

    def output(self, weights: Float[Array, "n rules"], basis: Float[Array, "n rules"]) -> Float[Array, " n"]:
        """theta^T xi of Eqs. (36) and (42); between the smallest and the largest weight."""
        return (weights * basis).sum(-1)

    @eqx.filter_jit
    def basis_norm_squared(self) -> Float[Array, ""]:
        """|xi(0)|^2: the only figure of the fuzzy design that matters for small signals; between 1/rules and 1."""
        return (self.basis(jnp.zeros((1, self.inputs))) ** 2).sum()


def gaussian_sets(count: int = 5, reach: tuple[float, ...] = (1.0,), width: float | None = None) -> FuzzySystem:
    """Equally spaced sets from -reach to reach on every input.

    Args:
        count: sets per input; one set is the constant 1.
        reach: outermost centre of each input, in its unit; one entry per input.
        width: of each set as a share of `reach`; default: the spacing.

    Raises:
        BadInput: count < 1, reach or width not positive.
    """
    if count < 1:
        raise BadInput("sets", "be 1 or more", count)
    checks.positive("reach", np.asarray(reach))
    spacing = 2.0 / (count - 1) if count > 1 else 1.0
    share = spacing if width is None else width
    checks.positive("width", share)
    centres = np.linspace(-1.0, 1.0, count) if count > 1 else np.zeros(1)
    rows = np.asarray(reach, dtype=float)[:, None]
    widths = np.full(count, share)
    return FuzzySystem(rows * centres, rows * widths, evenly_spaced=is_even(centres, widths))

"""Elementary functions made of sums, products and fused products: the same bits on every machine, within a few ulp.

Range reductions after W. J. Cody and W. Waite, Software Manual for the Elementary Functions (1980). The polynomials are
Chebyshev fits made with 60 digits (`mpmath.chebyfit`), off by less than a tenth of a double's last place. Where a
result is below the ordinary numbers it is zero.
"""

from collections.abc import Sequence
from math import inf, nan, pi
from typing import NamedTuple

from simdjit.argument_reduction import quarters_of
from simdjit.calls import called, rarely
from simdjit.graph import F64
from simdjit.scalar import Scalar, fused, larger, smaller, where


class _Format(NamedTuple):
    """A kind of floating-point number.

    Attributes:
        whole: integers of its size.
        digits: bits of its fraction.
        bias: of its exponent.
        tiny: the least ordinary number.
        largest, least: x for which e^x is the largest and the least ordinary number.
        ln2, half_pi: in parts; so short that small whole numbers times all but the last are exact.
        turned: angles for which the parts of half_pi suffice.
        root: bits of the square root of one half.
    """

    whole: str
    digits: int
    bias: int
    tiny: float
    largest: float
    least: float
    ln2: tuple[float, ...]
    half_pi: tuple[float, ...]
    turned: float
    root: int


def _hex(*parts: str) -> tuple[float, ...]:
    return tuple(map(float.fromhex, parts))


FORMATS = {
    "float64": _Format(
        whole="int64",
        digits=52,
        bias=1023,
        tiny=2.0**-1022,
        largest=709.782712893384,
        least=-708.3964185322641,
        ln2=_hex("0x1.62e42fee00000p-1", "0x1.a39ef35793c76p-33"),
        half_pi=_hex("0x1.921fb54400000p+0", "0x1.0b4611a600000p-34", "0x1.3198a2e037073p-69"),
        turned=1e6,
        root=0x3FE6A09E667F3BCD,
    ),
    "float32": _Format(
        whole="int32",
        digits=23,
        bias=127,
        tiny=2.0**-126,
        largest=88.72283,
        least=-87.33654,
        ln2=_hex("0x1.62e4p-1", "0x1.7f7d1cp-20"),
        half_pi=_hex("0x1.92p+0", "0x1.fb4p-12", "0x1.4442d18p-24"),
        turned=1e4,
        root=0x3F3504F3,
    ),
}

# (e^r - 1 - r) / r^2 of r up to ln(2) / 2.
_EXP = [
    0.5,
    0.1666666666666667,
    0.04166666666666667,
    0.008333333333326136,
    0.0013888888888883748,
    0.00019841269874820627,
    2.4801587325547743e-05,
    2.7557255400206422e-06,
    2.75572736431103e-07,
    2.5105217004720745e-08,
    2.0914686968086876e-09,
]
# (2 artanh(s) - 2 s) / s^3 of s^2, s up to tan(pi / 8)^2.
_LOG = [
    0.666666666666667,
    0.39999999999899444,
    0.2857142862600327,
    0.22222211130259878,
    0.18182889455674947,
    0.15331710618210773,
    0.14616585424888623,
]
# (sin(r) - r) / r^3 and (cos(r) - 1 + r^2 / 2) / r^4 of r^2, r up to pi / 4.
_SIN = [
    -0.16666666666666666,
    0.008333333333330936,
    -0.00019841269836740532,
    2.7557316093198404e-06,
    -2.5051129896450185e-08,
    1.5917988979397435e-10,
]
_COS = [
    0.041666666666666664,
    -0.0013888888888887389,
    2.48015872987544e-05,
    -2.755731726587808e-07,
    2.087614504941318e-09,
    -1.138254464534925e-11,
]
# (arctan(s) - s) / s^3 of s^2, s up to tan(pi / 8).
_ATAN = [
    -0.3333333333333333,
    0.1999999999999548,
    -0.14285714284657894,
    0.11111111014561013,
    -0.09090904549884611,
    0.07692182535116648,
    -0.06664502215671447,
    0.058580687568615106,
    -0.05085030492810941,
    0.03921955253255129,
    -0.019162068915902573,
]


def exp(x: Scalar) -> Scalar:
    """e^x."""
    return _exp_halved(x, 0)


def _exp_halved(x: Scalar, times: int) -> Scalar:
    """e^x / 2^times; infinite only where that is."""
    form = FORMATS[x.type]
    small, n = exp_parts(x)
    most, least = (bound + times * 0.6931471805599453 for bound in (form.largest, form.least))
    return where(x < least, 0.0, where(x.apply("le", most), scaled(small + 1.0, n, -times), x * inf))


def scaled(x: Scalar, n: Scalar, more: int = 0) -> Scalar:
    """x 2^(n + more) where both x and the result are ordinary numbers: a small whole number is put to the exponent."""
    form = FORMATS[x.type]
    return (x.to("bits", form.whole) + (number(n, more) << form.digits)).to("bits", x.type)


def expm1(x: Scalar) -> Scalar:
    """e^x - 1, exact to the last digits for small x."""
    grown = _expm1_halved(larger(x, -50.0))
    return where(x > FORMATS[x.type].largest, inf, grown + grown)


def _expm1_halved(x: Scalar) -> Scalar:
    """(e^x - 1) / 2 for x from -50 on."""
    small, n = exp_parts(x)
    form = FORMATS[x.type]
    half = (number(n, form.bias - 1) << form.digits).to("bits", x.type)
    return fused(half, small, half - 0.5)


def exp_parts(x: Scalar) -> tuple[Scalar, Scalar]:
    """expm1 of what is left after whole multiples of ln 2, and their number."""
    n = (x * 1.4426950408889634).apply("round")
    r = _less(x, n, FORMATS[x.type].ln2)
    return grown(r), n


def grown(r: Scalar) -> Scalar:
    """e^r - 1 of a small number."""
    return fused(r * r, polynomial(r, _EXP), r)


def number(n: Scalar, more: int = 0) -> Scalar:
    """A small whole number and some more in the lowest bits of an integer: quicker than a conversion."""
    form = FORMATS[n.type]
    return (n + (1.5 * 2.0**form.digits + more)).to("bits", form.whole)


def _less(x: Scalar, n: Scalar, parts: Sequence[float]) -> Scalar:
    """x - n (a + b + c), part by part."""
    for part in parts:
        x = fused(n, -part, x)
    return x


def tanh(x: Scalar) -> Scalar:
    """By E = expm1(2|x|): E / (E + 2); 1 from 20 on."""
    size = smaller(abs(x), 20.0)
    half = _expm1_halved(size + size)
    return (half / (half + 1.0)).signed(x)


def sinh(x: Scalar) -> Scalar:
    """By E = expm1(|x|): (E + E / (E + 1)) / 2, which is e^|x| / 2 from 40 on."""
    size = abs(x)
    half = _expm1_halved(smaller(size, 40.0))
    return where(size > 40.0, _exp_halved(size, 1), half + half / (half + half + 1.0)).signed(x)


def cosh(x: Scalar) -> Scalar:
    """(e^|x| + e^-|x|) / 2."""
    half = _exp_halved(abs(x), 1)
    return half + 0.25 / half


def log_parts(x: Scalar) -> tuple[Scalar, Scalar]:
    """n and f of an ordinary positive number 2^n (1 + f), 1 + f from sqrt(1/2) to sqrt(2)."""
    form = FORMATS[x.type]
    bits = x.to("bits", form.whole)
    power = (bits - form.root) >> form.digits
    f = (bits - (power << form.digits)).to("bits", x.type) - 1.0
    return power.to("convert", x.type), f


def log(x: Scalar) -> Scalar:
    """By 2 artanh(f / (2 + f)) of what is left after powers of two; that of less than ordinary numbers is that of 0."""
    form = FORMATS[x.type]
    n, f = log_parts(x)
    s = f / (f + 2.0)
    z = s * s
    tail = s * fused(z, polynomial(z, _LOG), -f)  # 2 s = f - s f
    result = fused(n, form.ln2[0], f + fused(n, form.ln2[1], tail))
    return where(x < inf, where(x < form.tiny, where(x < -form.tiny, x.constant(nan), -inf), result), x)


def log1p(x: Scalar) -> Scalar:
    """log(1 + x), with what the sum lost put back."""
    whole = x + 1.0
    lost = (x - (whole - 1.0)) / whole
    return where(x < inf, log(whole) + where(whole > 0.0, lost, 0.0), x)


def asinh(x: Scalar) -> Scalar:
    """log(|x| + sqrt(x^2 + 1)), of large numbers log(2|x|)."""
    size = abs(x)
    square = size * size
    near = size + square / ((square + 1.0).apply("sqrt") + 1.0)
    return _log1p_or_twice(size, near).signed(x)


def acosh(x: Scalar) -> Scalar:
    """log(x + sqrt(x^2 - 1)), of large numbers log(2 x)."""
    beyond = x - 1.0
    near = beyond + (beyond * (beyond + 2.0)).apply("sqrt")
    return where(x < 1.0, nan, _log1p_or_twice(x, near))


def _log1p_or_twice(x: Scalar, near: Scalar) -> Scalar:
    """log(1 + near), of large x log(2 x)."""
    large = x > 2.0**28
    return log1p(where(large, x - 1.0, near)) + where(large, x.constant(0.6931471805599453), 0.0)


def atanh(x: Scalar) -> Scalar:
    """log((1 + |x|) / (1 - |x|)) / 2."""
    size = abs(x)
    return (log1p((size + size) / (1.0 - size)) * 0.5).signed(x)


def sin(x: Scalar) -> Scalar:
    """Of any finite angle."""
    return _turned(x, 0)


def cos(x: Scalar) -> Scalar:
    """Of any finite angle."""
    return _turned(x, 1)


def tan(x: Scalar) -> Scalar:
    """sin(x) / cos(x)."""
    return sin(x) / cos(x)


def _turned(x: Scalar, more: int) -> Scalar:
    """sin of some quarter turns beyond x."""
    form = FORMATS[x.type]
    n = (x * (2 / pi)).apply("round")
    near = _sine(_less(x, n, form.half_pi), number(n, more))
    return rarely(abs(x) > form.turned, x, _FAR[more], near)


def _sine(r: Scalar, quarters: Scalar) -> Scalar:
    """sin of some quarter turns beyond a small angle."""
    z = r * r
    even = fused(r * z, polynomial(z, _SIN), r)
    odd = fused(z * z, polynomial(z, _COS), fused(z, -0.5, 1.0))
    value = where((quarters & 1).equal(0), even, odd)
    return where((quarters & 2).equal(0), value, -value)


def _turned_far(x: Scalar, more: int) -> Scalar:
    turns, rest = quarters_of(abs(x).to("convert", F64))
    value = _sine(rest * (pi / 2), number(turns, more)).to("convert", x.type)
    if not more:
        value = where(x < 0.0, -value, value)
    return where(abs(x) < inf, value, nan)


_FAR = (called("sin_far")(lambda x: _turned_far(x, 0)), called("cos_far")(lambda x: _turned_far(x, 1)))


def atan(x: Scalar) -> Scalar:
    """Inverse of tan, from -pi/2 to pi/2."""
    return _slope(abs(x), x.constant(1.0)).signed(x)


def atan2(y: Scalar, x: Scalar) -> Scalar:
    """Angle of a point; 0 at the origin, and a multiple of pi/4 for one that is infinitely far."""
    up, along = abs(y), abs(x)
    nowhere, endless = smaller(up, along), larger(up, along)
    up, along = up * 0.25, along * 0.25  # their sum is finite
    both = nowhere.equal(inf)
    turn = _slope(where(both, 1.0, up), where(both | endless.equal(0.0), 1.0, along))
    left = x.to("bits", FORMATS[x.type].whole) < 0
    return where(left, pi - turn, turn).signed(y)


def asin(x: Scalar) -> Scalar:
    """Inverse of sin."""
    return _slope(abs(x), ((1.0 - x) * (x + 1.0)).apply("sqrt")).signed(x)


def acos(x: Scalar) -> Scalar:
    """Inverse of cos."""
    turn = _slope(((1.0 - x) * (x + 1.0)).apply("sqrt"), abs(x))
    return where(x < 0.0, pi - turn, turn)


def _slope(up: Scalar, along: Scalar) -> Scalar:
    """atan(up / along) of two that are not negative: a multiple of pi/4, and a small rest."""
    steep, middle = (up > along * bound for bound in (2.414213562373095, 0.4142135623730951))
    s = where(steep, -along, where(middle, up - along, up)) / where(steep, up, where(middle, up + along, along))
    z = s * s
    rest = fused(s * z, polynomial(z, _ATAN), s)
    return where(steep, pi / 2, where(middle, rest.constant(pi / 4), 0.0)) + rest


def polynomial(x: Scalar, coefficients: Sequence[float]) -> Scalar:
    """c0 + c1 x + c2 x^2 + ... by pairs, pairs of pairs and so on (Estrin): short chains of operations."""
    terms = [x.constant(c) for c in coefficients]
    while len(terms) > 1:
        pairs = [terms[i : i + 2] for i in range(0, len(terms), 2)]
        terms = [fused(pair[1], x, pair[0]) if len(pair) == 2 else pair[0] for pair in pairs]
        x = x * x
    return terms[0]

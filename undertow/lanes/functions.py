"""Elementary functions made of additions and multiplications: the same bits on every machine, within a few ulp.

Range reductions after W. J. Cody and W. Waite, Software Manual for the Elementary Functions (1980); the polynomials
are Taylor series, cut where a double ends.
"""

from collections.abc import Sequence
from math import factorial, inf, nan, pi
from typing import NamedTuple

from undertow.lanes.scalar import Scalar, larger, smaller, where


class _Format(NamedTuple):
    """A kind of floating-point number.

    Attributes:
        whole: integers of its size.
        digits: bits of its fraction.
        bias: of its exponent.
        largest: x for which e^x and e^-x are ordinary numbers.
        ln2, half_pi: in parts; so short that small whole numbers times all but the last are exact.
        root: bits of the square root of one half.
    """

    whole: str
    digits: int
    bias: int
    largest: float
    ln2: tuple[float, ...]
    half_pi: tuple[float, ...]
    root: int


def _hex(*parts: str) -> tuple[float, ...]:
    return tuple(map(float.fromhex, parts))


_FORMATS = {
    "float64": _Format(
        whole="int64",
        digits=52,
        bias=1023,
        largest=708.0,
        ln2=_hex("0x1.62e42fee00000p-1", "0x1.a39ef35793c76p-33"),
        half_pi=_hex("0x1.921fb54400000p+0", "0x1.0b4611a600000p-34", "0x1.3198a2e037073p-69"),
        root=0x3FE6A09E667F3BCD,
    ),
    "float32": _Format(
        whole="int32",
        digits=23,
        bias=127,
        largest=87.0,
        ln2=_hex("0x1.62e4p-1", "0x1.7f7d1cp-20"),
        half_pi=_hex("0x1.92p+0", "0x1.fb4p-12", "0x1.4442d18p-24"),
        root=0x3F3504F3,
    ),
}

_EXP = [1 / factorial(k) for k in range(2, 14)]
_LOG = [2 / (2 * k + 1) for k in range(1, 12)]
_SIN = [(-1) ** k / factorial(2 * k + 1) for k in range(1, 8)]
_COS = [(-1) ** k / factorial(2 * k) for k in range(2, 9)]
_ATAN = [(-1) ** k / (2 * k + 1) for k in range(1, 23)]


def exp(x: Scalar) -> Scalar:
    """e^x; zero or infinite where that is no ordinary number."""
    most = _FORMATS[x.type].largest
    small, scale = _exp_parts(smaller(larger(x, -most), most))
    return where(x < -most, 0.0, where(x > most, inf, scale + scale * small))


def expm1(x: Scalar) -> Scalar:
    """e^x - 1, exact to the last digits for small x."""
    most = _FORMATS[x.type].largest
    small, scale = _exp_parts(smaller(larger(x, -most), most))
    return where(x > most, inf, scale * small + (scale - 1.0))


def _exp_parts(x: Scalar) -> tuple[Scalar, Scalar]:
    """expm1 of what is left after whole multiples of ln 2, and two to the power of their number."""
    form = _FORMATS[x.type]
    n = (x * 1.4426950408889634).apply("round")
    r = _less(x, n, form.ln2)
    scale = (_number(n, form.bias) << form.digits).to("bits", x.type)
    return r + r * r * polynomial(r, _EXP), scale


def _number(n: Scalar, more: int = 0) -> Scalar:
    """A small whole number and some more in the lowest bits of an integer: quicker than a conversion."""
    form = _FORMATS[n.type]
    return (n + (1.5 * 2.0**form.digits + more)).to("bits", form.whole)


def _less(x: Scalar, n: Scalar, parts: Sequence[float]) -> Scalar:
    """x - n (a + b + c), part by part."""
    for part in parts:
        x = x - n * part
    return x


def tanh(x: Scalar) -> Scalar:
    """By expm1(2|x|); 1 from 20 on."""
    size = smaller(abs(x), 20.0)
    grown = expm1(size + size)
    return _signed(x, grown / (grown + 2.0))


def sinh(x: Scalar) -> Scalar:
    """By E = expm1(|x|): (E + E / (E + 1)) / 2."""
    grown = expm1(abs(x))
    return _signed(x, (grown + grown / (grown + 1.0)) * 0.5)


def cosh(x: Scalar) -> Scalar:
    """(e^x + e^-x) / 2."""
    grown = exp(abs(x))
    return (grown + 1.0 / grown) * 0.5


def log(x: Scalar) -> Scalar:
    """By 2 artanh(f / (2 + f)) of what is left after powers of two."""
    form = _FORMATS[x.type]
    bits = x.to("bits", form.whole)
    power = (bits - form.root) >> form.digits  # leaves a fraction from sqrt(1/2) to sqrt(2)
    f = (bits - (power << form.digits)).to("bits", x.type) - 1.0
    n = power.to("convert", x.type)
    s = f / (f + 2.0)
    z = s * s
    tail = s * z * polynomial(z, _LOG) - s * f  # 2 s = f - s f
    result = n * form.ln2[0] + (f + (tail + n * form.ln2[1]))
    return where(x < inf, where(x < 0.0, nan, where(x.equal(0.0), -inf, result)), x)


def log1p(x: Scalar) -> Scalar:
    """log(1 + x), with what the sum lost put back."""
    whole = x + 1.0
    lost = (x - (whole - 1.0)) / whole
    return where(x < inf, log(whole) + where(whole > 0.0, lost, 0.0), x)


def sin(x: Scalar) -> Scalar:
    """For |x| up to a million; beyond that digits are lost."""
    return _turned(x, 0)


def cos(x: Scalar) -> Scalar:
    """For |x| up to a million; beyond that digits are lost."""
    return _turned(x, 1)


def tan(x: Scalar) -> Scalar:
    """sin(x) / cos(x)."""
    return sin(x) / cos(x)


def _turned(x: Scalar, more: int) -> Scalar:
    """sin of some quarter turns beyond x."""
    n = (x * (2 / pi)).apply("round")
    r = _less(x, n, _FORMATS[x.type].half_pi)
    z = r * r
    sine = r + r * z * polynomial(z, _SIN)
    cosine = 1.0 + (z * z * polynomial(z, _COS) - z * 0.5)
    number = _number(n, more)
    value = where((number & 1).equal(0), sine, cosine)
    return where((number & 2).equal(0), value, -value)


def atan(x: Scalar) -> Scalar:
    """Inverse of tan, from -pi/2 to pi/2."""
    return _signed(x, _slope(abs(x), x.constant(1.0)))


def atan2(y: Scalar, x: Scalar) -> Scalar:
    """Angle of a point; 0 at the origin."""
    nowhere = x.equal(0.0) & y.equal(0.0)
    turn = _slope(abs(y), where(nowhere, 1.0, abs(x)))
    return _signed(y, where(x < 0.0, pi - turn, turn))


def asin(x: Scalar) -> Scalar:
    """Inverse of sin."""
    return atan2(x, ((1.0 - x) * (x + 1.0)).apply("sqrt"))


def acos(x: Scalar) -> Scalar:
    """Inverse of cos."""
    return atan2(((1.0 - x) * (x + 1.0)).apply("sqrt"), x)


def _slope(up: Scalar, along: Scalar) -> Scalar:
    """atan(up / along) of two that are not negative: a multiple of pi/4, and a small rest."""
    steep, middle = (up > along * bound for bound in (2.414213562373095, 0.4142135623730951))
    s = where(steep, -along, where(middle, up - along, up)) / where(steep, up, where(middle, up + along, along))
    z = s * s
    rest = s + s * z * polynomial(z, _ATAN)
    return where(steep, pi / 2, where(middle, rest.constant(pi / 4), 0.0)) + rest


def power(x: Scalar, y: Scalar) -> Scalar:
    """x^y of a base that is not negative, by exp(y log x)."""
    return where(y.equal(0.0), 1.0, where(x.equal(0.0), 0.0, exp(y * log(x))))


def _signed(x: Scalar, size: Scalar) -> Scalar:
    return where(x < 0.0, -size, size)


def polynomial(x: Scalar, coefficients: Sequence[float]) -> Scalar:
    """c0 + c1 x + c2 x^2 + ... by pairs, pairs of pairs and so on (Estrin): short chains of operations."""
    terms = [x.constant(c) for c in coefficients]
    while len(terms) > 1:
        pairs = [terms[i : i + 2] for i in range(0, len(terms), 2)]
        terms = [pair[0] + pair[1] * x if len(pair) == 2 else pair[0] for pair in pairs]
        x = x * x
    return terms[0]

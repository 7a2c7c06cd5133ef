"""Powers, right to a few units of the last place however large they are.

The logarithm to base two is carried in two parts, as in K. C. Ng's e_pow.c (Sun Microsystems, 1993).
"""

from math import inf, nan

from simdjit.functions import FORMATS, exp, grown, log, log_parts, polynomial, scaled
from simdjit.graph import F64
from simdjit.scalar import Scalar, where

_LN2 = 0.6931471805599453

# 2 / (3 ln 2), whole and in two parts, the first of 26 bits.
_SCALE = float.fromhex("0x1.ec709dc3a03fdp-1")
_SCALE_PARTS = (float.fromhex("0x1.ec709d8000000p-1"), float.fromhex("0x1.0e80ff5d27f05p-27"))

# log(m) = 2/3 s (3 + s^2 + r), s = (m - 1) / (m + 1); r = s^4 times this of s^2.
_TAIL = [
    0.6000000000000004,
    0.4285714285700776,
    0.3333333340665351,
    0.27272712371316815,
    0.23078362194693047,
    0.19928936152790028,
    0.19370426508273375,
]


def exp2(x: Scalar) -> Scalar:
    """2^x."""
    return _exp2(x, x.constant(0.0))


def _exp2(x: Scalar, less: Scalar) -> Scalar:
    """2^(x + less), less much smaller than x."""
    n = x.apply("round")
    result = scaled(grown(((x - n) + less) * _LN2) + 1.0, n)
    bias, whole = FORMATS[x.type].bias, x + less
    return where(whole < 1.0 - bias, 0.0, where(whole < bias + 1.0, result, x * inf))


def power(x: Scalar, y: Scalar) -> Scalar:
    """x^y as IEEE 754 has it; y may be a whole number of another type."""
    size = abs(x)
    if y.type.startswith("float"):
        whole, half = y.apply("floor").equal(y), y * 0.5
        odd = whole & half.apply("floor").apply("ne", half)
    else:
        whole, odd = y.equal(y), (y & 1).equal(1)
    result = where(size.equal(1.0) & y.equal(y), 1.0, _of_size(size, y))
    result = where((x < 0.0) & (size < inf), where(whole, result, nan), result)
    negative = x.to("bits", FORMATS[x.type].whole) < 0
    result = where(odd & negative, -result, result)
    return where(y.equal(0) | x.equal(1.0), 1.0, result)


def _of_size(size: Scalar, y: Scalar) -> Scalar:
    """Power of a number that is not negative; that of less than ordinary numbers is that of 0."""
    y = y.to("convert", F64)
    if size.type != F64:
        return exp(y * log(size.to("convert", F64))).to("convert", size.type)
    high, low = _log2(size)
    coarse = _upper(y)
    product = coarse * high
    ordinary = (size.apply("ge", FORMATS[F64].tiny)) & (size < inf) & (abs(y) < inf)
    edge = y * where(size < FORMATS[F64].tiny, size.constant(-inf), where(size < inf, high, size))
    return _exp2(where(ordinary, product, edge), where(ordinary, (y - coarse) * high + y * low, 0.0))


def _log2(x: Scalar) -> tuple[Scalar, Scalar]:
    """log2 of an ordinary positive double, its upper half and the rest."""
    n, f = log_parts(x)
    inverse = 1.0 / (f + 2.0)
    s = f * inverse
    # s and f + 2 in halves, whose products are exact.
    coarse, whole = _upper(s), _upper(f + 2.0)
    rest = f - (whole - 2.0)
    fine = inverse * ((f - coarse * whole) - coarse * rest)
    square = coarse * coarse
    z = s * s
    tail = z * z * polynomial(z, _TAIL) + fine * (coarse + s)
    sum_ = _upper(square + 3.0 + tail)
    sum_rest = tail - ((sum_ - 3.0) - square)
    high, low = coarse * sum_, fine * sum_ + sum_rest * s
    upper = _upper(high + low)
    lower = low - (upper - high)
    first = _SCALE_PARTS[0] * upper
    second = _SCALE_PARTS[1] * upper + lower * _SCALE
    total = _upper(first + second + n)
    return total, second - ((total - n) - first)


def _upper(x: Scalar) -> Scalar:
    """A double with the lower half of its digits left out."""
    return (x.to("bits", "int64") & -(2**27)).to("bits", x.type)


def cbrt(x: Scalar) -> Scalar:
    """By its logarithm, and a step of Newton's."""
    size = abs(x)
    root = exp(log(size) * (1.0 / 3.0))
    root = root + (size / (root * root) - root) * (1.0 / 3.0)
    return where(size.apply("ge", FORMATS[x.type].tiny) & (size < inf), root.signed(x), x)

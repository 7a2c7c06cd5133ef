"""Large angles in quarter turns: as many digits of 2/pi as it takes.

M. H. Payne and R. N. Hanek, Radian reduction for trigonometric functions, ACM SIGNUM Newsletter 18 (1983).
"""

from functools import cache

from simdjit.graph import I64, U64
from simdjit.scalar import Scalar, larger, smaller

# Bits of 2/pi in one piece, and pieces: a product with half a number is exact, and what is left after the last one
# is less than 2^-129 quarter turns.
_BITS, _PIECES = 23, 8

# Zeros before the point of 2/pi, so that small numbers find some, too; words of 32 bits in all.
_ZEROS, _WORDS = 64, 41


def quarters_of(x: Scalar) -> tuple[Scalar, Scalar]:
    """Quarter turns of a positive double from 1e4 on, whole ones but for multiples of four, and the rest."""
    bits = x.to("bits", I64)
    first = (bits >> 52) - 1013  # place of the digit of 2/pi that tells two quarter turns
    whole = ((bits & (2**52 - 1)) | (1075 << 52)).to("bits", x.type)
    high = (whole.to("bits", I64) & -(2**26)).to("bits", x.type)
    low, high = whole - high, high * 2.0**-26
    pieces = [_piece(first + _BITS * k) for k in range(_PIECES)]
    # Products by what their last digit weighs; whole multiples of four quarter turns are left out at once.
    of_high = [high * piece * 2.0 ** (5 - _BITS * k) for k, piece in enumerate(pieces)]
    of_low = [low * piece * 2.0 ** (-21 - _BITS * k) for k, piece in enumerate(pieces)]
    angle = _within_a_turn(of_high[1]) + _within_a_turn(of_low[0])
    angle = angle + (_within_a_turn(of_high[2]) + _within_a_turn(of_low[1]))
    turns = angle.apply("round")
    rest, lost = angle - turns, x.constant(0.0)
    for k in range(3, _PIECES):
        for term in (of_high[k], of_low[k - 1]):
            rest, error = _exact_sum(rest, term)
            lost = lost + error
    return turns, rest + lost


def _within_a_turn(quarters: Scalar) -> Scalar:
    return quarters - (quarters * 0.25).apply("round") * 4.0


def _exact_sum(a: Scalar, b: Scalar) -> tuple[Scalar, Scalar]:
    """The sum, and what it lost (D. E. Knuth)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


def _piece(place: Scalar) -> Scalar:
    """Digits of 2/pi from a place on, as a whole number."""
    graph = place.graph
    words = [graph.constant(word, U64) for word in _words()]
    word = smaller(larger(place >> 5, 0), len(words) - 1)
    found = Scalar(graph, graph.entry(words, word.node)) << (place & 31).to("bits", U64)
    return ((found >> (64 - _BITS)) | (1075 << 52)).to("bits", "float64") - 2.0**52


@cache
def _words() -> list[int]:
    """Digits of 2/pi, 64 from every 32nd on."""
    more = 64
    scale = 32 * _WORDS - _ZEROS + more
    inverse = lambda n: sum((-1) ** k * (1 << scale) // ((2 * k + 1) * n ** (2 * k + 1)) for k in range(scale // 4))
    pi = 4 * (4 * inverse(5) - inverse(239))  # J. Machin
    digits = ((2 << 2 * scale) // pi) >> more
    return [digits >> 32 * (_WORDS - 2 - i) & (2**64 - 1) for i in range(_WORDS - 1)]

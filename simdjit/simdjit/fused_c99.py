"""Fused products in C99 for libraries whose `fma` rounds twice, as newlib's does where the processor has none.

A program that is compiled with -DSOFTWARE_FMA takes these everywhere, so that any machine can test them; and one with
-DQUICK_FMA that of WebAssembly, which has fast sums and products of doubles and no fused one.
"""

# In whole numbers, for processors without a unit for doubles. The product has 106 bits and is exact in 128, with the
# sum's room above it and, below, a bit that stands for all that was shifted out. Bits are lost only where the parts
# are so far from each other that at most one leading bit cancels.
#
# In doubles: the product as a sum of two (T. J. Dekker, 1971), and that plus the third by a sum that is rounded to odd
# (S. Boldo, G. Melquiond, 2008). Where a part might leave the range, libm's own.
_FLOAT64 = """\
#if defined(SOFTWARE_FMA) || (defined(_NEWLIB_VERSION) && !defined(__FP_FAST_FMA))
typedef struct {
    uint64_t high, low;
    int32_t exponent; /* of the last bit */
    bool negative;
} wide_float64;

static wide_float64 wide_of_float64(double x) {
    uint64_t bits;
    (void)memcpy(&bits, &x, sizeof bits);
    wide_float64 y = {bits & 0xFFFFFFFFFFFFFULL, 0, (int32_t)((bits >> 52) & 0x7FF), (bits >> 63) != 0};
    if (y.exponent == 0) {
        for (y.exponent = 1; (y.high >> 52) == 0; --y.exponent) {
            y.high <<= 1;
        }
    } else {
        y.high |= 1ULL << 52;
    }
    y.exponent -= 1075;
    return y;
}

static void shift_right(wide_float64 *x, int32_t bits) {
    for (; bits > 0 && (x->high | x->low) > 1; bits -= 32) {
        const uint32_t n = (bits < 32) ? (uint32_t)bits : 32U;
        const uint64_t lost = (x->low << (64U - n)) != 0;
        x->low = (x->low >> n) | (x->high << (64U - n)) | lost;
        x->high >>= n;
    }
}

static double fused_float64(double x, double y, double z) {
    if (!isfinite(x) || !isfinite(y) || x == 0 || y == 0) {
        return x * y + z;
    }
    if (!isfinite(z) || z == 0) {
        return (z == 0) ? (x * y) : (z + z);
    }
    const wide_float64 a = wide_of_float64(x), b = wide_of_float64(y);
    wide_float64 s = wide_of_float64(z), p = {0, 0, a.exponent + b.exponent - 20, a.negative != b.negative};
    const uint64_t a1 = a.high >> 32, a0 = a.high & 0xFFFFFFFFU, b1 = b.high >> 32, b0 = b.high & 0xFFFFFFFFU;
    const uint64_t low = a0 * b0, one = a1 * b0 + (low >> 32), other = a0 * b1 + (one & 0xFFFFFFFFU);
    p.high = a1 * b1 + (one >> 32) + (other >> 32);
    p.low = (other << 32) | (low & 0xFFFFFFFFU);
    p.high = (p.high << 20) | (p.low >> 44);
    p.low <<= 20;
    s.high <<= 8;
    s.exponent -= 72;
    wide_float64 *const lesser = (p.exponent < s.exponent) ? &p : &s;
    const int32_t exponent = (p.exponent < s.exponent) ? s.exponent : p.exponent;
    shift_right(lesser, exponent - lesser->exponent);
    if (p.negative == s.negative) {
        s.low += p.low;
        s.high += p.high + ((s.low < p.low) ? 1U : 0U);
    } else {
        const bool turned = (p.high < s.high) || (p.high == s.high && p.low < s.low);
        const wide_float64 large = turned ? s : p, small = turned ? p : s;
        s = large;
        s.low -= small.low;
        s.high -= small.high + ((large.low < small.low) ? 1U : 0U);
        if ((s.high | s.low) == 0) {
            return 0.0;
        }
    }
    s.exponent = exponent + 64; /* of the last bit of its upper half, which is made to begin with a one */
    for (; (s.high >> 63) == 0; --s.exponent) {
        s.high = (s.high << 1) | (s.low >> 63);
        s.low <<= 1;
    }
    s.high |= (s.low != 0) ? 1U : 0U;
    int32_t biased = s.exponent + 63 + 1023, dropped = 11;
    if (biased < 1) {
        dropped += 1 - biased;
        biased = 1;
    }
    uint64_t bits = 0;
    if (dropped < 64) {
        const uint64_t rest = s.high << (64 - dropped), half = 1ULL << 63;
        bits = s.high >> dropped;
        bits += (rest > half || (rest == half && (bits & 1U) != 0)) ? 1U : 0U;
    } else {
        bits = (dropped == 64 && s.high > (1ULL << 63)) ? 1U : 0U;
    }
    bits += (uint64_t)(biased - 1) << 52;
    bits = (bits < (0x7FFULL << 52)) ? bits : (0x7FFULL << 52);
    bits |= s.negative ? (1ULL << 63) : 0U;
    double result;
    (void)memcpy(&result, &bits, sizeof result);
    return result;
}
#elif defined(QUICK_FMA) || defined(__wasm__)
static double odd_float64(double x, double y) {
    const double sum = x + y, part = sum - x, lost = (x - (sum - part)) + (y - part);
    int64_t bits;
    (void)memcpy(&bits, &sum, sizeof bits);
    if (lost != 0 && (bits & 1) == 0) {
        bits += ((lost > 0) == (sum > 0)) ? 1 : -1;
    }
    double result;
    (void)memcpy(&result, &bits, sizeof result);
    return result;
}

static double fused_float64(double x, double y, double z) {
    const double p = x * y, most = 0x1p900;
    if (!(fabs(p) > 0x1p-900 && fabs(p) < most && fabs(x) < most && fabs(y) < most && fabs(z) < most)) {
        return (x == 0 || y == 0) ? (p + z) : fma(x, y, z);
    }
    const double wide_x = 0x1.0000002p27 * x, wide_y = 0x1.0000002p27 * y;
    const double x1 = wide_x - (wide_x - x), y1 = wide_y - (wide_y - y), x2 = x - x1, y2 = y - y1;
    const double rest = ((x1 * y1 - p) + x1 * y2 + x2 * y1) + x2 * y2;
    const double a = z + rest, a1 = a - z, a2 = (z - (a - a1)) + (rest - a1);
    const double b = p + a, b1 = b - p, b2 = (p - (b - b1)) + (a - b1);
    return b + odd_float64(a2, b2);
}
#else
#define fused_float64 fma
#endif"""

# The sum of an exact product and a number, as a double that is rounded to odd (S. Boldo, G. Melquiond, 2008).
_FLOAT32 = """\
#if defined(SOFTWARE_FMA) || defined(QUICK_FMA) || defined(__wasm__) || \\
    (defined(_NEWLIB_VERSION) && !defined(__FP_FAST_FMAF))
static float fused_float32(float x, float y, float z) {
    const double p = (double)x * y, sum = p + z, part = sum - p;
    const double rest = (p - (sum - part)) + (z - part);
    if (!isfinite(sum) || rest == 0) {
        return (float)sum;
    }
    uint64_t bits;
    double odd;
    (void)memcpy(&bits, &sum, sizeof bits);
    if ((bits & 1U) == 0) {
        bits = ((rest > 0) == (sum > 0)) ? (bits + 1U) : (bits - 1U);
    }
    (void)memcpy(&odd, &bits, sizeof odd);
    return (float)odd;
}
#else
#define fused_float32 fmaf
#endif"""

FUSED = {"float64": _FLOAT64, "float32": _FLOAT32}

"""Fused products in C have the bits of a library that rounds them once, subnormal and infinite ones included."""

import shutil
import subprocess

import pytest

from simdjit.fused_c99 import FUSED

pytestmark = pytest.mark.compiler

COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)]

PROGRAM = """
#define %s
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

%s

%s

static uint64_t chance(void) { /* G. Marsaglia, 2003 */
    static uint64_t x = 88172645463325252ULL;
    x ^= x << 13;
    x ^= x >> 7;
    return x ^= x << 17;
}

/* Of exponents that are at most so far from zero; of any where that is zero. Some end with zeros. */
static double number(int spread) {
    uint64_t bits = chance();
    const uint64_t middle = 1023 + chance() %% (2U * (unsigned)spread + 1U) - (unsigned)spread;
    const uint64_t exponent = (spread != 0) ? middle : (chance() %% 2048);
    bits &= (chance() %% 8 == 0) ? ~0xFFFFFFFFFFFULL : ~0ULL;
    bits = (bits & 0x800FFFFFFFFFFFFFULL) | (exponent << 52);
    double x;
    (void)memcpy(&x, &bits, sizeof x);
    return x;
}

int main(void) {
    static const int spreads[] = {0, 3, 30, 60, 110, 1022};
    long different = 0;
    for (long i = 0; i < 3000000; ++i) {
        const int spread = spreads[i %% 6];
        double x = number(spread), y = number(spread), z = number(spread);
        if (i %% 7 < 2) {
            z = nextafter(-x * y, (i %% 7 == 0) ? 0.0 : 1e300); /* nearly everything cancels */
        }
        if (i %% 11 == 0) { /* less than ordinary numbers */
            x = ldexp(number(1), -1000 - (int)(chance() %% 60));
            z = ldexp(number(1), -1022 - (int)(chance() %% 60));
        }
        if (i %% 13 == 0) { /* nearly half of a last place of the product */
            z = ldexp(nextafter(x * y, (i %% 2 == 0) ? 0.0 : 1e300), (int)(chance() %% 112) - 56);
        }
        const float u = (float)x, v = (float)y, w = (float)z;
        const double one = fma(x, y, z), other = fused_float64(x, y, z);
        const float one_f = fmaf(u, v, w), other_f = fused_float32(u, v, w);
        different += memcmp(&one, &other, sizeof one) != 0 && !(isnan(one) && isnan(other));
        different += memcmp(&one_f, &other_f, sizeof one_f) != 0 && !(isnan(one_f) && isnan(other_f));
    }
    printf("%%ld different\\n", different);
    return different != 0;
}
"""


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("flags", [("-O2",), ("-O1", "-fsanitize=undefined", "-fno-sanitize-recover=all")])
@pytest.mark.parametrize("way", ["SOFTWARE_FMA", "QUICK_FMA"])
def test_products_are_fused(tmp_path, compiler, flags, way):
    (tmp_path / "fused.c").write_text(PROGRAM % (way, FUSED["float64"], FUSED["float32"]))
    options = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-ffp-contract=off", *flags]
    command = [compiler, *options, "fused.c", "-o", "fused", "-lm"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert subprocess.run(["./fused"], cwd=tmp_path, capture_output=True, text=True).stdout == "0 different\n"

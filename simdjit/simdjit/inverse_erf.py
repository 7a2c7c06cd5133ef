"""Inverse of the error function, which makes normal numbers of uniform ones.

The variable is w = -log(1 - x^2), in three parts, after M. Giles, Approximating the erfinv function, GPU Computing Gems
(2011); the polynomials are Chebyshev fits of erfinv(x) / x made with 50 digits (`mpmath.chebyfit`), off by less than
2e-15.
"""

from math import inf, nan

from simdjit.calls import called, rarely
from simdjit.functions import log, polynomial
from simdjit.scalar import Scalar, smaller, where

_CENTRAL = [
    1.6536545626831027,
    0.2401581824255897,
    -0.006033670871427011,
    -0.0007407025341669402,
    0.0001867342080212427,
    -1.3882523361276876e-05,
    -1.3654691796592068e-06,
    4.2347877672780653e-07,
    -2.907038666019143e-08,
    -4.112633104297614e-09,
    1.0512202440121784e-09,
    -5.4154417754696635e-11,
    -1.2977505202014966e-11,
    2.6335724924608484e-12,
    -8.106594456438496e-14,
    -4.0554139746886e-14,
    6.581955305929239e-15,
    2.166994626283574e-17,
    -1.290702354613073e-16,
    1.1125794759379464e-17,
    1.1027771591500033e-18,
    -1.6787330615256773e-19,
    -2.362369698566107e-22,
]
_MIDDLE = [
    3.0838856104922208,
    1.0052589676941646,
    0.005370914553573593,
    -0.003751208508030541,
    0.0024914420969979908,
    -0.0016882755445265592,
    0.0009532893618552461,
    -0.00035503764895782253,
    2.4031286377073694e-05,
    6.828561398530996e-05,
    -4.7319187369358214e-05,
    1.2472740144742724e-05,
    2.9264777314239854e-06,
    -4.008956966932278e-06,
    1.497191022600222e-06,
    1.3250759477977463e-08,
    -2.697313682066162e-07,
    9.284332225420571e-08,
]
_FAR = [
    4.849906401408584,
    1.0103004648645453,
    -0.0001387193183793902,
    -0.00021503011982656274,
    7.599527807604776e-05,
    -1.9681770719043677e-05,
    4.526052743790951e-06,
    -9.9302927406069e-07,
    2.290516780486715e-07,
    -6.755650411430056e-08,
    2.9021987809100164e-08,
    -1.525464535688987e-08,
    7.815701028842222e-09,
    -3.471592786518304e-09,
    1.3217356090705066e-09,
    -4.375207316201619e-10,
    6.64614473432584e-11,
    4.288306392748705e-11,
    -1.9689317019622416e-11,
]


@called("erf_inv_tail")
def _tail(w: Scalar) -> Scalar:
    """erfinv(x) / x for |x| above 0.999: one number in 500."""
    root = w.apply("sqrt")
    return where(w < 16.0, polynomial(root - 3.25, _MIDDLE), polynomial(root - 5.0, _FAR))


def erf_inv(x: Scalar) -> Scalar:
    """x for which erf is the given number; infinite at -1 and 1, and none beyond."""
    w = smaller(-log((1.0 - x) * (x + 1.0)), 37.0)
    result = x * rarely(w.apply("ge", 6.25), w, _tail, polynomial(w - 3.125, _CENTRAL))
    return where(abs(x) < 1.0, result, where(abs(x).equal(1.0), x * inf, nan))

"""Suite U2: U1 repeated, for long runs."""

from undertow.physics.disturbances.u1 import SuiteU1

_PERIOD = 20.0  # s, the duration for which U1 is made: its chirp never stops sweeping


def u2(scale: float = 1.0) -> SuiteU1:
    """Benchmark suite U2 for long runs: U1 of t mod 20 s, on every axis (m/s^2, rad/s^2).

    Args:
        scale: factor on all of them.
    """
    return SuiteU1(scale, _PERIOD)

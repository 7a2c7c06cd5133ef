"""Fixed steps of the pendulum that tools share: order 4 is in `pendulum`, order 8 is that of DOP853."""

from pendulum import STIFFNESS
from scipy.integrate import DOP853

_STAGES = DOP853.n_stages
_A, _B = DOP853.A[:_STAGES, :_STAGES], DOP853.B


def dop853(angle, rate, torque, h, sine):
    """One step of h seconds with the coefficients of Hairer, Norsett and Wanner that SciPy uses; order 8."""
    slopes = []
    for i in range(_STAGES):
        angle_here, rate_here = (
            now + h * sum(float(a) * slope[which] for a, slope in zip(_A[i], slopes, strict=False) if a)
            for which, now in enumerate((angle, rate))
        )
        slopes.append((rate_here, torque - STIFFNESS * sine(angle_here)))
    angle_moved, rate_moved = (
        h * sum(float(b) * slope[which] for b, slope in zip(_B, slopes, strict=True) if b) for which in (0, 1)
    )
    return angle + angle_moved, rate + rate_moved

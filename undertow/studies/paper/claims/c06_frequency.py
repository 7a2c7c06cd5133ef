"""C6: the scheme copes with uncertainty of high frequency. Up to which?"""

import itertools
import math

import numpy as np

from undertow.analysis.linear import crossing_frequency, estimation_response
from undertow.studies.paper.claims.finding import Finding, Runs, steady
from undertow.studies.paper.setup import GOAL, law_of, scenario

CLAIM = "The scheme estimates uncertainties of large amplitude and high frequency."

# rad/s; six at a time, one per axis: the axes are independent on rung `ideal`.
_QUICK = ((5.0, 20.0, 50.0, 95.0, 105.0, 200.0),)
_SWEEP = (*_QUICK, (0.5, 1.0, 2.0, 10.0, 35.0, 70.0), (90.0, 100.0, 115.0, 150.0, 300.0, 400.0))


def scenarios(quick: bool) -> dict:
    """Unit sinusoids of different frequency on the six axes, at the goal from the start."""
    return {
        _name(i): scenario(
            f"RCAFC against unit sinusoids of {', '.join(f'{w:g}' for w in block)} rad/s, one per axis",
            disturbance={"kind": "sinusoid", "amplitude": 1.0, "frequency": list(block)},
            initial={"position": GOAL},
        )
        for i, block in enumerate(_QUICK if quick else _SWEEP)
    }


def judge(runs: Runs) -> Finding:
    """|d_hat - d| / |d| against frequency, measured and predicted."""
    points = []
    for i, block in enumerate(_SWEEP):
        if _name(i) in runs:
            found = steady(runs[_name(i)])
            ratios = np.divide(found["estimation_rms_axes"], found["uncertainty_rms_axes"])
            points += zip(block, ratios.tolist(), strict=True)
    points.sort()
    law = law_of(runs["ideal_rcafc"])
    predicted = np.abs(estimation_response(law, np.array([w for w, _ in points]))).tolist()
    numbers = {
        "frequency": [w for w, _ in points],
        "error_ratio": [r for _, r in points],
        "error_ratio_predicted": predicted,
        "crossing_measured": _crossing(points),
        "crossing_predicted": crossing_frequency(law),
    }
    below, above = points[0], points[-1]
    text = (
        f"The estimate is off by {100 * below[1]:.1f} % of d at {below[0]:g} rad/s and by {100 * above[1]:.0f} % at "
        f"{above[0]:g} rad/s. From {numbers['crossing_measured']:.0f} rad/s on (predicted "
        f"{numbers['crossing_predicted']:.0f}) it is worse than no estimate at all."
    )
    verdict = f"holds if d stays well below {numbers['crossing_measured']:.0f} rad/s"
    return Finding(verdict, text, _name(0), numbers)


def _name(block: int) -> str:
    return f"c06_frequency_{block + 1}"


def _crossing(points: list[tuple[float, float]]) -> float:
    """Frequency at which the measured ratio passes 1, interpolated on logarithmic axes; infinite if nowhere."""
    for (w0, r0), (w1, r1) in itertools.pairwise(points):
        if r0 < 1 <= r1:
            share = -math.log(r0) / (math.log(r1) - math.log(r0))
            return w0 * (w1 / w0) ** share
    return math.inf

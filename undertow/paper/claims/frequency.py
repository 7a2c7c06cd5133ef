"""C6: the scheme estimates uncertainty of high frequency, and up to which frequency."""

import itertools
import math
from typing import Any

import numpy as np

from undertow.analysis.small_signal import crossing_frequency, estimation_response
from undertow.paper.claims.finding import ClaimVerdict, Runs, claim, steady
from undertow.paper.horizons import Long
from undertow.paper.setup import CONTROLLERS, SIX_AXES, law_of, scenario

# rad/s; six at a time, one per axis.
_QUICK = ((5.0, 20.0, 50.0, 95.0, 105.0, 200.0),)
_SWEEP = (*_QUICK, (0.5, 1.0, 2.0, 10.0, 35.0, 70.0), (90.0, 100.0, 115.0, 150.0, 300.0, 400.0))


def _frequency_scenarios(quick: bool) -> dict:
    """Unit sinusoids of different frequency on six independent axes, at the goal from the start."""
    return {
        _name(controller, i): scenario(
            f"{controller.upper()} against unit sinusoids of {', '.join(f'{w:g}' for w in block)} rad/s, one per axis",
            composite=composite,
            disturbance={"kind": "sinusoid", "amplitude": 1.0, "frequency": list(block), "offset": [0.0] * 6},
            **SIX_AXES,
        )
        for controller, composite in CONTROLLERS.items()
        for i, block in enumerate(_QUICK if quick else _SWEEP)
    }


@claim(
    "C6", "The scheme estimates uncertainties of large amplitude and high frequency.", scenarios=_frequency_scenarios
)
def frequency(runs: Runs, long: Long) -> ClaimVerdict:
    """|d_hat - d| / |d| against frequency, measured and predicted."""
    sweep = {controller: _sweep(runs, controller) for controller in CONTROLLERS}
    points = list(zip(sweep["rcafc"]["frequency"], sweep["rcafc"]["measured"], strict=True))
    crossing, predicted = _crossing(points), crossing_frequency(law_of(runs["ideal_rcafc"]))
    lowest, highest = points[0], points[-1]
    text = (
        f"The error of the estimate is {100 * lowest[1]:.2g} % of d at {lowest[0]:g} rad/s and "
        f"{100 * highest[1]:.0f} % at {highest[0]:g} rad/s. From {crossing:.0f} rad/s on "
        f"(theory: {predicted:.0f}) it is worse than no estimate."
    )
    numbers = {"sweep": sweep, "crossing_measured": crossing, "crossing_predicted": predicted}
    verdict = f"holds if d stays well below {crossing:.0f} rad/s"
    return ClaimVerdict(verdict, text, _name("rcafc", 0), "six axes without a motor, sinusoids, 20 s", numbers)


def _name(controller: str, block: int) -> str:
    return f"c06_{controller}_{block + 1}"


def _sweep(runs: Runs, controller: str) -> dict[str, Any]:
    """Measured points in order of frequency, and the small-signal curve."""
    points = []
    for i, block in enumerate(_SWEEP):
        if _name(controller, i) in runs:
            metrics = steady(runs[_name(controller, i)])
            ratios = np.divide(metrics["estimation_rms_axes"], metrics["uncertainty_rms_axes"])
            points += zip(block, ratios.tolist(), strict=True)
    points.sort()
    curve = np.geomspace(0.5, 500.0, 120)
    law = law_of(runs[_name(controller, 0)])
    return {
        "frequency": [frequency for frequency, _ in points],
        "measured": [ratio for _, ratio in points],
        "theory_frequency": curve.tolist(),
        "theory": np.abs(estimation_response(law, curve)).tolist(),
    }


def _crossing(points: list[tuple[float, float]]) -> float:
    """Frequency at which the measured ratio passes 1, interpolated on logarithmic axes; infinite if it never does."""
    for (w0, r0), (w1, r1) in itertools.pairwise(points):
        if r0 < 1 <= r1:
            share = -math.log(r0) / (math.log(r1) - math.log(r0))
            return w0 * (w1 / w0) ** share
    return math.inf

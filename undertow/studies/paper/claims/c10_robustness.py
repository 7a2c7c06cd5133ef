"""C10: robust to design parameters and initial conditions."""

import numpy as np

from undertow.core.status import Status
from undertow.studies.paper.claims.finding import Finding, Runs, steady
from undertow.studies.paper.setup import SIX_AXES, scenario

CLAIM = "The performance is fully robust to the design parameters and to the initial conditions."

_TABLE1 = {
    "adaptation": 100.0,
    "composite": 500.0,
    "pole": 150.0,
    "robust_gain": 10.0,
    "layer": 0.5,
    "compensation_gain": 0.1,
}
_STARTS = 6
_NOISE = "c10_noise"


def scenarios(quick: bool) -> dict:
    """Every gain halved and doubled, random starts; and 1 cm/s of velocity noise with closely spaced sets."""
    gains = {
        f"c10_{name}_{'half' if factor < 1 else 'double'}": scenario(
            f"RCAFC with {name} times {factor:g}", **_with(name, factor * value)
        )
        for name, value in _TABLE1.items()
        for factor in (0.5, 2.0)
    }
    draws = np.random.default_rng(1).uniform(-1, 1, (_STARTS, 2, 6))
    reach = np.array([3.0, 3.0, 3.0, 1.0, 0.7, 3.0])
    starts = {
        f"c10_start_{i + 1}": scenario(
            f"RCAFC from random start {i + 1}",
            initial={"position": (draw[0] * reach).round(3).tolist(), "velocity": (0.5 * draw[1]).round(3).tolist()},
        )
        for i, draw in enumerate(draws)
    }
    noise = {
        _NOISE: scenario(
            "RCAFC with sets spaced 0.1 and velocity noise of 1 cm/s, 1 kHz: the weights drift until it diverges",
            controller={"sets": 3, "reach": [0.1], "width": 1.0},
            disturbance="none",
            sensor={"kind": "white_noise", "velocity": 0.01},
            loop={"kind": "sampled", "duration": 20.0},
            **SIX_AXES,
        )
    }
    if quick:
        gains = dict(list(gains.items())[:2])
        starts = dict(list(starts.items())[:1])
    return gains | starts | noise


def judge(runs: Runs) -> Finding:
    """Spread of the tracking error, and the case that breaks it."""
    nominal = steady(runs["ideal_rcafc"])["tracking_rms"]
    swept = {n: r for n, r in runs.items() if n.startswith("c10_") and n != _NOISE}
    failed = sorted(name for name, run in swept.items() if run.status is not Status.OK)
    ratios = {name: steady(run)["tracking_rms"] / nominal for name, run in swept.items() if name not in failed}
    low, high = min(ratios, key=ratios.__getitem__), max(ratios, key=ratios.__getitem__)
    noise = runs[_NOISE]
    numbers = {"ratios": ratios, "failed": failed, "noise_ended": float(noise.outcome.ended)}
    text = (
        f"Continuous and without noise: halving or doubling any gain of Table 1, or starting elsewhere "
        f"({len(swept)} runs), changes the tracking rms by factors from {ratios[low]:.2f} "
        f"({low[4:]}) to {ratios[high]:.2f} ({high[4:]})" + (f"; {len(failed)} runs end early. " if failed else ". ")
    )
    if noise.status is Status.OK:
        return Finding(
            "holds" if not failed else "fails", text + "Velocity noise of 1 cm/s is survived.", _NOISE, numbers
        )
    text += (
        f"With 1 cm/s of velocity noise at 1 kHz and sets spaced 0.1 the weights drift and the run ends at "
        f"{float(noise.outcome.ended):.1f} s ({noise.status.word})."
    )
    return Finding("holds if there is neither noise nor sampling", text, _NOISE, numbers)


def _with(name: str, value: float) -> dict:
    return {"composite": value} if name == "composite" else {"controller": {name: value}}

"""C10: robust to design parameters and initial conditions."""

import numpy as np

from undertow.analysis.drift import time_to_divergence
from undertow.core.status import Status
from undertow.paper.claims.finding import ClaimVerdict, Runs, claim, steady
from undertow.paper.horizons import Long, sampled
from undertow.paper.setup import SIX_AXES, law_of, scenario

_TABLE1 = {
    "adaptation": 100.0,
    "composite": 500.0,
    "pole": 150.0,
    "robust_gain": 10.0,
    "layer": 0.5,
    "compensation_gain": 0.1,
}
_STARTS = 6
_NOISE, _SEEDS, _NOISY = "c10_noise", 3, 200.0  # s


def _robustness_scenarios(quick: bool) -> dict:
    """Every gain halved and doubled, and random starts."""
    gains = {
        f"c10_{name}_{'half' if factor < 1 else 'double'}": scenario(
            f"RCAFC with {name} times {factor:g}", controller={name: factor * value}
        )
        for name, value in _TABLE1.items()
        for factor in (0.5, 2.0)
    }
    samples = np.random.default_rng(1).uniform(-1, 1, (_STARTS, 2, 6))
    reach = np.array([3.0, 3.0, 3.0, 1.0, 0.7, 3.0])
    starts = {
        f"c10_start_{i + 1}": scenario(
            f"RCAFC from random start {i + 1}",
            initial={"position": (state[0] * reach).round(3).tolist(), "velocity": (0.5 * state[1]).round(3).tolist()},
        )
        for i, state in enumerate(samples)
    }
    if quick:
        gains = dict(list(gains.items())[:2])
        starts = dict(list(starts.items())[:1])
    return gains | starts


def _robustness_batched(quick: bool) -> dict:
    """1 cm/s of velocity noise, with the unchanged fuzzy sets of the benchmark."""
    return {
        f"{_NOISE}_{seed}": scenario(
            "RCAFC with velocity noise of 1 cm/s, 1 kHz: the weights drift until it diverges",
            disturbance="none",
            navigation={"kind": "white_noise", "velocity": 0.01},
            loop=sampled(_NOISY),
            seed=seed,
            **SIX_AXES,
        )
        for seed in range(_SEEDS)
    }


@claim(
    "C10",
    "The performance is fully robust to the design parameters and to the initial conditions.",
    scenarios=_robustness_scenarios,
    batched=_robustness_batched,
)
def robustness(runs: Runs, long: Long) -> ClaimVerdict:
    """Spread of the tracking error, and the counterexample."""
    nominal = steady(runs["ideal_rcafc"])["tracking_rms"]
    swept = {n: r for n, r in runs.items() if n.startswith("c10_")}
    failed = sorted(name for name, run in swept.items() if run.status is not Status.OK)
    ratios = {name: steady(run)["tracking_rms"] / nominal for name, run in swept.items() if name not in failed}
    low, high = min(ratios, key=ratios.__getitem__), max(ratios, key=ratios.__getitem__)
    noisy = [long[f"{_NOISE}_{seed}"] for seed in range(_SEEDS)]
    expected = time_to_divergence(law_of(noisy[0]), 1e-3, 0.01)
    numbers = {
        "ratios": ratios,
        "failed": failed,
        "noise_ended": [None if run.lasted else run.ended for run in noisy],
        "noise_expected": expected,
    }
    text = (
        "Level ideal, continuous and without noise, 20 s: halving or doubling any gain of Table 1, or starting "
        f"elsewhere ({len(swept)} runs), changes the tracking rms by factors from {ratios[low]:.2f} "
        f"({low[4:]}) to {ratios[high]:.2f} ({high[4:]})" + (f"; {len(failed)} runs end early. " if failed else ". ")
    )
    simulated = f"level ideal, U1, 20 s; with noise six axes without a motor, 1 kHz, {_NOISY:g} s"
    if any(run.lasted for run in noisy):
        count = sum(run.lasted for run in noisy)
        text += f"With 1 cm/s of velocity noise at 1 kHz {count} of {_SEEDS} runs last {_NOISY:g} s."
        return ClaimVerdict("holds" if not failed else "fails", text, f"{_NOISE}_0", simulated, numbers)
    ends = sorted(run.ended for run in noisy)
    text += (
        f"With 1 cm/s of velocity noise at 1 kHz and the sets of the benchmark (width 0.5) the weights drift and the "
        f"run ends after {ends[0]:.0f} to {ends[-1]:.0f} s ({_SEEDS} seeds; theory of section 3.8: {expected:.0f} s)."
    )
    verdict = "holds if there is neither noise nor sampling, for 20 s"
    return ClaimVerdict(verdict, text, f"{_NOISE}_0", simulated, numbers)

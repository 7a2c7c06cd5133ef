"""C14: the method works for other plants."""

import math
from typing import cast

import equinox as eqx
import jax.numpy as jnp

from undertow.core.status import Status
from undertow.paper.claims.finding import ClaimVerdict, Runs, claim, tracking_error
from undertow.paper.horizons import Long
from undertow.paper.setup import scenario
from undertow.physics.plants.magnetic_levitation import LevitationRig, MagneticLevitation
from undertow.scenario.results.run_result import ScenarioResult

_SIMULATED = "pendulum 10 s, ball 5 s"

_PENDULUM = "c14_pendulum"
_IDEAL = "c14_levitation_ideal"

# Gaps, mm, about which the ball oscillates by 1 mm: the lag of the coil grows as the gap shrinks.
_GAPS = (5, 6, 7, 8, 10, 12, 14)
_QUICK = (6, 10)


def _other_plants_scenarios(quick: bool) -> dict:
    """Table 1 on Wang's pendulum with a wrong nominal model, and on a levitated ball at several gaps."""
    pendulum = scenario(
        "Table 1 on an inverted pendulum whose nominal model is too light and too short",
        plant={"kind": "inverted_pendulum"},
        model={"cart_mass": 0.8, "pole_mass": 0.05, "half_length": 0.35},
        reference={"kind": "sine", "amplitude": 0.1, "frequency": 1.0},
        disturbance={"kind": "sinusoid", "amplitude": 1.0, "frequency": 3.0},
        initial={"position": [math.pi / 60]},
        loop={"kind": "continuous", "duration": 10.0},
    )
    coils = {_at(gap): _levitation("coil", gap) for gap in (_QUICK if quick else _GAPS)}
    ideal = {} if quick else {_IDEAL: _levitation("ideal", min(_GAPS))}
    return {_PENDULUM: pendulum} | coils | ideal


@claim(
    "C14",
    "The method works for other systems x_ddot = f + G u + d (pendulum, magnetic levitation).",
    scenarios=_other_plants_scenarios,
)
def other_plants(runs: Runs, long: Long) -> ClaimVerdict:
    """Tracking on both plants, and the lag of the coil at which it fails."""
    coils = sorted((_lag(runs[_at(gap)]), gap) for gap in _GAPS if _at(gap) in runs)
    numbers = {
        "pendulum": tracking_error(runs[_PENDULUM]),
        "levitation": [
            {"gap": gap / 1e3, "lag": lag, "tracking_rms": tracking_error(runs[_at(gap)])} for lag, gap in coils
        ],
    }
    text = (
        f"Table 1 unchanged. Pendulum with nominal mass and length up to 50 % too small, load of 1 rad/s^2: "
        f"tracking rms {_shown(runs[_PENDULUM], 'rad')}. Ball about a gap, with the lag of its coil at this gap: "
    )
    text += "; ".join(f"{gap} mm ({1e3 * lag:.1f} ms) {_shown(runs[_at(gap)], 'm')}" for lag, gap in coils) + "."
    if _IDEAL in runs:
        numbers["levitation_ideal"] = tracking_error(runs[_IDEAL])
        text += f" With coils without lag, {min(_GAPS)} mm: {_shown(runs[_IDEAL], 'm')}."
    lost = [lag for lag, gap in coils if runs[_at(gap)].status is not Status.OK]
    tolerated = [lag for lag, _ in coils if not lost or lag < lost[0]]
    if runs[_PENDULUM].status is not Status.OK or not tolerated:
        return ClaimVerdict("fails", text, _PENDULUM if tolerated else _at(coils[0][1]), _SIMULATED, numbers)
    if not lost:
        return ClaimVerdict("holds", text, _PENDULUM, _SIMULATED, numbers)
    verdict = (
        f"holds if the actuator lags by no more than {1e3 * tolerated[-1]:.1f} ms; not with {1e3 * lost[0]:.1f} ms"
    )
    return ClaimVerdict(verdict, text, next(_at(gap) for lag, gap in coils if lag == lost[0]), _SIMULATED, numbers)


def _at(gap: int) -> str:
    return f"c14_levitation_{gap}mm"


def _levitation(fidelity: str, gap: int) -> dict:
    return scenario(
        f"Table 1 on a ball levitated {gap} mm below the magnet, fidelity {fidelity}",
        plant={"kind": "magnetic_levitation", "fidelity": fidelity},
        model={},
        reference={"kind": "sine", "amplitude": 1e-3, "frequency": 1.0, "offset": gap / 1e3},
        disturbance="none",
        initial={"position": [gap / 1e3]},
        loop={"kind": "continuous", "duration": 5.0},
    )


def _lag(run: ScenarioResult) -> float:
    """Time constant of the upper coil where the ball starts, s."""
    rig = cast(MagneticLevitation, run.built.closed_loop.plant).rig
    start = run.built.scenario.initial.position
    return float(_lags(rig, jnp.asarray(start))[0])


_lags = eqx.filter_jit(LevitationRig.lag)  # one program, not seven small ones


def _shown(run: ScenarioResult, unit: str) -> str:
    error = tracking_error(run)
    return (
        f"ends at {float(run.outcome.ended):.2f} s ({run.status.word.replace('_', ' ')})"
        if error is None
        else f"{error:.2g} {unit}"
    )

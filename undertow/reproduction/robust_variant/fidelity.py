"""Preset `robust` and the paper's laws at every fidelity level, and with a PID at sea; all sampled."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from undertow.bench.workload import W2
from undertow.core.status import Status
from undertow.reproduction.all_outputs import with_all_outputs
from undertow.reproduction.robust_variant import station_keeping
from undertow.reproduction.setup import FIDELITIES, HAND_TUNED, RAFC, RCAFC, scenario
from undertow.scenario.execute import Executed

LAWS = {
    "rcafc": ("RCAFC, Table 1", {"kind": "rcaf", "composite": RCAFC}),
    "rafc": ("RAFC, Table 1", {"kind": "rcaf", "composite": RAFC}),
    "robust": ("robust", {"kind": "rcaf", "preset": "robust"}),
    "measured": ("robust, speeds measured", {"kind": "rcaf", "preset": "robust"}),
}

WHOLE = FIDELITIES[-1]
_SAMPLED = {"kind": "sampled", "duration": 20.0}

# Supply and load of the thrusters: name -> words, supply in V, factor on suite U1.
_SUPPLIES = {
    "24V_03": ("full motor model, 24 V, U1 x 0.3", 24.0, 0.3),
    "24V": ("full motor model, 24 V, U1: beyond the motors", 24.0, 1.0),
}

# Suite U1 at 0.3 of its size, and for 1.5 s an overload that 24 V cannot hold: t, then m/s^2 and rad/s^2.
_PUSHED, _LET_GO, _JUDGED = 8.0, 9.5, 17.0  # s
_PUSH, _REST = [4.0, 4.0, -4.0, 2.0, 2.0, 2.0], [0.0] * 6
_SAMPLES = [(0.0, _REST), (_PUSHED, _REST), (_PUSHED + 0.01, _PUSH), (_LET_GO, _PUSH), (_LET_GO + 0.01, _REST)]
_OVERLOAD = [{"kind": "u1", "scale": 0.3}, {"kind": "table", "samples": [[t, *size] for t, size in _SAMPLES]}]

# One number per axis for all gains, so that both sets of gains share one program.
_TABLE1: dict[str, Any] = {
    "feedback": [[1, 2]] * 6,
    "pole": [150] * 6,
    "adaptation": [100] * 6,
    "composite": [500] * 6,
    "robust_gain": 10,
    "compensation_gain": 0.1,
    "weights_bound": float("inf"),
}
_AT_SEA: dict[str, tuple[str, dict[str, Any]]] = {
    "table1": ("Table 1", {"kind": "rcaf", **_TABLE1}),
    "hand_tuned": ("paper's law, tuned by hand", {"kind": "rcaf", **HAND_TUNED}),
    "robust": ("robust, no given gain", {"kind": "rcaf", "preset": "robust"}),
}


class Place(NamedTuple):
    """Setting of a comparison."""

    words: str
    runs: dict[str, tuple[str, dict[str, Any]]]  # law -> its name, and the scenario


def places(quick: bool) -> dict[str, Place]:
    """Every setting, from the simplest to the most realistic; quick: the full motor model only."""
    found = {}
    for fidelity in (WHOLE,) if quick else FIDELITIES:
        words = "full motor model, no limit" if fidelity == WHOLE else fidelity
        found[fidelity] = Place(words, _laws(words, fidelity, {"kind": "u1"}, quick=quick))
    for name, (words, volts, scale) in _SUPPLIES.items():
        found[name] = Place(words, _laws(words, WHOLE, {"kind": "u1", "scale": scale}, volts, quick))
    if not quick:
        words = "full motor model, 24 V, U1 x 0.3, overload of 1.5 s"
        two = {key: one for key, one in _laws(words, WHOLE, _OVERLOAD, 24.0).items() if key in ("rcafc", "robust")}
        two = {key: (name, one | {"steady": {"start": _JUDGED}}) for key, (name, one) in two.items()}
        found["overload"] = Place(words, two)
        words = "BlueROV2 Heavy, T200s at 16 V, 100 Hz, current, waves, own sensors"
        found["sea"] = Place(
            words,
            {
                key: (name, at_sea(f"{name}: BlueROV2 Heavy at sea, from its own sensors", law))
                for key, (name, law) in _AT_SEA.items()
            },
        )
        found |= {place: Place(*each) for place, each in station_keeping.places().items()}
    return found


def scenarios(quick: bool) -> dict[str, dict[str, Any]]:
    """Every run, by name."""
    return {
        _name(place, law): one for place, compared in places(quick).items() for law, (_, one) in compared.runs.items()
    }


def table(runs: Mapping[str, Executed], quick: bool) -> list[dict[str, Any]]:
    """One row per setting and law: ending and steady metrics."""
    return [
        {
            "place": place,
            "words": compared.words,
            "law": law,
            "name": name,
            "scenario": f"scenarios/{_name(place, law)}.yaml",
            **_row(runs[_name(place, law)]),
        }
        for place, compared in places(quick).items()
        for law, (name, _) in compared.runs.items()
    ]


def _name(place: str, law: str) -> str:
    return f"robust_variant_{place}_{law}"


def _laws(
    words: str, fidelity: str, load: Any, supply: float | None = None, quick: bool = False
) -> dict[str, tuple[str, dict]]:
    found = {}
    for key, (name, law) in LAWS.items():
        if key == "measured" and (quick or fidelity != WHOLE):
            continue
        sensor = {"speed_sensor": fidelity == "ideal" or key == "measured"}
        one = scenario(f"{name}: {words}", fidelity=fidelity, loop=_SAMPLED, disturbance=load, model=sensor)
        one["controller"] = law
        if supply is not None:
            one["plant"]["thruster"]["supply"] = supply
        found[key] = (name, one)
    return found


def at_sea(description: str, law: dict[str, Any]) -> dict[str, Any]:
    """The scenario of examples/bluerov2_heavy.yaml with another law."""
    return W2 | {"description": description, "controller": law}


def _row(run: Executed) -> dict[str, Any]:
    return {
        "status": run.status.word,
        "diverged_at": None if run.status is Status.OK else float(run.outcome.ended),
        "steady": with_all_outputs(run.steady),
        "largest_after": _largest_after(run, _PUSHED),
        "position_rms": _late_rms(run, run.dataset["error"]),
        "navigation_rms": _late_rms(run, run.dataset["measured_position"] - run.dataset["position"]),
    }


def _late_rms(run: Executed, series: xr.DataArray) -> float | None:
    """Rms of the first three outputs over the steady window, m for a vehicle."""
    late = series.sel(time=slice(*run.built.window())).values[:, :3]
    return float(np.sqrt((late**2).mean())) if run.steady else None


def _largest_after(run: Executed, start: float) -> float | None:
    """Largest tracking error from a time (s) on, which shows the effect of an overload."""
    late = run.dataset["error"].sel(time=slice(start, None)).values
    return float(np.abs(late).max()) if late.size and run.status is Status.OK else None

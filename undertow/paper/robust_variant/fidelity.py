"""Preset `robust` and the paper's laws at every fidelity level, and with a PID at sea; all sampled."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from undertow.core.status import Status
from undertow.paper.all_outputs import with_all_outputs
from undertow.paper.setup import FIDELITIES, HAND_TUNED, RAFC, RCAFC, scenario
from undertow.scenario.results.run_result import ScenarioResult
from undertow.studies.speed.workload import W2

LAWS = {
    "rcafc": ("RCAFC, Table 1", {"kind": "paper", "composite": RCAFC}),
    "rafc": ("RAFC, Table 1", {"kind": "paper", "composite": RAFC}),
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
    "table1": ("Table 1", {"kind": "paper", **_TABLE1}),
    "hand_tuned": ("paper's law, tuned by hand", {"kind": "paper", **HAND_TUNED}),
    "robust": ("robust, no given gain", {"kind": "rcaf", "preset": "robust"}),
}


# Station keeping at sea: words, navigation, gains; pairs are for translation and rotation. Both laws were tuned with
# the same budget; `benchmarks/station_keeping.py` finds their gains and simulates 500 runs of each, with every
# published parameter set as the true plant in turn.
_STATION: dict[str, tuple[str, str, dict[str, dict[str, Any]]]] = {
    "station": (
        "BlueROV2 Heavy keeps station, position fixes of 5 cm",
        "observer",
        {
            "pid": {"frequency": (7.073, 10.07), "damping": (1.292, 4.0), "integral_share": (0.1532, 0.0227)},
            "robust": {
                "bandwidth": (27.33, 40.77),
                "damping": (0.947, 0.977),
                "tracking": (3.085, 8.575),
                "actuator_rate": 22.07,
            },
        },
    ),
    "station_known": (
        "the same, exact position and velocity",
        "perfect",
        {
            "pid": {"frequency": (9.015, 10.8), "damping": (1.74, 3.628), "integral_share": (0.1445, 0.0289)},
            "robust": {
                "bandwidth": (39.91, 42.2),
                "damping": (0.983, 0.991),
                "tracking": (11.97, 15.08),
                "actuator_rate": 46.9,
            },
        },
    ),
}
_STATION_LAWS: dict[str, tuple[str, dict[str, Any]]] = {
    "pid": ("PID, tuned", {"kind": "pid"}),
    "robust": ("robust, tuned", {"kind": "rcaf", "preset": "robust"}),
}


class ComparedRun(NamedTuple):
    """One law in one setting."""

    place: str
    words: str  # for the setting
    law: str
    name: str  # of the law
    scenario: dict[str, Any]

    @property
    def key(self) -> str:
        """Name of its files."""
        return f"robust_variant_{self.place}_{self.law}"


def runs(quick: bool) -> list[ComparedRun]:
    """Every law in every setting, from the simplest to the most realistic; quick: the full motor model only."""
    compared = []
    laws = [law for law in LAWS if law != "measured" or not quick]
    for fidelity in (WHOLE,) if quick else FIDELITIES:
        words = "full motor model, no limit" if fidelity == WHOLE else fidelity
        laws_of_fidelity = [law for law in laws if law != "measured" or fidelity == WHOLE]
        compared += [_of_odin(fidelity, words, law, {"kind": "u1"}, fidelity) for law in laws_of_fidelity]
    for case, (words, volts, scale) in _SUPPLIES.items():
        compared += [_of_odin(case, words, law, {"kind": "u1", "scale": scale}, supply=volts) for law in laws]
    if quick:
        return compared
    words = "full motor model, 24 V, U1 x 0.3, overload of 1.5 s"
    overload = [_of_odin("overload", words, law, _OVERLOAD, supply=24.0) for law in ("rcafc", "robust")]
    compared += [run._replace(scenario=run.scenario | {"steady": {"start": _JUDGED}}) for run in overload]
    words = "BlueROV2 Heavy, T200s at 16 V, 100 Hz, current, waves, own sensors"
    for law, (name, controller) in _AT_SEA.items():
        described = {"description": f"{name}: BlueROV2 Heavy at sea, from its own sensors", "controller": controller}
        compared.append(ComparedRun("sea", words, law, name, W2 | described))
    return compared + [_of_station(case, law) for case in _STATION for law in _STATION_LAWS]


def scenarios(quick: bool) -> dict[str, dict[str, Any]]:
    """Every run, by name."""
    return {run.key: run.scenario for run in runs(quick)}


def table(results: Mapping[str, ScenarioResult], quick: bool) -> list[dict[str, Any]]:
    """One row per setting and law: ending and steady metrics."""
    return [{**run._asdict(), "scenario": f"scenarios/{run.key}.yaml", **_row(results[run.key])} for run in runs(quick)]


def _of_odin(
    case: str, words: str, law: str, load: Any, fidelity: str = WHOLE, supply: float | None = None
) -> ComparedRun:
    name, controller = LAWS[law]
    sensor = {"speed_sensor": fidelity == "ideal" or law == "measured"}
    data = scenario(f"{name}: {words}", fidelity=fidelity, loop=_SAMPLED, disturbance=load, model=sensor)
    data["controller"] = controller
    if supply is not None:
        data["plant"]["thruster"]["supply"] = supply
    return ComparedRun(case, words, law, name, data)


def _of_station(case: str, law: str) -> ComparedRun:
    words, navigation, gains = _STATION[case]
    name, controller = _STATION_LAWS[law]
    per_axis = {
        key: [gain[0]] * 3 + [gain[1]] * 3 if isinstance(gain, tuple) else gain for key, gain in gains[law].items()
    }
    vehicle = lambda parameters: {"kind": "bluerov2_heavy", "parameters": parameters}
    data = {
        "description": f"{name}: {words}",
        "plant": {"vehicle": vehicle("ng2024"), "thruster": {"kind": "t200", "supply": 16}, "ledger": False},
        "model": {"vehicle": vehicle("vonbenzon2022"), "rate_term": True},
        "controller": controller | per_axis,
        "reference": {"kind": "setpoint", "position": [0] * 6},
        "disturbance": [{"kind": "current", "velocity": [0.4, 0.3, 0]}, {"kind": "waves", "height": 0.5, "depth": 3}],
        "navigation": navigation,
        "loop": {"kind": "sampled", "dt": 0.01, "duration": 60.0, "record": 0.05},
        "steady": {"start": 30.0},
    }
    return ComparedRun(case, words, law, name, data)


def _row(run: ScenarioResult) -> dict[str, Any]:
    return {
        "status": run.status.word,
        "diverged_at": None if run.status is Status.OK else float(run.outcome.ended),
        "steady": with_all_outputs(run.steady),
        "largest_after": _largest_after(run, _PUSHED),
        "position_rms": _late_rms(run, run.dataset["error"]),
        "navigation_rms": _late_rms(run, run.dataset["measured_position"] - run.dataset["position"]),
    }


def _late_rms(run: ScenarioResult, series: xr.DataArray) -> float | None:
    """Rms of the first three outputs over the steady window, m for a vehicle."""
    late = series.sel(time=slice(*run.built.window())).values[:, :3]
    return float(np.sqrt((late**2).mean())) if run.steady else None


def _largest_after(run: ScenarioResult, start: float) -> float | None:
    """Largest tracking error from a time (s) on, which shows the effect of an overload."""
    late = run.dataset["error"].sel(time=slice(start, None)).values
    return float(np.abs(late).max()) if late.size and run.status is Status.OK else None

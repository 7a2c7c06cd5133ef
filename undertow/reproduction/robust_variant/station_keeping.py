"""Station keeping of BlueROV2 Heavy at sea: preset `robust` and a PID, with real navigation and exact measurements.

Both laws were tuned with the same budget; `benchmarks/station_keeping.py` finds their gains and simulates 500 runs of
each, with every published parameter set as the true plant in turn.
"""

from typing import Any

_NOMINAL, _TRUE = "vonbenzon2022", "ng2024"
_START, _END = 30.0, 60.0  # s

_PID, _ROBUST = ("pid", "PID, tuned"), ("robust", "robust, tuned")


def _pid(frequency: tuple, damping: tuple, integral_share: tuple) -> dict[str, Any]:
    """A PID; pairs of gains are for translation and rotation."""
    gains = {"frequency": frequency, "damping": damping, "integral_share": integral_share}
    return {"kind": "pid", **_per_axis(gains)}


def _robust(bandwidth: tuple, damping: tuple, tracking: tuple, actuator_rate: float) -> dict[str, Any]:
    gains = {"bandwidth": bandwidth, "damping": damping, "tracking": tracking}
    return {"kind": "rcaf", "preset": "robust", **_per_axis(gains), "actuator_rate": actuator_rate}


def _per_axis(gains: dict[str, tuple]) -> dict[str, list[float]]:
    return {name: [moving] * 3 + [turning] * 3 for name, (moving, turning) in gains.items()}


# Setting -> words, sensor, laws.
_PLACES = {
    "station": (
        "BlueROV2 Heavy keeps station, position fixes of 5 cm",
        "navigation",
        {
            _PID: _pid((7.073, 10.07), (1.292, 4.0), (0.1532, 0.0227)),
            _ROBUST: _robust((27.33, 40.77), (0.947, 0.977), (3.085, 8.575), 22.07),
        },
    ),
    "station_known": (
        "the same, exact position and velocity",
        "perfect",
        {
            _PID: _pid((9.015, 10.8), (1.74, 3.628), (0.1445, 0.0289)),
            _ROBUST: _robust((39.91, 42.2), (0.983, 0.991), (11.97, 15.08), 46.9),
        },
    ),
}


def places() -> dict[str, tuple[str, dict[str, tuple[str, dict[str, Any]]]]]:
    """Words of each setting, and by law its name and the scenario."""
    return {
        place: (words, {key: (name, _scenario(f"{name}: {words}", law, sensor)) for (key, name), law in laws.items()})
        for place, (words, sensor, laws) in _PLACES.items()
    }


def _scenario(description: str, law: dict[str, Any], sensor: str) -> dict[str, Any]:
    vehicle = lambda parameters: {"kind": "bluerov2_heavy", "parameters": parameters}
    return {
        "description": description,
        "plant": {"vehicle": vehicle(_TRUE), "thruster": {"kind": "t200", "supply": 16}, "ledger": False},
        "model": {"vehicle": vehicle(_NOMINAL), "rate_term": True},
        "controller": law,
        "reference": {"kind": "setpoint", "position": [0] * 6},
        "disturbance": [{"kind": "current", "velocity": [0.4, 0.3, 0]}, {"kind": "waves", "height": 0.5, "depth": 3}],
        "navigation": sensor,
        "loop": {"kind": "sampled", "dt": 0.01, "duration": _END, "record": 0.05},
        "steady": {"start": _START},
    }

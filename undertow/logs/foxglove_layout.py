"""A layout of Foxglove for our logs: the vehicle in three dimensions, its motion, errors, thrusters and estimate."""

import json
from typing import Any

from undertow.logs import foxglove

# Panel -> its title, and what it plots: topic, signal and columns.
_BODY = ("surge", "sway", "heave")  # of a law in body axes
_OUTPUTS = ("north", "east", "down", "roll", "pitch", "yaw")
_PLOTS = {
    "Plot!position": ("Position, m", "/motion", ("position", "reference"), _OUTPUTS[:3]),
    "Plot!attitude": ("Attitude, rad", "/motion", ("position", "reference"), _OUTPUTS[3:]),
    "Plot!error": ("Tracking error, m and rad", "/motion", ("error",), _OUTPUTS),
    "Plot!input": ("Input of the thrusters", "/thrusters", ("input",), tuple(f"T{i}" for i in range(1, 9))),
    "Plot!estimate": ("Estimate of the uncertainty", "/controller", ("estimate",), (*_BODY, *_OUTPUTS)),
}
_COLOURS = ("#0072b2", "#e07b00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#f0e442", "#999999")


def layout() -> str:
    """The layout as JSON, which Foxglove imports: Layouts, Import from file."""
    panels: dict[str, Any] = {"3D!view": _view()} | {name: _plot(*settings) for name, settings in _PLOTS.items()}
    contents = {
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1.0},
        "layout": _split(
            "row",
            _split("column", "3D!view", "Plot!input", 60),
            _split("column", _split("column", "Plot!position", "Plot!attitude", 50),
                   _split("column", "Plot!error", "Plot!estimate", 50), 50),
            50,
        ),
    }  # fmt: skip
    return json.dumps(contents, indent=1) + "\n"


def _split(direction: str, first: Any, second: Any, share: int) -> dict[str, Any]:
    return {"direction": direction, "first": first, "second": second, "splitPercentage": share}


def _view() -> dict[str, Any]:
    """The 3-D panel: from the side, following the vehicle, with the axes of the world."""
    return {
        "foxglovePanelTitle": "Vehicle",
        "followTf": foxglove.VEHICLE,
        "followMode": "follow-position",
        "fixedFrame": foxglove.WORLD,
        "cameraState": {
            "distance": 5.0,
            "perspective": True,
            "phi": 65.0,
            "thetaOffset": 45.0,
            "target": [0, 0, 0],
            "targetOffset": [0, 0, 0],
            "targetOrientation": [0, 0, 0, 1],
            "fovy": 45,
            "near": 0.1,
            "far": 5000,
        },
        "scene": {"transforms": {"axisScale": 0.5}},
        "transforms": {},
        "topics": {"/scene": {"visible": True}},
        "layers": {"grid": {"layerId": "foxglove.Grid", "instanceId": "grid", "frameId": foxglove.WORLD, "size": 20}},
    }


def _plot(title: str, topic: str, signals: tuple[str, ...], columns: tuple[str, ...]) -> dict[str, Any]:
    paths = [
        {
            "value": f"{topic}.{signal}.{column}",
            "enabled": True,
            "timestampMethod": "publishTime",
            "label": f"{signal} {column}",
            "color": _COLOURS[i % len(_COLOURS)],
            "lineSize": 1.0 if signal == signals[0] else 2.0,
        }
        for signal in signals
        for i, column in enumerate(columns)
    ]
    return {
        "foxglovePanelTitle": title,
        "paths": paths,
        "showXAxisLabels": True,
        "showYAxisLabels": True,
        "showLegend": True,
        "legendDisplay": "floating",
        "showPlotValuesInLegend": False,
        "isSynced": True,
        "xAxisVal": "timestamp",
        "sidebarDimension": 240,
    }

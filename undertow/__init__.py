"""undertow: robust adaptive control of underwater vehicles, from volts to trajectory, that shows its own limits.

    import undertow as ut
    plant = ut.HybridVehicle(ut.vehicles.odin(), ut.thrusters.paper_table3())
    run = ut.simulate(plant, "robust", ut.references.setpoint([2, 3, 4, 0, 0, 1]))

Names are loaded when first used: `import undertow` by itself is quick.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from undertow import controllers as controllers
    from undertow import disturbances as disturbances
    from undertow import faults as faults
    from undertow import navigation as navigation
    from undertow import plants as plants
    from undertow import power as power
    from undertow import references as references
    from undertow import sensors as sensors
    from undertow import supervision as supervision
    from undertow import thrusters as thrusters
    from undertow import vehicles as vehicles
    from undertow.autopilot.autopilot import Autopilot as Autopilot
    from undertow.autopilot.navigation_filter import NavigationFilter as NavigationFilter
    from undertow.autopilot.vehicle import Vehicle as Vehicle
    from undertow.comparison.comparison import Comparison as Comparison
    from undertow.comparison.comparison import compare as compare
    from undertow.controllers.rcaf import rcaf as rcaf
    from undertow.core.errors import BadInput as BadInput
    from undertow.logs.frames import attitudes_of_quaternions as attitudes_of_quaternions
    from undertow.logs.frames import body_vectors as body_vectors
    from undertow.logs.frames import world_vectors as world_vectors
    from undertow.plants.hybrid_vehicle import HybridVehicle as HybridVehicle
    from undertow.process_setup import prepare as prepare
    from undertow.run import Run as Run
    from undertow.run import simulate as simulate
    from undertow.run import simulate_scenario as simulate_scenario
    from undertow.scenario.csv_table import read_samples as read_samples
    from undertow.scenario.log_file import read_log as read_log

    __version__: str

# Public name -> module; packages of parts stand for themselves.
_HOMES = {
    "Autopilot": "undertow.autopilot.autopilot",
    "BadInput": "undertow.core.errors",
    "Comparison": "undertow.comparison.comparison",
    "HybridVehicle": "undertow.plants.hybrid_vehicle",
    "NavigationFilter": "undertow.autopilot.navigation_filter",
    "Run": "undertow.run",
    "Vehicle": "undertow.autopilot.vehicle",
    "attitudes_of_quaternions": "undertow.logs.frames",
    "body_vectors": "undertow.logs.frames",
    "compare": "undertow.comparison.comparison",
    "prepare": "undertow.process_setup",
    "rcaf": "undertow.controllers.rcaf",
    "read_log": "undertow.scenario.log_file",
    "read_samples": "undertow.scenario.csv_table",
    "simulate": "undertow.run",
    "simulate_scenario": "undertow.run",
    "world_vectors": "undertow.logs.frames",
}
_PACKAGES = (
    "controllers",
    "disturbances",
    "faults",
    "navigation",
    "plants",
    "power",
    "references",
    "sensors",
    "supervision",
    "thrusters",
    "vehicles",
)


def __getattr__(name: str) -> Any:
    if name in _PACKAGES:
        return importlib.import_module(f"undertow.{name}")
    if name in _HOMES:
        return getattr(importlib.import_module(_HOMES[name]), name)
    if name == "__version__":
        return importlib.import_module("importlib.metadata").version("undertow")
    raise AttributeError(f"undertow has no `{name}`. It has: {', '.join(__dir__())}")


def __dir__() -> list[str]:
    return sorted((*_PACKAGES, *_HOMES, "__version__"))

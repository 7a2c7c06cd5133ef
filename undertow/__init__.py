"""undertow: robust adaptive control of underwater vehicles, from volts to trajectory, that shows its own limits.

    import undertow as ut
    plant = ut.HybridVehicle(ut.vehicles.odin(), ut.thrusters.paper_table3())
    run = ut.simulate(plant, "robust", ut.references.setpoint([2, 3, 4, 0, 0, 1]))

Names are loaded when first used: `import undertow` by itself is quick.
"""

import importlib
from typing import TYPE_CHECKING, Any

from undertow.core.part_packages import PACKAGE_OF

if TYPE_CHECKING:
    from undertow.comparison import Comparison as Comparison
    from undertow.comparison import compare as compare
    from undertow.control import controllers as controllers
    from undertow.control import navigation as navigation
    from undertow.control import references as references
    from undertow.control import supervision as supervision
    from undertow.control.controllers.rcaf import rcaf as rcaf
    from undertow.core.errors import BadInput as BadInput
    from undertow.core.process_setup import prepare as prepare
    from undertow.explorer import explore as explore
    from undertow.identification import IdentifiedModel as IdentifiedModel
    from undertow.identification import identify as identify
    from undertow.logs.frames import attitudes_of_quaternions as attitudes_of_quaternions
    from undertow.logs.frames import body_vectors as body_vectors
    from undertow.logs.frames import world_vectors as world_vectors
    from undertow.outside.autopilot.autopilot import Autopilot as Autopilot
    from undertow.outside.autopilot.navigation_filter import NavigationFilter as NavigationFilter
    from undertow.outside.autopilot.vehicle import Vehicle as Vehicle
    from undertow.physics import disturbances as disturbances
    from undertow.physics import faults as faults
    from undertow.physics import plants as plants
    from undertow.physics import power as power
    from undertow.physics import sensors as sensors
    from undertow.physics import thrusters as thrusters
    from undertow.physics import vehicles as vehicles
    from undertow.physics.plants.hybrid_vehicle import HybridVehicle as HybridVehicle
    from undertow.run import Run as Run
    from undertow.run import simulate as simulate
    from undertow.run import simulate_scenario as simulate_scenario
    from undertow.scenario.csv_table import read_samples as read_samples
    from undertow.scenario.log_file import read_log as read_log

    __version__: str

# Public name -> module.
_HOMES = {
    "Autopilot": "undertow.outside.autopilot.autopilot",
    "BadInput": "undertow.core.errors",
    "Comparison": "undertow.comparison",
    "HybridVehicle": "undertow.physics.plants.hybrid_vehicle",
    "IdentifiedModel": "undertow.identification",
    "NavigationFilter": "undertow.outside.autopilot.navigation_filter",
    "Run": "undertow.run",
    "Vehicle": "undertow.outside.autopilot.vehicle",
    "attitudes_of_quaternions": "undertow.logs.frames",
    "body_vectors": "undertow.logs.frames",
    "compare": "undertow.comparison",
    "explore": "undertow.explorer",
    "identify": "undertow.identification",
    "prepare": "undertow.core.process_setup",
    "rcaf": "undertow.control.controllers.rcaf",
    "read_log": "undertow.scenario.log_file",
    "read_samples": "undertow.scenario.csv_table",
    "simulate": "undertow.run",
    "simulate_scenario": "undertow.run",
    "world_vectors": "undertow.logs.frames",
}


def __getattr__(name: str) -> Any:
    if name in PACKAGE_OF:
        return importlib.import_module(PACKAGE_OF[name])
    if name in _HOMES:
        return getattr(importlib.import_module(_HOMES[name]), name)
    if name == "__version__":
        return importlib.import_module("importlib.metadata").version("undertow")
    raise AttributeError(f"undertow has no `{name}`. It has: {', '.join(__dir__())}")


def __dir__() -> list[str]:
    return sorted((*PACKAGE_OF, *_HOMES, "__version__"))

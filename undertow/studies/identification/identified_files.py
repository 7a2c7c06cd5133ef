"""What an identification leaves for the other commands: a vehicle file with deviations, and a scenario that uses it."""

import datetime
import importlib.metadata
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from undertow.core.atomic_io import write_whole
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.scenario.build import Built
from undertow.scenario.provenance import recording_hash
from undertow.scenario.reading import dump
from undertow.scenario.vehicle_parameters import is_outside
from undertow.scenario.vehicle_writer import contents_of, plant_section, write_vehicle
from undertow.studies.identification.free_parameters import axis_parameters
from undertow.studies.identification.identify import Identification


def write_files(built: Built, identification: Identification, logs: Sequence[Path], folder: Path) -> None:
    """Write `vehicle.yaml` and `identified.yaml`, the scenario with that vehicle and its thrusters.

    Args:
        built: scenario of the identification.
        identification: result.
        logs: files that it is from.
        folder: where to write.

    Raises:
        OSError: the folder cannot be written, or a log is gone.
    """
    plant = built.closed_loop.plant
    assert isinstance(plant, HybridVehicle)  # it was identified
    of_inputs = axis_parameters()  # belong to the sticks of a pilot, and to no vehicle
    chosen = [
        (i, interval) for i, interval in enumerate(identification.intervals) if interval.parameter.name not in of_inputs
    ]
    values = {interval.parameter.name: interval.value for _, interval in chosen}
    deviations = {interval.parameter.name: interval.deviation for _, interval in chosen}
    write_vehicle(
        folder / "vehicle.yaml",
        contents_of(plant.vehicle),
        values,
        deviations,
        identification.uncertainty.correlation([i for i, _ in chosen]),
        _provenance(identification, logs),
    )
    scenario: dict[str, Any] = dict(built.text.data)
    outside = {name: value for name, value in values.items() if is_outside(name)}
    scenario["plant"] = plant_section(scenario.get("plant", {}), "vehicle.yaml", plant.inputs(), outside)
    write_whole(folder / "identified.yaml", dump(scenario))


def _provenance(identification: Identification, logs: Sequence[Path]) -> dict[str, Any]:
    return {
        "date": datetime.date.today().isoformat(),
        "version": importlib.metadata.version("undertow"),
        "logs": [{"name": path.name, "sha256": recording_hash(path)} for path in logs],
        "estimated": [parameter.name for parameter in identification.parameters],
    }

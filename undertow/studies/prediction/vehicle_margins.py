"""Margins of a loop over the vehicles within the deviations of its vehicle file, which the controller does not know."""

from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx

from undertow.scenario.build import Built
from undertow.scenario.sampled_plants import OF_FILE, sampled_plants
from undertow.scenario.vehicle_file import has_deviations
from undertow.studies.prediction.linearized_points import linearized_points, nearest_to_instability, robustness
from undertow.studies.prediction.operating_point import operating_point


class VehicleMargins(NamedTuple):
    """Margins of one vehicle.

    Attributes:
        name: of the vehicle.
        found: whether its loop has an equilibrium at all operating points.
        radius: largest spectral radius over one control step; the loop is stable below 1.
        margins: as in `Prediction`, at the operating point closest to instability.
    """

    name: str
    found: bool
    radius: float
    margins: dict[str, float]

    @property
    def is_stable(self) -> bool:
        """Whether the loop is stable wherever it has been linearised."""
        return self.found and self.radius < 1


def margins_over_vehicles(
    built: Built, count: int, progress: Callable[[str, float], None]
) -> tuple[VehicleMargins, ...]:
    """Margins with each of some vehicles at random; () where the vehicle has no deviations.

    Args:
        built: scenario.
        count: number of vehicles.
        progress: called with a message and the share done.
    """
    if not count or not has_deviations(built.text):
        return ()
    plants = sampled_plants(built, built.scenario.seed, count)
    del plants[OF_FILE]  # which the prediction itself is of
    found = []
    for number, (name, plant) in enumerate(plants.items()):
        progress(
            f"margins of vehicle {number + 1} of {count} within the deviations of the file", 0.8 + 0.2 * number / count
        )
        found.append(_margins_with(built, name, plant))
    return tuple(found)


def _margins_with(built: Built, name: str, plant) -> VehicleMargins:
    loop = eqx.tree_at(lambda one: one.plant, built.closed_loop, plant)
    points = linearized_points(operating_point(built._replace(closed_loop=loop)))
    worst = nearest_to_instability(points)
    margins = robustness(worst, built.scenario.loop.dt)
    return VehicleMargins(name, all(point.found for point in points), worst.radius, margins)

"""Six independent axes, where the theory says that vehicles do not matter."""

import math
from collections.abc import Callable

from undertow.controllers.composite_law import RCAF
from undertow.controllers.presets.paper import paper
from undertow.core.contracts import AbstractController, Model
from undertow.disturbances.random_suite import RandomSuite, random_suite
from undertow.loop.closed_loop import ClosedLoop
from undertow.plants.double_integrator import double_integrator
from undertow.references.setpoint import setpoint
from undertow.reproduction.ablations.rough_sensor import RoughSensor

AXES = 6

Law = Callable[[Model], AbstractController]


def loop(
    law: Law,
    load: RandomSuite | None = None,
    navigation: RoughSensor | None = None,
    goal: float = 0.0,
    limit: float = math.inf,
) -> ClosedLoop:
    """A law on x_ddot = u + d.

    Args:
        law: from a model to a controller.
        load: d; None for 2 m/s^2 rms of sinusoids of 0.3 to 10 rad/s on levels of 2 m/s^2, new ones every 2 s.
        navigation: None for a perfect one.
        goal: wanted position of every axis, m.
        limit: of the input, m/s^2.
    """
    plant = double_integrator(AXES, limit)
    load = random_suite() if load is None else load
    return ClosedLoop(plant, law(plant.model()), setpoint([goal] * AXES), load, navigation or RoughSensor())


def basis_norm_squared(**options) -> float:
    """|xi(0)|^2 of the paper's law with other sets."""
    law: RCAF = paper(double_integrator(1).model(), **options)
    return float(law.fuzzy.basis_norm_squared())

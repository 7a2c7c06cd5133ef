"""Independent axes x_ddot = u + d under the paper's law: where the theory can be read off."""

import numpy as np
import pytest

from undertow.control.controllers.rcaf import rcaf
from undertow.control.navigation.perfect import perfect
from undertow.control.references.setpoint import setpoint
from undertow.physics.disturbances.none import none
from undertow.physics.plants.double_integrator import double_integrator
from undertow.simulation.loop.closed_loop import ClosedLoop

THREE_SETS = {"sets": 3}  # at -1, 0, 1 with width 1: the layout of section 3


@pytest.fixture
def rails():
    """Maker of closed loops on independent axes; every axis is one experiment."""

    def make(axes=1, goal=0.0, disturbance=None, limit=float("inf"), **choices):
        plant = double_integrator(axes, limit)
        law = rcaf(plant.model(), **({"preset": "paper"} | THREE_SETS | choices))
        goals = setpoint(np.broadcast_to(np.asarray(goal, dtype=float), (axes,)))
        return ClosedLoop(plant, law, goals, disturbance or none(), perfect())

    return make


@pytest.fixture
def table1():
    """Maker of the law on one axis, three sets unless told otherwise."""

    def make(**choices):
        return rcaf(double_integrator().model(), **({"preset": "paper"} | THREE_SETS | choices))

    return make

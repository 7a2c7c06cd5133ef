"""ODIN with the paper's thrusters, for what depends on vehicle and motors."""

import math
from collections.abc import Sequence

from undertow.disturbances.adding import Together
from undertow.disturbances.parameter_error import parameter_error
from undertow.disturbances.random_suite import random_suite
from undertow.loop.closed_loop import ClosedLoop
from undertow.plants.hybrid_vehicle import hybrid_vehicle
from undertow.references.setpoint import setpoint
from undertow.reproduction.ablations.on_axes import Law
from undertow.reproduction.ablations.rough_sensor import RoughSensor
from undertow.reproduction.ablations.thruster_loss import ThrusterLoss
from undertow.thrusters.paper_table3 import paper_table3
from undertow.vehicles.odin import odin

_EXACT = (1.0, 1.0)


def loop(
    law: Law,
    fidelity: str = "ideal",
    *,
    supply: float = math.inf,
    dead_zone: float = 0.0,
    size: float = 0.6,
    errors: dict | None = None,
    loss: tuple[float, float] = (1.0, 0.0),
    thrusters: Sequence[int] | None = None,
    goal: Sequence[float] = (0.0,) * 6,
    noise: float = 0.0,
    **model,
) -> ClosedLoop:
    """A law on ODIN.

    Args:
        law: from a model to a controller.
        fidelity: of the fidelity ladder.
        supply, dead_zone: of the thrusters, V.
        size: of the random suite, sinusoids and levels, m/s^2 and rad/s^2.
        errors: ranges of `parameter_error`; a factor that is not named is 1.
        loss: share that is left, and of how many thrusters.
        thrusters: numbers of those that are fitted; None for all eight.
        goal: wanted position, m and rad.
        noise: standard deviation of the velocity's, m/s and rad/s.
        model: what the law is told, `speed_sensor` or `rate_term`.
    """
    plant = hybrid_vehicle(odin(), paper_table3(fidelity, supply, dead_zone), thrusters, ledger=False)
    exact = dict.fromkeys(("mass", "damping", "restoring", "thrust"), _EXACT)
    left, number = loss
    load = (
        random_suite(size, step=size),
        parameter_error(**{**exact, **(errors or {})}),
        ThrusterLoss(left, number, thrusters=plant.inputs()),
    )
    told = law(plant.model(**model))
    return ClosedLoop(plant, told, setpoint(list(goal)), Together(load), RoughSensor(noise=noise))

"""Runs that can have no prediction, which is known from the run and its parts before anything is linearised."""

import jax
import numpy as np

from undertow.analysis.linearization.jacobians import without
from undertow.core.arrays import as_array
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.physics.thrusters.thruster import AbstractThruster
from undertow.scenario.results.run_result import ScenarioResult

_SATURATED = 0.1  # share of the time, from which on a loop without limits says nothing about the run
_FLAT = 0.05  # slope of the thrust that counts as none, as a share of that at half the supply


def reason_without_prediction(result: ScenarioResult) -> str:
    """Why a run has no prediction, as far as that is known in milliseconds; empty where it takes a linearisation."""
    if result.steady is None:
        return "the run did not reach its steady window"
    saturated = result.steady.get("saturated_fraction", 0.0)
    if saturated >= _SATURATED:
        return f"actuators were saturated {100 * saturated:.0f} % of the time, which the linear model does not capture"
    return _flat_thrust(result)


def _flat_thrust(result: ScenarioResult) -> str:
    """A sentence where a thruster without dynamics swings about an input at which its thrust has almost no slope.

    With dynamics, a slope comes from the motor. Without, thrust that grows with the square of the voltage has none at
    rest, and the linear loop would need impossible voltages.
    """
    plant = result.built.of_the_law().closed_loop.plant
    if not isinstance(plant, HybridVehicle) or _has_state(plant.thruster, plant.inputs()):
        return ""
    supply = np.asarray(plant.thruster.supply, dtype=float)
    if not np.isfinite(supply).all():
        return ""
    start, stop = result.built.window()
    time = np.asarray(result.outcome.time)
    inputs = np.asarray(result.outcome.signals["input"])[(time >= start) & (time <= stop)]
    mean, swing = inputs.mean(axis=0), inputs.std(axis=0)
    thruster = without(plant.thruster, ("dead_zone",))  # as it is linearised
    slope = lambda voltage: np.asarray(jax.jvp(lambda u: thruster.thrust((), u), (voltage,), (voltage * 0 + 1,))[1])
    share = np.abs(slope(as_array(mean)) / slope(as_array(np.broadcast_to(supply / 2, mean.shape))))
    flat = (share < _FLAT) & (swing > np.abs(mean))
    if not flat.any():
        return ""
    worst = int(np.where(flat, share, np.inf).argmin())
    return (
        f"input {worst + 1} swings about {mean[worst]:.2g} {plant.input_unit}, where it has almost no effect (in a "
        "dead zone, or where force grows with its square), so that no linear model describes the loop there. The run "
        "itself is not affected"
    )


def _has_state(thruster: AbstractThruster, count: int) -> bool:
    """Whether thrust has dynamics; a thruster that wraps another one has those of the inner one."""
    return any(leaf.size for leaf in jax.tree.leaves(jax.eval_shape(lambda: thruster.initial_state(count))))

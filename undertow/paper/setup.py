"""The paper's set-up as scenario data, with its gaps filled, so that every number can be reproduced from a file."""

import math
from typing import Any, cast

from undertow.analysis.small_signal import gains
from undertow.control.controllers.composite_law import RCAF
from undertow.control.controllers.presets.paper import paper
from undertow.core.runtime import in_precision
from undertow.paper.running import BatchedRun
from undertow.physics.plants.double_integrator import double_integrator
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.physics.thrusters.fidelity_levels import ElectromechanicalThruster
from undertow.physics.thrusters.motor import DCMotor
from undertow.scenario.results.run_result import ScenarioResult

GOAL = [2.0, 3.0, 4.0, math.pi / 3, math.pi / 4, 2 * math.pi / 5]  # m, rad; Section 5

RCAFC, RAFC = 500.0, 0.0  # gamma_eps of Table 1, and of Eq. (61)

CONTROLLERS = {"rcafc": RCAFC, "rafc": RAFC}

FIDELITIES = ("ideal", "static", "shaft", "electromechanical")


def scenario(
    description: str,
    *,
    fidelity: str = "ideal",
    composite: float = RCAFC,
    controller: dict[str, Any] | None = None,
    **changes: Any,
) -> dict[str, Any]:
    """ODIN with the paper's thrusters under suite U1, Table 1 gains, as one ODE over 20 s.

    Args:
        description: what the scenario shows.
        fidelity: that of the thrusters. At `ideal` the speed sensor is perfect (Example 1), elsewhere there is none.
        composite: gamma_eps; 0 is RAFC.
        controller: further options of the law.
        changes: other keys of the scenario, replacing the paper's.
    """
    # When the loop with the full motor model is unstable, propeller drag is too stiff for fixed steps of 1 ms.
    method = "adaptive" if fidelity == "electromechanical" else "rk4"
    thruster = {"kind": "paper_table3", "fidelity": fidelity}
    plant = {"kind": "hybrid_vehicle", "vehicle": "odin", "thruster": thruster, "ledger": False}  # these runs are timed
    return {
        "description": description,
        "plant": plant,
        "model": {"speed_sensor": fidelity == "ideal"},
        "controller": {"kind": "paper", "composite": composite, **(controller or {})},
        "reference": {"kind": "setpoint", "position": GOAL},
        "disturbance": {"kind": "u1"},
        "loop": {"kind": "continuous", "duration": 20.0, "method": method},
    } | changes


# The paper's law as fast as a T200 allows: gains for BlueROV2 Heavy, tuned by hand.
HAND_TUNED: dict[str, Any] = {
    "feedback": [[4, 7], [4, 7], [4, 7], [20, 13], [20, 13], [20, 13]],
    "pole": [4, 4, 4, 3, 3, 3],
    "adaptation": [0.15, 0.15, 0.15, 0.05, 0.05, 0.05],
    "composite": [150, 150, 150, 200, 200, 200],
    "robust_gain": 0.1,
    "compensation_gain": 0,
    "weights_bound": 40,
}

# Six independent axes x_ddot = u + d: equivalent to fidelity `ideal` for a law with an exact model.
SIX_AXES = {
    "plant": {"kind": "double_integrator", "axes": 6},
    "model": {},
    "reference": {"kind": "setpoint", "position": [0.0] * 6},
}


# Gains that make two laws comparable, so that the law differs and not the effort of tuning.
_GAMMA = 100.0  # Table 1


def equal_gain() -> dict[str, Any]:
    """Gains of RAFC tuned as hard as RCAFC: gamma such that gamma (p12 / (k1 + kr p12)) equals RCAFC's loop gain.

    By section 3.1 the loop gain at low frequency is gamma rho [p12 / k1' + gamma_eps / a1] / p, with k1' the
    effective position gain and a1 the effective pole of the identification model.
    """
    return {"adaptation": round(_GAMMA * equal_gain_ratio(), 1)}


def equal_gain_ratio() -> float:
    """Ratio of the low-frequency loop gains of RCAFC and RAFC at Table 1: about 68."""
    g = gains(paper(double_integrator(1).model()))
    tracking_branch = g.p12 / g.stiffness
    return (tracking_branch + g.composite / g.pole) / tracking_branch


def same_loop_gain(fuzzy_input: str, sets: int) -> dict[str, Any]:
    """A fuzzy system with the gamma |xi|^2 of Table 1 with five sets on the modelling error. Section 3.1."""
    matched = _GAMMA * _basis_norm_squared("error", 5) / _basis_norm_squared(fuzzy_input, sets)
    return {"fuzzy_input": fuzzy_input, "sets": sets, "adaptation": round(matched, 3)}


def _basis_norm_squared(fuzzy_input: str, sets: int) -> float:
    """|xi|^2 at zero."""
    with in_precision("float64"):
        law = paper(double_integrator(1).model(), fuzzy_input=fuzzy_input, sets=sets)
        return float(law.fuzzy.basis_norm_squared())


def law_of(run: ScenarioResult | BatchedRun) -> RCAF:
    """The law that ran."""
    return cast(RCAF, run.built.closed_loop.controller)


def plant_of(run: ScenarioResult | BatchedRun) -> HybridVehicle:
    """The vehicle that was run."""
    return cast(HybridVehicle, run.built.closed_loop.plant)


def motor_of(run: ScenarioResult | BatchedRun) -> DCMotor:
    """The motor of its thrusters."""
    return cast(ElectromechanicalThruster, plant_of(run).thruster).motor

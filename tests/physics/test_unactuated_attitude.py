"""Where a vehicle leans about an axis that its thrusters cannot turn it about, against runs."""

import dataclasses

import numpy as np
import pytest

import undertow as ut
from undertow.control.references import setpoint
from undertow.core.runtime import double_outside_runs
from undertow.physics.disturbances import current
from undertow.scenario.plausibility import plausibility
from undertow.scenario.unactuated_attitude import largest_lean
from undertow.simulation.loop.closed_loop import ClosedLoop

STILL, WATER = setpoint([0.0] * 6), current([-0.4, 0.0, 0.0])
LEVEL, AHEAD = np.zeros((1, 3)), np.array([[0.4, 0.0, 0.0]])


@double_outside_runs
def bluerov2(depth: float) -> ut.HybridVehicle:
    """A BlueROV2, which cannot pitch, with its centre of gravity so far, m, below that of buoyancy."""
    vehicle = dataclasses.replace(ut.vehicles.bluerov2(), r_g=np.array([0.0, 0.0, depth]))
    return ut.HybridVehicle(vehicle, ut.thrusters.t200(fidelity="shaft", supply=16.0))


def held(plant: ut.HybridVehicle, duration: float) -> np.ndarray:
    """Positions of a run that keeps station in `WATER`."""
    run = ut.simulate(plant, "robust", STILL, disturbance=WATER, dt=0.02, record=1.0, duration=duration)
    return run.dataset.position.values


@pytest.mark.full
@pytest.mark.parametrize("depth, degrees", [(0.02, 17), (0.01, 36)])
def test_the_lean_is_that_of_a_run(depth, degrees):
    plant = bluerov2(depth)
    lean = largest_lean(plant, LEVEL, AHEAD)
    assert (lean.axis, lean.row) == ("pitch", 0) and round(np.degrees(lean.angle)) == degrees
    found = held(plant, 600.0)[-1]  # the damping of this parameter set is large
    assert found[4] == pytest.approx(lean.angle, rel=1e-3) and abs(found[3]) < 1e-6


def test_what_all_thrusters_turn_and_what_they_cannot_hold_has_no_lean():
    motor = ut.thrusters.t200(fidelity="shaft", supply=16.0)
    assert largest_lean(ut.HybridVehicle(ut.vehicles.bluerov2_heavy(), motor), LEVEL, AHEAD) is None
    surge_alone = ut.HybridVehicle(ut.vehicles.remus100(), motor)
    assert largest_lean(surge_alone, LEVEL, AHEAD) is None


def test_upright_in_still_water_and_the_fastest_flow_counts():
    plant = bluerov2(0.02)
    # The vertical thrusters, which hold its surplus of buoyancy, act a little ahead of the centre of gravity.
    assert largest_lean(plant, LEVEL, 0 * AHEAD).angle == pytest.approx(0.0, abs=1e-3)
    several = largest_lean(plant, np.zeros((3, 3)), np.outer([0.5, 1.0, 0.7], AHEAD[0]))
    assert several.row == 1 and several.angle == largest_lean(plant, LEVEL, AHEAD).angle
    # From astern it leans about as far the other way, and a turned vehicle as one that the water meets from ahead.
    assert largest_lean(plant, LEVEL, -AHEAD).angle == pytest.approx(several.angle, rel=0.05)
    across = largest_lean(plant, np.array([[0.0, 0.0, np.pi / 2]]), np.array([[0.0, 0.4, 0.0]]))
    assert across.angle == pytest.approx(several.angle, rel=1e-9)


@pytest.mark.full
def test_a_vehicle_that_turns_over_is_warned_of():
    """With 2 mm the run does turn over; with the published 2 cm nothing is said."""
    assert np.abs(held(bluerov2(0.002), 600.0)[:, 3:5]).max() > 1.0
    (advised,) = said_of(bluerov2(0.002))
    assert "cannot pitch the vehicle" in advised.sentence and "it leans by 72 degrees" in advised.sentence
    assert said_of(bluerov2(0.02)) == ()


def said_of(plant: ut.HybridVehicle):
    """Advice on the same run."""
    law = ut.controllers.pid(plant.model(), frequency=1.0)
    return plausibility(ClosedLoop(plant, law, STILL, WATER, ut.navigation.perfect()), 600.0, None)

"""REMUS 100 as a spheroid against PythonVehicleSimulator, run unmodified (data/pvs_remus100.json)."""

import json
from pathlib import Path

import numpy as np
from hull import cross_flow_coefficient

from undertow.physics.vehicles import remus100

PEER = json.loads((Path(__file__).parent / "data" / "pvs_remus100.json").read_text())
VEHICLE = remus100("fossen_python")


def test_mass_matrix():
    np.testing.assert_allclose(VEHICLE.mass_matrix(), PEER["M"], rtol=1e-9, atol=1e-12)


def test_weight_and_buoyancy():
    np.testing.assert_allclose([VEHICLE.weight, VEHICLE.buoyancy], PEER["W"], rtol=1e-9)


def test_mass_of_the_scaled_spheroid():
    """The 31.9 kg that MSS scales its spheroid for."""
    assert abs(float(remus100("fossen_mss").mass) - 31.90) < 5e-3


def test_cross_flow_is_that_of_the_hull_functions():
    """Hoerner's curve at beam = draft, to the four decimals that the vehicle has."""
    sway = 0.5 * 1026.0 * 0.19 * 1.6 * float(cross_flow_coefficient(0.19, 0.19))
    np.testing.assert_allclose(float(VEHICLE.quadratic_damping[1, 1]), sway, rtol=5e-5)

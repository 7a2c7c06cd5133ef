"""A part made outside of any run holds double precision, whatever the caller's `jax_enable_x64` is; and it stays."""

from pathlib import Path

import jax
import numpy as np

from undertow.core.arrays import in_present_precision
from undertow.core.runtime import in_precision
from undertow.plants.hybrid_vehicle import HybridVehicle
from undertow.scenario.vehicle_file import read_vehicle
from undertow.thrusters import t200

EXAMPLES = Path(__file__).parents[2] / "examples"


def bits(part):
    return [np.asarray(leaf) for leaf in jax.tree.leaves(part) if isinstance(leaf, jax.Array)]


def test_the_callers_setting_does_not_matter(part_name, made_anew):
    with jax.enable_x64(True):
        wanted = bits(made_anew(part_name))
    with jax.enable_x64(False):
        found = bits(made_anew(part_name))
        assert not jax.config.jax_enable_x64
    assert [leaf.dtype for leaf in found] == [leaf.dtype for leaf in wanted]
    for one, other in zip(found, wanted, strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_run_converts_its_parts(part):
    """To single precision, and back to nothing but what it can hold."""
    _, whole = part
    with in_precision("float32"):
        single = in_present_precision(whole)
    assert all(leaf.dtype != np.float64 for leaf in bits(single))
    for one, other in zip(bits(single), bits(whole), strict=True):
        np.testing.assert_array_equal(one, other.astype(one.dtype))


def test_neither_does_it_for_parts_that_are_made_step_by_step():
    """From a file to what a law is made of, in a process that computes in single precision."""

    def made():
        thruster = t200()
        vehicle = read_vehicle(EXAMPLES / "my_rov.yaml").vehicle()
        plant = HybridVehicle(vehicle, thruster)
        fewer = HybridVehicle(vehicle.with_thrusters(range(1, vehicle.thrusters)), thruster)
        return vehicle.body(), plant, plant.model(rate_term=True), fewer.model(), vehicle.thruster_matrix()

    with jax.enable_x64(True):
        wanted = bits(made())
    with jax.enable_x64(False):
        found = bits(made())
    assert len(found) == len(wanted) > 30
    for one, other in zip(found, wanted, strict=True):
        assert one.dtype == np.float64
        np.testing.assert_array_equal(one, other)

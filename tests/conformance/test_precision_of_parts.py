"""A part made outside of any run holds double precision, whatever the caller's `jax_enable_x64` is; and it stays."""

from pathlib import Path

import jax
import numpy as np
import pytest

from undertow.core.arrays import in_present_precision
from undertow.core.runtime import in_precision
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.physics.thrusters import t200
from undertow.scenario.vehicle_file import read_vehicle

EXAMPLES = Path(__file__).parents[2] / "examples"


def bits(part):
    return [np.asarray(leaf) for leaf in jax.tree.leaves(part) if isinstance(leaf, jax.Array)]


@pytest.mark.full
def test_the_callers_setting_does_not_matter(all_made_anew):
    """Every part, and everything that it is made from, made once under each setting."""
    with jax.enable_x64(False):
        found = {name: bits(part) for name, part in all_made_anew().items()}
        assert not jax.config.jax_enable_x64
    with jax.enable_x64(True):
        wanted = {name: bits(part) for name, part in all_made_anew().items()}
    for name, leaves in wanted.items():
        assert [leaf.dtype for leaf in found[name]] == [leaf.dtype for leaf in leaves], name
        for one, other in zip(found[name], leaves, strict=True):
            np.testing.assert_array_equal(one, other, err_msg=str(name))


@pytest.mark.full
def test_a_run_converts_its_parts(all_parts):
    """To single precision, and back to nothing but what it can hold."""
    for name, whole in all_parts.items():
        with in_precision("float32"):
            single = in_present_precision(whole)
        assert all(leaf.dtype != np.float64 for leaf in bits(single)), name
        for one, other in zip(bits(single), bits(whole), strict=True):
            np.testing.assert_array_equal(one, other.astype(one.dtype), err_msg=str(name))


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

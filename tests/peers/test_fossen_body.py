"""Equation of motion of three vehicles, term by term, against numbers computed independently (data/*_body_dynamics.json)."""

import json
from pathlib import Path
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from textbook import rotation_from_euler

from undertow.core.contracts import Load
from undertow.physics.plants import hybrid_vehicle
from undertow.physics.thrusters import paper_table3
from undertow.physics.vehicles import VehicleModel, bluerov2_heavy, odin, rexrov


class Peer(NamedTuple):
    """A vehicle as undertow has it, and the file's numbers for all states at once."""

    vehicle: VehicleModel
    file: dict
    cases: dict


@pytest.fixture(scope="module", params=[odin, bluerov2_heavy, rexrov], ids=lambda make: make.__name__)
def peer(request):
    data = Path(__file__).parent / "data" / f"{request.param.__name__}_body_dynamics.json"
    file = json.loads(data.read_text())
    cases = {name: np.array([case[name] for case in file["cases"]]) for name in file["cases"][0]}
    return Peer(request.param(), file, cases)


@pytest.fixture(scope="module")
def terms(peer):
    """The same names as in the file, for all states at once."""
    plant = hybrid_vehicle(peer.vehicle, paper_table3("shaft"))
    # The file's accelerations were computed with its own thruster matrix, rounded to 8 decimals.
    plant = eqx.tree_at(lambda p: p.thruster_matrix, plant, jnp.asarray(peer.file["thruster_matrix"]))
    # Under one name, as the numbers of one vehicle: one program for all.
    structure = jax.tree.structure(hybrid_vehicle(odin(), paper_table3("shaft")))
    plant = jax.tree.unflatten(structure, jax.tree.leaves(plant))
    return _terms(plant, peer.cases["eta"], peer.cases["nu"], peer.cases["thrust"])


@eqx.filter_jit
def _terms(plant, *cases):
    motor = plant.thruster.motor

    def evaluate(case):
        eta, nu, thrust = case
        speed = jnp.sign(thrust) * jnp.sqrt(jnp.abs(thrust) / motor.thrust_coefficient)
        x = plant.initial_state(eta)._replace(nu=nu)
        x = x._replace(thrusters=x.thrusters._replace(speed=speed))
        down = rotation_from_euler(eta[3:])[2]
        return {
            "eta_dot": plant.output(jnp.zeros(()), x).velocity,
            "C_nu": plant.body.coriolis(nu),
            "D_nu": plant.body.damping(nu),
            "g": plant.body.restoring(down),
            "nu_dot": plant.dynamics(jnp.zeros(()), x, jnp.zeros(8), Load(jnp.zeros(6), jnp.zeros(6))).nu,
        }

    return jax.lax.map(evaluate, cases)


def test_there_are_fifty_states(peer):
    assert peer.cases["eta"].shape == (50, 6)


def test_mass_matrix(peer):
    np.testing.assert_allclose(peer.vehicle.mass_matrix(), peer.file["M"], rtol=1e-10)


def test_thruster_matrix_to_its_printed_digits(peer):
    np.testing.assert_allclose(peer.vehicle.thruster_matrix(), peer.file["thruster_matrix"], rtol=0, atol=1e-8)


@pytest.mark.parametrize("name", ["eta_dot", "C_nu", "D_nu", "g", "nu_dot"])
def test_term_of_the_equation_of_motion(peer, terms, name):
    """Relative to the length of each vector: single entries cancel."""
    expected = peer.cases[name]
    difference = np.linalg.norm(np.asarray(terms[name]) - expected, axis=1)
    assert (difference <= 1e-10 * np.linalg.norm(expected, axis=1)).all()

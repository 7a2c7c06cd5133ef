"""ODIN's equation of motion, term by term, against numbers computed independently (data/odin_body_dynamics.json)."""

import json
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core.contracts import Load
from undertow.numerics.rotations import rotation_from_euler
from undertow.plants import hybrid_vehicle
from undertow.thrusters import paper_table3
from undertow.vehicles import odin

PEER = json.loads((Path(__file__).parent / "data" / "odin_body_dynamics.json").read_text())
CASES = {name: np.array([case[name] for case in PEER["cases"]]) for name in PEER["cases"][0]}


@pytest.fixture(scope="module")
def terms():
    """The same names as in the file, for all states at once."""
    plant = hybrid_vehicle(odin(), paper_table3("shaft"))
    # The file's accelerations were computed with its own thruster matrix, rounded to 8 decimals.
    plant = eqx.tree_at(lambda p: p.thruster_matrix, plant, jnp.asarray(PEER["thruster_matrix"]))
    motor = plant.thruster.motor

    def evaluate(eta, nu, thrust):
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

    return jax.jit(jax.vmap(evaluate))(CASES["eta"], CASES["nu"], CASES["thrust"])


def test_there_are_fifty_states():
    assert CASES["eta"].shape == (50, 6)


def test_mass_matrix():
    np.testing.assert_allclose(odin().mass_matrix(), PEER["M"], rtol=1e-10)


def test_thruster_matrix_to_its_printed_digits():
    np.testing.assert_allclose(odin().thruster_matrix(), PEER["thruster_matrix"], rtol=0, atol=1e-8)


@pytest.mark.parametrize("name", ["eta_dot", "C_nu", "D_nu", "g", "nu_dot"])
def test_term_of_the_equation_of_motion(terms, name):
    """Relative to the length of each vector: single entries cancel."""
    difference = np.linalg.norm(np.asarray(terms[name]) - CASES[name], axis=1)
    assert (difference <= 1e-10 * np.linalg.norm(CASES[name], axis=1)).all()

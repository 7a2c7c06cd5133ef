"""The controller `experiment`: the forces of its script, and the limits that end it."""

import jax.numpy as jnp
import numpy as np
import pytest

from undertow.control.controllers.experiment import Abort, AbortLimits, experiment
from undertow.control.controllers.pid import pid
from undertow.core.contracts import Target
from undertow.core.errors import BadInput
from undertow.core.measurement import measurement_of_outputs
from undertow.core.runtime import in_precision
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.thrusters.t200 import t200
from undertow.physics.vehicles.bluerov2_heavy import bluerov2_heavy

WRENCH = np.array([40.0, -6.0, 60.0, 0.5, 2.2, 1.0])  # no thruster within its dead zone
ROWS = np.vstack([[0.0, *np.zeros(6)], [1.0, *WRENCH], [2.0, *-WRENCH], [3.0, *np.zeros(6)]])
STILL = np.zeros(6)


@pytest.fixture(scope="module")
def plant():
    with in_precision("float64"):
        return hybrid_vehicle(bluerov2_heavy(), t200("ideal"))


@pytest.fixture(scope="module")
def law(plant):
    with in_precision("float64"):
        return pid(plant.model(), frequency=0.5, feedforward=False, reference_frequency=0)


def at(position, velocity=STILL):
    return measurement_of_outputs(jnp.asarray(position, dtype=float), jnp.asarray(velocity, dtype=float))


def target(position=STILL):
    return Target(*(jnp.asarray(row, dtype=float) for row in (position, STILL, STILL)))


def excitations(part, times, y, dt=0.25):
    """Forces that the script adds at some times, while the vehicle is at one place."""
    z, found = part.init(y, target()), {}
    for step in range(round(max(times) / dt) + 1):
        found[step * dt] = np.asarray(part.command(z, y, target())[1]["excitation"])
        z = part.advance(z, y, target(), jnp.zeros(8), dt)
    return [found[time] for time in times], z


def test_rows_are_held_and_the_last_ends_the_script(law):
    with in_precision("float64"):
        found, _ = excitations(experiment(law.model, ROWS, law), (0.0, 0.75, 1.0, 1.75, 2.0, 2.75, 3.0, 4.0), at(STILL))
    expected = [STILL, STILL, WRENCH, WRENCH, -WRENCH, -WRENCH, STILL, STILL]
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_thrusters_push_with_the_force_of_the_script(plant, law):
    """At the target and at rest the law commands nothing, so that the steady thrust is that of the script alone."""
    with in_precision("float64"):
        part = experiment(law.model, np.vstack([[-1.0, *WRENCH], [9.0, *STILL]]), law)
        y = at([0.0, 0.0, 0.0, 0.0, 0.0, 0.7])
        r = target([0.0, 0.0, 0.0, 0.0, 0.0, 0.7])
        u, _ = part.command(part.init(y, r), y, r)
        thrust = law.model.actuators.force(law.model.actuators.init(), u)
        np.testing.assert_allclose(np.asarray(plant.thruster_matrix @ thrust), WRENCH, rtol=1e-6)


@pytest.mark.parametrize(
    ("position", "velocity", "u", "abort"),
    [
        ([1.4, 0.9, 5.9, 0.3, 0.3, 0.3], [0, 0, 0, 0.9, 0, 0], 9.0, Abort.NONE),
        ([1.6, 0, 5, 0, 0, 0], STILL, 0.0, Abort.DISTANCE),
        ([0, -1.1, 5, 0, 0, 0], STILL, 0.0, Abort.DISTANCE),
        ([0, 0, 5.8, 0, 0, 0], STILL, 0.0, Abort.NONE),
        ([0, 0, 4.1, 0, 0, 0], STILL, 0.0, Abort.DEPTH),
        ([0, 0, 5, 0, 0, 0], [0, 0, 0, 0, -1.1, 0], 0.0, Abort.RATE),
        ([0, 0, 5, 0, 0, 2 * np.pi + 0.6], STILL, 0.0, Abort.ANGLE),
        ([0, 0, 5, 0, 0, 2 * np.pi + 0.4], STILL, 0.0, Abort.NONE),
        ([0, 0, 5, 0, 0, 0], STILL, -10.5, Abort.INPUT),
        ([np.nan, 0, 5, 0, 0, 0], STILL, 0.0, Abort.NONE),
    ],
)
def test_a_limit_ends_the_script(position, velocity, u, abort):
    numbers = [[3.0, 2.0, 2.0], 4.2, 6.0, 1.0, 0.5, 10.0]
    with in_precision("float64"):
        limits = AbortLimits(*map(jnp.asarray, numbers))
        code = limits.exceeded(at(position, velocity), target([0, 0, 5, 0, 0, 0]), jnp.full(8, u))
    assert Abort(int(code)) is abort


def test_the_room_turns_with_the_heading_of_the_target():
    """Three metres along a heading of east are three metres of east."""
    with in_precision("float64"):
        limits = AbortLimits(*map(jnp.asarray, ([6.0, 2.0, 2.0], -9.0, 9.0, 1.0, 1.0, 10.0)))
        east = target([0, 0, 0, 0, 0, np.pi / 2])
        assert int(limits.exceeded(at([0, 2.5, 0, 0, 0, np.pi / 2]), east, jnp.zeros(8))) == Abort.NONE
        assert int(limits.exceeded(at([2.5, 0, 0, 0, 0, np.pi / 2]), east, jnp.zeros(8))) == Abort.DISTANCE


def test_an_abort_lasts_and_a_restart_goes_on(law):
    with in_precision("float64"):
        part = experiment(law.model, ROWS, law, room=(1.0, 1.0, 1.0))
        _, outside = excitations(part, (1.0,), at([0.6, 0, 0, 0, 0, 0]))
        restarted = part.restarted(part.knowledge(outside), at(STILL), target())
        assert int(restarted.abort) == Abort.DISTANCE
        assert float(restarted.elapsed.time) == 1.25
        np.testing.assert_array_equal(part.command(restarted, at(STILL), target())[1]["excitation"], STILL)


def test_bad_scripts(law):
    for rows in (ROWS[:1], ROWS[:, :4], ROWS[::-1], np.where(ROWS == 60.0, np.nan, ROWS)):
        with pytest.raises(BadInput, match="samples"):
            experiment(law.model, rows, law)
    with pytest.raises(BadInput, match="room"):
        experiment(law.model, ROWS, law, room=(0.0, 1.0, 1.0))

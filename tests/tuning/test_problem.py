"""What is tuned, on what, and its slope."""

from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from messages import named

from undertow.analysis.linearization.jacobians import Parts, without
from undertow.cli.main import run
from undertow.control.controllers import pid
from undertow.control.navigation import observer
from undertow.control.references import setpoint
from undertow.core.contracts import Load, Pose
from undertow.core.errors import BadInput
from undertow.physics.disturbances import current, sinusoid, wrench
from undertow.physics.disturbances.loads import SumOfDisturbances
from undertow.physics.plants import hybrid_vehicle
from undertow.physics.sensors import depth, dvl, imu
from undertow.physics.thrusters import t200
from undertow.physics.vehicles import bluerov2_heavy
from undertow.scenario.reading import from_data, read
from undertow.scenario.vehicle_file import read_vehicle
from undertow.simulation.checkpoint import Checkpoint
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.studies.tuning.cost import shares
from undertow.studies.tuning.evaluator import Evaluation, Scaled
from undertow.studies.tuning.objective import Objective
from undertow.studies.tuning.problem import problem
from undertow.studies.tuning.search import descend, search
from undertow.studies.tuning.stability import Certifier
from undertow.studies.tuning.tunable_parameters import options, parameters

pytestmark = pytest.mark.full

AXIS = {
    "plant": {"kind": "double_integrator", "axes": 1, "limit": 20.0},
    "controller": {"kind": "pid", "frequency": 3.0},
    "reference": {"kind": "setpoint", "position": [0.0]},
    "disturbance": {"kind": "sinusoid", "amplitude": 1.0, "frequency": 1.0},
    "navigation": {"kind": "white_noise", "velocity": 0.01},
    "loop": {"duration": 6.0, "dt": 0.02, "record": 0.1},
    "tune": {"parameters": {"frequency": [0.5, 12], "damping": [0.4, 2]}, "train": {"seeds": 2}},
}


@pytest.fixture(scope="module")
def axis():
    """The problem, and its programs."""
    found = problem(from_data(AXIS))
    make = lambda point: found.law(found.options(point))
    examples = [make(found.start), make(np.zeros(2)), make(np.ones(2))]
    return found, Evaluation(found.training_loop, make, examples, (found.train, found.held_out))


@pytest.mark.slow
def test_slope_by_differences_is_the_derivative_through_the_run(axis):
    """Against forward differentiation of the same runs by XLA."""
    found, evaluation = axis
    plan, training_loop, trials = found.training_loop.plan(), found.training_loop, found.train

    def cost(point, trial):
        plant = jax.tree.map(lambda leaf: leaf[trial] if eqx.is_array(leaf) else leaf, trials.plants)
        law = found.law(found.options(point))
        run = training_loop.run(law, plant, trials.keys[trial], trials.sizes[trial])
        options = {"duration": plan.steps * plan.dt, "dt": plan.dt, "record_every": 0}
        outcome = sampled.simulate(run.loop, key=run.key, accumulators=run.accumulators, **options)
        parts = shares(outcome.accumulated[0], outcome.ended, training_loop.duration)
        return parts.cost(training_loop.weights)

    point = np.array([0.5, 0.4])
    exact = np.mean([jax.jacfwd(cost)(jnp.asarray(point), trial) for trial in range(trials.number)], axis=0)
    np.testing.assert_allclose(evaluation.slope(point), exact, rtol=1e-3)


def test_slope_at_a_bound_stays_inside(axis, monkeypatch):
    _, evaluation = axis
    monkeypatch.setattr(evaluation, "costs", lambda points: 3 * points[:, 0] + points[:, 1] + (points > 1).sum(axis=1))
    np.testing.assert_allclose(evaluation.slope(np.array([1.0, 0.0])), [3.0, 1.0])


def test_a_constant_that_changes_is_none(axis):
    """With one example all numbers of the law are constants: for another law the program is compiled anew."""
    found, evaluation = axis
    make = lambda point: found.law(found.options(point))
    fixed = Evaluation(found.training_loop, make, [make(found.start)], (found.train,))
    points = np.array([found.start, [0.2, 0.9]])
    expected = evaluation.costs(points)
    assert abs(expected[1] / expected[0] - 1) > 1e-2
    np.testing.assert_allclose([*fixed.costs(points[:1]), *fixed.costs(points[1:])], expected, rtol=1e-12)


@pytest.mark.slow
def test_both_methods_come_to_the_same_gains(axis, tmp_path):
    found, evaluation = axis
    certifier = Certifier(found.training_loop, found.train, evaluation.law(found.start))
    best = []
    for method in ("gradient", "search"):
        checkpoint = Checkpoint(tmp_path / method, method, 1e9, False)
        asked = Objective(evaluation, lambda point: certifier(evaluation.law(point)), checkpoint, lambda *_: None)
        start = found.start
        asked.costs(start[None])
        if method == "gradient":
            descend(asked, start, asked.best.cost, 30)
        else:
            search(asked, start, 25, seed=0)
        best.append(asked.best)
    assert abs(best[0].cost - best[1].cost) < 0.02 * best[0].cost
    assert best[0].cost < 0.5 * asked.steps[0].cost


def test_the_same_number_whatever_the_batch(axis):
    """Batches are filled up and cut: 7 laws on 3 held-out runs."""
    found, evaluation = axis
    laws = [evaluation.law(np.array([0.1 * i, 0.5])) for i in range(7)]
    together = evaluation.total(evaluation.shares(laws, found.held_out.part(np.array([0, 1, 3]))))
    alone = evaluation.total(evaluation.shares(laws[4:5], found.held_out.part(np.array([3]))))
    assert together.shape == (7, 3)
    np.testing.assert_allclose(together[4, 2], alone[0, 0], rtol=1e-12)


def test_certificate_begins_where_the_first_law_rests(axis, monkeypatch):
    """The same radii as from afar, with a fraction of the Jacobians."""
    found, evaluation = axis
    certifier = Certifier(found.training_loop, found.train, evaluation.law(found.start))
    counted, differentiate = [], Parts.differentiate
    monkeypatch.setattr(Parts, "differentiate", lambda *given: counted.append(1) or differentiate(*given))
    law = evaluation.law(np.array([0.9, 0.1]))
    radii, near = certifier(law).radii, len(counted)
    monkeypatch.setattr(certifier, "_first", [[None] * len(points) for points in certifier._points])
    np.testing.assert_allclose(radii, certifier(law).radii, rtol=1e-9)
    assert near < 0.7 * (len(counted) - near)


def test_seeds_are_held_out(axis):
    found, _ = axis
    keys = {tuple(np.asarray(key)) for trials in (found.train, found.held_out) for key in trials.keys}
    assert len(keys) == found.train.number + found.held_out.number == 6


def test_start_is_what_was_given(axis):
    found, _ = axis
    np.testing.assert_allclose(found.options(found.start)["frequency"], [3.0])
    assert found.rounded(found.start) == {"frequency": [3.0], "damping": [1.0]}


def test_parameter_sets_take_turns():
    sea = {"plant": {"vehicle": "bluerov2_heavy", "thruster": "t200"}, "controller": {"kind": "pid"}}
    still = {
        "reference": {"kind": "setpoint", "position": [0.0] * 6},
        "loop": {"dt": 0.05, "duration": 2.0, "record": 0.1},
    }
    found = problem(from_data(sea | still))
    assert found.train.variants == ("vonbenzon2022", "ng2024", "px4") * 2
    assert found.held_out.variants == ("vonbenzon2022", "wu2018", "gazebo_box_drag") * 4
    masses = np.asarray(found.train.plants.body.mass_matrix)[:3, 0, 0]
    np.testing.assert_allclose(masses, [13.5 + 6.36, 11.5 + 10.77, 13.4 + 1.272])
    assert [parameter.axes for parameter in found.parameters[:2]] == [(0, 1, 2), (3, 4, 5)]
    np.testing.assert_allclose(found.training_loop.sums.input_scale, 16.0)


def test_slopes_are_taken_without_steps():
    """Rounded readings have no slope: nothing is rounded, nothing else changes."""
    sensor = observer([imu(), dvl(), depth()])
    plant = hybrid_vehicle(bluerov2_heavy(), t200())
    loop = ClosedLoop(plant, pid(plant.model()), setpoint([0.0] * 6), sinusoid(), sensor)
    smooth = without(loop, ("resolution", "dead_zone"))
    assert float(smooth.plant.thruster.dead_zone) == 0.0 and float(loop.plant.thruster.dead_zone) == 1.2
    pairs = zip(loop.navigation.filter.sensors, smooth.navigation.filter.sensors, strict=True)
    assert [(float(a.sampling.resolution), float(b.sampling.resolution)) for a, b in pairs] == [(0.0, 0.0)] + [
        (1e-3, 0.0)
    ] * 2
    changed = jax.tree.map(lambda a, b: bool((a != b).any()), loop, smooth)
    assert sum(jax.tree.leaves(changed)) == 4  # the dead zone also stands in the law's own model


def test_dials_and_options():
    chosen = parameters(
        {"tracking": (1.0, 100.0), "feedback[0]": (1, 2), "feedback[1]": (3, 4), "rate": (5, 6)},
        [(0, 2), (1,)],
        ["rate"],
    )
    at = options(chosen, jnp.array([0.5, 0.0, 0.0, 1.0, 1.0, 0.0, 1.0]), 3)
    np.testing.assert_allclose(at["tracking"], [10.0, 1.0, 10.0])
    np.testing.assert_allclose(at["feedback"], [[1, 4], [2, 3], [1, 4]])
    np.testing.assert_allclose(at["rate"], 6.0)
    for parameter in chosen:
        np.testing.assert_allclose(parameter.share(parameter.value(0.3)), 0.3)
        assert parameter.share(1e9) == 1.0 and parameter.share(1e-9) == 0.0


@pytest.mark.parametrize(
    ("ranges", "said"),
    [
        ({"a": (2.0, 1.0)}, "`tune.parameters.a` must be [low, high] with low < high, but is [2.0, 1.0]"),
        (
            {"a": (0.0, 1.0)},
            "`tune.parameters.a` must have a positive lower bound, for a logarithmic scale, but is 0.0",
        ),
        ({"a": (1.0,)}, "`tune.parameters.a` must be [low, high], but is [1.0]"),
        ({"a[0]": (1, 2)}, "`tune.parameters.a[0]` must be `a`, which is one number per axis"),
        ({"feedback": (1, 2)}, "`tune.parameters.feedback` must be one of feedback[0], feedback[1]"),
    ],
)
def test_ranges_that_cannot_be(ranges, said):
    with pytest.raises(BadInput) as error:
        parameters(ranges, [(0,)])
    assert named(str(error.value)) == named(said)


def test_one_ode_is_not_what_a_vehicle_runs():
    ode = {"controller": "paper", "navigation": "perfect", "loop": {"kind": "continuous", "duration": 1.0}}
    with pytest.raises(BadInput, match=r"^`loop.kind` must be sampled, for gains to be used on a vehicle"):
        problem(from_data(AXIS | ode))


def test_disturbance_of_another_size():
    inner = SumOfDisturbances((sinusoid(2.0, 1.0), wrench([1.0] * 6), current([0.3, 0.1, 0.0])))
    place, calm = Pose(jnp.zeros(3), jnp.eye(3), jnp.zeros(3)), Load(jnp.ones(6), jnp.zeros(6))
    half = Scaled(inner, 0.5)
    one, two = (each.at(each.realize(jax.random.PRNGKey(0)), 0.7, place, calm) for each in (inner, half))
    np.testing.assert_allclose(two.acceleration - 1, 0.5 * (one.acceleration - 1))
    np.testing.assert_allclose(two.wrench, 0.5 * one.wrench)
    np.testing.assert_allclose(two.water.velocity, [0.15, 0.05, 0.0])


def test_a_vehicle_file_with_deviations_gives_other_vehicles_to_each_set(tmp_path, monkeypatch):
    """Plants of the trials: the values of the file first, then samples; the controller knows the values of the file."""
    monkeypatch.chdir(tmp_path)
    assert run(["init", "--own-vehicle"]) == 0
    file = Path("my_rov.yaml").read_text()
    Path("my_rov.yaml").write_text(file.replace("mass: 13.5  ", "mass: 13.5 +- 2"))
    text = read(Path("scenario.yaml"))
    found = problem(text._replace(data=text.data | {"tune": {"train": {"seeds": 2, "vehicles": 3}}}))
    masses = [np.asarray(trials.plants.vehicle.mass).tolist() for trials in (found.train, found.held_out)]
    assert [len(mass) for mass in masses] == [2 * 4, 4 * 5]
    assert masses[0][0] == masses[1][0] == 13.5
    assert masses[0][:4] == masses[0][4:]  # every vehicle with every seed
    others = [*masses[0][1:4], *masses[1][1:5]]
    assert len(set(others)) == 7 and all(8 < mass < 20 for mass in others)
    nominal = hybrid_vehicle(read_vehicle(Path("my_rov.yaml")).vehicle(), t200()).model().dynamics.body
    known = found.built.closed_loop.controller.model.dynamics.body
    np.testing.assert_array_equal(known.mass_matrix, nominal.mass_matrix)

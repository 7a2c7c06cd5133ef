"""The smallest departure that breaks a requirement, on plants for which it is known from theory."""

import numpy as np
import pytest

from undertow.core.errors import BadInput
from undertow.scenario.build import build
from undertow.scenario.reading import from_data
from undertow.scenario.results.run_scenario import run_scenario
from undertow.scenario.schema import Bounds
from undertow.studies.falsification.box import Box, box_of
from undertow.studies.falsification.falsify import as_data, falsify, judged_alone
from undertow.studies.falsification.gradient import Gradient
from undertow.studies.falsification.objective import RobustnessObjective, Violation
from undertow.studies.falsification.shrink import shrink

pytestmark = pytest.mark.full

DT, K_P, K_D = 0.05, 1.0, 1.0
PLANT = {
    "plant": {"kind": "double_integrator", "axes": 1},
    "controller": {"kind": "pid", "gains": [[K_P, 0.0, K_D]], "reference_frequency": 0},
    "reference": {"kind": "setpoint", "position": [0.0]},
    "initial": {"position": [1.0]},
}


def scenario(formula, vary, **other):
    asked = {"requirements": {"kept": {"formula": formula}}, "falsify": {"vary": vary}}
    return from_data(PLANT | asked | other)


def found_in(text, **options):
    return falsify(text, **({"budget": 1500, "method": "search"} | options))


def test_gain_at_which_the_sampled_loop_is_unstable():
    """A held PD law on a double integrator has a pole at -1 at k_d = 2 / T, whatever k_p (Jury)."""
    grows = "always[40, 50] abs(error) < 1"
    loop = {"loop": {"dt": DT, "duration": 50.0, "record": DT}}
    found = found_in(scenario(grows, {"controller.gains[0][2]": {"between": [0.5, 80.0]}}, **loop))
    assert found.finished
    np.testing.assert_allclose(found.values()["controller.gains[0][2]"], 2 / DT, rtol=0.02)
    np.testing.assert_allclose(found.violation.size, (2 / DT - K_D) / (80 - K_D), rtol=0.02)


def unstable_from(dt):
    """Smallest number of steps of delay with which the held PD law is unstable: eigenvalues of the sampled loop."""
    move, push = np.array([[1.0, dt], [0.0, 1.0]]), np.array([dt**2 / 2, dt])
    for steps in range(1, 100):
        whole = np.zeros((2 * (steps + 1), 2 * (steps + 1)))
        whole[:2, :2] = move
        whole[:2, -2:] = -np.outer(push, [K_P, K_D])
        whole[2:, :-2] = np.eye(2 * steps)
        if np.abs(np.linalg.eigvals(whole)).max() > 1:
            return steps
    raise AssertionError


@pytest.mark.slow
def test_delay_at_which_the_loop_is_unstable():
    """A delay acts from the next control step on: one a hair above n - 1 steps is the smallest of n steps.

    Beside it the delay margin of the continuous loop, less half a sampling time for the hold.
    """
    dt, grows = 0.1, "always[60, 80] abs(error) < 1"
    loop = {"loop": {"dt": dt, "duration": 80.0, "record": dt}}
    noisy = {"navigation": {"kind": "degraded", "delay": 0.0}}
    found = found_in(scenario(grows, {"navigation.delay": {"between": [0.0, 1.5]}}, **loop, **noisy))
    steps = unstable_from(dt)
    np.testing.assert_allclose(found.values()["navigation.delay"], (steps - 1) * dt, rtol=0.02)
    crossover = np.sqrt((K_D**2 + np.sqrt(K_D**4 + 4 * K_P**2)) / 2)
    margin = np.arctan(K_D * crossover / K_P) / crossover
    assert abs(steps * dt - (margin - dt / 2)) < dt


TWO = {
    "disturbance": [
        {"kind": "sinusoid", "amplitude": 0.0, "frequency": 0.7},
        {"kind": "sinusoid", "amplitude": 0.0, "frequency": 2.0, "phase": 0.9},
    ],
    "loop": {"dt": 0.02, "duration": 12.0, "record": 0.02},
}
BOUNDS = {"disturbance[0].amplitude": (-4.0, 2.0), "disturbance[1].amplitude": (-1.0, 3.0)}
LIMIT = 0.4


@pytest.fixture(scope="module")
def two():
    vary = {key: {"between": list(bounds)} for key, bounds in BOUNDS.items()}
    return scenario(f"always[6, 12] abs(error) < {LIMIT}", vary, **TWO)


def nearest_by_superposition(two):
    """Departure of least norm: the error is linear in both amplitudes, so each instant has two lines as its boundary."""

    def error(first, second):
        data = two.data | {
            "disturbance": [one | {"amplitude": a} for one, a in zip(TWO["disturbance"], (first, second), strict=True)]
        }
        outcome = run_scenario(data).outcome
        return np.asarray(outcome.signals["error"])[np.asarray(outcome.time) >= 6 - 1e-9, 0]

    rest = error(0.0, 0.0)
    slopes = np.stack([error(1.0, 0.0) - rest, error(0.0, 1.0) - rest], axis=-1)
    best = np.inf
    for reach in [(a, b) for a in BOUNDS["disturbance[0].amplitude"] for b in BOUNDS["disturbance[1].amplitude"]]:
        for sign in (1.0, -1.0):
            normal, left = slopes * np.array(reach), LIMIT - sign * rest
            for axes in ([0], [1], [0, 1]):
                some = sign * normal[:, axes]
                points = left[:, None] * some / (some**2).sum(1, keepdims=True)
                inside = ((points >= 0) & (points <= 1)).all(1)
                best = min(best, np.sqrt((points[inside] ** 2).sum(1)).min(initial=np.inf))
    return best


@pytest.mark.parametrize("method", ["gradient", "search"])
def test_two_disturbances_by_superposition(two, method):
    found = found_in(two, method=method, budget=700)
    assert found.differentiated == (method == "gradient")
    exact = nearest_by_superposition(two)
    assert exact * (1 - 1e-6) < found.violation.size < 1.02 * exact


def test_a_single_run_repeats_the_counterexample(two):
    found = found_in(two, budget=300)
    assert found.repeated()
    alone = run_scenario(found.single_runs[-1].built.resolved)
    assert judged_alone(found.evaluator.requirements, alone) == found.broken
    assert not found.broken["kept"] > 0
    data = as_data(found)
    assert data["counterexample"]["repeated"] and len(data["evaluations"]["robustness"]) == data["runs"] <= 300
    sizes = [step["size"] for step in data["history"]]
    assert sizes == sorted(sizes, reverse=True)


def test_a_gradient_by_differentiation_is_that_of_differences(two):
    evaluator = found_in(two, budget=8).evaluator
    at = np.array([0.31, 0.22])
    one_seed = lambda points: evaluator.robustness(points, [0] * len(points))
    exact, differences = (Gradient(evaluator, one_seed, way)(at) for way in (True, False))
    np.testing.assert_allclose(exact, differences, rtol=0.1)


def test_the_same_seed_gives_the_same_search(two):
    first, second = (found_in(two, budget=150, seed=3) for _ in range(2))
    assert first.objective.robustnesses == second.objective.robustnesses
    assert not first.finished and first.objective.runs == 150


def test_the_seed_is_part_of_the_search():
    """With three seeds, the smallest noise that breaks a requirement is that of the worst of them."""
    loop = {
        "navigation": {"kind": "white_noise", "velocity": 0.0},
        "loop": {"dt": 0.05, "duration": 5.0, "record": 0.05},
    }
    text = scenario("always[2, 5] abs(error) < 0.5", {"navigation.velocity": {"between": [0.0, 20.0]}}, **loop)
    several = text._replace(data=text.data | {"falsify": text.data["falsify"] | {"seeds": 3}, "seed": 5})
    found = found_in(several, budget=450)
    alone = [found_in(text._replace(data=text.data | {"seed": seed}), budget=150) for seed in (5, 6, 7)]
    smallest = min(alone, key=lambda one: one.violation.size)
    np.testing.assert_allclose(found.violation.size, smallest.violation.size, rtol=0.05)
    assert found.violation.seed == smallest.violation.seed
    assert found.single_runs[-1].built.scenario.seed == found.violation.seed and found.repeated()


def test_bounds_without_a_violation(two):
    vary = {key: {"between": [-0.01, 0.01]} for key in BOUNDS}
    found = found_in(two._replace(data=two.data | {"falsify": {"vary": vary}}), budget=60)
    assert found.violation is None and found.values() == {} and as_data(found)["counterexample"] is None
    assert as_data(found)["least_robustness"] > 0


def test_an_interrupted_search_continues_from_its_checkpoint(two, tmp_path):
    path = tmp_path / "runs.jsonl"
    whole = found_in(two, budget=100, checkpoint=path)
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[: len(lines) // 2]))
    again = found_in(two, budget=100, checkpoint=path, resume=True)
    assert again.objective.robustnesses == whole.objective.robustnesses
    with pytest.raises(BadInput, match="continue with the same scenario and method"):
        found_in(two, budget=100, checkpoint=path, resume=True, seed=1)


def unit_box(numbers):
    """A box of some numbers from -2 to 2, nominal 0, which vary nothing."""
    axis = box_of({"initial.position[0]": build_bounds()}, build(PLANT)).axes[0]
    return Box(tuple(axis._replace(key=f"x{i}", low=-2.0, nominal=0.0, high=2.0) for i in range(numbers)))


def build_bounds():
    return Bounds.model_validate({"between": [0.0, 2.0]})


def test_a_curved_boundary_in_five_dimensions():
    """Outside of an ellipsoid: the smallest violation is the end of its shortest axis."""
    axes = np.array([0.9, 0.8, 0.5, 0.7, 0.95])
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(5, 5)))[0]
    inside = lambda points: 1 - (((points @ turn) / axes) ** 2).sum(-1)
    objective = RobustnessObjective(
        lambda points, seeds: inside(points), unit_box(5), [0], 6000, lambda runs, least, smallest: None
    )
    start = np.full(5, 0.9)
    objective.robustness(start[None])
    assert isinstance(objective.smallest, Violation)
    slope = lambda point: -2 * turn @ ((point @ turn) / axes**2)
    shrink(objective, slope, np.eye(5), seed=0)
    np.testing.assert_allclose(objective.smallest.size, axes.min(), rtol=0.02)


def test_departures_and_numbers():
    built = build(from_data(PLANT))
    vary = {"initial.position[0]": build_bounds()}
    box = box_of(vary, built)
    assert box.values(np.array([0.25])) == {"initial.position[0]": 1.25}
    assert box.values(np.array([-0.25])) == {"initial.position[0]": 0.75}
    points = np.random.default_rng(0).random((20, 1))
    np.testing.assert_allclose(box.to_cube(box.of_cube(points)), points)
    np.testing.assert_allclose(box.of_cube(points)[:, 0], 2 * points[:, 0] - 1)

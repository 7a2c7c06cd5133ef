"""Trials that are built together have the bits of trials that are built alone, and are valid where these are."""

from pathlib import Path

import numpy as np
import pytest

from undertow.core import runtime
from undertow.scenario.build import build
from undertow.scenario.part_cache import PartCache
from undertow.scenario.prepare import loop_run
from undertow.scenario.reading import from_data, read
from undertow.simulation.loop.loop_runs import numbers_of
from undertow.studies.campaign import build_trials as building
from undertow.studies.campaign.build_trials import TraceableKinds, build_trials, valid_trials
from undertow.studies.campaign.campaign_schema import validate
from undertow.studies.campaign.trials import trials

pytestmark = pytest.mark.full

EXAMPLES = Path(__file__).parents[2] / "examples"
SAMPLED = [path.stem for path in sorted(EXAMPLES.glob("*.yaml")) if path.stem not in ("my_rov", "magnetic_levitation")]


def several_of(scenario, vary, number=60, folder=Path(), **others):
    """Trials of a scenario in which some keys vary."""
    data = from_data({"scenario": scenario, "vary": vary, "trials": number, "seed": 3, **others})
    found = trials(validate(data), data)
    return found._replace(scenario=found.scenario._replace(folder=folder))


def built_both_ways(several):
    """Trials by their places, alone; and as they are built for a task."""
    part_cache, rows = PartCache(), np.arange(several.number)
    with runtime.on_processor():
        alone = dict(valid_trials(several, part_cache, rows.tolist()))
        together = list(build_trials(several, part_cache, rows, several.sampled(rows), TraceableKinds()))
    return alone, together


def assert_same_bits(alone, together):
    """Every valid trial is there once, and each of its numbers is that of the trial that was built alone."""
    assert sorted(np.concatenate([found.places for found in together])) == sorted(alone)
    for found in together:
        for i, place in enumerate(found.places):
            expected = numbers_of(loop_run(alone[place]))
            own = [
                leaf if number is None else number[i]
                for number, leaf in zip(found.batch.numbers, numbers_of(found.batch.first.run), strict=True)
            ]
            assert [np.asarray(leaf).tobytes() for leaf in own] == [np.asarray(leaf).tobytes() for leaf in expected]


def numbers(node, path=""):
    """Key paths of the fractions of a scenario with every default filled in; of a list the first only."""
    if isinstance(node, dict):
        for key, inner in node.items():
            yield from numbers(inner, f"{path}.{key}".lstrip("."))
    elif isinstance(node, list) and node:
        yield from numbers(node[0], f"{path}[0]")
    elif type(node) is float and np.isfinite(node):
        yield path, node


HEAVY = {
    "plant.vehicle.mass": {"normal": [11.0, 0.5]},
    "model.vehicle.mass": {"uniform": [10.5, 11.5]},
    "initial.position[2]": {"uniform": [-0.1, 0.1]},
    "controller.bandwidth": {"log_uniform": [1.0, 3.0]},
    "controller.tracking": {"uniform": [0.5, 1.0]},
    "controller.actuator_rate": {"uniform": [10.0, 20.0]},
    "disturbance[0].velocity[0]": {"normal": [0.3, 0.1]},
    "disturbance[1].height": {"uniform": [0.2, 0.8]},
    "navigation.dvl_blend": {"uniform": [0.05, 0.2]},
    "navigation.sensors[0].rate_bias": {"choice": [0.0, 1e-3, 2e-3]},
}


def test_a_vehicle_at_sea_is_built_together():
    text = read(EXAMPLES / "bluerov2_heavy.yaml")
    data = dict(text.data) | {"initial": {"position": [0.0] * 6}, "model": {"vehicle": "bluerov2_heavy"}}
    data["navigation"] = build(text).resolved["navigation"]
    several = several_of(data, HEAVY, folder=text.folder)
    alone, together = built_both_ways(several)
    assert [len(found.places) for found in together] == [60]
    assert_same_bits(alone, together)


@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_both_precisions(campaign, precision):
    data = campaign()
    vary = {"disturbance.amplitude": {"uniform": [0.5, 2.0]}, "controller.frequency": {"log_uniform": [1.0, 3.0]}}
    alone, together = built_both_ways(several_of(data["scenario"] | {"precision": precision}, vary))
    assert [len(found.places) for found in together] == [60]
    assert_same_bits(alone, together)


@pytest.mark.slow
@pytest.mark.parametrize("name", SAMPLED)
def test_every_number_of_the_examples(name):
    """A tenth of each number up and down, one at a time."""
    text = read(EXAMPLES / f"{name}.yaml")
    resolved = build(text).resolved
    sections = {key: resolved[key] for key in building._TRACED if key in resolved}
    found = 0
    for key, value in numbers(sections):
        spread = sorted((0.9 * value, 1.1 * value)) if value else [-0.01, 0.01]
        alone, together = built_both_ways(several_of(dict(text.data), {key: {"uniform": spread}}, folder=text.folder))
        if alone:
            assert_same_bits(alone, together)
            found += len(together) == 1
    assert found >= 8  # keys that are built together


def test_trials_that_differ_in_their_seeds_only(campaign):
    alone, together = built_both_ways(several_of(campaign()["scenario"], {}))
    assert [len(found.places) for found in together] == [60]
    assert_same_bits(alone, together)


def test_invalid_trials_are_those_that_are_invalid_alone(campaign):
    """Half of the amplitudes are such that a condition fails: those of `not_negative` and of `positive`."""
    scenario = campaign()["scenario"] | {
        "reference": {"kind": "setpoint", "position": [0.0], "settling": 1.0},
        "controller": {"kind": "pid", "frequency": 2.0},
    }
    vary = {"controller.frequency": {"uniform": [-2.0, 2.0]}, "reference.settling": {"uniform": [-1.0, 3.0]}}
    alone, together = built_both_ways(several_of(scenario, vary))
    assert 10 < len(alone) < 40 and len(together) == 1
    assert_same_bits(alone, together)


def test_choices_of_parts_and_of_counts_are_built_apart(campaign):
    vary = {
        "controller": {"choice": [{"kind": "pid", "frequency": 2.0}, {"kind": "paper", "sets": 3}]},
        "disturbance.amplitude": {"uniform": [0.5, 2.0]},
    }
    alone, together = built_both_ways(several_of(campaign()["scenario"], vary, 150))
    assert len(together) == 2
    assert_same_bits(alone, together)


def test_a_setting_of_the_run_is_built_one_by_one(campaign):
    alone, together = built_both_ways(several_of(campaign()["scenario"], {"loop.duration": {"uniform": [1.0, 2.0]}}, 8))
    assert len(together) == len(alone) == 8


OWN = """
import jax.numpy as jnp
import numpy as np
from undertow.physics.disturbances.sinusoid import sinusoid

def by_numpy(amplitude=1.0):
    return sinusoid(amplitude=float(np.sqrt(amplitude)))

def by_value(amplitude=1.0):
    return sinusoid(amplitude=amplitude if amplitude < 1.0 else 1.0)

def otherwise_when_traced(amplitude=1.0):
    known = isinstance(amplitude, float)
    return sinusoid(amplitude=amplitude * (1.0 if known else 1.0 + 1e-15))

def by_jax(amplitude=1.0):
    return sinusoid(amplitude=jnp.sqrt(amplitude))
"""


@pytest.mark.parametrize(
    "function, groups", [("by_numpy", 60), ("by_value", 60), ("otherwise_when_traced", 60), ("by_jax", 1)]
)
def test_parts_of_the_users_own(campaign, tmp_path, function, groups):
    """One that looks at its numbers, or gives other bits for many trials, is built trial by trial."""
    (tmp_path / "own.py").write_text(OWN)
    scenario = campaign()["scenario"] | {"disturbance": {"kind": f"./own.py:{function}", "amplitude": 1.0}}
    several = several_of(scenario, {"disturbance.amplitude": {"uniform": [0.5, 2.0]}}, folder=tmp_path)
    alone, together = built_both_ways(several)
    assert len(together) == groups
    assert_same_bits(alone, together)

"""Whatever a scenario says, it is built or refused in one line: never anything else."""

import copy
import math

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from undertow.core.errors import BadInput
from undertow.scenario.build import build
from undertow.scenario.part_cache import PartCache

pytestmark = pytest.mark.full

VALID = {
    "description": "fuzzed",
    "plant": {
        "kind": "hybrid_vehicle",
        "vehicle": {"kind": "odin", "mass": 125.0, "r_g": [0.0, 0.0, 0.05]},
        "thruster": {"kind": "paper_table3", "fidelity": "ideal", "supply": 24.0, "motor": {"resistance": 1.2}},
    },
    "model": {"speed_sensor": False, "rate_term": True, "regularisation": 0.1},
    "controller": {
        "kind": "paper",
        "feedback": [1.0, 2.0],
        "weight": [[10.0, 0.0], [0.0, 10.0]],
        "adaptation": 100.0,
        "composite": 20.0,
        "fuzzy_input": "error",
        "sets": 3,
        "reach": [1.0],
        "width": 0.5,
        "substeps": 1,
        "method": "euler",
    },
    "reference": {"kind": "setpoint", "position": [1.0, 2.0, 3.0, 0.0, 0.0, 1.0]},
    "disturbance": {"kind": "table", "samples": [[0.0, 1, 2, 3, 4, 5, 6], [1.0, 0, 0, 0, 0, 0, 0]]},
    "navigation": {"kind": "white_noise", "position": 0.1, "velocity": [0.1] * 6},
    "loop": {"kind": "sampled", "duration": 1.0, "dt": 1e-3, "record": 1e-2, "substeps": 1, "method": "rk4"},
    "initial": {"position": [0.0] * 6, "velocity": None},
    "steady": {"start": 0.5, "stop": 1.0},
    "seed": 1,
}

NAMES = (
    "odin",
    "paper_table3",
    "linear_voltage",
    "double_integrator",
    "paper",
    "robust",
    "circle",
    "u1",
    "sinusoid",
    "none",
    "kind",
)
NUMBERS = st.one_of(st.integers(-(10**20), 10**20), st.floats(), st.sampled_from([0, 1, -1, 1e-300, 1e300, math.nan]))
WORDS = st.one_of(st.sampled_from(NAMES), st.text(max_size=8))
LEAVES = st.one_of(NUMBERS, WORDS, st.booleans(), st.none())
VALUES = st.recursive(
    LEAVES, lambda inner: st.lists(inner, max_size=7) | st.dictionaries(WORDS, inner, max_size=3), max_leaves=8
)


def paths(node, path=()):
    """Every place in a tree of mappings and lists."""
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in items:
        yield (*path, key)
        yield from paths(value, (*path, key))


PLACES = list(paths(VALID))


@st.composite
def mutated(draw):
    scenario = copy.deepcopy(VALID)
    for _ in range(draw(st.integers(1, 3))):
        *above, last = draw(st.sampled_from(PLACES))
        node = scenario
        try:
            for key in above:
                node = node[key]
            how = draw(st.sampled_from(["replace", "replace", "remove", "rename", "add"]))
            if how == "replace":
                node[last] = draw(VALUES)
            elif how == "add" and isinstance(node, dict):
                node[draw(WORDS)] = draw(VALUES)
            elif how == "rename" and isinstance(node, dict):
                node[draw(WORDS)] = node.pop(last)
            else:
                del node[last]
        except (KeyError, IndexError, TypeError):  # an earlier change took this place away
            continue
    return scenario


PARTS = PartCache()  # those that no change has met, made once


def built_or_refused_in_one_line(scenario):
    try:
        build(scenario, PARTS)
    except BadInput as error:
        said = str(error)
        assert said.startswith("`") and " must " in said
        assert len(said.splitlines()) == 1 and len(said) < 1000


def test_unchanged_scenario_builds():
    build(VALID)


@pytest.mark.parametrize("examples", [15, pytest.param(400, marks=pytest.mark.slow)])
def test_changed_scenario(examples):
    @settings(max_examples=examples, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
    @given(mutated())
    def every(scenario):
        built_or_refused_in_one_line(scenario)

    every()


@settings(max_examples=50, deadline=None, derandomize=True)
@given(VALUES)
def test_anything_at_all(value):
    built_or_refused_in_one_line(value if isinstance(value, dict) else {"reference": value})

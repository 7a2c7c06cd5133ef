"""Whatever stands in a vehicle file: one clear complaint, or findings; never a crash or a warning."""

import copy
from pathlib import Path

import numpy as np
import pytest

from undertow.core.errors import BadInput
from undertow.scenario.checks.vehicle_lint import derived, lint
from undertow.scenario.reading import read
from undertow.scenario.vehicle_schema import parse

pytestmark = pytest.mark.full

SOUND = read(Path(__file__).parents[2] / "examples" / "my_rov.yaml").data
ODD = [
    0,
    -1,
    1e-300,
    1e300,
    1e14,
    1e-9,
    [],
    {},
    "x",
    None,
    True,
    [0, 0, 0],
    [0] * 6,
    [[0] * 6] * 6,
    [1e14] * 3,
    [-1, 1, 1],
]


def spoilt(rng):
    data = copy.deepcopy(SOUND)
    for _ in range(rng.integers(1, 4)):
        key, odd = rng.choice(list(data)), ODD[rng.integers(len(ODD))]
        inside = data[key][0] if key == "thrusters" and isinstance(data[key], list) and data[key] else None
        if isinstance(inside, dict) and inside:
            inside[rng.choice(list(inside))] = odd
        else:
            data[key] = odd
    return data


def test_odd_contents():
    rng, linted = np.random.default_rng(1), 0
    for _ in range(1500):
        try:
            facts = parse(spoilt(rng)).facts()
        except BadInput as complaint:
            assert "\n" not in str(complaint)
            continue
        sentences = [finding.sentence() for finding in lint(facts)]
        assert all("\n" not in sentence and "nan" not in sentence for sentence in sentences)
        assert all(len(row) == 3 for row in derived(facts))
        linted += 1
    assert linted > 50

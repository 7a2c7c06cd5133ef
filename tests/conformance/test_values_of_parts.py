"""What every part of the catalogue computes from given numbers is what it computed when it was recorded.

Closed forms and published numbers, by which the parts were judged, are in the other tests.
"""

import json

import equinox as eqx
import jax
import numpy as np
import pytest
from catalogue_parts import ALL, groups, make
from recorded import FILE, is_as_recorded
from use_of_parts import NUMBERS, numbers

from undertow.core.param import tuning_ranges

# Their programs take longest to compile, and tests of their own check what they compute.
HEAVY = {("navigation", "kalman"), ("supervision", "supervisor"), ("controllers", "nmpc")}
# Laws and faults have closed forms of their own in the quick set; their programs take longer than all others.
IN_THE_FULL_SET = ("controllers", "navigation", "faults")


def values_of(pairs):
    """What each part computes, by its name, from three rows of numbers; by one program for all."""
    parts = {"/".join(pair): make(*pair) for pair in pairs}
    arrays, rest = eqx.partition(parts, eqx.is_array)

    @jax.jit
    def values(arrays, v):
        whole = eqx.combine(arrays, rest)
        return {name: numbers(name.partition("/")[0], part, v) for name, part in whole.items()}

    rows = [values(arrays, v) for v in np.random.default_rng(8).uniform(-1, 1, (3, NUMBERS))]
    return {name: np.concatenate([row[name] for row in rows]) for name in parts}


@pytest.mark.parametrize(
    "pairs",
    [pytest.param(pairs, marks=pytest.mark.full if pairs[0][0] in IN_THE_FULL_SET else ()) for pairs in groups(HEAVY)],
    ids=lambda pairs: "/".join(pairs[0]),
)
def test_values_are_those_that_were_recorded(pairs):
    for name, values in values_of(pairs).items():
        assert np.isfinite(values).all(), name
        is_as_recorded(name, values)


def test_parameters_are_those_that_were_recorded():
    """All numbers of every part and of what it is made of, its defaults among them; nothing is compiled."""
    for pair in ALL:
        is_as_recorded(f"parameters of {'/'.join(pair)}", eqx.filter(make(*pair), eqx.is_inexact_array))


def test_ranges_of_gains_are_those_that_were_recorded():
    """Between which `undertow tune` searches."""
    for pair in ALL:
        if ranges := tuning_ranges(make(*pair)):
            is_as_recorded(f"ranges of {'/'.join(pair)}", ranges)


def test_a_value_is_recorded_of_every_part():
    parts = {name for name in json.loads(FILE.read_text()) if name.partition("/")[0] in {kind for kind, _ in ALL}}
    assert parts == {"/".join(pair) for pair in set(ALL) - HEAVY}

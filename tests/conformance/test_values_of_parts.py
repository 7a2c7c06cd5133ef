"""What every part of the catalogue computes from given numbers is what it computed when `values_of_parts.json` was written.

A change of a number that is meant is written anew by `python tests/conformance/test_values_of_parts.py`; closed forms
and published numbers, by which the parts were judged, are in the other tests.
"""

import json
from pathlib import Path

import equinox as eqx
import jax
import numpy as np
import pytest
from catalogue_parts import ALL, groups, make
from use_of_parts import NUMBERS, numbers

from undertow.process_setup import prepare

RECORDED = Path(__file__).with_name("values_of_parts.json")
# Their programs take longest to compile, and tests of their own check what they compute.
HEAVY = {("navigation", "kalman"), ("supervision", "supervisor"), ("controllers", "nmpc")}
QUICK = ("faults", "sensors", "navigation")


def digests(pairs):
    """Two numbers for each part, to which each of its numbers contributes whatever its size, by three rows of numbers."""
    parts = {"/".join(pair): make(*pair) for pair in pairs}
    arrays, rest = eqx.partition(parts, eqx.is_array)

    @jax.jit
    def values(arrays, v):
        whole = eqx.combine(arrays, rest)
        return {name: numbers(name.partition("/")[0], part, v) for name, part in whole.items()}

    rows = [values(arrays, v) for v in np.random.default_rng(8).uniform(-1, 1, (3, NUMBERS))]
    found = {}
    for name in parts:
        every = np.concatenate([np.asarray(row[name]) for row in rows])
        assert np.isfinite(every).all(), name
        size = np.arcsinh(1e6 * np.clip(every, -1e300, 1e300))
        weights = np.random.default_rng(9).uniform(-1, 1, (2, len(size)))
        found[name] = [len(size), *(weights @ size).tolist()]
    return found


@pytest.mark.parametrize(
    "pairs",
    [pytest.param(pairs, marks=() if pairs[0][0] in QUICK else pytest.mark.full) for pairs in groups(HEAVY)],
    ids=lambda pairs: "/".join(pairs[0]),
)
def test_values_are_those_that_were_recorded(pairs):
    recorded = json.loads(RECORDED.read_text())
    for name, found in digests(pairs).items():
        np.testing.assert_allclose(found, recorded[name], rtol=0, atol=1e-6, err_msg=name)


def test_a_value_is_recorded_of_every_part():
    assert set(json.loads(RECORDED.read_text())) == {"/".join(pair) for pair in set(ALL) - HEAVY}


def record():
    """Writes the present values."""
    found = {name: digest for pairs in groups(HEAVY) for name, digest in digests(pairs).items()}
    lines = ",\n".join(f'"{name}": {json.dumps([round(x, 9) for x in one])}' for name, one in sorted(found.items()))
    RECORDED.write_text(f"{{\n{lines}\n}}\n")


if __name__ == "__main__":
    prepare()
    jax.config.update("jax_enable_x64", True)
    record()

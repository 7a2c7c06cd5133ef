"""What a run gave when it was recorded: for numbers that no closed form gives, so that no change of one goes unseen.

A change that is meant is recorded anew by `UNDERTOW_RECORD=1 python -m pytest ...`, one process at a time.
"""

import json
import os
from pathlib import Path

import jax
import numpy as np

FILE = Path(__file__).with_name("recorded.json")


def digest(tree) -> list[float]:
    """How many numbers there are, and two sums to which each contributes whatever its size."""
    leaves = [np.zeros(0), *(np.asarray(leaf, dtype=float).ravel() for leaf in jax.tree.leaves(tree))]
    every = np.nan_to_num(np.concatenate(leaves), nan=7e9, posinf=8e9, neginf=-9e9).clip(-1e300, 1e300)
    weights = np.random.default_rng(9).uniform(-1, 1, (2, len(every)))
    return [len(every), *(weights @ np.arcsinh(1e4 * every)).tolist()]


def is_as_recorded(name: str, tree) -> None:
    """Checks all numbers of a tree, within 1e-10 and a millionth, against those that were recorded by this name."""
    recorded, found = json.loads(FILE.read_text()) if FILE.exists() else {}, digest(tree)
    if os.environ.get("UNDERTOW_RECORD"):
        recorded[name] = [round(number, 8) for number in found]
        lines = ",\n".join(f"{json.dumps(key)}: {json.dumps(recorded[key])}" for key in sorted(recorded))
        FILE.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")
    np.testing.assert_allclose(found, recorded[name], rtol=0, atol=2e-6, err_msg=name)

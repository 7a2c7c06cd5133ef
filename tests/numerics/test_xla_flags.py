"""The compiler as a process of undertow sets it up gives the numbers that each part gives alone."""

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.full

PROGRAM = """
from undertow.core.process_setup import prepare

prepare()
import numpy as np
from test_values_of_parts import HEAVY, groups, values_of

(references,) = [pairs for pairs in groups(HEAVY) if ("references", "waypoints") in pairs]
together = values_of(references)
for pair in references:
    ((name, alone),) = values_of([pair]).items()
    np.testing.assert_allclose(together[name], alone, rtol=1e-9, atol=1e-9, err_msg=name)
"""


def test_parts_of_one_program_do_not_change_each_other(tmp_path):
    """With the fusion emitters of JAX 0.10 the way-points came out metres away."""
    tests = Path(__file__).parents[1]
    path = ":".join(map(str, (tests.parent, tests, tests / "conformance")))
    setting = {"PYTHONPATH": path, "UNDERTOW_CACHE": str(tmp_path), "PATH": ""}
    ended = subprocess.run([sys.executable, "-c", PROGRAM], env=setting, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr[-2000:]

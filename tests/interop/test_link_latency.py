"""benchmarks/link_latency.py prints times of both links."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.interop


@pytest.mark.slow
def test_it_measures():
    script = Path(__file__).parents[2] / "benchmarks/link_latency.py"
    command = [sys.executable, str(script), "--steps", "20", "--json"]
    found = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    assert set(found) == {"ardupilot", "mavlink"}
    for values in found.values():
        assert values["steps"] == 20 and 0 < values["p50"] <= values["p99"] <= values["max"]

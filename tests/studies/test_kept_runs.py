"""Runs of the reproduction keep the series of the figures, and are repeated bit for bit from what they keep."""

import pytest
import xarray as xr

from undertow.paper.running import start_all
from undertow.scenario.reading import read
from undertow.scenario.results.repetition import compare
from undertow.scenario.results.run_scenario import run_scenario
from undertow.simulation.processes import Tasks, worker_processes

pytestmark = pytest.mark.full

AXIS = {
    "plant": {"kind": "double_integrator", "axes": 1, "limit": 20},
    "controller": {"kind": "pid", "frequency": 2},
    "reference": {"kind": "setpoint", "position": [1.0]},
    "disturbance": {"kind": "sinusoid", "amplitude": 1},
    "navigation": {"kind": "white_noise", "velocity": 0.01},
    "loop": {"duration": 2.0, "dt": 0.01, "record": 0.01},
    "seed": 3,
}


def test_a_kept_run_is_repeated_bit_for_bit(tmp_path):
    with worker_processes(1) as pool:
        ran = start_all({"axis": AXIS}, tmp_path, Tasks(pool, lambda words, share: None))()["axis"]
    file = tmp_path / "runs" / "axis.nc"
    series = {"position", "reference", "input", "uncertainty", "estimate"}
    with xr.open_dataset(file) as kept:
        assert set(kept.data_vars) == series < set(ran.dataset.data_vars)
        assert "velocity" in kept.attrs["left_out"].split(", ")
        for name in kept.data_vars:
            assert kept[name].values.tobytes() == ran.dataset[name].values.tobytes()
    repeated = run_scenario(read(file)).dataset
    assert set(repeated.data_vars) == set(ran.dataset.data_vars)
    found = compare(file, repeated)
    assert found.equal and found.sentence.startswith("axis.nc was repeated bit for bit (content hash ")

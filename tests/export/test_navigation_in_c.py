"""Navigation filters as C99: the bits of the batch compiler, and those of the filter in Python, in a loop."""

import re
import shutil
import subprocess

import numpy as np
import pytest

import undertow as ut
from undertow.outside.export.navigation import export_navigation
from undertow.scenario.build import build
from undertow.scenario.reading import from_data

pytestmark = pytest.mark.compiler

COMPILERS = [name for name in ("gcc", "clang") if shutil.which(name)]
SENSORS = ["imu", "dvl", "depth", "compass", {"kind": "position_fix", "delay": 0.2}]
SCENARIO = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
    "controller": {"kind": "pid", "frequency": 2.0},
    "reference": {"kind": "setpoint", "position": [0, 0, 0, 0, 0, 0]},
    "loop": {"duration": 1.0, "dt": 0.01},
}
LOOP = """\
#include <stdio.h>
#include "navigation.h"
int main(void) {
    static navigation_state state;
    navigation_input input = navigation_DEFAULTS;
    navigation_output output;
    for (int k = 0; k < 200; ++k) {
        input.sensor_imu_fresh = true;
        for (int i = 0; i < 8; ++i) input.sensor_imu_reading[i] = (i == 7) ? -9.81 : 0.001 * i * (k % 7);
        input.sensor_dvl_fresh = (k % 10) == 0;
        input.sensor_dvl_reading[0] = 0.125;
        input.sensor_position_fix_fresh = (k % 50) == 1;
        (k == 0) ? navigation_start(&state, &input, &output) : navigation_step(&state, &input, &output);
    }
    for (int i = 0; i < 3; ++i) printf("%a\\n", output.motion_position[i]);
    for (int i = 0; i < 6; ++i) printf("%a\\n", output.motion_velocity[i]);
    for (int i = 0; i < 4; ++i) printf("%a\\n", output.motion_attitude[i]);
    return 0;
}
"""


@pytest.mark.parametrize(
    "kind, precision",
    [
        ("observer", "float64"),  # the program is a tenth as long
        pytest.param("kalman", "float64", marks=pytest.mark.slow),
        pytest.param("kalman", "float32", marks=pytest.mark.slow),
    ],
)
def test_every_bit_is_that_of_the_batch_compiler(tmp_path, kind, precision):
    scenario = SCENARIO | {"navigation": {"kind": kind, "sensors": SENSORS}}
    export_navigation(build(from_data(scenario)), precision=precision).write(tmp_path)
    for compiler in COMPILERS:
        flags = "-O1 -fsanitize=undefined,address -fno-sanitize-recover=all"
        command = ["make", "clean", "test", f"CC={compiler}", f"CFLAGS={flags}"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert "0 of 50 steps differ" in done.stdout
    assert not re.search(r"\b(malloc|calloc|free|printf)\b", (tmp_path / "navigation.c").read_text())


DISTURBED = [
    "imu",
    {"kind": "dvl", "correlated_noise": 0.01, "correlation_time": 2},
    "depth",
    {"kind": "compass", "soft_iron": 0.05, "interference": 1e-3},
    {"kind": "position_fix", "delay": 0.2},
]


@pytest.mark.parametrize(
    ("kind", "sensors"),
    [("observer", SENSORS), ("kalman", SENSORS), pytest.param("kalman", DISTURBED, marks=pytest.mark.slow)],
)
def test_a_loop_in_c_is_the_loop_in_python(tmp_path, kind, sensors):
    scenario = SCENARIO | {"navigation": {"kind": kind, "sensors": sensors}}
    export_navigation(build(from_data(scenario))).write(tmp_path)
    (tmp_path / "loop.c").write_text(LOOP)
    flags = ["-O1", "-std=c99", "-ffp-contract=off"]
    subprocess.run([COMPILERS[0], *flags, "loop.c", "navigation.c", "-o", "loop", "-lm"], cwd=tmp_path, check=True)
    said = subprocess.run([tmp_path / "loop"], capture_output=True, text=True, check=True).stdout
    found = [float.fromhex(line) for line in said.split()]
    alone = ut.NavigationFilter(scenario)
    for k in range(200):
        readings = {"imu": [0.001 * i * (k % 7) if i < 7 else -9.81 for i in range(8)]}
        if k % 10 == 0:
            readings["dvl"] = [0.125, 0.0, 0.0]
        if k % 50 == 1:
            readings["position_fix"] = [0.0, 0.0]
        if k == 0:
            motion = alone.start(np.zeros(3), np.zeros(6), [1.0, 0.0, 0.0, 0.0], readings)
        else:
            # The clock of the filter rounds as a simulation does, 0.01 s is not a difference of its times.
            motion = alone.step(readings)
    np.testing.assert_allclose(found, np.concatenate(motion), rtol=0, atol=1e-15)

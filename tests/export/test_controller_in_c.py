"""Exported controllers where the caller's clock is wrong, in a loop in C: as `Autopilot` takes it."""

import shutil
import subprocess

import numpy as np
import pytest

import undertow as ut
from undertow.outside.export.controller import export_controller
from undertow.scenario.build import build
from undertow.scenario.reading import from_data

pytestmark = pytest.mark.compiler

COMPILER = next(name for name in ("gcc", "clang") if shutil.which(name))
SCENARIO = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
    "controller": {"kind": "rcaf", "preset": "robust"},
    "reference": {"kind": "setpoint", "position": [1, 0, 0, 0, 0, 0]},
    "loop": {"duration": 1.0, "dt": 0.01},
}
LOOP = """\
#include <math.h>
#include <stdio.h>
#include "controller.h"
int main(void) {
    static controller_state state;
    controller_input input = controller_DEFAULTS;
    controller_output output;
    input.target_position[0] = 1;
    for (int k = 0; k < 60; ++k) {
        input.motion_position[0] = 0.001 * k;
        input.dt = (k == 30) ? WRONG : 0.01;
        (k == 0) ? controller_start(&state, &input, &output) : controller_step(&state, &input, &output);
        for (int i = 0; i < 8; ++i) input.applied[i] = output.command[i];
    }
    for (int i = 0; i < 8; ++i) printf("%a\\n", output.command[i]);
    return 0;
}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("c")
    export_controller(build(from_data(SCENARIO))).write(path)
    (path / "loop.c").write_text(LOOP)
    flags = ["-O1", "-std=c99", "-ffp-contract=off", "-c"]
    subprocess.run([COMPILER, *flags, "controller.c"], cwd=path, check=True)
    return path


@pytest.fixture(scope="module")
def autopilot():
    return ut.Autopilot(SCENARIO)


def commands(folder, wrong):
    compiled = [COMPILER, "-std=c99", f"-DWRONG={wrong}", "loop.c", "controller.o", "-o", "loop", "-lm"]
    subprocess.run(compiled, cwd=folder, check=True)
    said = subprocess.run([folder / "loop"], capture_output=True, text=True, check=True).stdout
    return np.array([float.fromhex(line) for line in said.split()])


@pytest.mark.parametrize(
    "wrong, seconds", [("0.05", 0.05), ("10.0", 10.0), ("INFINITY", None), ("NAN", None), ("0.0", None), ("-1.0", None)]
)
def test_a_time_that_is_wrong_costs_one_step(folder, autopilot, wrong, seconds):
    """A long time counts as five sampling times; one that is none leaves the state, and the next step is as if it had not been."""
    target = [1.0, 0, 0, 0, 0, 0]
    at = lambda k: ([0.001 * k, 0.0, 0.0], np.zeros(6), np.zeros(3))
    expected = autopilot.start(*at(0), target=target)
    for k in range(1, 60):
        if k == 30 and seconds is None:
            continue  # what the last step gave is applied a step longer, as in C
        expected = autopilot.step(*at(k), target=target, dt=seconds if k == 30 else None)
    found = commands(folder, wrong)
    assert np.isfinite(found).all()
    if seconds is not None:
        np.testing.assert_array_equal(found, expected)
    else:
        np.testing.assert_allclose(found, expected, atol=0.5)  # V; the step that was none gave a command of its own

"""The controller in KTH's simulator: always a stand-in with the same interface, and theirs where the file is here.

UNDERTOW_KTH=BlueROV2.py python -m pytest -n 0 tests/peers/test_kth_autopilot.py
"""

import importlib.util
import os
from pathlib import Path

import jax
import numpy as np
import pytest
from textbook import jacobian

import undertow as ut

pytestmark = pytest.mark.full

EXAMPLE = Path(__file__).parents[2] / "examples" / "kth_bluerov2.py"
LAYOUT = np.asarray(ut.vehicles.bluerov2_heavy().thruster_matrix())


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("kth_bluerov2", EXAMPLE)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Lag:
    """First-order lag of a thrust that moves on whenever it is asked; its output matrix has one row, as theirs."""

    def __init__(self):
        self._Cc, self._x = np.array([[1.0]]), np.zeros(1)

    def step(self, u, dt):
        self._x = u + (self._x - u) * np.exp(-dt / 0.03)
        return float(self._Cc @ self._x)  # an error of NumPy 2.4 unless the row is made a vector


class StandIn:
    """A vehicle with the interface of theirs: diagonal matrices with other numbers than the controller knows."""

    _rates = staticmethod(jax.jit(jacobian))

    def __init__(self):
        self.thruster_lags, self.current_speed = [Lag() for _ in range(8)], np.zeros(3)
        self.inertia = np.array([18.0, 22.0, 30.0, 0.5, 0.4, 0.6])
        self.linear, self.quadratic = np.array([15, 5, 30, 0.5, 1, 0.5]), np.array([120, 200, 180, 1, 0.5, 1.5])

    def _old_thruster_force_from_input(self, volts):
        return 30.0 * volts

    def dynamics(self, x, u, dt):
        given = zip(self.thruster_lags, self._old_thruster_force_from_input(u), strict=True)
        wrench = LAYOUT @ [lag.step(one, dt) for lag, one in given]
        to_world, nu = np.asarray(self._rates(x[3:6])), x[6:]
        through_water = nu - np.append(to_world[:3, :3].T @ self.current_speed, np.zeros(3))
        drag = (self.linear + self.quadratic * np.abs(through_water)) * through_water
        righting = np.append(np.zeros(3), [1.3 * np.sin(x[3]), 1.3 * np.sin(x[4]), 0.0])
        return np.append(to_world @ nu, (wrench - drag - righting) / self.inertia)


def test_a_simulator_with_their_interface(example, capsys):
    """Within a millimetre in a current, at 50 Hz; a controller that does nothing ends elsewhere."""
    distance, angle = example.main(StandIn(), seconds=20.0)
    assert distance < 1e-3 and angle < 1e-3
    assert "last 5 of 20 s: at most" in capsys.readouterr().out

    class Idle:
        sampling_time = 0.02

        def start(self, *_, target):
            return np.zeros(8)

        step = start

    drifting, start = example.simulate(StandIn(), Idle(), seconds=0.2), np.zeros(12)
    np.testing.assert_array_equal(drifting, np.tile(start, (11, 1)))


if "UNDERTOW_KTH" in os.environ:

    def test_their_simulator(example):
        distance, angle = example.main(example.simulator(os.environ["UNDERTOW_KTH"]))
        assert distance < 1e-3 and angle < 1e-3


def test_no_simulator(example, tmp_path):
    with pytest.raises(SystemExit, match="is not a Python file"):
        example.simulator(tmp_path / "BlueROV2.py")

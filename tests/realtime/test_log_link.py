"""Replay of a log: the same bits, other ones where the controller is another, and logs that are damaged."""

import numpy as np
import pytest

import undertow as ut
from undertow.core.errors import BadInput
from undertow.logs.read import read_log
from undertow.outside.realtime.control_loop import RealTimeLoop, Reason
from undertow.outside.realtime.log_link import LogLink
from undertow.outside.realtime.loop_clock import SimulatedClock

pytestmark = pytest.mark.full


def replayed(autopilot, path):
    link = LogLink(path, autopilot.plant)
    assert RealTimeLoop(autopilot, link, SimulatedClock()).run() is Reason.LINK_ENDED
    return link


@pytest.fixture(scope="module")
def autopilot(heavy):
    return ut.Autopilot(heavy)


@pytest.fixture(scope="module")
def log(autopilot, tmp_path_factory):
    """Two starts, missing readings, late and repeated steps, targets, applied inputs."""
    path, chance = tmp_path_factory.mktemp("log") / "run.mcap", np.random.default_rng(0)
    autopilot.log_to(path)
    for applied in (None, np.linspace(-3, 3, 8)):
        autopilot.start(chance.normal(size=3), np.zeros(6), 0.1 * chance.normal(size=3), applied=applied)
        for k in range(60):
            position, velocity = chance.normal(size=3), 0.1 * chance.normal(size=6)
            if k % 7 == 3:
                position[1] = np.nan
            if k % 11 == 5:
                velocity[:] = np.inf
            autopilot.step(
                position,
                velocity,
                0.1 * chance.normal(size=3),
                target=(chance.normal(size=6), chance.normal(size=6), -0.0 * np.ones(6)) if k % 3 else None,
                applied=chance.normal(size=8) if k % 2 else None,
                propellers=None if k % 5 else 100 * chance.normal(size=8),
                dt=[0.01, 0.013, 0.3, -1.0][k % 4],
            )
    autopilot.close_log()
    return path


def test_a_replay_has_the_bits_of_the_log(autopilot, log):
    link = replayed(autopilot, log)
    assert link.differences() == [] and link.counts() == {"steps of the log": 92, "replayed": 92}
    np.testing.assert_array_equal(link._found, read_log(log)["commanded_input"].values)
    assert np.ptp(link._found) > 1.0


def test_a_step_that_is_logged_later_is_logged_once(autopilot, tmp_path, heavy_data):
    """A repeated step changes nothing, and is not in the log."""
    later = ut.Autopilot(heavy_data, log=tmp_path / "later.mcap", log_later=True)
    later.start(np.zeros(3), np.zeros(6), np.zeros(3))
    for dt in (0.01, 0.0, 0.012, -1.0, 0.01):
        later.log_step()
        later.step(np.ones(3), np.zeros(6), np.zeros(3), dt=dt)
        later.log_step()
        later.log_step()
    later.close_log()
    np.testing.assert_array_equal(read_log(tmp_path / "later.mcap")["elapsed"].values, [0, 0.01, 0.012, 0.01])
    assert replayed(autopilot, tmp_path / "later.mcap").differences() == []


def test_one_bit_of_one_command_is_found(autopilot, log):
    link = replayed(autopilot, log)
    link._found[30, 2] = np.nextafter(link._found[30, 2], 1e9)
    (one,) = link.differences()
    assert (one.actuator, one.steps, one.first) == ("T3", 1, read_log(log)["elapsed"].time[30])
    assert 0 < one.largest < 1e-14


def test_another_controller_differs(heavy_data, log):
    other = ut.Autopilot(heavy_data | {"controller": {"kind": "pid", "frequency": 2.1}})
    found = replayed(other, log).differences()
    assert len(found) == 8 and all(one.steps > 50 and one.largest > 1e-3 for one in found)


def test_a_log_that_was_cut_is_replayed_up_to_there(autopilot, log, tmp_path):
    """As after `kill -9`: at many places, steps that are whole are replayed with their bits."""
    whole, path, steps = log.read_bytes(), tmp_path / "cut.mcap", []
    for length in np.linspace(len(whole) // 3, len(whole) - 1, 4).astype(int):
        path.write_bytes(whole[:length])
        link = replayed(autopilot, path)
        assert link.differences() == []
        steps.append(link.counts()["replayed"])
    assert steps[0] > 0 and steps == sorted(steps) and steps[-1] == 92


def test_damaged_logs_are_refused_in_one_line(autopilot, log, tmp_path):
    whole, path, chance, refused = log.read_bytes(), tmp_path / "damaged.mcap", np.random.default_rng(3), 0
    for _ in range(60):
        data = bytearray(whole)
        data[chance.integers(len(data))] ^= int(chance.integers(1, 256))
        path.write_bytes(bytes(data))
        try:
            LogLink(path, autopilot.plant)
        except BadInput as error:
            assert "\n" not in str(error) and path.name in str(error)
            refused += 1
    assert refused > 30  # the others hit the index or text that does not matter


def test_logs_of_others_are_refused(autopilot, log, tmp_path, heavy_data):
    run = ut.simulate_scenario(heavy_data)
    run.log().save(tmp_path / "run.mcap")
    with pytest.raises(BadInput, match="what a controller received"):
        LogLink(tmp_path / "run.mcap", autopilot.plant)
    with pytest.raises(BadInput, match="6 actuators"):
        LogLink(log, ut.plants.hybrid_vehicle(ut.vehicles.bluerov2(), thruster=ut.thrusters.t200(supply=16)))

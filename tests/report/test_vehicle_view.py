"""A vehicle in a notebook: what its numbers mean, and a picture whose marks are where the thrusters are."""

import re

import numpy as np
import pytest

import undertow as ut
from undertow.report.vehicle_picture import vehicle_picture

DOT = re.compile(r'<circle cx="([\d.]+)" cy="([\d.]+)" r="3" [^>]*/><polyline points="([^"]+)"')
RING = re.compile(r'<circle cx="([\d.]+)" cy="([\d.]+)" r="7" ')
NAMED = re.compile(r"<text[^>]*>(T[^<]*)</text>")


def arrows(markup):
    """Start and tip of every arrow, and the centre of every ring, in pixels."""
    found = [
        (np.array([x, y], float), np.array(corners.split()[1].split(","), float))
        for x, y, corners in DOT.findall(markup)
    ]
    return found, [np.array(ring, float) for ring in RING.findall(markup)]


def test_marks_are_where_the_thrusters_are():
    """From above, bow to the right and starboard below; the four horizontal thrusters are arrows, the others rings."""
    vehicle = ut.vehicles.bluerov2_heavy()
    positions, directions = (np.asarray(each) for each in (vehicle.thruster_positions, vehicle.thruster_directions))
    found, rings = arrows(str(vehicle_picture(vehicle)))
    above, beside = found[:4], found[4:]
    assert len(beside) == 4 and len(rings) == 4, "from starboard, each two cover each other"
    starts = np.array([start for start, _ in above] + rings)
    scale = np.ptp(starts[:4, 0]) / np.ptp(positions[:4, 0])
    np.testing.assert_allclose(starts - starts.mean(0), scale * (positions - positions.mean(0))[:, :2], atol=0.2)
    for (start, tip), direction in zip(above, directions[:4], strict=True):
        along = (tip - start) / np.linalg.norm(tip - start)
        np.testing.assert_allclose(along, direction[:2], atol=0.01)
    heights = np.array([start[1] for start, _ in beside])
    assert np.ptp(heights) == pytest.approx(scale * np.ptp(positions[:, 2]), abs=0.2), "both views have one scale"


def test_every_thruster_is_named_in_both_views():
    for make in (ut.vehicles.odin, ut.vehicles.bluerov2, ut.vehicles.rexrov, ut.vehicles.lauv):
        vehicle = make()
        names = [name for names in NAMED.findall(str(vehicle_picture(vehicle))) for name in names.split(", ")]
        assert sorted(names) == sorted(2 * [f"T{number + 1}" for number in range(vehicle.thrusters)])


def test_thrust_to_and_from_the_eye():
    """Four vertical thrusters push down in one published layout: a cross from above; up in the other: a dot."""
    markup = {
        layout: str(vehicle_picture(ut.vehicles.bluerov2_heavy(layout=layout)))
        for layout in ("vonbenzon2022", "ardusub_gazebo")
    }
    assert markup["vonbenzon2022"].count('r="2"') == 4 and markup["ardusub_gazebo"].count('r="2"') == 0


def test_a_notebook_shows_a_vehicle_and_a_plant_made_of_it():
    vehicle = ut.vehicles.odin()
    shown = vehicle._repr_html_()
    assert 'class="answer holds"' in shown and "Its mass is 125 kg." in shown and shown.count("<svg") == 1
    assert shown.count("<div") == shown.count("</div>") and shown.startswith('<div class="undertow">')
    assert ut.HybridVehicle(vehicle, ut.thrusters.t200())._repr_html_() == shown


@pytest.mark.full
def test_a_notebook_shows_a_vehicle_that_is_stepped():
    scenario = {
        "description": "a vehicle",
        "plant": {"vehicle": "odin", "thruster": {"kind": "t200", "fidelity": "static"}, "ledger": False},
        "controller": "pid",
        "reference": {"kind": "setpoint", "position": [1, 0, 0, 0, 0, 0]},
        "loop": {"duration": 4.0, "dt": 0.05, "record": 0.1},
    }
    vehicle = ut.Vehicle(scenario)
    vehicle.step(np.zeros(8))
    shown = vehicle._repr_html_()
    assert "It is at 0.05 s of 4 s, and its state is valid." in shown and "Its 8 thrusters control" in shown
    assert "Each step takes 8 commands (V), held for 50 ms" in shown and shown.count("<svg") == 1
    pendulum = {"plant": "inverted_pendulum", "controller": "pid", "reference": {"kind": "setpoint", "position": [0]}}
    shown = ut.Vehicle({**pendulum, "loop": {"duration": 1.0, "dt": 0.01, "record": 0.1}})._repr_html_()
    assert "Each step takes 1 command (N), held for 10 ms" in shown and "<svg" not in shown

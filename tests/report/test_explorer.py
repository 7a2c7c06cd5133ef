"""Sliders in a notebook: each position is the run of the changed file, and a value that cannot be is said."""

import re

import numpy as np
import pytest

import undertow as ut
from undertow.report.live_picture import live_picture
from undertow.report.run_page import shown_of

pytestmark = [pytest.mark.full, pytest.mark.filterwarnings("ignore:`ut.explore` shows its sliders:UserWarning")]

SCENARIO = {
    "plant": {"kind": "double_integrator", "axes": 1, "limit": 20},
    "controller": {"kind": "pid", "frequency": 2.0},
    "reference": {"kind": "setpoint", "position": [1.0]},
    "disturbance": [{"kind": "sinusoid", "amplitude": 1.0, "frequency": 3.0}],
    "loop": {"duration": 4.0, "dt": 0.02, "record": 0.1},
}


def controls(explorer):
    return {control.description: control for control in explorer.view.children if hasattr(control, "description")}


def test_a_slider_is_a_changed_file():
    explorer = ut.explore(
        SCENARIO, {"controller.frequency": (1.0, 4.0), "seed": (0, 9), "loop.backend": ["simd", "xla"]}
    )
    sliders = controls(explorer)
    assert sliders["controller.frequency"].value == 2.0, "it begins where the file is"
    assert type(sliders["seed"]).__name__ == "IntSlider" and sliders["loop.backend"].value == "simd"
    before = explorer._picture.value
    sliders["controller.frequency"].value = 3.1
    assert explorer.values == {"controller.frequency": 3.1}, "the seed is still that of the file"
    sliders["seed"].value = 5
    changed = {**SCENARIO, "controller": {"kind": "pid", "frequency": 3.1}, "seed": 5}
    expected = ut.simulate_scenario(changed).outcome.signals["position"]
    np.testing.assert_array_equal(explorer.run.outcome.signals["position"], expected)
    assert explorer._picture.value != before and explorer.values["controller.frequency"] == 3.1


def test_what_cannot_be_is_said_and_the_last_run_stays():
    explorer = ut.explore(SCENARIO, {"controller.frequency": (-1.0, 4.0)})
    run = explorer.run
    controls(explorer)["controller.frequency"].value = -0.5
    assert "must be positive" in explorer._picture.value and explorer.run is run
    controls(explorer)["controller.frequency"].value = 2.5
    assert "<svg" in explorer._picture.value and explorer.run is not run


def test_without_ranges_the_numbers_of_the_file_have_sliders():
    explorer = ut.explore(ut.simulate_scenario(SCENARIO))
    found = {name: (slider.min, slider.max) for name, slider in controls(explorer).items() if hasattr(slider, "min")}
    assert found == {
        "controller.frequency": (0.0, 4.0),
        "disturbance[0].amplitude": (0.0, 2.0),
        "disturbance[0].frequency": (0.0, 6.0),
    }


def test_a_slider_starts_at_the_value_in_force():
    """Defaults of the scenario and of its parts, and a gain by rule; what is stated as a name counts as that."""
    ranges = {
        "seed": (0, 9),
        "controller.frequency": (0.1, 30.0),
        "controller.damping": (0.0, 4.0),
        "disturbance[0].frequency": (0.0, 8.0),
        "loop.duration": (2, 10),
        "loop.backend": ["xla", "simd"],
        "controller": ["adrc", "pid"],
        "controller.delay": [0.01, 0.02],
    }
    disturbance = [{"kind": "sinusoid", "amplitude": 1.0}]
    explorer = ut.explore({**SCENARIO, "controller": {"kind": "pid"}, "disturbance": disturbance}, ranges)
    values = {name: control.value for name, control in controls(explorer).items() if name in ranges}
    proportional = explorer.run.loop.controller.proportional  # the square of the frequency
    assert values.pop("controller.frequency") == pytest.approx(np.sqrt(float(proportional)), rel=1e-12)
    assert values == {
        "seed": 0,
        "controller.damping": 1.0,
        "disturbance[0].frequency": 1.0,
        "loop.duration": 4,
        "loop.backend": "simd",
        "controller": "pid",
        "controller.delay": None,
    }


@pytest.mark.parametrize(
    "ranges, remedy",
    [
        ({"controller.frequency": (4.0, 1.0)}, "have a range from low to high"),
        ({"controller.frequncy": (1.0, 3.0)}, "Did you mean `frequency`"),
        ({"controller.frequency": 3}, r"have \(lowest, highest\), a list of choices, or a switch"),
    ],
)
def test_ranges_that_are_none(ranges, remedy):
    with pytest.raises(ut.BadInput, match=remedy):
        ut.explore(SCENARIO, ranges)


def test_a_run_of_objects_has_no_file_to_change():
    run = ut.simulate(ut.plants.double_integrator(1), "pid", ut.references.setpoint([1.0]), duration=1.0)
    assert run.scenario == {}
    with pytest.raises(ut.BadInput, match="be of a run of a scenario"):
        run.again(seed=1)
    with pytest.raises(ut.BadInput, match="Write it as a scenario, a file or a mapping, and give that"):
        ut.explore(run, {"seed": (0, 9)})


def test_outside_of_a_notebook_it_says_so():
    with pytest.warns(UserWarning, match=r"which this is not\. Elsewhere, `run.again"):
        explorer = ut.explore(SCENARIO, {"seed": (0, 9)})
    assert repr(explorer).startswith("Sliders of seed, in a Jupyter notebook.\nRun: completed")


def test_the_picture_has_the_numbers_of_the_run():
    """The lowest point of the curve of the error stands where its largest value is, on the scale that is written."""
    run = ut.simulate_scenario(SCENARIO)
    picture = str(live_picture(run.result, shown_of(run.result)))
    curves = [
        np.array([pair.split(",") for pair in points.split()], float)
        for points in re.findall('points="([^"]+)"', picture)
    ]
    boxes = [
        tuple(map(float, box))
        for box in re.findall(r'<rect x="([\d.]+)" y="([\d.]+)" width="([\d.]+)" height="([\d.]+)"', picture)
    ]
    tops = re.findall(r'text-anchor="end"[^>]*>([^<]+)<', picture)
    assert len(boxes) == 3 and len(tops) == 6
    x, y, width, height = boxes[1]
    error = next(curve for curve in curves if curve[:, 0].min() == x and len(curve) > 2)
    size = np.abs(run.outcome.signals["error"][:, 0])
    scale = float(tops[2])
    np.testing.assert_allclose((y + height - error[:, 1]) / height * scale, size, atol=0.01 * scale)
    np.testing.assert_allclose((error[:, 0] - x) / width * 4.0, run.outcome.time, atol=0.01)

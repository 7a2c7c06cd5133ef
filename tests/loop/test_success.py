"""A run that reached its end is `completed`; whether control succeeded is judged by a stated criterion."""

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from undertow.analysis.metrics import Metrics, accumulators, meanings, output_groups, results
from undertow.analysis.success import criterion_of, evaluate_success
from undertow.control.controllers.pid import pid
from undertow.control.navigation.perfect import perfect
from undertow.control.references.setpoint import setpoint
from undertow.core.metric import Metric
from undertow.core.number_text import display_units
from undertow.core.status import Status
from undertow.physics.disturbances.sinusoid import sinusoid
from undertow.physics.plants.double_integrator import DoubleIntegrator, double_integrator
from undertow.scenario.reading import dump
from undertow.scenario.results.run_scenario import run_scenario
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.studies.campaign.task import NOT_JUDGED, run_trials

KNOWN = {"position_rms": Metric("m", ""), "attitude_rms": Metric("rad", "")}


@pytest.mark.full
def test_metres_and_radians_are_never_one_number():
    """Outputs in m and rad of one plant: each group is the rms of its own axes, and there is none of all."""
    units = ("m", "rad", "m", "rad")
    plant = DoubleIntegrator(np.inf, outputs=("x", "a", "y", "b"), output_units=units)
    law, load = pid(plant.model(), frequency=2.0), sinusoid(np.array([1.0, 2.0, 3.0, 4.0]), 1.0)
    loop = ClosedLoop(plant, law, setpoint(np.zeros(4)), load, perfect())
    metrics = Metrics(1.0, 3.99, units)
    run = sampled.simulate(loop, duration=4.0, dt=0.02, record_every=1, accumulators=(metrics,))
    found = results((metrics,), run.accumulated)
    late = (np.asarray(run.time) >= 1.0 - 1e-9) & (np.asarray(run.time) < 3.99)
    error = np.asarray(run.signals["error"])[late]
    rms = lambda axes: np.sqrt((error[:, axes] ** 2).mean())
    assert found["position_rms"] == pytest.approx(rms([0, 2]), rel=1e-12)
    assert found["attitude_rms"] == pytest.approx(rms([1, 3]), rel=1e-12)
    assert found["position_max"] == np.abs(error[:, [0, 2]]).max()
    assert found["attitude_max"] == np.abs(error[:, [1, 3]]).max()
    np.testing.assert_allclose(found["error_rms_axes"], np.sqrt((error**2).mean(0)), rtol=1e-12)
    assert "tracking_rms" not in found


@pytest.mark.full
def test_orientation_is_the_angle_of_the_rotation_between_attitude_and_target():
    """Against SciPy, sample by sample, with pitches beyond 90 degrees; a target that is written in other angles is the same."""
    plant = DoubleIntegrator(np.inf, outputs=("roll", "pitch", "yaw"), output_units=("rad",) * 3)
    law, load = pid(plant.model(), frequency=2.0), sinusoid(np.array([1.0, 2.0, 3.0]), 1.0)
    loop = ClosedLoop(plant, law, setpoint(np.array([0.3, 2.0, -1.0]), settling=3.0), load, perfect())
    (metrics,) = accumulators(plant, (), 0.0, 3.99)
    run = sampled.simulate(loop, duration=4.0, dt=0.02, record_every=1, accumulators=(metrics,))
    euler = lambda name: Rotation.from_euler("ZYX", np.asarray(run.signals[name])[:, ::-1])
    angles = (euler("reference") * euler("position").inv()).magnitude()[np.asarray(run.time) < 3.99]
    found = results((metrics,), run.accumulated)["orientation_rms"]
    assert found == pytest.approx(np.sqrt((angles**2).mean()), rel=1e-9)
    same = {"reference": jnp.array([0.0, 2.0, 0.0]), "position": jnp.array([np.pi, np.pi - 2.0, np.pi])}
    assert float(metrics._turn(same)) == pytest.approx(0.0, abs=1e-7)
    assert "orientation_rms" not in meanings(
        ClosedLoop(double_integrator(2), law, setpoint(np.zeros(2)), load, perfect())
    )


@pytest.mark.parametrize(
    ("units", "groups"),
    [
        (("m", "m"), {"position": ("m", [0, 1])}),
        (("rad",), {"attitude": ("rad", [0])}),
        (("K", "K"), {"tracking": ("K", [0, 1])}),
        (("m", "K"), {"position": ("m", [0])}),  # K is told per axis only
        (("K", "Pa"), {}),
    ],
)
def test_outputs_are_grouped_by_unit(units, groups):
    assert output_groups(units) == groups


def test_tables_show_degrees():
    assert display_units(np.pi / 2, "rad") == (90.0, "deg") and display_units(2.0, "m") == (2.0, "m")


def test_a_bang_bang_run_is_no_success_by_default():
    known = KNOWN | {"saturated_fraction": Metric("", "")}
    criterion = criterion_of(None, known)
    steady = {"position_rms": 0.01, "attitude_rms": 0.01, "saturated_fraction": 0.78}
    verdict = evaluate_success(criterion, steady)
    assert verdict is not None and verdict.exceeded == {"saturated_fraction": 0.78}
    assert evaluate_success(
        criterion, steady | {"saturated_fraction": 0.125}
    ).within  # one of eight thrusters at its limit
    assert evaluate_success(criterion_of({"position_rms": 0.05}, known), steady).within
    assert criterion_of(None, {"saturated_fraction": Metric("", "")}) == {}


def test_what_exceeds_its_limit():
    criterion = {"position_rms": 0.05, "attitude_rms": 0.1}
    good = evaluate_success(criterion, {"position_rms": 0.01, "attitude_rms": 0.02})
    assert good.within and not good.exceeded
    bad = evaluate_success(criterion, {"position_rms": 0.2, "attitude_rms": 0.02})
    assert not bad.within and bad.exceeded == {"position_rms": 0.2}
    undefined = evaluate_success(criterion, {"position_rms": 0.01})
    assert not undefined.within and undefined.exceeded == {"attitude_rms": None}
    failed = evaluate_success(criterion, None)
    assert not failed.within and not failed.exceeded
    assert evaluate_success({}, {"position_rms": 9.0}) is None
    assert good and not bad and not undefined and not failed, "`if run.success:` asks whether it went well"


SCENARIO = {
    "plant": {"kind": "double_integrator", "axes": 1},
    "controller": {"kind": "pid", "frequency": 2.0},
    "reference": {"kind": "setpoint", "position": [0.0]},
    "disturbance": {"kind": "sinusoid", "amplitude": 1.0},
    "loop": {"duration": 4.0, "dt": 0.02, "record": 0.1, "backend": "xla"},  # compiled once for all of them
}


@pytest.mark.full
def test_completed_is_not_success():
    """The same loop with a limit above and below its error; the default where nothing is said."""
    found = run_scenario(SCENARIO)
    error = found.steady["position_rms"]
    assert found.status is Status.OK and found.dataset.attrs["status"] == "completed"
    assert found.success.criterion == {"position_rms": 0.05, "saturated_fraction": 0.25}
    assert found.success.within == (error < 0.05)
    for most, within in ((1.01 * error, True), (0.99 * error, False)):
        assert run_scenario(SCENARIO | {"success": {"position_rms": most}}).success.within is within
    assert run_scenario(SCENARIO | {"success": {}}).success is None


@pytest.mark.full
def test_success_of_trials():
    """Of the two amplitudes one is within; a trial that fails is not, and without a criterion none is judged."""
    error = run_scenario(SCENARIO | {"steady": {"every_step": True}}).steady["position_rms"]
    asked = {
        "scenario": SCENARIO | {"success": {"position_rms": 1.5 * error}},
        "trials": 1,
        "cross": {"disturbance.amplitude": [1.0, 2.0, 1e300]},
    }
    found = run_trials(dump(asked), "", [0, 1, 2])
    assert found["success"].tolist() == [1, 0, 0] and found["status"][2] != 0
    free = asked | {"scenario": SCENARIO | {"success": {}}, "cross": {}}
    assert run_trials(dump(free), "", [0])["success"].tolist() == [NOT_JUDGED]

"""Metrics of inputs have the unit of the input, and what is not defined is not there."""

import json

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

import undertow as ut
from undertow.analysis.metrics import MEANINGS, Metrics, meanings, results, results_of_batch
from undertow.cli.main import run as command
from undertow.control.controllers.pid import pid
from undertow.control.controllers.rcaf import rcaf
from undertow.control.navigation.perfect import perfect
from undertow.control.references.setpoint import setpoint
from undertow.control.references.sine import sine
from undertow.physics.disturbances.none import none
from undertow.physics.disturbances.sinusoid import sinusoid
from undertow.physics.plants import double_integrator, inverted_pendulum, magnetic_levitation, two_link_arm
from undertow.scenario.reading import dump
from undertow.simulation.loop import sampled
from undertow.simulation.loop.closed_loop import ClosedLoop

DT = 0.01


def settling(reference, duration=20.0, position=None, load=None, stop=np.inf):
    """Settling times by every sample, of all axes and of each, and the run."""
    plant = double_integrator(2)
    loop = ClosedLoop(
        plant, pid(plant.model(), frequency=2.0, reference_frequency=0), reference, load or none(), perfect()
    )
    at = {"duration": duration, "dt": DT, "record_every": 1, "position": position}
    outcome = sampled.simulate(loop, accumulators=(Metrics(0.0, stop),), **at)
    found = results((Metrics(0.0, stop),), outcome.accumulated)
    return found.get("settling_time"), found.get("settling_time_axes"), outcome


@pytest.mark.full
def test_a_step_settles_when_the_error_stays_within_2_percent_of_it():
    """By the recorded error itself."""
    whole, axes, outcome = settling(setpoint([1.0, -3.0]), position=np.array([0.5, 0.0]))
    error, time = np.abs(np.asarray(outcome.signals["error"])), np.asarray(outcome.time)
    wanted = [time[np.flatnonzero(error[:, i] > 0.02 * step)[-1]] for i, step in enumerate((0.5, 3.0))]
    np.testing.assert_allclose(axes, wanted, atol=1e-12)
    assert whole == max(axes) and 1.0 < whole < 15.0


@pytest.mark.full
def test_a_transition_settles_after_its_end():
    """Not before the target rests, however well it is followed; 2 % of the way, not of an error that was none at first."""
    whole, _, outcome = settling(setpoint([1.0, 2.0], settling=5.0))
    error, time = np.abs(np.asarray(outcome.signals["error"])), np.asarray(outcome.time)
    late = max(time[np.flatnonzero(error[:, i] > 0.02 * way)[-1:]].max(initial=0.0) for i, way in enumerate((1.0, 2.0)))
    assert whole == pytest.approx(max(5.0, late), abs=2 * DT)


@pytest.mark.full
def test_a_moving_target_has_no_settling_time():
    whole, axes, _ = settling(sine(amplitude=[1.0, 1.0]))
    assert whole is None and axes is None


@pytest.mark.full
def test_until_a_window_ends():
    """What comes after the window does not count: a load that unsettles it later.

    To enter the band last at 11.91 s says nothing by 12 s, when less than a tenth of the time has passed since.
    """
    stopped = lambda stop: settling(setpoint([1.0, 1.0]), stop=stop)[0]
    assert stopped(1.0) == stopped(12.0) == np.inf
    assert stopped(14.0) == settling(setpoint([1.0, 1.0]))[0] == pytest.approx(11.91, abs=DT)


@pytest.mark.full
def test_never_and_no_way_to_go():
    whole, axes, _ = settling(setpoint([1.0, 0.0]), load=sinusoid(30.0, 1.0))
    assert whole == axes[0] == np.inf, "the load keeps it out of the band for ever"
    assert np.isnan(axes[1]), "an axis that starts at its target has nothing to settle"
    assert settling(setpoint([0.0, 0.0]))[0] is None


@pytest.mark.full
def test_many_runs_at_once_have_the_same_times():
    import jax

    _, _, outcome = settling(setpoint([1.0, -3.0]))
    several = jax.tree.map(lambda leaf: np.stack([leaf, leaf]), outcome.accumulated[0])
    one = Metrics().values(outcome.accumulated[0])
    for name, values in results_of_batch((Metrics(),), (several,)).items():
        np.testing.assert_array_equal(values, [one[name]] * 2, err_msg=name)


@pytest.mark.parametrize(
    ("plant", "unit"),
    [
        (inverted_pendulum(), "N"),
        (two_link_arm(), "N m"),
        (magnetic_levitation(), "A^2"),
        (double_integrator(), "m/s^2"),
    ],
)
def test_inputs_are_in_their_own_unit(plant, unit):
    assert plant.input_unit == unit
    loop = ClosedLoop(
        plant, pid(plant.model(), frequency=2.0), setpoint(np.zeros(len(plant.outputs))), none(), perfect()
    )
    units = {name: metric.unit for name, metric in meanings(loop).items()}
    assert units["input_rms"] == units["input_peak"] == unit and units["input_variation"] == f"{unit}/s"
    assert not any("[" in one for one in units.values())
    assert not any("voltage" in name or "V" in one.unit or "volt" in one.meaning for name, one in MEANINGS.items())


SCENARIO = {
    "plant": {"kind": "inverted_pendulum"},
    "controller": {"kind": "rcaf", "preset": "robust", "sets": 3},
    "reference": {"kind": "setpoint", "position": [0.0]},
    "initial": {"position": [0.1]},
    "loop": {"duration": 2.0, "dt": 0.01},
}


@pytest.mark.slow
def test_the_table_of_a_run_says_newtons(tmp_path, capsys):
    """And how many rules the law has."""
    (tmp_path / "cart.yaml").write_text(dump(SCENARIO), encoding="utf-8")
    assert command(["simulate", str(tmp_path / "cart.yaml"), "--out", str(tmp_path / "out"), "--no-prediction"]) == 0
    rows = [line.replace("│", " ").split() for line in capsys.readouterr().out.splitlines()]
    units = {row[0]: row[-1] for row in rows if len(row) > 3}
    assert (units["input_rms"], units["input_peak"], units["input_variation"]) == ("N", "N", "N/s")
    metrics = json.loads((tmp_path / "out" / "metrics.json").read_text())
    assert metrics["steady"]["rules"] == metrics["whole"]["rules"] == 3


@pytest.mark.full
def test_from_python_too():
    plant = ut.plants.inverted_pendulum()
    law = rcaf(plant.model(), preset="robust", sampling_time=DT)
    found = ut.simulate(plant, law, setpoint([0.0]), duration=1.0, dt=DT, position=[0.1])
    lines = {line.split()[0]: line.split()[-1] for line in repr(found).splitlines()[2:]}
    assert (lines["input_rms"], lines["input_variation"]) == ("N", "N/s")
    assert found.metrics["steady"]["rules"] == found.metrics["whole"]["rules"] == 5, "those of the preset"


@pytest.mark.full
def test_metres_and_radians_never_make_one_number():
    """Every metric of the outputs, of a law that has all signals, against NumPy: those in m, those in rad, and each."""
    rng, steps, gathered = np.random.default_rng(3), 40, Metrics(units=("m", "rad", "m"))
    names = ("error", "reference", "estimate", "uncertainty", "robust_term", "modelling_error")
    series = {name: rng.normal(size=(steps, 3)) for name in names} | {"weights": rng.normal(size=(steps, 3, 2))}
    series |= {name: rng.random((steps, 4)) for name in ("input", "power", "saturated")}
    series["bad_readings"] = np.zeros(steps)
    at = lambda k: {name: jnp.asarray(values[k]) for name, values in series.items()}
    update, state = eqx.filter_jit(gathered.update), gathered.init(at(0))
    for k in range(steps):
        state = update(state, jnp.asarray(DT * k), at(k))
    found = gathered.values(state)

    parts = {"estimation": series["estimate"] - series["uncertainty"], "uncertainty": series["uncertainty"]}
    parts |= {"robust": series["robust_term"], "model": series["modelling_error"]}
    wanted = {}
    for group, axes in {"position": [0, 2], "attitude": [1]}.items():
        wanted[f"{group}_rms"] = np.sqrt((series["error"][:, axes] ** 2).mean())
        wanted[f"{group}_max"] = np.abs(series["error"][:, axes]).max()
        wanted[f"{group}_weights_peak"] = np.abs(series["weights"][:, axes]).max()
        wanted |= {f"{group}_{name}_rms": np.sqrt((part[:, axes] ** 2).mean()) for name, part in parts.items()}
    assert {name for name in found if name.startswith(("position", "attitude"))} == set(wanted)
    for name, value in wanted.items():
        np.testing.assert_allclose(found[name], value, rtol=1e-14, err_msg=name)
    assert not {"estimation_rms", "weights_peak", "tracking_rms"} & set(found)
    peaks = gathered.per_axis(state)["weights_peak_axes"]
    np.testing.assert_array_equal(peaks, np.abs(series["weights"]).max((0, 2)))


@pytest.mark.full
def test_energy_is_that_of_the_ledger_where_there_is_one():
    """Between two times, in a made-up run whose power at the samples says something else."""
    gathered, times = Metrics(0.1, 0.3), np.arange(5) / 10
    names = ("error", "reference", "uncertainty", "input", "saturated")
    still = {name: jnp.zeros(1) for name in names} | {"bad_readings": jnp.zeros(())}

    def energy(**series):
        at = lambda k: still | {name: jnp.asarray(values[k]) for name, values in series.items()}
        state = gathered.init(at(0))
        for k, t in enumerate(times):
            state = gathered.update(state, jnp.asarray(t), at(k))
        return gathered.values(state)["energy"]

    power = np.stack([100 * times, 0 * times], axis=-1)
    assert energy(power=power) == pytest.approx(50 * (0.3**2 - 0.1**2))
    assert energy(power=power, energy_source=7.0 + times**3) == pytest.approx(0.3**3 - 0.1**3)


@pytest.mark.full
def test_units_of_metrics_of_the_outputs():
    arm, law = two_link_arm(), lambda plant: rcaf(plant.model(), preset="robust", sampling_time=DT)
    loop = ClosedLoop(arm, law(arm), setpoint(np.zeros(2)), none(), perfect())
    units = {name: metric.unit for name, metric in meanings(loop).items()}
    assert units["attitude_rms"] == "rad" and units["attitude_estimation_rms"] == "rad/s^2"
    assert units["attitude_model_rms"] == "rad/s" and units["attitude_weights_peak"] == "rad/s^2"
    assert not any(name.startswith("position") for name in units) and "estimation_rms" not in units

"""The estimate: an independent implementation gives the same numbers, and simulated dives give theirs back."""

import dataclasses
import errno
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
import scipy.signal
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

import undertow as ut
from undertow.cli import identify as command
from undertow.cli.options.identify import IdentifyCommand
from undertow.core.measurement import BODY_AXES
from undertow.core.runtime import in_precision
from undertow.logs.log import Log
from undertow.logs.log_signals import Series
from undertow.physics.plants.hybrid_vehicle import hybrid_vehicle
from undertow.physics.thrusters.t200 import t200
from undertow.physics.vehicles.bluerov2_heavy import bluerov2_heavy
from undertow.report.answers.identification_answer import answer_of_identification, mean_fits
from undertow.scenario.reading import dump
from undertow.scenario.vehicle_file import read_vehicle
from undertow.studies.identification.dive import dive_of
from undertow.studies.identification.free_parameters import FreeParameter, axis_parameters, chosen, parameters_of
from undertow.studies.identification.identified_vehicle import prior_vehicle
from undertow.studies.identification.model import Unknowns, model_of
from undertow.studies.identification.output_error import fit
from undertow.studies.identification.segments import segments_of
from undertow.studies.identification.simulated_dive import AMPLITUDES, simulated_log, telegraph_dive, telegraph_wrenches
from undertow.studies.identification.validation import prediction_errors, whiteness

pytestmark = pytest.mark.full

TRUTH = {"linear_damping.surge": 20.0, "quadratic_damping.surge": 90.0, "added_mass.heave": 24.0, "net_buoyancy": 2.0}
SCENARIO = {
    "plant": {"vehicle": "bluerov2_heavy", "thruster": {"kind": "t200", "supply": 16}},
    "controller": "robust",
    "reference": {"kind": "setpoint", "position": [0] * 6},
    "loop": {"duration": 1, "dt": 0.02, "record": 0.02},
}
STEP = 0.05


@pytest.fixture(scope="module")
def plant():
    with in_precision("float64"):
        return hybrid_vehicle(bluerov2_heavy(), t200())


def dive_log(plant, seed, duration=60.0, truth=TRUTH):
    with in_precision("float64"):
        return telegraph_dive(plant, truth, seed, duration)


def test_scipy_finds_the_same_damping(plant):
    """Surge alone, by an integrator and a solver of others: both kinds of damping, with priors and without."""
    generator = np.random.default_rng(4)
    duration, mass, gain, lag = 10.0, 13.5 + 6.36, 50.0, 0.2
    commands = np.repeat(generator.uniform(-0.6, 0.6, 10), round(1 / STEP))
    edges = np.arange(0.0, duration, 1.0)
    measured_at = STEP * (np.arange(round(duration / STEP)) + 1.0) - 1e-9  # at the ends of steps

    def speeds(linear, quadratic):
        state, found = np.zeros(2), []
        for begin in edges:
            inside = measured_at[(measured_at > begin) & (measured_at < begin + 1.0)]
            command = commands[round(begin / STEP)]

            def rate(t, x, command=command):
                return [(x[1] - linear * x[0] - quadratic * abs(x[0]) * x[0]) / mass, (gain * command - x[1]) / lag]

            solution = solve_ivp(
                rate, (begin, begin + 1.0), state, t_eval=[*inside, begin + 1.0], rtol=1e-9, atol=1e-11
            )
            found.append(solution.y[0, :-1])
            state = solution.y[:, -1]
        return np.concatenate(found)

    noise = 0.02
    measured = speeds(22.0, 80.0) + noise * generator.standard_normal(len(measured_at))
    with in_precision("float64"):
        known = parameters_of(plant) | axis_parameters()
        names = ("linear_damping.surge", "quadratic_damping.surge")
        parameters = chosen(known, names)
        vehicle = prior_vehicle(plant, has_axis_inputs=True)
        actuation = vehicle.actuation.with_values({"axis_gain.surge": gain} | {f"axis_lag.{a}": lag for a in BODY_AXES})
        model = model_of(dataclasses.replace(vehicle, actuation=actuation), parameters)
        zeros = np.zeros((len(measured), 2))
        log = Log(
            {
                "body_velocity": Series(measured_at, np.column_stack([measured, zeros])),
                "attitude": Series(measured_at, np.zeros((len(measured), 3))),
                "input": Series(STEP * np.arange(len(commands)), np.pad(commands[:, None], ((0, 0), (0, 5)))),
            },
            "surge",
            "CSV",
        )
        dive = dive_of(log, log["input"], STEP)
        segments = segments_of([dive], duration)
        unknowns = Unknowns(tuple(parameters), 1)
        estimate = fit(model, segments, STEP, np.zeros(len(unknowns.least())), unknowns.least())
    sigma = estimate.noise[6]

    def residuals(z):
        values = [parameter.value(one) for parameter, one in zip(parameters, z, strict=True)]
        return np.concatenate([(speeds(*values) - measured) / sigma, z])

    theirs = least_squares(residuals, [0.0, 0.0], x_scale=0.1)
    ours = estimate.z[:2]
    deviations = np.sqrt(np.diagonal(np.linalg.inv(theirs.jac.T @ theirs.jac)))
    assert np.abs(sigma / noise - 1) < 0.2
    # Ours also frees current, biases and the begin, which takes a part of what the dive says.
    assert (np.abs(ours - theirs.x) < 1.0 * deviations).all()
    values = [parameter.value(z) for parameter, z in zip(parameters, ours, strict=True)]
    np.testing.assert_allclose(values, [22.0, 80.0], rtol=0.25)


@pytest.fixture(scope="module")
def identified(plant):
    free = (*TRUTH, "thruster_gain")
    return ut.identify(SCENARIO, [dive_log(plant, 1, 30.0), dive_log(plant, 2, 30.0)], free=free)


def test_known_numbers_are_in_their_intervals(identified):
    for name, value in TRUTH.items():
        interval = identified.parameters[name]
        assert interval.low <= value <= interval.high, name
        assert interval.share < 0.2, name
    gain = identified.parameters["thruster_gain"]
    assert gain.low <= 1.0 <= gain.high


def test_dives_left_out_are_predicted(identified):
    for validation in identified.data["validation"]:
        assert min(validation["identified"]["free_run_fit"].values()) > 60
    assert "better than the vehicle file" in repr(identified)
    assert "free_run" in identified.plot()
    assert "<svg" in identified._repr_html_() or "<img" in identified._repr_html_()


def test_files_say_what_was_found(identified, tmp_path):
    identified.write(tmp_path)
    numbers = read_vehicle(tmp_path / "vehicle.yaml").uncertainty.numbers
    for name, interval in identified.parameters.items():
        if name != "thruster_gain":
            np.testing.assert_allclose(numbers[name].value, interval.value, rtol=1e-9)
            np.testing.assert_allclose(numbers[name].deviation, interval.deviation, rtol=1e-9)
    text = (tmp_path / "identified.yaml").read_text()
    assert "vehicle.yaml" in text and "adjusted" in text


def test_numbers_that_cannot_be_written_are_printed(identified, tmp_path, monkeypatch, capsys):
    """What took minutes is not lost with a full disk."""

    def full_disk(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.chdir(tmp_path)
    Path("s.yaml").write_text(dump(SCENARIO))
    monkeypatch.setattr(command, "read_log", lambda *_: None)
    monkeypatch.setattr(command, "identify", lambda *_, **__: identified.result)
    monkeypatch.setattr(command, "write_files", full_disk)
    with pytest.raises(OSError, match="No space left"):
        command.identify_vehicle(IdentifyCommand(scenario=Path("s.yaml"), logs=[Path("dive.csv")]))
    assert "added mass, heave" in capsys.readouterr().out and not Path("runs/s-identified").exists()


def test_of_sticks_only_the_vehicle_is_written(plant, tmp_path):
    """Gains, lags and delay of the inputs along the axes are found, and are no numbers of the vehicle."""
    generator = np.random.default_rng(6)
    with in_precision("float64"):
        gains = {f"axis_gain.{axis}": jnp.asarray(gain) for axis, gain in zip(BODY_AXES, AMPLITUDES, strict=True)}
        lags = {f"axis_lag.{axis}": jnp.asarray(0.2) for axis in BODY_AXES}
        vehicle = prior_vehicle(plant, has_axis_inputs=True).with_values(gains | lags)
        log = simulated_log(vehicle, telegraph_wrenches(generator, 40.0, np.ones(6)), generator)
    model = ut.identify(SCENARIO, log, free=("axis_gain", "axis_lag", "axis_delay", "net_buoyancy"), per_axis=True)
    surge = model.parameters["axis_gain.surge"]
    assert surge.low <= AMPLITUDES[0] <= surge.high
    model.write(tmp_path)
    assert set(read_vehicle(tmp_path / "vehicle.yaml").uncertainty.numbers) == {"net_buoyancy"}


def test_deviations_of_a_vehicle_file_are_priors(identified, plant, tmp_path):
    """A second identification begins with what the first one found, is nowhere less sure, and on the whole surer."""
    identified.write(tmp_path)
    again = ut.identify(tmp_path / "identified.yaml", dive_log(plant, 3, 30.0), free=("net_buoyancy",))
    left = []
    for name in TRUTH:
        before, after = identified.parameters[name], again.parameters[name]
        np.testing.assert_allclose(after.parameter.prior, before.value, rtol=1e-9)
        left.append(after.deviation / before.deviation)
    assert max(left) <= 1 + 1e-9
    assert np.median(left) < 0.8


def test_a_tenth_of_outliers_moves_little(identified, plant):
    generator = np.random.default_rng(5)

    def spoiled(log):
        signals = dict(log.signals)
        for name, size in {"position": 2.0, "body_velocity": 1.0}.items():
            values = signals[name].values.copy()
            hit = generator.random(len(values)) < 0.1
            values[hit] += size * generator.choice([-1.0, 1.0], (hit.sum(), 3))
            signals[name] = signals[name]._replace(values=values)
        return Log(signals, log.source, log.format)

    logs = [spoiled(dive_log(plant, seed, 30.0)) for seed in (1, 2)]
    estimates = ut.identify(SCENARIO, logs, free=tuple(TRUTH)).parameters
    for name, value in TRUTH.items():
        assert estimates[name].low <= value <= estimates[name].high, name


def test_a_log_of_a_much_heavier_vehicle_is_not_believed(plant):
    truth = {"added_mass.surge": 150.0, "added_mass.sway": 170.0, "added_mass.heave": 250.0}
    heavy = ut.identify(SCENARIO, dive_log(plant, 1, 30.0, truth), free=("added_mass",), priors={"mass": "13.5 +- 0.1"})
    assert "not believable" in repr(heavy)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"free": ("added_mas",)}, "must name parameters of the vehicle, but is added_mas"),
        ({"priors": {"mass": "heavy"}}, "must be text such as"),
        ({"priors": {"lag": "-1 +- 0.1"}}, "must be positive"),
        ({"step": 0.0}, "`step` must be positive"),
        ({"step": 0.3}, "`step` must be at most 0.2 s, as the thrusters have a lag of 0.1 s"),
        ({"per_axis": True}, "must have 6 inputs, one for each of the axes"),
    ],
)
def test_mistakes_are_one_line(plant, options, message):
    with pytest.raises(ut.BadInput, match=message) as caught:
        ut.identify(SCENARIO, dive_log(plant, 1, 5.0), **options)
    assert "\n" not in str(caught.value)


def test_a_free_run_that_diverges_fits_nothing(plant):
    """What is finite before it diverges is no fit."""
    log = dive_log(plant, 3, 12.0)
    with in_precision("float64"):
        drag = FreeParameter("quadratic_damping.surge", "N s^2/m^2", 1e6, 1.0)
        model = model_of(prior_vehicle(plant), [drag])
        errors = prediction_errors(model, np.zeros(1), dive_of(log, log["input"], STEP))
    assert errors.fit["u"] == -np.inf


def test_correlation_of_residuals_is_that_of_a_first_order_process():
    """An autoregression of 0.6 has it as its first autocorrelation; white noise has none."""
    generator = np.random.default_rng(0)
    noise = generator.standard_normal(20_000)
    coloured = np.zeros(len(noise))
    for k in range(1, len(noise)):
        coloured[k] = 0.6 * coloured[k - 1] + noise[k]
    inputs = generator.standard_normal((len(noise), 2))
    assert whiteness(noise, inputs).is_white
    test = whiteness(coloured, inputs)
    assert not test.is_white
    assert test.correlation == pytest.approx(0.6, abs=0.02)
    assert whiteness(noise + 0.2 * np.roll(inputs[:, 0], 3), inputs).with_inputs == pytest.approx(0.2, abs=0.02)


def test_correlations_of_residuals_are_those_of_scipy():
    generator = np.random.default_rng(4)
    e, u = generator.standard_normal((2, 300))
    e, lags = e - e.mean(), np.arange(1, 21)
    theirs = scipy.signal.correlate(e, e)[len(e) - 1 + lags] / (e @ e)
    with_u = scipy.signal.correlate(e, u - u.mean())[len(e) - 1 + np.arange(21)] / np.sqrt(
        (e @ e) * ((u - u.mean()) ** 2).sum()
    )
    test = whiteness(e + 1.0, u[:, None])
    assert test.correlation == pytest.approx(np.abs(theirs).max(), rel=1e-12)
    assert test.with_inputs == pytest.approx(np.abs(with_u).max(), rel=1e-12)


def test_dives_that_no_estimate_used_are_what_a_model_is_judged_by():
    fit = lambda is_unseen, own: {
        "is_unseen": is_unseen,
        "identified": {"free_run_fit": {"u": own}},
        "prior": {"free_run_fit": {"u": 40.0}},
    }
    assert mean_fits({"validation": [fit(False, 90.0), fit(False, 70.0)]}) == {"u": (80.0, 40.0)}
    assert mean_fits({"validation": [fit(False, 90.0), fit(True, 20.0), fit(True, 30.0)]}) == {"u": (25.0, 40.0)}


def test_a_model_as_good_as_the_file_may_be_used():
    """Fits are compared within one per cent."""
    fit = lambda own, before: {
        "is_unseen": False,
        "identified": {"free_run_fit": {"u": own}},
        "prior": {"free_run_fit": {"u": before}},
    }
    data = {"dives": [{"duration": 60.0}], "parameters": {}, "refused_axes": [], "undetermined": [], "converged": True}
    data |= {"findings": [], "disturbance": {}}
    verdicts = [answer_of_identification(data | {"validation": [fit(90.0, b)]}).verdict for b in (90.4, 50.0, 97.0)]
    assert [" as well as " in verdicts[0], " better than " in verdicts[1], "do not use it" in verdicts[2]] == [True] * 3

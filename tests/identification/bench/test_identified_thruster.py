"""Thrusters identified from bench records: closed forms, SciPy's own fit, the published table, coverage, missing reverse."""

from pathlib import Path

import numpy as np
import pytest
from benches import SUPPLY, power_curve, settled_bench, settled_table, step_bench
from scipy.optimize import curve_fit

from undertow.core.errors import BadInput
from undertow.core.runtime import in_precision
from undertow.physics.thrusters.dc_motor import dc_motor
from undertow.physics.thrusters.first_order import first_order
from undertow.physics.thrusters.t200 import t200
from undertow.scenario.factory import make
from undertow.studies.identification.bench.bench_reader import read_bench
from undertow.studies.identification.bench.bench_response import settled_response
from undertow.studies.identification.bench.identify_thruster import identify_thruster, section_of

TABLE = Path(__file__).parents[2] / "peers" / "data" / "t200_table.csv"
VOLTS = np.linspace(-SUPPLY, SUPPLY, 65)
TRUTH = {"thrust_per_volt": 1.0, "power": 1.45, "dead_zone": 0.7, "reverse_share": 0.78}


def estimates(fit):
    return {interval.parameter.name: interval for interval in fit.intervals}


def test_numbers_of_a_noiseless_curve_come_back():
    result = identify_thruster([settled_table(VOLTS, power_curve(VOLTS))])
    found = estimates(result.best)
    for name, value in TRUTH.items():
        assert found[name].value == pytest.approx(value, rel=1e-4)
        assert found[name].low <= value <= found[name].high
    assert result.best.left_out["thrust"] < 1e-3


def test_estimates_are_those_of_scipys_curve_fit():
    """With so many rows the priors weigh nothing, and without outliers neither does the robust loss."""
    volts = np.linspace(-SUPPLY, SUPPLY, 801)
    thrust = power_curve(volts) + 0.5 * np.random.default_rng(4).uniform(-1, 1, len(volts))
    model = lambda v, gain, power, zone, share: power_curve(v, gain, power, zone, share)
    peer, covariance = curve_fit(model, volts, thrust, p0=(0.9, 1.5, 0.8, 0.8))
    found = estimates(identify_thruster([settled_table(volts, thrust)]).best)
    for name, value, deviation in zip(TRUTH, peer, np.sqrt(np.diagonal(covariance)), strict=True):
        assert found[name].value == pytest.approx(value, abs=0.3 * deviation)
        assert found[name].deviation == pytest.approx(deviation, rel=0.5)


def test_an_outlier_moves_nothing_far():
    thrust = power_curve(VOLTS) + 0.1 * np.random.default_rng(0).standard_normal(len(VOLTS))
    clean = estimates(identify_thruster([settled_table(VOLTS, thrust)]).best)
    thrust[50] += 8.0
    found = estimates(identify_thruster([settled_table(VOLTS, thrust)]).best)
    for name in ("power", "reverse_share"):
        assert abs(found[name].value - clean[name].value) < 0.02


def test_lag_and_delay_of_a_record_over_time():
    with in_precision("float64"):
        truth = first_order(
            thrust_per_volt=1.0,
            power=1.45,
            reverse_share=0.78,
            time_constant=0.12,
            linear_gain=3.0,
            dead_zone=0.7,
            dead_zone_kind="subtract",
        )
    table = step_bench(truth, 1)
    result = identify_thruster(
        [table._replace(current=VOLTS[:1].repeat(len(table.volts)) * np.nan, speed=table.speed * np.nan)]
    )
    found = estimates(result.best)
    for name, value in (TRUTH | {"time_constant": 0.12, "delay": 0.04}).items():
        assert found[name].value == pytest.approx(value, rel=0.05)
        assert found[name].low <= value <= found[name].high
    assert not any(finding.name == "lag" for finding in result.findings)


@pytest.mark.full
def test_inertia_of_a_motor_follows_from_steps():
    with in_precision("float64"):
        truth = dc_motor(
            rotor_inertia=3.2e-4, reverse_thrust_coefficient=2.9e-4, dead_zone=0.8, dead_zone_kind="subtract"
        )
    result = identify_thruster([step_bench(truth, 3, duration=12.0)])
    assert result.best.problem.form.name == "motor"
    assert estimates(result.best)["rotor_inertia"].value == pytest.approx(3.2e-4, rel=0.02)
    assert estimates(result.best)["reverse_thrust_coefficient"].value == pytest.approx(2.9e-4, rel=0.02)


def test_constants_come_back_from_a_table_with_as_many_digits_as_the_published_one():
    """A table of the catalogue's T200, with the digits that Blue Robotics prints."""
    with in_precision("float64"):
        bench = settled_bench(t200(), VOLTS)
    bench = bench._replace(
        thrust=np.round(bench.thrust / 9.80665, 2) * 9.80665,
        current=np.round(bench.current, 2),
        speed=np.round(bench.speed, 1),
    )
    result = identify_thruster([bench])
    found = estimates(result.best)
    truth = t200().motor
    assert result.best.problem.form.dead_zone_kind == "pass"
    for name in ("resistance", "back_emf_constant", "thrust_coefficient", "torque_coefficient"):
        assert found[name].value == pytest.approx(float(getattr(truth, name)), rel=0.01)
    assert found["dead_zone"].low <= 1.2 <= found["dead_zone"].high
    assert result.best.rms("thrust") < 0.05  # its last digit is worth 0.1 N


@pytest.mark.full
def test_published_t200_at_16_volts():
    """The curve is closer to the table than the catalogue's motor, which was fitted to all supplies (1.5 N)."""
    table = read_bench(TABLE, 16.0)
    assert len(table.volts) == 201
    with in_precision("float64"):
        result = identify_thruster([table], {"t200": t200()})
    assert result.compared["t200"] == pytest.approx(1.48, abs=0.02)
    by_form = {fit.problem.form.name: fit for fit in result.fits}
    assert by_form["curve"].rms("thrust") < 0.3
    assert by_form["motor"].rms("thrust") < 0.4
    assert by_form["motor"].rms("current") < 0.2
    for fit in result.fits:
        thrust, _ = fit.thrust_band(np.array([16.0, -16.0]))
        np.testing.assert_allclose(thrust, [51.44, -39.91], atol=1.5)


def test_rows_of_a_supply_are_chosen():
    table = read_bench(TABLE)
    assert len(table.volts) == 1206
    with pytest.raises(BadInput, match="10, 12, 14, 16, 18, 20"):
        read_bench(TABLE, 11.0)


def test_a_scenario_accepts_the_section_and_gives_the_same_thrust():
    result = identify_thruster([settled_table(VOLTS, power_curve(VOLTS))])
    section = section_of(result.best, result.largest)
    with in_precision("float64"):
        part, _ = make("thrusters", section, Path())
        thrust = np.asarray(settled_response(part, VOLTS[::8]).thrust)
    expected, _ = result.best.thrust_band(VOLTS[::8])
    assert section["supply"] == SUPPLY
    np.testing.assert_allclose(thrust, expected, atol=1e-6)


def test_without_reverse_its_share_is_no_parameter_and_said_so():
    forward = VOLTS[VOLTS >= 0]
    result = identify_thruster([settled_table(forward, power_curve(forward))])
    assert "reverse_share" not in estimates(result.best)
    assert section_of(result.best, result.largest)["reverse_share"] == 1.0
    assert any(finding.name == "reverse" and finding.severity == "refused" for finding in result.findings)


@pytest.mark.full
def test_intervals_contain_the_truth():
    """95 % intervals over 60 seeds: the binomial makes fewer than 52 less likely than 1 in 100."""
    inside = dict.fromkeys(TRUTH, 0)
    for seed in range(60):
        noise = 0.4 * np.random.default_rng(seed).standard_normal(len(VOLTS))
        found = estimates(identify_thruster([settled_table(VOLTS, power_curve(VOLTS) + noise)]).best)
        for name, value in TRUTH.items():
            inside[name] += found[name].low <= value <= found[name].high
    assert min(inside.values()) >= 52, inside


def test_truth_outside_the_form_widens_the_intervals():
    """A bump that the form lacks counts as an error that neighbouring rows share, and not as noise."""
    white = 0.3 * np.random.default_rng(2).standard_normal(len(VOLTS))
    bump = 0.3 * np.sqrt(2) * np.sin(VOLTS)
    own, other = (
        estimates(identify_thruster([settled_table(VOLTS, power_curve(VOLTS) + error)]).best) for error in (white, bump)
    )
    assert other["power"].deviation > 1.3 * own["power"].deviation

"""Reading bench records: columns, units and signs; and what is refused, in words."""

import numpy as np
import pytest
from benches import SUPPLY, power_curve, settled_table

from undertow.core.errors import BadInput
from undertow.studies.identification.bench.bench_check import check_bench
from undertow.studies.identification.bench.bench_reader import read_bench
from undertow.studies.identification.bench.columns import columns_of

PULSES = np.arange(1100, 1901, 20)
VOLTS = (PULSES - 1500) / 400 * SUPPLY


def written(folder, header, *columns):
    path = folder / "bench.csv"
    rows = [",".join(f"{value:.6g}" for value in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("title", "quantity", "unit"),
    [
        (" PWM (µs)", "pulse", "us"),
        ("Force (Kg f)", "thrust", "kgf"),
        ("thrust_N", "thrust", "N"),
        ("thrust [lbf]", "thrust", "lbf"),
        ("Thrust (g)", "thrust", "gf"),
        ("RPM", "speed", "rpm"),
        ("speed_rad_s", "speed", "rad/s"),
        ("Current (A)", "current", "A"),
        ("supply_V", "supply", "V"),
        ("command_V", "voltage", "V"),
        ("throttle_%", "duty", "%"),
        ("time_ms", "time", "ms"),
    ],
)
def test_titles_name_quantity_and_unit(title, quantity, unit):
    column = columns_of([title])[quantity]
    assert column.unit == unit
    assert column.factor > 0


def test_columns_as_the_manufacturer_has_them(tmp_path):
    thrust = power_curve(VOLTS) / 9.80665
    speed, current = np.abs(VOLTS) * 200, np.abs(VOLTS) * 1.5
    header = " PWM (µs),RPM,Current (A),Voltage (V),Power (W),Force (Kg f),Efficiency (g/W)"
    path = written(tmp_path, header, PULSES, speed, current, 0 * VOLTS + 16, current * 16, thrust, 0 * VOLTS)
    table = read_bench(path)
    np.testing.assert_allclose(table.volts, VOLTS, rtol=1e-6)
    np.testing.assert_allclose(table.thrust, power_curve(VOLTS), rtol=1e-5)
    np.testing.assert_allclose(table.speed, VOLTS * 200 * 2 * np.pi / 60, rtol=1e-5)
    np.testing.assert_allclose(table.current, VOLTS * 1.5, rtol=1e-6)
    assert table.time is None


def test_duties_pulses_and_volts_are_the_same_command(tmp_path):
    thrust = power_curve(VOLTS)
    tables = [
        read_bench(written(tmp_path, "pwm_us,thrust_N", PULSES, thrust), SUPPLY),
        read_bench(written(tmp_path, "duty,thrust_N", VOLTS / SUPPLY, thrust), SUPPLY),
        read_bench(written(tmp_path, "duty_%,thrust_N", 100 * VOLTS / SUPPLY, thrust), SUPPLY),
        read_bench(written(tmp_path, "command,thrust_N", PULSES, thrust), SUPPLY),
        read_bench(written(tmp_path, "voltage_V,thrust_N", VOLTS, thrust)),
    ]
    for table in tables:
        np.testing.assert_allclose(table.volts, VOLTS, atol=1e-12)


def test_sizes_of_thrust_get_the_sign_of_the_command(tmp_path):
    table = read_bench(written(tmp_path, "voltage_V,thrust_N", VOLTS, np.abs(power_curve(VOLTS))))
    np.testing.assert_allclose(table.thrust, power_curve(VOLTS), rtol=1e-5)
    assert any("no sign" in note for note in table.notes)


def test_a_record_over_time_needs_rows_close_together(tmp_path):
    thrust = power_curve(VOLTS)
    close = read_bench(written(tmp_path, "time_s,voltage_V,thrust_N", 0.02 * np.arange(len(VOLTS)), VOLTS, thrust))
    apart = read_bench(written(tmp_path, "time_s,voltage_V,thrust_N", 2.0 * np.arange(len(VOLTS)), VOLTS, thrust))
    assert close.time is not None
    assert apart.time is None
    assert any("too far" in note for note in apart.notes)


@pytest.mark.parametrize(
    ("header", "columns", "supply", "words"),
    [
        ("pwm_us,thrust_N", (PULSES, power_curve(VOLTS)), None, "--supply"),
        ("pwm_us,thrust", (PULSES, power_curve(VOLTS)), 16.0, "say the unit of thrust"),
        ("pwm_us,current_A", (PULSES, VOLTS), 16.0, "column of thrust"),
        ("thrust_N,current_A", (VOLTS, VOLTS), 16.0, "column of the command"),
        ("duty,thrust_N", (PULSES, power_curve(VOLTS)), 16.0, "duties from -1 to 1"),
        ("pwm_us,thrust_N", (VOLTS, power_curve(VOLTS)), 16.0, "pulses from"),
        ("pwm_us,thrust_V", (PULSES, power_curve(VOLTS)), 16.0, "thrust_V in V"),
        ("pwm_us,thrust_N,force_N", (PULSES, VOLTS, VOLTS), 16.0, "one column of thrust"),
    ],
)
def test_records_that_cannot_be_read(tmp_path, header, columns, supply, words):
    with pytest.raises(BadInput, match=words):
        read_bench(written(tmp_path, header, *columns), supply)


def with_current(thrust):
    return settled_table(VOLTS, thrust, current=np.abs(power_curve(VOLTS)) * 0.5)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        (settled_table(VOLTS[-4:], power_curve(VOLTS[-4:])), "5 forward commands"),
        (settled_table(VOLTS, 0 * VOLTS + 3.0), "thrust that changes"),
        (settled_table(VOLTS, -power_curve(VOLTS)), "positive commands give negative thrust"),
        (settled_table(VOLTS[:20], power_curve(VOLTS[:20])), "forward commands"),
        (settled_table(VOLTS, power_curve(VOLTS)[np.random.default_rng(0).permutation(len(VOLTS))] + VOLTS), "rises"),
        (with_current(power_curve(VOLTS) / 9.80665), "kgf"),
        (with_current(power_curve(VOLTS) / 9.80665e-3), "gf"),
    ],
)
def test_records_that_cannot_be_used(table, words):
    with pytest.raises(BadInput, match=words):
        check_bench([table])


def test_findings_that_do_not_stop():
    dead = with_current(power_curve(VOLTS) + 3.0)._replace(speed=np.full(len(VOLTS), 7.0))
    names = {(finding.name, finding.severity) for finding in check_bench([dead])}
    sentences = " ".join(map(str, check_bench([dead])))
    assert ("speed", "left_out") in names
    assert ("lag", "refused") in names
    assert "at command 0 the thrust is 3 N" in sentences


def test_a_mapping_names_columns_of_any_header(tmp_path):
    path = written(tmp_path, "clock,channel_3,cell", 20 * np.arange(len(VOLTS)), PULSES, power_curve(VOLTS) / 9.80665)
    mapping = tmp_path / "mapping.yaml"
    mapping.write_text(
        "time: {column: clock, unit: ms}\n"
        "signals:\n"
        "  input: {columns: [channel_3], unit: us, supply: 16, dead_band: 0}\n"
        "  thrust: {columns: [cell], unit: kgf}\n"
    )
    table = read_bench(path, mapping=mapping)
    np.testing.assert_allclose(table.volts, VOLTS, atol=1e-9)
    np.testing.assert_allclose(table.thrust, power_curve(VOLTS), rtol=1e-5)
    assert table.time is not None

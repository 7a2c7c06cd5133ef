"""`undertow identify --thruster`: what it writes, and that a scenario takes it."""

import json
from pathlib import Path

import pytest
from ruamel.yaml import YAML

TABLE = Path(__file__).parents[1] / "peers" / "data" / "t200_table.csv"


@pytest.mark.full
def test_a_bench_becomes_a_section_that_a_scenario_accepts(undertow, tmp_path):
    said = undertow("identify", "--thruster", str(TABLE), "--supply", "16", "--compare", "t200", "--out", "out")
    assert said.code == 0, said
    assert "of rows that were left out within" in said.out
    assert "t200 has an error of 1.48 N rms" in said.out
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["figures", "identification.html", "identification.json", "thruster.yaml"]
    data = json.loads((tmp_path / "out" / "identification.json").read_text())
    assert [form["form"] for form in data["forms"]] == ["motor", "curve"]
    assert data["forms"][0]["rms_left_out"]["thrust"] < 0.8
    section = YAML(typ="safe").load((tmp_path / "out" / "thruster.yaml").read_text())["thruster"]
    assert section["kind"] == "dc_motor"
    scenario = {
        "plant": {"vehicle": "bluerov2_heavy", "thruster": section},
        "controller": "robust",
        "reference": {"kind": "setpoint", "position": [0, 0, 1, 0, 0, 0]},
        "loop": {"duration": 1},
    }
    (tmp_path / "s.yaml").write_text(json.dumps(scenario))
    assert undertow("check", "s.yaml").code == 0
    again = undertow("identify", "--thruster", str(TABLE), "--supply", "16", "--out", "out")
    assert again.code == 2 and "earlier result" in again.err


def test_further_records_have_an_option_of_their_own(refused):
    assert "with --thruster" in refused("identify", "--thruster", "a.csv", "b.csv")

"""What is there, with units and sources."""

import json

import jsonschema
import pytest

import undertow as ut
from undertow.analysis.metrics import MEANINGS
from undertow.core import catalogue
from undertow.core.errors import BadInput
from undertow.scenario import describing
from undertow.scenario.schema_keys import keys
from undertow.simulation.loop.recorded_signals import RECORDED
from undertow.studies.campaign.campaign_schema import Campaign, CampaignRequirement, Distribution, RecordedSignals

PARTS = [(kind, name) for kind in catalogue.KINDS for name in catalogue.names(kind)]


@pytest.mark.full
@pytest.mark.parametrize("kind", catalogue.KINDS)
def test_every_part_is_listed_with_its_kind(undertow, kind):
    listed = undertow("list", kind)
    assert listed.code == 0 and all(name in listed.out for name in catalogue.names(kind))


@pytest.mark.full
@pytest.mark.parametrize(("kind", "name"), PARTS)
def test_every_part_is_described(undertow, kind, name):
    described = undertow("describe", f"{kind}/{name}")
    presets = list(catalogue.presets_of(catalogue.names(kind)[name]))
    title = f"{presets[0]}, preset of {name} ({kind})" if presets else f"{name} ({kind})"
    assert described.code == 0 and described.out.startswith(title)


@pytest.mark.full
@pytest.mark.parametrize(("kind", "name"), PARTS)
def test_every_option_has_a_meaning(kind, name):
    for description in describing.describe(f"{kind}/{name}"):
        assert description.summary
        assert [option.name for option in description.options if not option.meaning] == []


def test_list_shows_everything(undertow):
    out = undertow("list").out
    assert all(name in out for _, name in PARTS)


def test_presets_are_found_by_their_names(undertow):
    """In `list`, in `describe` and as `controller` of a scenario: one name for a law."""
    rows = {row["name"]: row for row in json.loads(undertow("list", "controllers", "--json").out)}
    for preset, law in {
        "robust": "rcaf",
        "learning": "rcaf",
        "paper": "rcaf",
        "px4": "cascade",
        "placed": "cascade",
    }.items():
        assert rows[preset]["description"].startswith(f"Preset of `{law}`: ")
        (described,) = describing.describe(preset)
        usual = "required" if law == "rcaf" else "placed"
        assert (described.title, described.options[0].default) == (f"{preset}, preset of {law}", usual)
        assert catalogue.spelled_out("controllers", {"kind": preset}) == {"kind": law, "preset": preset}
    assert not set(catalogue.presets("controllers")) & set(catalogue.names("controllers"))
    with pytest.raises(BadInput, match="`preset` must be left out, because `robust` is a preset of `rcaf`"):
        catalogue.spelled_out("controllers", {"kind": "robust", "preset": "paper"})


def test_parameters_come_with_unit_symbol_and_source(undertow):
    out = undertow("describe", "paper_table3").out
    for word in ("motor.resistance", "1.2", "ohm", "R", "winding resistance", "the paper, Table 3"):
        assert word in out
    assert "Advice: torque constant / back-EMF constant is 117" in out


@pytest.mark.full
def test_controller_shows_its_options_and_the_defaults_of_its_class():
    rcaf, sound, learning = describing.describe("rcaf")
    assert [one.title for one in (rcaf, sound, learning)] == [
        f"{p}, preset of rcaf" for p in catalogue.presets_of(catalogue.names("controllers")["rcaf"])
    ]
    assert "bandwidth" in {option.name for option in sound.options}
    options = {option.name: option for option in rcaf.options}
    assert "model" not in options
    assert options["composite"].default == 500.0 and "gamma_eps" in options["composite"].meaning
    parameters = {parameter.name: parameter for parameter in rcaf.parameters}
    assert parameters["feedback"].symbol == "K" and parameters["feedback"].source == "Table 1"


def test_part_of_a_file(undertow, tmp_path):
    (tmp_path / "mine.py").write_text(
        'def part(size: float = 2.0):\n    """Mine.\n\n    Args:\n        size: m.\n    """\n'
    )
    out = undertow("describe", "./mine.py:part").out
    assert "Mine." in out and "size" in out
    (tmp_path / "law.py").write_text("def law(model, stiffness: float = 2.0):\n    return model\n")
    out = undertow("describe", "./law.py:law").out
    assert "stiffness" in out and "model" not in out  # which undertow gives


def test_scenario_keys(undertow):
    out = undertow("describe", "scenario").out
    assert all(key.path in out and key.meaning for key in keys())
    assert "loop.duration" in out and "required" in out


def test_campaign_keys(undertow):
    out = undertow("describe", "campaign").out
    models = (Campaign, Distribution, CampaignRequirement, RecordedSignals)
    assert all(key.path in out and key.meaning for model in models for key in keys(model))
    schema = json.loads(undertow("describe", "campaign", "--json-schema").out)
    assert set(schema["properties"]) == set(Campaign.model_fields)
    scenario = {"plant": "double_integrator", "reference": {"kind": "setpoint", "position": [1]}}
    good = {"scenario": scenario, "vary": {"a": {"uniform": [1, 2]}}, "cross": {"b": [1, 2], "c": {"low": 1}}}
    wrong = lambda data: [one.json_path for one in jsonschema.Draft7Validator(schema).iter_errors(data)]
    assert wrong(good) == wrong({"scenario": "s.yaml"}) == []
    assert wrong(good | {"grid": {}}) and wrong({"scenario": {"plan": "odin"}}) == ["$.scenario"]


def test_metrics(undertow):
    out = " ".join(undertow("describe", "metrics").out.replace("│", " ").split())  # cells without their lines
    assert all(name in out and meaning.meaning in out for name, meaning in MEANINGS.items())


def test_version(undertow):
    assert undertow("version").out.startswith("undertow ")


def test_signals_are_those_that_are_declared(undertow):
    """Of every run, and of a law: the same declarations that a result file is labelled by."""
    out = undertow("describe", "signals").out
    assert all(name in out and signal.meaning in out for name, signal in RECORDED.items())
    out = undertow("describe", "pid").out
    assert "estimate d_hat of the lumped uncertainty" in out and "attained_share" in out and "weights" not in out


def test_presets_and_mistakes_in_python():
    """`ut.controllers.robust` is what `controller: robust` is, and a mistyped option is one line."""
    model = ut.HybridVehicle(ut.vehicles.odin(), ut.thrusters.paper_table3()).model()
    assert ut.controllers.robust(model) == ut.rcaf(model, preset="robust")
    assert set(catalogue.presets("controllers")) < set(dir(ut.controllers))
    for part in (ut.controllers.robust, ut.controllers.adrc):
        with pytest.raises(BadInput, match=f"`bandwidht` must be an option of `{part.__name__}`.*`bandwidth`"):
            part(model, bandwidht=3)
    with pytest.raises(BadInput, match="`model` must be the nominal model of a plant"):
        ut.rcaf()


def test_a_dead_thruster_is_off():
    with pytest.raises(BadInput, match="Did you mean `off`"):
        catalogue.find("faults", "dead")

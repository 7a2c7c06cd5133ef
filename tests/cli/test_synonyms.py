"""The words that stand for keys: each of the table leads to a key that exists, and is none itself."""

from undertow.scenario import vehicle_schema
from undertow.scenario.schema_keys import keys
from undertow.scenario.synonyms import WORDS, hint_for
from undertow.studies.campaign.campaign_schema import Campaign, CampaignRequirement, Distribution

_CAMPAIGN = {*Campaign.model_fields}
_CAMPAIGN |= {f"vary.*.{name}" for name in Distribution.model_fields}
_CAMPAIGN |= {f"requirements.*.{name}" for name in CampaignRequirement.model_fields}
_OPTIONS = {"plant.vehicle", "plant.thruster", "controller.gains", "navigation.sensors"}  # of parts
KEYS = {"scenario": {key.path for key in keys()}, "campaign": _CAMPAIGN, "vehicle file": {*vehicle_schema.KEYS}}


def test_every_word_stands_for_a_key_and_is_none():
    for file, words in WORDS.items():
        assert set(words) <= KEYS[file] | _OPTIONS
        for key, others in words.items():
            section = key.rpartition(".")[0]
            assert not {f"{section}.{word}".lstrip(".") for word in others.split()} & KEYS[file]


def test_no_word_stands_for_two_keys_of_one_place():
    for words in WORDS.values():
        every = [(key.rpartition(".")[0], word) for key, others in words.items() for word in others.split()]
        assert len(set(every)) == len(every)


def test_hint_depends_on_the_place():
    assert hint_for(("loop", "T"), "scenario") == "Did you mean `duration`?"
    assert hint_for(("T",), "scenario") == "Did you mean `loop.duration`? Write `loop: {duration: ...}`"
    assert hint_for(("vary", "plant.vehicle.mass", "Range"), "campaign") == "Did you mean `uniform`?"
    assert hint_for(("loop", "reference"), "scenario") == hint_for(("nothing",), "scenario") == ""

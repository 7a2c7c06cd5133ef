"""Trials by their numbers: what is put where, and in which order combinations come."""

import pytest

from undertow.core.errors import BadInput
from undertow.scenario.reading import from_data
from undertow.studies.campaign.campaign_schema import validate
from undertow.studies.campaign.trials import trials

LIST = [{"kind": "current", "velocity": [0.1, 0.2, 0.3]}, "waves"]


def made(data):
    text = from_data(data)
    return trials(validate(text), text)


def test_values_stand_where_the_key_path_says(campaign):
    data = campaign()
    data["scenario"] |= {"disturbance": LIST}
    put = {
        "disturbance[0].velocity[1]": 5.0,
        "disturbance[1].height": 0.7,
        "initial.position": [1.0],
        "navigation": "perfect",
    }
    data |= {"vary": {}, "cross": {key: [value] for key, value in put.items()}}
    found = made(data).data(0)
    assert found["disturbance"] == [{"kind": "current", "velocity": [0.1, 5.0, 0.3]}, {"kind": "waves", "height": 0.7}]
    assert found["initial"] == {"position": [1.0]} and found["navigation"] == "perfect"
    assert data["scenario"]["disturbance"] is LIST and LIST[0]["velocity"][1] == 0.2


def test_every_combination_flies_the_same_draws_and_seeds(campaign):
    several = made(campaign(trials=5, cross={"controller": ["pid", "paper"], "loop.dt": [0.01, 0.02]}))
    assert several.number == 20
    assert [several.values(i)["controller"] for i in range(4)] == ["pid", "pid", "paper", "paper"]
    assert [several.values(i)["loop.dt"] for i in range(4)] == [0.01, 0.02, 0.01, 0.02]
    for sample in range(5):
        same = [several.values(4 * sample + i)["disturbance.amplitude"] for i in range(4)]
        assert len(set(same)) == 1
        assert len({several.seed(4 * sample + i) for i in range(4)}) == 1


def test_variants_change_several_keys_together(campaign):
    """An axis of its own, after those of `cross`, on whose values a variant acts."""
    fast = {"controller.frequency": 9.0, "loop.dt": 0.01}
    data = campaign(
        trials=2, cross={"controller": ["pid", {"kind": "pid", "damping": 2.0}]}, variants={"as is": {}, "fast": fast}
    )
    several = made(data)
    assert several.number == 8 and list(several.campaign.axes) == ["controller", "variant"]
    assert several.campaign.keys == ["disturbance.amplitude", "controller", "controller.frequency", "loop.dt"]
    assert several.data(2)["controller"] == {"kind": "pid", "damping": 2.0} and several.data(2)["loop"]["dt"] == 0.02
    assert several.data(3)["controller"] == {"kind": "pid", "damping": 2.0, "frequency": 9.0}
    assert several.data(3)["loop"]["dt"] == 0.01 and several.seed(3) == several.seed(0) != several.seed(4)


@pytest.mark.parametrize(
    "changes, said",
    [
        ({"variants": {"a": {"seed": 1}}}, "seed` must be left out"),
        ({"variants": {"a": {"loop..dt": 1}}}, "be a key path"),
        ({"variants": {"a": {"disturbance.amplitude": 1.0}}}, "not be in `vary` as well"),
        ({"variants": {"a": {}}, "cross": {"variant": [1, 2]}}, "left out beside `variants`"),
    ],
)
def test_variants_that_cannot_be(campaign, changes, said):
    with pytest.raises(BadInput, match=said):
        made(campaign(**changes))


def test_parts_have_names(campaign):
    parts = [{"kind": "rcaf", "preset": "robust"}, "pid", {"kind": "pid", "frequency": 3.0}]
    assert list(validate(from_data(campaign(cross={"controller": parts}))).cross["controller"]) == [
        "rcaf robust",
        "pid",
        "pid frequency=3.0",
    ]


@pytest.mark.parametrize(
    "key, said",
    [
        ("disturbance[3].height", "name one of the 2 entries, 0 to 1, but is \\[3\\]"),
        ("loop.dt.more", "lead to a key of the scenario, but is past 0.02"),
    ],
)
def test_a_key_path_that_leads_nowhere_is_told(campaign, key, said):
    data = campaign(vary={key: {"uniform": [0.0, 1.0]}})
    data["scenario"] |= {"disturbance": LIST}
    with pytest.raises(BadInput, match=said):
        made(data).data(0)

"""The ablations: campaigns that can be run, verdicts that find what they ask for, statistics against closed forms."""

import math
from pathlib import Path

import jax
import numpy as np
import pytest
from scipy.stats import binom

from undertow.analysis.small_signal import gains
from undertow.control.controllers.presets.paper import paper
from undertow.control.controllers.presets.robust import robust
from undertow.core.errors import BadInput
from undertow.paper.ablations import study
from undertow.paper.ablations.study import Variant, spread
from undertow.paper.ablations.verdicts import ABLATIONS
from undertow.paper.robust_variant import conclusions, fidelity
from undertow.paper.setup import equal_gain_ratio
from undertow.physics.disturbances import random_suite
from undertow.physics.plants import double_integrator
from undertow.scenario.part_cache import PartCache
from undertow.scenario.reading import dump
from undertow.studies.campaign.build_trials import build_trial
from undertow.studies.campaign.campaign_schema import read_campaign
from undertow.studies.campaign.campaign_summary import median_interval
from undertow.studies.campaign.trials import trials

pytestmark = pytest.mark.full

FOLDER = Path(study.__file__).parent
MODEL = double_integrator(1).model()


def several(name):
    return trials(*read_campaign(FOLDER / f"{name}.yaml"))


def scenario(name, variant):
    """The scenario of the first trial of a variant."""
    found = several(name)
    names = [", ".join(each) for each in study.itertools.product(*found.campaign.axes.values())]
    return found.data(names.index(variant))


def names(ablation):
    return [
        ", ".join(each)
        for name in ablation.campaigns
        for each in study.itertools.product(*several(name).campaign.axes.values())
    ]


def everywhere(value, metrics):
    """Metrics that are the same for all seeds."""
    return dict.fromkeys(metrics, dict.fromkeys(("median", "low", "high", "median_low", "median_high"), value))


def pretended(ablation, value=1.0):
    one = Variant("as given", 30, 0, everywhere(value, ablation.metrics))
    return {name: one for name in names(ablation)}


def test_there_are_twenty_one_questions():
    assert {one.id for one in ABLATIONS} == {f"A{k}" for k in range(1, 22)}
    files = [name for one in ABLATIONS for name in one.campaigns]
    assert {f"{name}.yaml" for name in files} | {"axes.yaml", "odin.yaml", "heavy.yaml"} == {
        path.name for path in FOLDER.glob("*.yaml")
    }
    for one in ABLATIONS:
        assert several(one.campaigns[0]).campaign.description.endswith("?") and one.prediction.endswith(".")
        assert len(set(names(one))) == len(names(one)) > 1


@pytest.mark.slow
@pytest.mark.parametrize("ablation", ABLATIONS, ids=lambda one: one.id)
def test_every_variant_can_be_built(ablation):
    for name in ablation.campaigns:
        found, cache = several(name), PartCache()
        assert found.campaign.trials == 30
        for i in range(len(found.combinations)):
            assert build_trial(found, cache, i).scenario.loop.kind == "sampled"


@pytest.mark.parametrize("ablation", ABLATIONS, ids=lambda one: one.id)
def test_a_verdict_finds_its_variants_and_misses_one_that_is_gone(ablation):
    found = pretended(ablation)
    assert ablation.judge(found).agrees in ("yes", "partly", "no")
    misspelt = {f"{name}!": one for name, one in found.items()}
    if ablation.id != "A14":  # whose verdict is on all variants, whatever they are called
        with pytest.raises(KeyError):
            ablation.judge(misspelt)


def test_conclusions_find_their_variants():
    results = [
        {"id": one.id, "variants": [{"name": name, **each._asdict()} for name, each in pretended(one).items()]}
        for one in ABLATIONS
    ]
    rows = [{"place": run.place, "law": run.law, "status": "completed", "steady": None} for run in fidelity.runs(False)]
    numbers = conclusions.Numbers(rows, results)
    asked = [sentence for sentences in conclusions._KINDS.values() for sentence in sentences]
    for sentence in asked:
        try:
            assert isinstance(sentence(numbers), str)
        except TypeError as error:  # of metrics of a run that, here, did not reach its end
            assert "NoneType" in str(error)
    del results[2]["variants"][0]
    with pytest.raises(KeyError):
        conclusions.conclusions(rows[:0], results)


def test_median_and_quantiles_of_the_first_thirty_numbers():
    """The 95 % interval of the median of 30 is from the 10th to the 21st, with 95.7 %."""
    found = spread(np.random.default_rng(0).permutation(np.arange(1.0, 31.0)))
    assert tuple(found.values()) == pytest.approx((15.5, 2.45, 28.55, 10.0, 21.0))


@pytest.mark.parametrize("count", [6, 8, 30, 100, 1000])
def test_interval_of_the_median_covers_95_percent_and_hardly_more(count):
    low, high = median_interval(np.arange(1.0, count + 1))
    covered = lambda r: 1 - 2 * binom.cdf(r - 1, count, 0.5)
    assert covered(low) >= 0.95 > covered(low + 1) and low + high == count + 1


def test_interval_holds_the_median_as_often_as_it_says():
    draws = np.random.default_rng(1).exponential(size=(2000, 30))
    inside = [low <= math.log(2) <= high for low, high in map(median_interval, draws)]
    assert np.mean(inside) == pytest.approx(0.957, abs=0.015)


def test_runs_that_ended_early_are_infinitely_bad():
    assert spread(np.array([1.0, 2.0, np.inf]))["median"] == 2.0
    assert spread(np.array([1.0, np.inf, np.inf]))["median"] == np.inf


SMALL = {
    "scenario": {
        "plant": {"kind": "double_integrator", "axes": 6},
        "controller": "paper",
        "reference": {"kind": "setpoint", "position": [0.0] * 6},
        "disturbance": {"kind": "random_suite", "amplitude": 0.2, "step": 0.1},
        "loop": {"kind": "sampled", "duration": 0.4},
    },
    "trials": 3,
}


def variants(tmp_path, given):
    path = tmp_path / "small.yaml"
    path.write_text(dump(SMALL | {"variants": given}))
    return dict(study.variants(path, ("tracking_rms", "share"), False, tmp_path))


def test_an_ablation_with_a_known_answer_and_one_that_is_unstable(tmp_path):
    """One set or five, the same gamma |xi|^2: the same errors, as long as the modelling error is small (I18)."""
    one = {"controller.sets": 1, "controller.adaptation": matched(sets=1)}
    found = variants(tmp_path, {"five": {}, "one": one, "fast": {"controller.adaptation": 1e6}})
    assert [each.settings for each in found.values()][::2] == ["Table 1", "controller.adaptation: 1000000.0"]
    five, one, fast = found.values()
    for metric in ("tracking_rms", "share"):
        assert one.median(metric) == pytest.approx(five.median(metric), rel=5e-3)
    assert five.failures == 0 and five.metrics["tracking_rms"]["low"] < five.metrics["tracking_rms"]["high"]
    assert (fast.seeds, fast.failures) == (3, 3) and fast.metrics == everywhere(math.inf, ("tracking_rms", "share"))
    again = read_campaign(tmp_path / "campaigns" / "small.yaml")[0]
    assert again.number == 9 and again.variants["one"]["controller.sets"] == 1


def test_a_variant_that_cannot_be_built_is_no_failure_of_the_law(tmp_path):
    with pytest.raises(BadInput, match="sets"):
        variants(tmp_path, {"five": {}, "none": {"controller.sets": 0}})


def matched(**options):
    """gamma with the gamma |xi|^2 of Table 1."""
    rho = lambda **options: float(paper(MODEL, **options).fuzzy.basis_norm_squared())
    return 100 * rho() / rho(**options)


@pytest.mark.parametrize(
    ("name", "variant", "options"),
    [
        ("a01_fuzzy_input", "state, matched", {"fuzzy_input": "state"}),
        ("a02_sets", "1 set", {"sets": 1}),
        ("a02_sets", "3 sets", {"sets": 3}),
        ("a02_sets", "5 sets", {"sets": 5}),
        ("a02_sets", "15 sets", {"sets": 15}),
        ("a02_sets", "5 sets to 3", {"reach": (3.0,)}),
        ("a02_sets", "5 sets to 0.3", {"reach": (0.3,)}),
    ],
)
def test_gains_that_make_fuzzy_systems_comparable(name, variant, options):
    controller = scenario(name, variant)["controller"]
    assert controller.get("adaptation", 100) == pytest.approx(matched(**options), rel=1e-6)


def test_gains_that_make_laws_comparable():
    """Section 3.1 of the theory: what Table 1, and preset robust, amount to as a linear observer."""
    table1, of = gains(paper(MODEL)), lambda variant: scenario("a03_linear_equivalents", variant)["controller"]
    for variant in ("linear observer", "INDI", "robust at Table 1, 1 set"):
        linear = of(variant)
        assert linear["bandwidth"] ** 2 == pytest.approx(table1.b2, rel=1e-6)
        assert 2 * linear["damping"] * linear["bandwidth"] == pytest.approx(table1.pole, rel=1e-6)
        assert linear["feedback"] == pytest.approx([table1.stiffness, table1.damping])
    assert of("RAFC, equal gain")["adaptation"] == pytest.approx(100 * equal_gain_ratio(), rel=1e-6)
    law, dt = robust(MODEL, reference_frequency=0), 1e-3
    of_rates, of_estimate = (float(gain) / dt for gain in law.estimator.gains(jax.numpy.asarray(dt)))
    for variant in ("robust's linear observer", "robust's INDI"):
        linear = of(variant)
        assert linear["bandwidth"] ** 2 == pytest.approx(of_estimate, rel=1e-6)
        assert 2 * linear["damping"] * linear["bandwidth"] == pytest.approx(of_rates, rel=1e-6)
        assert linear["feedback"] == pytest.approx(np.ravel(law.feedback).tolist(), rel=1e-6)
    one_set = scenario("a18_drift", "one set")["controller"]["adaptation"]
    rho = lambda **options: float(paper(MODEL, **options).fuzzy.basis_norm_squared())
    assert one_set == pytest.approx(100 * rho(sets=3, reach=(0.1,)) / rho(sets=1), rel=1e-6)
    slow = scenario("a11_motor", "30 rad/s, full motor model")["controller"]
    assert slow["adaptation"] * 500 * rho() == pytest.approx(30**2, rel=1e-3) and slow["pole"] == 2 * 30


def test_loads_have_the_size_that_is_asked_for():
    load = random_suite(2.0, 1.0, 10.0, step=3.0, hold=0.5, span=200.0)
    times = np.arange(0.0, 200.0, 0.05)
    none = double_integrator(6).no_load()

    @jax.jit
    def signal(key):
        path = load.realize(key)
        return jax.vmap(lambda t: load.at(path, t, None, none).acceleration)(times)

    values = np.asarray([signal(key) for key in jax.random.split(jax.random.PRNGKey(0), 8)])
    assert np.sqrt((values**2).mean()) == pytest.approx(math.hypot(2.0, 3.0), rel=0.03)
    assert np.abs(values[0] - values[1]).max() > 1
    jumps = np.asarray(load.jumps(2.0))
    np.testing.assert_allclose(jumps, [0.5, 1.0, 1.5])

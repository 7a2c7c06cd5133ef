"""Entries of the key `faults`: their errors name the key, the line and the remedy; what they resolve to repeats them."""

import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as some

from undertow.cli.main import run
from undertow.core.errors import BadInput
from undertow.physics.faults.kinds import list_kinds
from undertow.physics.faults.sampling import random_faults
from undertow.scenario.build import build
from undertow.scenario.fault_injection import with_faults
from undertow.scenario.part_cache import PartCache
from undertow.scenario.schema import Fault

BASE = {
    "plant": {"vehicle": "odin", "thruster": "linear_voltage"},
    "controller": "pid",
    "reference": {"kind": "setpoint", "position": [0, 0, 0, 0, 0, 0]},
    "loop": {"duration": 1.0, "dt": 0.01},
}
KALMAN = {"navigation": {"kind": "kalman", "sensors": ["imu", "dvl", "depth"]}}
OFF = {"target": "thruster 1", "mode": "off"}
PARTS = PartCache()  # made once for all tests


def built(*entries, **more):
    return build(BASE | more | {"faults": list(entries)}, PARTS)


@pytest.mark.parametrize(
    ("entry", "says"),
    [
        ({"mode": "off"}, "`faults[0].target` must be given"),
        ({"target": "thruster 1"}, "`faults[0].mode` must be given"),
        ({"target": "sonar", "mode": "off"}, "`faults[0].target` must be something that this scenario has"),
        ({"target": "dvl", "mode": "off"}, "This scenario has: position, attitude"),
        ({"target": "random", "mode": "off"}, "Write `number: random`"),
        ({"target": "thruster", "mode": "off"}, "Write `target: thruster 1`, for example"),
        ({"target": "thruster 9", "mode": "off"}, "`faults[0].number` must be from 1 to 8, or random"),
        ({"target": "thruster 0", "mode": "off"}, "`faults[0].number` must be from 1 to 8, or random"),
        ({"target": "thruster 1", "mode": "off", "number": 2}, "must be left out: the target is `thruster 1`"),
        ({"target": "position 2", "mode": "off"}, "must be left out for `position`"),
        ({"target": "thruster 1", "mode": "of"}, "Did you mean `off`?"),
        ({"target": "thruster 1", "mode": "nan"}, "must be a mode of `thruster`"),
        ({"target": "position", "mode": "runaway"}, "Its modes: bias, delayed, garbage"),
        (OFF | {"severity": 0.5}, "`faults[0].severity` must be left out: `off` of `thruster` has none"),
        ({"target": "bus", "mode": "sag", "severity": 1.5}, "`faults[0].severity` must be from 0 to 1, but is 1.5"),
        ({"target": "bus", "mode": "sag", "severity": [0.5, 0.1]}, "or [lowest, highest] for one that is sampled"),
        ({"target": "bus", "mode": "sag", "severity": "big"}, "`faults[0].severity` must be a number"),
        (OFF | {"onset": -1}, "`faults[0].onset` must be 0 or more s, but is -1"),
        (OFF | {"onset": float("nan")}, "`faults[0].onset` must be a finite number"),
        (OFF | {"duration": 0}, "`faults[0].duration` must be greater than 0"),
        (OFF | {"onest": 1.0}, "Did you mean `onset`?"),
        (OFF | {"announced": "yes"}, "`faults[0].announced` must be"),
        ({"target": "position", "mode": "bias", "announced": True}, "Only thrusters and the bus announce"),
        ({"target": "position", "mode": "bias", "axis": 4}, "`faults[0].axis` must be from 1 to 3"),
        (OFF | {"axis": 1}, "`faults[0].axis` must be left out"),
        ({"target": "position", "mode": "delayed", "severity": 6.0}, "`faults[0].severity` must be at most 511"),
        ({"target": "computation", "mode": "overrun", "severity": [1, 2]}, "must be one number for `computation`"),
        ({"target": "position", "mode": "intermittent", "period": 0}, "`faults[0].period` must be positive"),
        ({"target": "position", "mode": "delayed", "longest": 2.0}, "`faults[0].longest` must be a key of a fault"),
        ({"target": "computation", "mode": "bit_flip", "entry": 10_000}, "entry"),
        ("thruster 1", "`faults[0]` must be"),
    ],
    ids=str,
)
def test_errors(entry, says):
    with pytest.raises(BadInput) as error:
        built(entry)
    assert says in str(error.value), str(error.value)


@pytest.mark.full
def test_error_names_the_line(tmp_path, capsys):
    path = tmp_path / "s.yaml"
    path.write_text(
        "reference: {kind: setpoint, position: [0, 0, 0, 0, 0, 0]}\nfaults:\n  - {target: bus, mode: sagg}\n"
    )
    assert run(["check", str(path)]) == 2
    assert "s.yaml, line 3" in (said := capsys.readouterr().err) and "Did you mean `sag`?" in said


def test_a_continuous_loop_has_no_faults():
    with pytest.raises(BadInput, match=r"`loop.kind` must be sampled with this list of `faults`"):
        built(OFF, controller="paper", loop={"kind": "continuous", "duration": 1.0})


@pytest.mark.full
@pytest.mark.parametrize(
    ("written", "target", "number"),
    [
        ({"target": "thruster 3"}, "thruster", 3),
        ({"target": "Thruster_3"}, "thruster", 3),
        ({"target": "thruster3"}, "thruster", 3),
        ({"target": "thruster", "number": 3}, "thruster", 3),
        ({"target": "T3"}, "thruster", 3),
        ({"target": "thruster", "number": "random"}, "thruster", "random"),
        ({"target": "dvl"}, "sensor dvl", None),
        ({"target": "sensor dvl"}, "sensor dvl", None),
        ({"target": "sensor_dvl"}, "sensor dvl", None),
        ({"target": "sensor depth"}, "sensor depth", None),
        ({"target": "depth"}, "depth", None),
        ({"target": "power"}, "bus", None),
    ],
    ids=str,
)
def test_names_of_targets(written, target, number):
    (entry,) = built(written | {"mode": "off"}, **KALMAN).resolved["faults"]
    assert (entry["target"], entry.get("number")) == (target, number)


@pytest.mark.full
def test_several_sensors_of_a_kind():
    """Without a number a fault is one of each of them."""
    twice = {"navigation": {"kind": "kalman", "sensors": ["imu", "depth", "depth"]}}
    places = lambda entry: [one.sensor for one in built(entry, **twice).closed_loop.navigation.faults.members]
    assert places({"target": "sensor depth", "mode": "off"}) == [1, 2]
    assert places({"target": "sensor depth 2", "mode": "off"}) == [2]
    with pytest.raises(BadInput, match=r"`faults\[0\].number` must be from 1 to 2"):
        places({"target": "sensor depth 3", "mode": "off"})


@pytest.mark.full
def test_resolved_entries_make_the_same_loop():
    entries = [OFF | {"announced": True}, {"target": "dvl", "mode": "delayed", "severity": 0.2, "onset": 0.3}]
    entries += [
        {"target": "plant", "mode": "leak", "rise": 3.0},
        {"target": "thruster", "number": "random", "mode": "slow"},
    ]
    entries += [{"target": "computation", "mode": "jitter"}, {"target": "attitude", "mode": "bias", "axis": 3}]
    first = built(*entries, **KALMAN)
    again = built(*json.loads(json.dumps(first.resolved["faults"])), **KALMAN)
    assert again.resolved == first.resolved
    one, other = (jax.tree.leaves((b.closed_loop.faults, b.closed_loop.navigation)) for b in (first, again))
    assert all(map(np.array_equal, one, other)) and len(one) == len(other)


@pytest.mark.full
def test_no_faults_leave_the_loop_as_it_is():
    plain, empty = build(BASE), build(BASE | {"faults": []})
    assert plain.closed_loop.faults is None and empty.closed_loop.faults is None
    assert plain.resolved == empty.resolved and "faults" not in plain.resolved
    assert "active_faults" not in plain.closed_loop.signals()


@pytest.mark.full
def test_advice_on_a_fault_that_nobody_would_notice():
    """The report of the propellers, where the nominal model leaves it unused."""
    entry = {"target": "propeller_speed", "mode": "off"}
    says = lambda **model: [one.says for one in built(entry, plant={"vehicle": "odin"}, model=model).advice()]
    assert any("`faults[0]` has no effect" in one for one in says())
    assert not any("has no effect" in one for one in says(speed_sensor=True))


@pytest.mark.full
def test_without_faults_is_the_loop_without_them():
    several = [OFF, {"target": "dvl", "mode": "off"}, {"target": "computation", "mode": "hang"}]
    clean, unfaulted = build(BASE | KALMAN).closed_loop, built(*several, **KALMAN).without_faults().closed_loop
    assert jax.tree.structure(clean) == jax.tree.structure(unfaulted)


def test_announced_faults_are_in_the_health_of_the_measurement():
    entries = [OFF | {"onset": 0.2, "duration": 0.3, "announced": True}, {"target": "thruster 2", "mode": "off"}]
    loop = built(*entries).closed_loop

    @jax.jit
    def health(times):
        realization, x = loop.realize(jax.random.PRNGKey(0)), loop.plant.initial_state()
        truth, measuring = loop.plant.output(jnp.zeros(()), x), realization.initial_measuring(x)
        return jax.vmap(lambda t: realization.read(t, truth, measuring)[0].health)(times)

    expected = np.ones((5, 8))
    expected[2:4, 0] = 0
    np.testing.assert_array_equal(health(np.array([0.0, 0.19, 0.2, 0.49, 0.5])), expected)


@pytest.mark.full
def test_own_mode_of_a_user(tmp_path, capsys):
    path = tmp_path / "my_fault.py"
    path.write_text(OWN)
    entry = {"target": "depth", "mode": f"{path}:half", "severity": 0.25}
    loop = built(entry).closed_loop
    realization = loop.faults.realize(jax.random.PRNGKey(0))
    y = loop.plant.output(jnp.zeros(()), loop.plant.initial_state(jnp.full(6, 0.8)))
    state = loop.faults.init(realization, y, jnp.zeros(8))
    found, _ = loop.faults.measurement(realization, state, jnp.zeros(()), y)
    assert float(found.position[2]) == pytest.approx(0.2) and float(found.position[0]) == pytest.approx(0.8)
    assert run(["check", f"{path}:half"]) == 0
    capsys.readouterr()
    assert run(["check", f"{path}:careless"]) == 2
    assert "apply" in capsys.readouterr().out


OWN = '''

import jax.numpy as jnp

from undertow.physics.faults.mode import AbstractMode, Altered, Severity


class Half(AbstractMode):
    """A share of the signal."""

    targets = ("quantity", "sensor")
    severity = Severity("share", "", 0.5, 0.0, 1.0)
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(moment.severity * value, jnp.asarray(True)), memory


class Careless(Half.__base__):
    """Loses an entry of the signal."""

    targets = ("quantity",)
    severity = Severity("share", "", 0.5, 0.0, 1.0)
    delays = False

    def init(self, value):
        return ()

    def apply(self, memory, moment, value):
        return Altered(value[1:], jnp.asarray(True)), memory


def half():
    """A share of the signal."""
    return Half()


def careless():
    """Loses an entry."""
    return Careless()
'''


@pytest.mark.full
def test_list_is_machine_readable(capsys):
    assert run(["list", "faults", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert [(one["target"], one["mode"]) for one in listed] == [(one.target, one.mode) for one in list_kinds()]
    assert run(["list", "faults"]) == 0
    assert f"{len(listed)} kinds" in capsys.readouterr().out


@pytest.mark.full
def test_random_faults_follow_from_their_generator():
    loop = built(**KALMAN).closed_loop
    made = lambda seed: random_faults(np.random.default_rng(seed), loop.plant, loop.navigation, 10.0, 60)
    assert made(1) == made(1) != made(2)
    assert json.loads(json.dumps(made(1))) == made(1)
    entries = [entry for seed in range(5) for entry in made(seed)]
    assert len({(entry["target"], entry["mode"]) for entry in entries}) > 100
    assert all(0 <= entry["onset"] <= 8.0 for entry in entries)
    assert all(0.2 <= entry.get("duration", 1.0) <= 5.0 for entry in entries)
    kinds = {(kind.target, kind.mode) for kind in list_kinds() if kind.can_be_announced}
    announced = [
        "announced" in entry for entry in entries if (entry["target"].rstrip(" 12345678"), entry["mode"]) in kinds
    ]
    assert len(announced) > 40 and np.mean(announced) == pytest.approx(1 / 3, abs=0.15)


@pytest.mark.full
def test_random_faults_are_those_of_the_loop():
    loop = built(**KALMAN).closed_loop
    for entry in random_faults(np.random.default_rng(3), loop.plant, loop.navigation, 10.0, 60):
        _, (resolved,) = with_faults(loop, [Fault.model_validate(entry)], sampling_time=0.01)
        assert resolved["mode"] == entry["mode"] and resolved["onset"] == entry["onset"] < 8


WORD = some.sampled_from(
    ["thruster 1", "thruster", "bus", "plant", "depth", "dvl", "sensor 2", "off", "sag", "", "\x00", "1e5"]
)
VALUE = some.one_of(
    WORD,
    some.floats(),
    some.integers(-(10**20), 10**20),
    some.booleans(),
    some.none(),
    some.lists(some.floats(), max_size=3),
)
KEY = some.sampled_from(
    ["target", "mode", "severity", "onset", "duration", "announced", "number", "axis", "period", "x"]
)


@pytest.mark.full
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize=True)
@given(some.dictionaries(KEY, VALUE, max_size=8))
def test_any_entry_is_used_or_refused(entry):
    try:
        built(OFF | entry)
    except BadInput as error:
        assert "faults[0]" in str(error) and "\n" not in str(error)

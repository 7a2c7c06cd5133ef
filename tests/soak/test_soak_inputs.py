"""Hostile inputs repeat by their identity, and what they do is judged: accepted, refused in one line, or a never-event."""

import os
import random

import pytest

from soak import mutation, specimens
from soak.command import attacked
from soak.input_runner import try_in_process
from soak.input_soak import try_inputs
from soak.inputs import BUILD, KINDS, Attack, attack, planned
from soak.verdict import Done, failure_of
from undertow.scenario.build import build
from undertow.scenario.reading import parse

pytestmark = pytest.mark.soak

VALID = {
    "run.nc": b"\x89HDF\r\n\x1a\n" + bytes(200),
    "run.csv": b"time [s],depth [m]\r\n0,1\r\n",
    "store/zarr.json": b"{}",
}


@pytest.mark.parametrize("name", specimens.SCENARIOS)
def test_every_specimen_is_valid(name, tmp_path):
    for file, data in specimens.scenario_files(specimens.SCENARIOS[name]).items():
        (tmp_path / file).write_bytes(data)
    build(parse(specimens.SCENARIOS[name], "s.yaml", tmp_path))


@pytest.mark.parametrize(
    ("files", "words"),
    [
        ({"vehicle.yaml": specimens.VEHICLE}, ["check", "vehicle.yaml"]),
        ({"c.yaml": specimens.CAMPAIGN}, ["check", "c.yaml"]),
        ({"log.csv": specimens.LOG, "m.yaml": specimens.MAPPING}, ["logs", "log.csv", "--mapping", "m.yaml"]),
        ({"mine.py": specimens.PLUG_IN, "s.yaml": specimens.PLUGGED}, [BUILD, "s.yaml"]),
    ],
)
def test_the_other_specimens_are_valid(files, words, tmp_path):
    given = Attack("", {name: text.encode() for name, text in files.items()}, tuple(words))
    assert try_in_process(attacked, given, tmp_path).code == 0


@pytest.mark.parametrize("kind", KINDS)
def test_an_identity_gives_the_same_input_again(kind):
    first, again, other = (attack(kind, 7, number, VALID) for number in (3, 3, 4))
    assert first == again and first != other
    assert first.identity == f"inputs/{kind}/7/3"


def test_inputs_are_planned_in_the_shares_of_their_kinds():
    plan = planned(1000)
    counts = {kind: sum(one == kind for one, _ in plan) for kind in KINDS}
    whole = sum(kind.share for kind in KINDS.values())
    assert len(plan) == len(set(plan)) <= 1000
    assert all(abs(counts[name] - 1000 * kind.share / whole) <= 1 for name, kind in KINDS.items())
    assert {kind for kind, _ in plan[:120]} == set(KINDS)  # an interrupted soak has some of each


def test_changes_of_data_make_other_texts_that_a_seed_repeats():
    text = specimens.SCENARIOS["heavy"]
    made = [mutation.spoilt_yaml(text, random.Random(seed)) for seed in range(60)]
    assert made == [mutation.spoilt_yaml(text, random.Random(seed)) for seed in range(60)]
    assert len(set(made)) > 55


DONE = Done(2, "", "Error: `loop.dt` must be positive, but is -1 s (s.yaml, line 3)\n", (0.1, 0.1), ())
FILES = {"s.yaml": b""}


@pytest.mark.parametrize(
    ("event", "change"),
    [
        ("N2", {"code": None}),
        ("N2", {"code": 3}),
        ("N2", {"code": -11}),
        ("N2", {"err": "Traceback (most recent call last):\n  ...\nError: `a` must be b\n"}),
        ("N3", {"code": 0, "seconds": (30.0, 40.0)}),
        ("N3", {"seconds": (1.5, 1.5)}),
        ("message", {"err": ""}),
        ("message", {"err": "Error: `a` must be b\nError: `c` must be d\n"}),
        ("message", {"err": "Error: `a` must be b\nmore\n"}),
        ("message", {"err": "Error: something went wrong\n"}),
        ("message", {"err": "Error: `a` must be \x1b[31mred\n"}),
        ("message", {"err": f"Error: `a` must be {'b' * 3000}\n"}),
        ("message", {"code": 0}),
        ("partial", {"left": ["out/run.nc"]}),
    ],
)
def test_what_must_never_happen_is_found(event, change):
    failure = failure_of("inputs/scenario/1/2", ["check", "s.yaml"], FILES, DONE._replace(**change))
    assert failure is not None and failure.event == event and failure.identity == "inputs/scenario/1/2"


@pytest.mark.parametrize(
    "done",
    [
        DONE,
        DONE._replace(err="Advice: a sentence\n" + DONE.err),
        DONE._replace(code=4, err="Error: files could not be read or written: s.yaml\n"),
        DONE._replace(code=4, err=f"Error: files could not be read or written: too long ({'b' * 150}...\n"),
        DONE._replace(err="Error: No such option: --x. See `undertow check --help`\n"),
        DONE._replace(code=0, err="", left=["out/run.nc"], seconds=(5.0, 5.0)),
        DONE._replace(err="", out="s.yaml: 1 error, 0 pieces of advice\n"),
    ],
)
def test_what_may_happen_is_no_failure(done):
    assert failure_of("", ["check", "s.yaml", "b" * 3000], FILES, done) is None


def test_hostile_inputs_of_every_kind_are_refused_or_accepted(tmp_path):
    """A few of each kind in this process; `python -m soak` tries thousands."""
    for kind in KINDS:
        for number in range(4):
            given = attack(kind, 1, number, VALID)
            done = try_in_process(attacked, given, tmp_path)
            failure = failure_of(given.identity, given.arguments, given.files, done._replace(seconds=(0.0, 0.0)))
            assert failure is None, (failure, done.err)
            assert not list(tmp_path.iterdir())


DEADLY = ("check", "c.yaml")
asked_before = []


def dying(arguments):
    """A command line whose process ends; the first time it is only warmed up."""
    if arguments == DEADLY and asked_before:
        os._exit(7)
    asked_before.extend([arguments] * (arguments == DEADLY))
    return 0


def test_a_process_that_dies_is_counted_and_replaced(tmp_path):
    """A campaign kills its process; the other inputs are tried by the next one."""
    asked = [attack(kind, 3, number, VALID) for kind, number in planned(16)]
    tried = try_inputs(dying, 16, 3, VALID, tmp_path, workers=1)
    deaths = [failure for failure, _ in tried.failures]
    killing = {one.identity for one in asked if one.arguments == DEADLY}
    assert {one.identity for one in deaths if one.event == "N2"} == killing and killing
    assert tried.number == len(asked)

"""Hostile inputs by kind: the files and the command line of each, from a seed and a number."""

import random
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

from soak import specimens
from soak.mutation import spoilt_bytes, spoilt_text, spoilt_words, spoilt_yaml
from soak.plug_ins import plug_in

# First word of a command line that reads, validates and builds a scenario without checking its parts: ten times as
# fast as `check`.
BUILD = "build"


class Attack(NamedTuple):
    """One hostile input.

    Attributes:
        identity: what repeats it: `inputs/KIND/SEED/NUMBER`.
        files: what stands in the current folder, by name; None for a folder.
        arguments: of `undertow`.
    """

    identity: str
    files: Mapping[str, bytes | None]
    arguments: tuple[str, ...]


Make = Callable[[random.Random, Mapping[str, bytes]], tuple[dict[str, bytes | None], list[str]]]


class InputKind(NamedTuple):
    """A kind of hostile input: its share, and what makes one from chance and the valid files of `sample_files.py`."""

    share: float
    make: Make


def attack(kind: str, seed: int, number: int, material: Mapping[str, bytes]) -> Attack:
    """The hostile input of a number.

    Args:
        kind: a key of `KINDS`.
        seed: of the whole soak.
        number: of the input within its kind.
        material: valid binary files, by name.
    """
    identity = f"inputs/{kind}/{seed}/{number}"
    files, arguments = KINDS[kind].make(random.Random(identity), material)
    return Attack(identity, files, tuple(arguments))


def planned(number: int) -> list[tuple[str, int]]:
    """Kind and number of each of so many inputs, kinds mixed so that an interrupted soak has some of each."""
    total_share = sum(kind.share for kind in KINDS.values())
    ordered = []
    for name, kind in KINDS.items():
        count = max(1, round(number * kind.share / total_share))
        ordered += [((i + 0.5) / count, name, i) for i in range(count)]
    return [(name, i) for _, name, i in sorted(ordered)][:number]


def _encoded(text: str) -> bytes:
    return text.encode("utf-8", "surrogatepass")


def _scenario(chance: random.Random, material: Mapping[str, bytes]) -> tuple[dict[str, bytes | None], list[str]]:
    text = chance.choice(list(specimens.SCENARIOS.values()))
    files = specimens.scenario_files(spoilt_yaml(text, chance))
    return {**files}, [BUILD if chance.random() < 0.9 else "check", "s.yaml"]


def _campaign(chance: random.Random, material: Mapping[str, bytes]) -> tuple[dict[str, bytes | None], list[str]]:
    return {"c.yaml": _encoded(spoilt_yaml(specimens.CAMPAIGN, chance))}, ["check", "c.yaml"]


def _vehicle(chance: random.Random, material: Mapping[str, bytes]) -> tuple[dict[str, bytes | None], list[str]]:
    return {"vehicle.yaml": _encoded(spoilt_yaml(specimens.VEHICLE, chance))}, ["check", "vehicle.yaml"]


def _table(chance: random.Random, material: Mapping[str, bytes]) -> tuple[dict[str, bytes | None], list[str]]:
    valid_table = _encoded(specimens.TABLE)
    table = (
        spoilt_bytes(valid_table, chance) if chance.random() < 0.5 else _encoded(spoilt_text(specimens.TABLE, chance))
    )
    files = specimens.scenario_files(specimens.SCENARIOS["recorded"])
    return {**files, "d.csv": table}, [BUILD, "s.yaml"]


def _mapping(chance: random.Random, material: Mapping[str, bytes]) -> tuple[dict[str, bytes | None], list[str]]:
    mapping, log = specimens.MAPPING, specimens.LOG
    if chance.random() < 0.6:
        mapping = spoilt_yaml(mapping, chance)
    else:
        log = spoilt_text(log, chance)
    out = ["--out", chance.choice(("x.csv", "x.mcap"))] if chance.random() < 0.2 else []
    return {"log.csv": _encoded(log), "m.yaml": _encoded(mapping)}, ["logs", "log.csv", "--mapping", "m.yaml", *out]


def _log(chance: random.Random, material: Mapping[str, bytes]) -> tuple[dict[str, bytes | None], list[str]]:
    names = [name for name in material if not name.startswith("store/")]
    name = chance.choice(names)
    if name.startswith("bag/"):
        bag = {file_name: data for file_name, data in material.items() if file_name.startswith("bag/")}
        return {**bag, name: spoilt_bytes(material[name], chance), "bag": None}, ["logs", "bag"]
    suffix = (
        Path(name).suffix
        if chance.random() < 0.95
        else chance.choice((".mcap", ".ulg", ".bin", ".db3", ".csv", ".bag"))
    )
    log_name = f"log{suffix}"
    out = ["--out", chance.choice(("x.csv", "x.mcap"))] if chance.random() < 0.2 else []
    return {log_name: spoilt_bytes(material[name], chance)}, ["logs", log_name, *out]


def _result(chance: random.Random, material: Mapping[str, bytes]) -> tuple[dict[str, bytes | None], list[str]]:
    return {"run.nc": spoilt_bytes(material["run.nc"], chance)}, [BUILD, "run.nc"]


# Valid command lines that end soon; with a word spoilt they mostly say so.
LINES = (
    ("check", "s.yaml", "--option", "mass=3"),
    ("check", "odin", "--option", "mass=130", "--option", "r_g=[0,0,0.1]"),
    ("check", "t200", "--option", "supply=16"),
    ("describe", "rcaf"),
    ("describe", "scenario", "--json-schema"),
    ("describe", "metrics"),
    ("list", "thrusters"),
    ("version",),
    ("logs", "log.csv", "--mapping", "m.yaml", "--out", "x.csv", "--overwrite"),
    ("logs", "layout", "--out", "layout.json"),
    ("init", "new", "--vehicle", "odin", "--own-controller"),
    ("campaign", "status", "folder"),
    ("export", "s.yaml", "--c99", "folder", "--part", "wrong", "--precision", "float32"),
    ("simulate", "missing.yaml", "--out", "folder", "--no-prediction", "--pdf", "wide"),
    ("campaign", "missing.yaml", "--workers", "2", "--resume", "--out", "folder"),
    ("compare", "missing.yaml", "--controllers", "robust,pid", "--trials", "2"),
    ("tune", "missing.yaml", "--method", "search", "--budget", "1"),
    ("analyze", "folder", "--out", "x"),
    ("export", "missing.yaml", "--fmu", "x", "--attitude", "euler", "--velocity", "body"),
)


def _command(chance: random.Random, material: Mapping[str, bytes]) -> tuple[dict[str, bytes | None], list[str]]:
    words = spoilt_words(list(chance.choice(LINES)), chance)
    files: dict[str, bytes | None] = {**specimens.scenario_files(specimens.SCENARIOS["axis"]), "folder": None}
    return files | {"log.csv": _encoded(specimens.LOG), "m.yaml": _encoded(specimens.MAPPING)}, words


def _plug_in(chance: random.Random, material: Mapping[str, bytes]) -> tuple[dict[str, bytes | None], list[str]]:
    code = plug_in(chance)
    words = chance.choice((["check", "s.yaml"], ["check", "./mine.py:law"], [BUILD, "s.yaml"]))
    return {"mine.py": _encoded(code), "s.yaml": _encoded(specimens.PLUGGED)}, words


def _store(chance: random.Random, material: Mapping[str, bytes]) -> tuple[dict[str, bytes | None], list[str]]:
    store: dict[str, bytes | None] = {
        f"out/{name.removeprefix('store/')}": data for name, data in material.items() if name.startswith("store/")
    }
    for _ in range(chance.choice((1, 1, 2, 5))):
        name = chance.choice(sorted(store))
        sample = chance.random()
        if sample < 0.5:
            store[name] = spoilt_bytes(store[name] or b"", chance)
        elif sample < 0.75 and len(store) > 1:
            del store[name]
        elif sample < 0.9:
            store[chance.choice(sorted(store))] = store[name]
        else:
            store[name + chance.choice((".partial", ".x", "2"))] = chance.randbytes(40)
    resumed = ["campaign", "c.yaml", "--out", "out", "--resume", "--workers", "1"]
    words = resumed if chance.random() < 0.3 else ["campaign", "status", "out"]
    return {**store, "c.yaml": _encoded(specimens.CAMPAIGN)}, words


KINDS: dict[str, InputKind] = {
    "scenario": InputKind(0.46, _scenario),
    "campaign": InputKind(0.10, _campaign),
    "vehicle": InputKind(0.10, _vehicle),
    "table": InputKind(0.06, _table),
    "mapping": InputKind(0.08, _mapping),
    "log": InputKind(0.08, _log),
    "result": InputKind(0.02, _result),
    "command": InputKind(0.05, _command),
    "plug_in": InputKind(0.02, _plug_in),
    "store": InputKind(0.01, _store),
}

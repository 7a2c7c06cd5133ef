"""Scenarios and campaigns that somebody got wrong: changes of the shipped examples, in their data and in their text."""

import copy
import random
from pathlib import Path

from ruamel.yaml import YAML

from undertow.scenario.reading import dump

EXAMPLES = Path(__file__).parents[2] / "examples"
SCENARIOS = [path for path in sorted(EXAMPLES.glob("*.yaml")) if path.stem != "my_rov"]
QUICK = [path for path in SCENARIOS if path.stem in ("inverted_pendulum", "magnetic_levitation", "two_link_arm")]

_NUMBERS = (0, 1, -1, 2, 0.5, -0.5, 1e-300, 5e-324, 1e-30, 1e-9, 1e12, 1e30, -1e30, 1e154, 1e200, -1e200, 1.7e308)
_ODD = (float("nan"), float("inf"), -float("inf"), 10**18, 10**30, -(10**30), 2**63, True, False, None)
_WORDS = ("", "x", "nan", "inf", "1e3", "odin", "rcaf", "none", "kind", "./no.py:f", "no.yaml", "no.csv", "2001-01-01")
_WORDS += ("\u00e9\u4e16", "a\nb", " ", "../..", "\u202e", "{}", "simd", "xla", "euler", "adaptive", "robust")
_KEYS = (
    "kind",
    "position",
    "velocity",
    "seed",
    "file",
    "samples",
    "fidelity",
    "mass",
    "preset",
    "loop",
    "dt",
    "x",
    "",
    "0",
)

# Sections that most scenarios leave out, so that changes meet them as well.
_EXTRA = {
    "initial": {"position": [0.1], "velocity": [0.0]},
    "steady": {"start": 0.01, "stop": 0.02, "every_step": True},
    "navigation": {"kind": "white_noise", "position": 0.01, "velocity": 0.01},
    "seed": 3,
    "model": {"speed_sensor": False},
}


def short(data):
    """The same scenario, for some hundredths of a second."""
    sampled = data.get("loop", {}).get("kind", "sampled") == "sampled"
    times = {"duration": 0.04, "dt": 1e-2, "record": 1e-2} if sampled else {"duration": 0.04, "dt": 1e-3}
    return data | {"loop": data.get("loop", {}) | times}


def scenario(chance: random.Random, examples=SCENARIOS) -> str:
    """Text of a scenario with one to three changes."""
    data = short(YAML(typ="safe", pure=True).load(chance.choice(examples).read_text()))
    for key in chance.sample(sorted(_EXTRA), chance.choice((0, 0, 1, 2))):
        data.setdefault(key, copy.deepcopy(_EXTRA[key]))
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        _change(data, chance)
    return _spoilt(dump(_bounded(data)), chance)


def campaign(chance: random.Random, examples=SCENARIOS) -> str:
    """Text of a campaign with one or two changes, of itself or of its scenario."""
    data = {
        "scenario": short(YAML(typ="safe", pure=True).load(chance.choice(examples).read_text())),
        "trials": 2,
        "vary": {"loop.dt": {"choice": [0.01, 0.005]}},
        "cross": {"loop.method": ["rk4", "euler"]},
        "requirements": {"position_rms": {"below": 0.1, "share": 0.5}},
        "series": {"signals": ["position"], "every": 0.01},
        "seed": 1,
        "chunk": 2,
    }
    for key in chance.sample(["vary", "cross", "requirements", "series"], chance.choice((0, 2, 3))):
        del data[key]
    for _ in range(chance.choice((1, 1, 2))):
        _change(data, chance)
    for key, most in (("trials", 4), ("chunk", 10)):
        if isinstance(data.get(key), int) and 0 < data[key] < 10**10:
            data[key] = min(data[key], most)
    if isinstance(data.get("scenario"), dict):
        _bounded(data["scenario"])
    return _spoilt(dump(data), chance)


def _bounded(data):
    """No change makes a run that takes long: times that would are put back, those that must be refused are not."""
    loop = data.get("loop")
    if isinstance(loop, dict) and isinstance(loop.get("duration"), int | float) and 0.1 < loop["duration"] <= 1e6:
        loop["duration"] = 0.04
    if isinstance(loop, dict) and isinstance(loop.get("dt"), int | float) and 1e-12 < loop["dt"] < 1e-4:
        loop["dt"] = 1e-3
    return data


def _change(data, chance):
    """One value replaced, taken away, doubled, moved or added, anywhere."""
    places = list(_places(data))
    *above, last = chance.choice(places)
    node = data
    for key in above:
        node = node[key]
    how = chance.random()
    if how < 0.62:
        node[last] = _value(chance, node[last])
    elif how < 0.72:
        del node[last]
    elif isinstance(node, list):
        node.insert(last, copy.deepcopy(node[last]) if how < 0.86 else _value(chance, None))
    elif how < 0.82:
        node[chance.choice(_KEYS)] = node.pop(last)
    elif how < 0.92:
        node[chance.choice(_KEYS)] = _value(chance, None)
    else:
        *others, key = chance.choice(places)
        other = data
        for step in others:
            other = other[step] if isinstance(other, dict | list) else other
        node[last] = copy.deepcopy(other[key]) if isinstance(other, dict | list) else None


def _value(chance, before):
    how = chance.random()
    if how < 0.4:
        return chance.choice(_NUMBERS)
    if how < 0.5:
        return chance.choice(_ODD)
    if how < 0.65:
        return chance.choice(_WORDS)
    if how < 0.75 and isinstance(before, int | float):
        return before * chance.choice((-1, 1e-6, 1e6, 1e30))
    if how < 0.85:
        return [chance.choice(_NUMBERS)] * chance.choice((0, 1, 2, 3, 6, 7, 40))
    if how < 0.9:
        return [[chance.choice((*_NUMBERS, *_ODD))] * chance.choice((1, 3, 7))] * chance.choice((1, 2, 6))
    if how < 0.95:
        return {chance.choice(_KEYS): chance.choice((*_NUMBERS, *_ODD, *_WORDS))}
    nested = chance.choice(_NUMBERS)
    for _ in range(chance.choice((1, 3, 30))):
        nested = {"a": nested} if chance.random() < 0.5 else [nested]
    return nested


def _places(node, path=()):
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in items:
        yield (*path, key)
        yield from _places(value, (*path, key))


_JUNK = (
    "\ufeff",
    "\x00",
    "\x07",
    "\t",
    "!!set ",
    "!!omap ",
    "!x ",
    "&a ",
    "*a",
    "<<: ",
    "? ",
    "- ",
    "{",
    "]",
    "|",
    "'",
    '"',
)
_JUNK += (
    "---\n",
    "...\n",
    "%YAML 9.9\n",
    "[" * 60,
    "#",
    ": ",
    "\u2028",
    "\\",
    "0x",
    "1_0",
    "~",
    "!!binary x",
    "&a [*a]",
)


def _spoilt(text: str, chance: random.Random) -> str:
    """The same text, now and then with a slip of the keyboard or of the disk."""
    how = chance.random()
    at = chance.randrange(len(text) + 1)
    if how < 0.75:
        return text
    if how < 0.9:
        return text[:at] + chance.choice(_JUNK) + text[at:]
    if how < 0.95:
        return text[:at]
    lines = text.splitlines(keepends=True)
    lines.insert(chance.randrange(len(lines) + 1), chance.choice(lines))
    return "".join(lines)

"""Changes that somebody's keyboard, program or disk makes of a valid file: of its data, of its text, of its bytes.

Every function takes its chance from a `random.Random`, so that a seed repeats an input.

The tests of undertow use hypothesis; here it does not fit. An input is tried in a process that may run out of memory or
be killed, which ends hypothesis with it. Its identity has to repeat it months later, but the examples of hypothesis
change with its version. And it would replace the calls of `chance` only: what there is to read are the changes.
"""

import copy
import random
from collections.abc import Iterator
from typing import Any

from undertow.scenario.reading import dump
from undertow.scenario.yaml_text import load

Path_ = tuple[Any, ...]

_NUMBERS: tuple[Any, ...] = (0, 1, -1, 2, 0.5, -0.5, 3, 7, 5e-324, 1e-300, 1e-30, 1e-9, 1e12, 1e30, -1e30, 1e154, 1e200)
_NUMBERS += (-1e200, 1.7e308, 2**31, 2**63, 10**18, 10**30, -(10**30))
_ODD: tuple[Any, ...] = (float("nan"), float("inf"), -float("inf"), True, False, None)
_UNITS = ("16 V", "0.01 s", "10ms", "3 m", "45 deg", "1,5", "1e3 N", "50%", "1_000", "0x10", "1e", "12:30", ".5.", "~")
_WORDS = (
    "",
    "x",
    "nan",
    ".inf",
    "1e3",
    "odin",
    "rcaf",
    "none",
    "kind",
    "./no.py:f",
    "no.yaml",
    "no.csv",
    "s.yaml",
    ".",
)
_WORDS += (
    "2001-01-01",
    "\u00e9\u4e16\U0001f30a",
    "a\nb",
    " ",
    "../..",
    "\u202e",
    "{}",
    "simd",
    "xla",
    "euler",
    "robust",
)
_WORDS += ("a" * 3000, "\x85", "\u2028", "/", "~", "%s", "{0}", "$HOME", "d.csv:f", "mine.py:", ":", ".py:", "d.csv")
_KEYS = ("kind", "position", "velocity", "seed", "file", "samples", "fidelity", "mass", "preset", "loop", "dt", "x", "")
_KEYS += ("0", "vary", "trials", "scenario", "k" * 2000, "\u00e9", "a b", "__class__", "self", "model", "plant.kind")

_JUNK = (
    "\ufeff",
    "\x00",
    "\x07",
    "\t",
    "\r",
    "\u2028",
    "\x85",
    "&a ",
    "*a",
    "!!python/object ",
    "!x ",
    "[",
    "]",
    "{",
    "}",
)
_JUNK += (
    ": ",
    "- ",
    "#",
    "'",
    '"',
    "|",
    ">",
    "%YAML 9\n",
    "---\n",
    "...\n",
    "<<: ",
    "? ",
    "\ud800",
    "\\",
    "`",
    "@",
    ",",
)

_BOMBS = (
    "a: &a [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n"
    + "".join(f"{b}: &{b} [{', '.join([f'*{a}'] * 10)}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)),
    "seed: &s [*s]\n",
    "plant: " + "[" * 3000 + "\n",
    "plant: " + "{a: " * 3000 + "\n",
    "seed: " + "9" * 6000 + "\n",
    "loop: {<<: 3}\n",
    "<<: [1, {a: 2}]\n",
    "plant: !!binary aGVsbG8=\n",
    "? [a, b]\n: 3\n",
)


def spoilt_yaml(text: str, chance: random.Random) -> str:
    """YAML text with one to three changes of its data, or of its characters."""
    if chance.random() < 0.6:
        data = load(text, "", "")[0]
        for _ in range(chance.choice((1, 1, 1, 2, 3))):
            change(data, chance)
        try:
            text = dump(data)
        except (UnicodeEncodeError, TypeError, ValueError):  # what no YAML file can hold
            return spoilt_text(text, chance)
        return text if chance.random() < 0.8 else spoilt_text(text, chance)
    return spoilt_text(text, chance)


def change(data: Any, chance: random.Random) -> None:
    """Replace, remove, misspell, double, move or add one value, anywhere in a tree of mappings and lists."""
    places = list(_places(data))
    if not places:
        return
    *above, last = chance.choice(places)
    node = data
    for key in above:
        node = node[key]
    sample = chance.random()
    if sample < 0.5:
        node[last] = _value(chance, node[last])
    elif sample < 0.6:
        del node[last]
    elif isinstance(node, list):
        node.insert(last, copy.deepcopy(node[last]) if sample < 0.8 else _value(chance, None))
    elif sample < 0.72:
        node[_misspelt(str(last), chance)] = node.pop(last)
    elif sample < 0.78:
        node[chance.choice(_KEYS)] = node.pop(last)
    elif sample < 0.88:
        node[chance.choice(_KEYS)] = _value(chance, None)
    else:  # the value of another place
        *path, key = chance.choice(places)
        source = data
        for step in path:
            source = source[step]
        node[last] = copy.deepcopy(source[key]) if key in source or isinstance(source, list) else None


def _places(node: Any, path: Path_ = ()) -> Iterator[Path_]:
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    for key, value in items:
        yield (*path, key)
        yield from _places(value, (*path, key))


def _misspelt(word: str, chance: random.Random) -> str:
    position = chance.randrange(len(word) + 1)
    left = word[:position]
    right = word[position:]
    swapped = left[:-1] + right[:1] + left[-1:] + right[1:]
    return chance.choice(
        (left + right[1:], left + "e" + right, swapped, word.upper(), word + " ", word.replace("_", ""))
    )


def _value(chance: random.Random, before: Any) -> Any:
    sample = chance.random()
    if sample < 0.3:
        return chance.choice(_NUMBERS)
    if sample < 0.42:
        return chance.choice(_ODD)
    if sample < 0.5:
        return chance.choice(_UNITS)
    if sample < 0.62:
        return chance.choice(_WORDS)
    if sample < 0.75 and isinstance(before, int | float):
        return before * chance.choice((-1, 1e-6, 1e6, 1e30, 2, 0.5))
    if sample < 0.85:
        return [chance.choice(_NUMBERS)] * chance.choice((0, 1, 2, 3, 6, 7, 40))
    if sample < 0.9:
        return [[chance.choice((*_NUMBERS, *_ODD))] * chance.choice((1, 3, 7))] * chance.choice((1, 2, 6))
    if sample < 0.95:
        return {chance.choice(_KEYS): chance.choice((*_NUMBERS, *_ODD, *_WORDS))}
    nested = chance.choice(_NUMBERS)
    for _ in range(chance.choice((1, 3, 30))):
        nested = {"a": nested} if chance.random() < 0.5 else [nested]
    return nested


def spoilt_text(text: str, chance: random.Random) -> str:
    """Text with a slip of the keyboard or of an editor: of a few characters, of a line, of all."""
    lines = text.splitlines(keepends=True)
    position, line = chance.randrange(len(text) + 1), chance.randrange(len(lines))
    sample = chance.random()
    if sample < 0.3:
        return text[:position] + chance.choice(_JUNK) + text[position:]
    if sample < 0.4:
        return text[:position] + text[position + chance.choice((1, 1, 2, 5, 40)) :]
    if sample < 0.48:
        return text[:position]
    if sample < 0.56:
        lines.insert(chance.randrange(len(lines) + 1), lines[line])
    elif sample < 0.62:
        del lines[line]
    elif sample < 0.72:
        lines[line] = chance.choice((" ", "    ", "\t")) + lines[line]
    elif sample < 0.78:
        lines[line] = lines[line].lstrip()
    elif sample < 0.84:
        return text[:position] + chance.choice((*map(str, _NUMBERS), *_UNITS, *_WORDS)) + text[position:]
    elif sample < 0.88:
        return chance.choice(_BOMBS) if chance.random() < 0.5 else text + chance.choice(_BOMBS)
    elif sample < 0.92:
        return "\ufeff" + text if chance.random() < 0.5 else text.replace("\n", "\r\n")
    elif sample < 0.95:
        return chance.choice(("", "\n", "~", "[]", "{}", "3", "a", "- a", "#", "---", "a: b: c", "null", "\0"))
    else:
        return text[:position] + "".join(chance.choice(_JUNK) for _ in range(chance.choice((3, 30)))) + text[position:]
    return "".join(lines)


def spoilt_bytes(data: bytes, chance: random.Random) -> bytes:
    """Bytes with what a disk, a cable or another program does to them."""
    if not data:
        return data
    spoilt = bytearray(data)
    sample = chance.random()
    position = chance.randrange(len(data))
    if sample < 0.4:
        for _ in range(chance.choice((1, 1, 2, 8, 60))):
            spoilt[chance.randrange(len(spoilt))] ^= 1 << chance.randrange(8)
    elif sample < 0.6:
        del spoilt[position:]
    elif sample < 0.7:
        del spoilt[position : position + chance.choice((1, 4, 100, 4096))]
    elif sample < 0.8:
        spoilt[position:position] = chance.randbytes(chance.choice((1, 4, 100)))
    elif sample < 0.9:
        long = chance.choice((1, 4, 8, 512))
        spoilt[position : position + long] = chance.choice((bytes(long), b"\xff" * long, chance.randbytes(long)))
    elif sample < 0.95:
        spoilt[position:position] = spoilt[position : position + 512]
    else:
        return chance.choice(
            (b"", bytes(64), bytes(range(256)), b"\x89PNG\r\n\x1a\n" + bytes(40), b"PK\x03\x04", data * 2)
        )
    return bytes(spoilt)


def spoilt_words(words: list[str], chance: random.Random) -> list[str]:
    """A command line with a word misspelt, removed, doubled, replaced or added."""
    spoilt = list(words)
    for _ in range(chance.choice((1, 1, 2))):
        position = chance.randrange(len(spoilt) + 1)
        sample = chance.random()
        inside = min(position, len(spoilt) - 1)
        if sample < 0.3 and spoilt:
            spoilt[inside] = _misspelt(spoilt[inside], chance)
        elif sample < 0.45 and spoilt:
            del spoilt[inside]
        elif sample < 0.55 and spoilt:
            spoilt.insert(position, spoilt[inside])
        elif sample < 0.8 and spoilt:
            spoilt[inside] = str(chance.choice((*_NUMBERS, *_UNITS, *_WORDS)))
        else:
            spoilt.insert(
                position, chance.choice(("--", "-", "--x", "-v", "--out=", "-o", *_WORDS, *map(str, _NUMBERS)))
            )
    return [word.replace("\0", "") for word in spoilt]  # no command line can hold one

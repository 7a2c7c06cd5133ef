"""The text of a temporal requirement.

    formula    = conjunction { "or" conjunction }
    conjunction = bounded { "and" bounded }
    bounded    = unary [ "until" [interval] unary ]
    unary      = "not" unary | "always" [interval] unary | "never" [interval] unary | "eventually" [interval] unary
               | "within" number "s" unary | "(" formula ")" | value ("<" | ">") number ["deg"]
    interval   = "[" number "," (number | "end") "]"
    value      = "mean" "(" entries "," number "s" ")" | entries
    entries    = ("abs" | "norm" | "largest" | "mean") "(" signal ")" | signal
    signal     = name [ "[" (number | name) "]" ]

`within 10 s always ...` reads as it stands: within 10 s, and then always.
"""

import re
from collections.abc import Mapping, Sequence
from math import radians
from typing import NamedTuple

from undertow.analysis.temporal.formula import (
    REDUCTIONS,
    Always,
    Below,
    Both,
    Formula,
    Interval,
    Not,
    Until,
    Value,
    either,
    eventually,
)
from undertow.core.errors import BadInput, did_you_mean

_DEEPEST = 40  # formulas inside one another

_TOKENS = re.compile(r"\s*([A-Za-z_]\w*|[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[<>()\[\],])")
_WORDS = ("always", "never", "eventually", "within", "until", "not", "and", "or")
_GROUPS = {"position_error": "m", "attitude_error": "rad"}


class Entries(NamedTuple):
    """Entries of a recorded signal: their names, () for a signal that is a number."""

    names: tuple[str, ...]


class FormulaNames(NamedTuple):
    """What a formula may name.

    Attributes:
        signals: name -> its entries; only signals that are numbers or lists of numbers.
        units: of the outputs, which are the entries of `error`.
    """

    signals: Mapping[str, Entries]
    units: Sequence[str]

    def words(self) -> tuple[str, ...]:
        """Names of all signals."""
        return (*(name for name, unit in _GROUPS.items() if unit in self.units), *self.signals)


def parse_formula(text: str, names: FormulaNames) -> Formula:
    """A formula from its text.

    Raises:
        BadInput: the text is no formula, or it names what is no signal; without a name, which `error_location` adds.
    """
    reader = _Reader(text, names)
    formula = reader.formula()
    if reader.left:
        raise reader.wrong("end, or go on with `and`, `or` or `until`")
    return formula


class _Reader:
    """Reads a text from the left."""

    def __init__(self, text: str, names: FormulaNames):
        self._names, self._text, self._at, self._depth = names, text, 0, 0
        self._tokens: list[tuple[str, int]] = []
        at = 0
        while text[at:].strip():
            match = _TOKENS.match(text, at)
            if match is None:
                raise BadInput("", "be a formula such as `within 10 s always position_error < 0.1`", repr(text))
            self._tokens.append((match[1], match.end()))
            at = match.end()

    @property
    def left(self) -> bool:
        """Whether the text goes on."""
        return self._at < len(self._tokens)

    def wrong(self, must: str) -> BadInput:
        """The error where the reader is."""
        before = self._text[: self._tokens[self._at - 1][1]].strip() if self._at else ""
        location = f"after `{before}`" if before else "at the beginning"
        got = repr(self._tokens[self._at][0]) if self.left else "the end"
        return BadInput("", f"{must}, {location}", got)

    def _next_is(self, *words: str) -> str:
        """The next word if it is one of these, which is then read; else ""."""
        if self.left and self._tokens[self._at][0] in words:
            self._at += 1
            return self._tokens[self._at - 1][0]
        return ""

    def _need(self, word: str) -> None:
        if not self._next_is(word):
            raise self.wrong(f"have `{word}`")

    def formula(self) -> Formula:
        formula = self._conjunction()
        while self._next_is("or"):
            formula = either(formula, self._conjunction())
        return formula

    def _conjunction(self) -> Formula:
        formula = self._bounded()
        while self._next_is("and"):
            formula = Both(formula, self._bounded())
        return formula

    def _bounded(self) -> Formula:
        formula = self._unary()
        if self._next_is("until"):
            interval = self._interval()
            return Until(formula, self._unary(), interval)
        return formula

    def _unary(self) -> Formula:
        self._depth += 1
        if self._depth > _DEEPEST:
            raise BadInput("", f"have at most {_DEEPEST} formulas inside one another", "more deeply nested")
        formula = self._inner()
        self._depth -= 1
        return formula

    def _inner(self) -> Formula:
        word = self._next_is("not", "always", "never", "eventually", "within", "(")
        if word == "not":
            return Not(self._unary())
        if word == "within":
            latest = self._seconds()
            return eventually(self._unary(), Interval(0.0, latest))
        if word == "(":
            formula = self.formula()
            self._need(")")
            return formula
        if word:
            interval = self._interval()
            inner = self._unary()
            if word == "eventually":
                return eventually(inner, interval)
            return Always(Not(inner) if word == "never" else inner, interval)
        return self._comparison()

    def _interval(self) -> Interval:
        if not self._next_is("["):
            return Interval()
        start = self._number()
        self._need(",")
        stop = float("inf") if self._next_is("end") else self._number()
        self._need("]")
        if not 0 <= start <= stop:
            raise BadInput("", "have intervals [start, stop] with 0 <= start <= stop", f"[{start:g}, {stop:g}]")
        return Interval(start, stop)

    def _number(self) -> float:
        try:
            number = float(self._tokens[self._at][0]) if self.left else None
        except ValueError:
            number = None
        if number is None:
            raise self.wrong("have a number")
        self._at += 1
        return number

    def _seconds(self) -> float:
        seconds = self._number()
        self._need("s")
        if not seconds > 0:
            raise BadInput("", "have positive times", f"{seconds:g} s")
        return seconds

    def _comparison(self) -> Formula:
        value = self._value()
        sign = self._next_is("<", ">")
        if not sign:
            raise self.wrong("compare a value with a number by `<` or `>`")
        limit = self._number()
        limit = radians(limit) if self._next_is("deg") else limit
        return Below(value, limit, 1.0 if sign == "<" else -1.0)

    def _value(self) -> Value:
        function = self._next_is("abs", *REDUCTIONS)
        if not function:
            return self._of_signal("", *self._signal())
        self._need("(")
        inner = self._next_is("abs", *REDUCTIONS) if function == "mean" else ""
        if inner:
            self._need("(")
            value = self._of_signal(inner, *self._signal())
            self._need(")")
        else:
            name, entries = self._signal()
            averaged = function == "mean" and self._upcoming() == ","
            value = self._of_signal("" if averaged else function, name, entries)
        if function == "mean" and (inner or self._upcoming() == ","):
            self._need(",")
            value = value.averaged(self._seconds())
        self._need(")")
        return value

    def _upcoming(self) -> str:
        return self._tokens[self._at][0] if self.left else ""

    def _signal(self) -> tuple[str, str | None]:
        """Name of a signal, and the entry in brackets."""
        name = self._upcoming()
        if not re.match(r"[A-Za-z_]", name) or name in _WORDS:
            raise self.wrong("name a signal")
        self._at += 1
        if name not in self._names.words():
            hint = did_you_mean(name, self._names.words())
            raise BadInput("", "name signals of the run", f"`{name}`", hint=hint)
        if not self._next_is("["):
            return name, None
        entry = self._upcoming()
        if not entry or entry == "]":
            raise self.wrong("name an entry")
        self._at += 1
        self._need("]")
        return name, entry

    def _of_signal(self, function: str, name: str, entry: str | None) -> Value:
        if name in _GROUPS and name not in self._names.signals:
            entries = tuple(i for i, unit in enumerate(self._names.units) if unit == _GROUPS[name])
            if entry is not None or function:
                raise BadInput("", f"use `{name}` by itself, because it is a number", f"`{name}` with more")
            return Value("error", entries, "norm")
        names = self._names.signals[name].names
        indices = None if entry is None else self._place(name, names, entry)
        if function in REDUCTIONS:
            if indices is not None or not names:
                raise BadInput("", f"use `{function}` for a signal with several entries", f"`{name}`")
            return Value(name, None, function)
        if names and indices is None:
            if len(names) > 1:
                hint = f"Its entries are {', '.join(names)}: write `{name}[{names[0]}]`, or `norm({name})`"
                raise BadInput("", "compare a number", f"`{name}`, which has {len(names)} entries", hint=hint)
            indices = (0,)
        return Value(name, indices, absolute=function == "abs")

    def _place(self, name: str, names: Sequence[str], entry: str) -> tuple[int]:
        if entry in names:
            return (names.index(entry),)
        if entry.isdigit() and int(entry) < len(names):
            return (int(entry),)
        hint = f"Its entries are {', '.join(names)}, or 0 to {len(names) - 1}" if names else "It is a number"
        raise BadInput("", f"name an entry of `{name}`", repr(entry), hint=hint)

"""What is said of values that a method returns in another form than its contract has."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from undertow.core.errors import BadInput
from undertow.core.return_checks import check_command, check_state, difference, form, not_two
from undertow.core.signals import Signal, check_declared
from undertow.physics.faults.mode import NO_SEVERITY, AbstractMode, Altered, Moment, apply_mode


class Law:
    """A law that answers anything."""

    def command(self):
        pass

    def advance(self):
        pass


@pytest.mark.parametrize(
    ("value", "says"),
    [
        (None, "nothing"),
        (jnp.zeros((2, 3)), "an array of shape (2, 3)"),
        ((1, 2, 3), "3 values"),
        ((1,), "one value"),
        ([1], "a list"),
    ],
    ids=str,
)
def test_forms(value, says):
    assert form(value).startswith(says)


def test_two_values():
    assert not_two("command", (1, 2), "both") == ""
    assert "two values, both" in not_two("command", (1, 2, 3), "both")
    assert "a list" in not_two("command", [1, 2], "both")


@pytest.mark.parametrize(
    ("value", "model", "says"),
    [
        (jnp.zeros(2), np.ones(2), ""),
        (1.0, jnp.zeros(()), ""),
        (None, jnp.zeros(2), "nothing"),
        ([0.0], jnp.zeros(2), "a list, not an array"),
        ({"a": 0.0}, {"a": 0.0, "b": 1.0}, "a tree of 1 arrays, not of 2"),
        ({"a": 0.0}, {"b": 0.0}, "or with other names"),
        ({"a": jnp.zeros(3)}, {"a": jnp.zeros(2)}, "of shape (3,) instead of (2,) in `['a']`"),
    ],
    ids=str,
)
def test_differences(value, model, says):
    found = difference(value, model)
    assert says in found and bool(found) == bool(says)


def test_types_count_where_they_are_asked_for():
    whole, real = jnp.zeros(2, dtype=int), jnp.zeros(2)
    assert difference(whole, real) == ""
    assert difference(whole, real, types=True) == "of type int64 instead of float64"


@pytest.mark.parametrize(
    ("answer", "says"),
    [
        (jnp.zeros(2), "two values"),
        ((jnp.zeros(3), {}), r"shape \(2,\)"),
        ((jnp.zeros(2), 1.0), "signals as a mapping"),
    ],
)
def test_answers_that_are_no_command(answer, says):
    check_command(Law(), (jnp.zeros(2), {}), 2)
    with pytest.raises(BadInput, match=says):
        check_command(Law(), answer, 2)


def test_a_state_that_changes_its_form():
    check_state(Law(), {"a": jnp.zeros(2)}, {"a": jnp.ones(2)})
    with pytest.raises(BadInput, match=r"`Law.advance` must .* of shape \(1,\) instead of \(2,\)"):
        check_state(Law(), {"a": jnp.zeros(1)}, {"a": jnp.ones(2)})


class Mode(AbstractMode):
    """A fault that alters a signal to the answer it was given."""

    answer: Any
    targets = ("quantity",)
    severity = NO_SEVERITY

    def init(self, value):
        return jnp.zeros(2)

    def apply(self, memory, moment, value):
        return self.answer


@pytest.mark.parametrize(
    ("answer", "says"),
    [
        (jnp.zeros(2), "the altered signal and the memory"),
        ((jnp.zeros(3), jnp.zeros(2)), "must return an Altered first, but returns"),
        ((Altered(jnp.zeros(2), True), jnp.zeros(2)), r"must return a signal of shape \(3,\)"),
        ((Altered(jnp.zeros(3), True), jnp.zeros(1)), "must return the memory in the form that `init` gives it"),
    ],
)
def test_answers_that_are_no_altered_signal(answer, says):
    value, zero = jnp.zeros(3), jnp.zeros(())
    moment = Moment(zero > 0, 0.0, 0.0, 1.0, jax.random.PRNGKey(0), jnp.asarray(0), value, holds=True)
    right = (Altered(value, True), jnp.zeros(2))
    assert apply_mode(Mode(right), jnp.zeros(2), moment, value) is right
    with pytest.raises(BadInput, match=f"^Mode: `apply`.*{says}"):
        apply_mode(Mode(answer), jnp.zeros(2), moment, value)


class Declaring:
    """A part that declares these signals."""

    def __init__(self, declared):
        self.signals = lambda: declared


@pytest.mark.parametrize(
    ("declared", "given", "says"),
    [
        (None, {}, "`Declaring.signals` must return a mapping"),
        ({"a": "m"}, {}, "`Declaring.signals` must return a mapping"),
        ({}, {"a": 1.0}, "`Declaring.command` gives a signal `a`, which `Declaring.signals` does not declare"),
        ({"a": Signal((), "m", "a")}, {}, "declares a signal `a`, which `Declaring.command` does not give"),
    ],
)
def test_signals_that_are_not_those_declared(declared, given, says):
    part = Declaring({"a": Signal((), "m", "a")})
    check_declared(part, {"a": 1.0}, "command")
    with pytest.raises(BadInput, match=says):
        check_declared(Declaring(declared), given, "command")

"""The key of a structure: equal where one compiled program serves, and different wherever it does not."""

import dataclasses
import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree

from undertow.core.contracts import Measurement, Target
from undertow.core.structure_key import Constant, NoKey, arrays_of, joined, structure_key
from undertow.physics.plants import double_integrator
from undertow.physics.thrusters import t200
from undertow.physics.vehicles import bluerov2_heavy, odin

VEHICLE = bluerov2_heavy()


def test_numbers_of_arrays_do_not_count():
    heavier = dataclasses.replace(VEHICLE, mass=VEHICLE.mass * 1.5)
    assert structure_key(VEHICLE) == structure_key(heavier)
    assert structure_key(jnp.ones(3)) == structure_key(jnp.zeros(3))


DIFFERENT = {
    "strings and their ends": (("ab", "c"), ("a", "bc")),
    "nesting": (((1, 2), 3), (1, (2, 3))),
    "whole numbers and fractions": (1, 1.0),
    "numbers and truths": (1, True),
    "tuples and lists": ((1, 2), [1, 2]),
    "kinds of tuples": (Target(1, 2, 3), (1, 2, 3)),
    "numbers of NumPy": (np.array([1.0, 2.0]), np.array([1.0, 3.0])),
    "zeros": (0.0, -0.0),
    "shapes": (jnp.zeros(3), jnp.zeros((3, 1))),
    "types of numbers": (jnp.zeros(3), jnp.zeros(3, dtype=int)),
    "arrays of JAX and of NumPy": (jnp.zeros(3), np.zeros(3)),
    "options": (t200(), t200(fidelity="static")),
    "vehicles": (VEHICLE, odin()),
    "partial functions": (functools.partial(jnp.sum, axis=0), functools.partial(jnp.sum, axis=1)),
    "functions": (jnp.sin, jnp.cos),
    "keys of mappings": ({"a": 1}, {"b": 1}),
    "nothing and an empty tuple": (None, ()),
    "the same part twice, and two": ((Measurement(1, 2), 3), (Measurement(1, 3), 3)),
}


@pytest.mark.parametrize("name", DIFFERENT)
def test_what_needs_another_program_has_another_key(name):
    first, other = DIFFERENT[name]
    assert structure_key(first) == structure_key(first)
    assert structure_key(first) != structure_key(other)


def test_weak_types_count():
    weak = jax.jit(lambda: 1.0)()
    assert weak.weak_type and structure_key(weak) != structure_key(jnp.ones(()))


def test_what_a_tree_is_made_from_again():
    """Functions of JAX that close over the form of a tree, as a linearisation has them."""
    of_two = ravel_pytree({"a": jnp.zeros(2), "b": jnp.zeros(3)})[1]
    same = ravel_pytree({"a": jnp.ones(2), "b": jnp.ones(3)})[1]
    other = ravel_pytree({"a": jnp.zeros(3), "b": jnp.zeros(2)})[1]
    assert structure_key(of_two) == structure_key(same) != structure_key(other)


def test_functions_of_one_line_and_name(monkeypatch):
    """As if this module were one of undertow."""
    monkeypatch.setattr("undertow.core.structure_key._KNOWN", {__name__.partition(".")[0], "builtins"})
    one, other, nested = lambda x: x + 1, lambda x: x - 1, lambda x: lambda y: y * x
    changed, kept = lambda x: lambda y: y / x, lambda x, gain=2.0: x * gain
    keys = [structure_key(function) for function in (one, other, nested, changed, kept)]
    assert len(set(keys)) == len(keys)

    def closing(gain):
        return lambda x: gain * x

    assert structure_key(closing(2)) == structure_key(closing(2)) != structure_key(closing(3))

    def before():
        inner = lambda: later
        with pytest.raises(NoKey):
            structure_key(inner)
        later = 1
        return inner, later

    before()


class Own(eqx.Module):
    gain: float = 1.0


# Named here, not by `str`: workers that run tests in parallel must agree on the names, and
# an address in memory differs between them.
OF_OTHERS = {"instance": Own(), "class": Own, "function": lambda x: x, "object": object(), "iterator": iter(())}


@pytest.mark.parametrize("value", OF_OTHERS.values(), ids=OF_OTHERS)
def test_code_of_others_has_no_key(value):
    with pytest.raises(NoKey):
        structure_key(double_integrator(), value)


def test_arrays_are_taken_out_and_put_back():
    arrays, rest = arrays_of((VEHICLE, "word", 2.5))
    vehicle, word, number = joined([array + 1 for array in arrays], rest)
    assert (word, number) == ("word", 2.5)
    np.testing.assert_array_equal(vehicle.mass, VEHICLE.mass + 1)


def test_arrays_count_where_they_are_constants():
    """Those of a tree are arguments of a program, unless it says otherwise; those of a function never are."""
    heavier = dataclasses.replace(VEHICLE, mass=VEHICLE.mass + 1)
    assert structure_key(VEHICLE) == structure_key(heavier)
    assert structure_key(Constant(VEHICLE)) != structure_key(Constant(heavier))
    assert structure_key(Constant(VEHICLE)) == structure_key(Constant(bluerov2_heavy()))

    def scaling(factor):
        function = lambda x: factor * x
        function.__module__ = "undertow.run"
        return function

    assert structure_key(scaling(jnp.ones(2))) == structure_key(scaling(jnp.ones(2)))
    assert structure_key(scaling(jnp.ones(2))) != structure_key(scaling(2 * jnp.ones(2)))

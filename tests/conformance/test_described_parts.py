"""Every part describes itself: parameters with meaning and unit, docstring, arguments explained."""

import inspect

import equinox as eqx
import jax
import numpy as np

from undertow.core import catalogue
from undertow.core.param import parameters


def test_catalogue_is_not_empty():
    for kind in catalogue.KINDS:
        assert catalogue.names(kind), kind


def test_parameters_have_meaning_and_unit(part):
    _, thing = part
    described = list(parameters(thing))
    for parameter in described:
        assert isinstance(parameter.meaning, str) and parameter.meaning.strip(), parameter.name
        assert isinstance(parameter.unit, str) and parameter.unit == parameter.unit.strip(), parameter.name
        assert parameter.name.isascii() and parameter.unit.isascii()
    if jax.tree.leaves(eqx.filter(thing, eqx.is_inexact_array)):
        assert described, "arrays, but no declared parameter"


def test_no_two_parameters_share_a_name(part):
    _, thing = part
    names = [parameter.name for parameter in parameters(thing)]
    assert len(names) == len(set(names))


def test_parameters_are_double_precision_arrays(part):
    """Numbers that may change are arrays, so that a changed one costs no compilation."""
    _, thing = part
    for parameter in parameters(thing):
        value = thing
        for step in parameter.name.replace("[", ".").replace("]", "").split("."):
            value = value[int(step)] if step.isdigit() else getattr(value, step)
        assert isinstance(value, jax.Array) and value.dtype == np.float64, parameter.name


def test_every_argument_is_explained():
    for kind in catalogue.KINDS:
        for name, part in catalogue.names(kind).items():
            text = inspect.getdoc(part)
            assert text, f"{kind}/{name}"
            for argument in inspect.signature(part).parameters:
                assert argument in text, f"{kind}/{name}: `{argument}` is not explained"

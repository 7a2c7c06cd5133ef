"""Every part describes itself: parameters with meaning and unit, docstring, arguments explained."""

import inspect

import equinox as eqx
import jax
import numpy as np
import pytest

from undertow.core import catalogue
from undertow.core.param import parameters


def test_catalogue_is_not_empty():
    for kind in catalogue.KINDS:
        assert catalogue.names(kind), kind


@pytest.mark.full
def test_parameters_have_meaning_and_unit(all_parts):
    for name, thing in all_parts.items():
        described = list(parameters(thing))
        for parameter in described:
            place = (*name, parameter.name)
            assert isinstance(parameter.meaning, str) and parameter.meaning.strip(), place
            assert isinstance(parameter.unit, str) and parameter.unit == parameter.unit.strip(), place
            assert parameter.name.isascii() and parameter.unit.isascii(), place
        if jax.tree.leaves(eqx.filter(thing, eqx.is_inexact_array)):
            assert described, f"{name}: arrays, but no declared parameter"


@pytest.mark.full
def test_no_two_parameters_share_a_name(all_parts):
    for name, thing in all_parts.items():
        names = [parameter.name for parameter in parameters(thing)]
        assert len(names) == len(set(names)), name


@pytest.mark.full
def test_parameters_are_double_precision_arrays(all_parts):
    """Numbers that may change are arrays, so that a changed one costs no compilation."""
    for name, thing in all_parts.items():
        for parameter in parameters(thing):
            value = thing
            for step in parameter.name.replace("[", ".").replace("]", "").split("."):
                value = value[int(step)] if step.isdigit() else getattr(value, step)
            assert isinstance(value, jax.Array) and value.dtype == np.float64, (*name, parameter.name)


def test_every_argument_is_explained():
    for kind in catalogue.KINDS:
        for name, part in catalogue.names(kind).items():
            text = inspect.getdoc(part)
            assert text, f"{kind}/{name}"
            for argument in inspect.signature(part).parameters:
                assert argument in text, f"{kind}/{name}: `{argument}` is not explained"

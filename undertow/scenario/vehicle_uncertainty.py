"""How sure the numbers of a vehicle file are: deviations beside the numbers, and the section `uncertainty`."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from undertow.core import checks
from undertow.core.errors import BadInput, did_you_mean
from undertow.physics.vehicles.published import Hull
from undertow.scenario.correlation import correlation_matrix, lower_triangle
from undertow.scenario.uncertain_number import UncertainNumber, uncertain_number
from undertow.scenario.values import checked
from undertow.scenario.vehicle_parameters import (
    POSITIVE,
    check_name,
    default_outside,
    is_outside,
    name_at,
    parameter_values,
    sign_of,
)

SECTION = "uncertainty"
_KEYS = ("parameters", "deviations", "correlation", "values")
_TEXTS = ("name", "source", "inertia_about", SECTION, "identified")
_AGREED = 1e-6  # relative, between a deviation beside its number and in the section


class VehicleUncertainty(NamedTuple):
    """Parameters of a vehicle that are not known exactly, and how their errors go together.

    A positive parameter is log-normal with the value as its median, another one normal. The correlation is that of the
    logarithms of the former.
    """

    numbers: dict[str, UncertainNumber]  # by name
    correlation: Float[np.ndarray, "P P"]

    def section(self) -> dict[str, Any]:
        """The same as the section of a vehicle file."""
        names = list(self.numbers)
        section: dict[str, Any] = {
            "parameters": names,
            "deviations": [float(n.deviation) for n in self.numbers.values()],
        }
        outside = {name: float(self.numbers[name].value) for name in names if is_outside(name)}
        if outside:
            section["values"] = outside
        if np.any(self.correlation != np.eye(len(names))):
            section["correlation"] = lower_triangle(self.correlation)
        return section


def without_deviations(contents: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, float]]:
    """Contents of a vehicle file with numbers alone, and the deviations that stood beside them, by key path.

    Raises:
        BadInput: a deviation that cannot be read.
    """
    deviations: dict[str, float] = {}
    plain = {key: value if key in _TEXTS else _plain(key, value, deviations) for key, value in contents.items()}
    return plain, deviations


def _plain(location: str, node: Any, deviations: dict[str, float]) -> Any:
    if isinstance(node, list):
        return [_plain(f"{location}[{i}]", entry, deviations) for i, entry in enumerate(node)]
    if isinstance(node, Mapping):
        return {
            key: entry if key == "name" else _plain(f"{location}.{key}", entry, deviations)
            for key, entry in node.items()
        }
    number = uncertain_number(location, node)
    if number is None:
        return node
    deviations[location] = number.deviation
    return number.value


def uncertainty_of(
    contents: Mapping[str, Any], deviations: Mapping[str, float], hull: Hull
) -> VehicleUncertainty | None:
    """What a vehicle file says of the errors of its numbers; None where it says nothing.

    Args:
        contents: of the file, numbers alone.
        deviations: that stood beside them, by key path.
        hull: of these contents.

    Raises:
        BadInput: unknown names, deviations that are not positive or differ, or no correlation matrix.
    """
    section = contents.get(SECTION)
    beside = _by_name(contents, deviations, hull)
    in_section = {} if section is None else _deviations_in(section)
    for i, (name, deviation) in enumerate(in_section.items()):
        if not math.isclose(beside.get(name, deviation), deviation, rel_tol=_AGREED):
            must = f"be the deviation that stands beside the number, {beside[name]:.9g}"
            hint = "Change both, or leave one of them out"
            raise BadInput(f"{SECTION}.deviations[{i}]", must, f"{deviation:.9g} of `{name}`", hint=hint)
    both = in_section | {name: deviation for name, deviation in beside.items() if name not in in_section}
    if not both:
        return None
    values = parameter_values(hull) | _values_in(section)
    numbers = {}
    for name, deviation in both.items():
        value = values[name] if name in values else default_outside(name)
        if sign_of(name) == POSITIVE and not value > 0:
            raise BadInput(name, "be positive where it has a deviation", value)
        numbers[name] = UncertainNumber(value, deviation)
    correlation = np.eye(len(both))
    if section is not None and "correlation" in section:
        correlation[: len(in_section), : len(in_section)] = correlation_matrix(
            f"{SECTION}.correlation", section["correlation"], len(in_section)
        )
    return VehicleUncertainty(numbers, correlation)


def _by_name(contents: Mapping[str, Any], deviations: Mapping[str, float], hull: Hull) -> dict[str, float]:
    """Deviations of parameters; those of other numbers, such as a thruster's position, are of no use.

    Weight, buoyancy, and what these follow from make up the net buoyancy.
    """
    by_name = {name_at(key): deviation for key, deviation in deviations.items() if name_at(key)}
    net_weight = abs(hull.buoyancy - hull.weight)
    # N, of the net buoyancy per relative error of a number from which weight and buoyancy follow
    effects = {"weight": hull.weight, "buoyancy": hull.buoyancy, "gravity": net_weight}
    effects |= {"volume": hull.buoyancy, "water_density": hull.buoyancy}
    net = [deviations[key] / float(contents[key]) * effect for key, effect in effects.items() if key in deviations]
    return by_name | ({"net_buoyancy": math.hypot(*net)} if any(net) else {})


def _deviations_in(section: Any) -> dict[str, float]:
    """Deviations of a section by name, checked."""
    if not isinstance(section, Mapping):
        raise BadInput(SECTION, f"be a mapping with the keys {', '.join(_KEYS)}", section)
    for key in section:
        if key not in _KEYS:
            raise BadInput(f"{SECTION}.{key}", "be left out", "unknown", hint=did_you_mean(str(key), _KEYS))
    for key in ("parameters", "deviations"):
        if not isinstance(section.get(key), list):
            raise BadInput(f"{SECTION}.{key}", "be a list", section.get(key, "not given"))
    names, deviations = section["parameters"], section["deviations"]
    for i, name in enumerate(names):
        check_name(f"{SECTION}.parameters[{i}]", name)
        if name in names[:i]:
            raise BadInput(f"{SECTION}.parameters[{i}]", "be there once", name)
    if len(deviations) != len(names):
        must = f"be {len(names)} numbers, one per entry of `parameters`"
        raise BadInput(f"{SECTION}.deviations", must, len(deviations))
    for i, deviation in enumerate(deviations):
        checks.positive(f"{SECTION}.deviations[{i}]", checked(f"{SECTION}.deviations[{i}]", deviation, float, 0.0))
    return {name: float(deviation) for name, deviation in zip(names, deviations, strict=True)}


def _values_in(section: Any) -> dict[str, float]:
    """Values of parameters that no other key of a vehicle file holds."""
    values = {} if section is None else section.get("values", {})
    if not isinstance(values, Mapping):
        raise BadInput(f"{SECTION}.values", "be a mapping of parameters to numbers", values)
    for name, value in values.items():
        location = f"{SECTION}.values.{name}"
        check_name(location, name)
        if not is_outside(name):
            raise BadInput(location, "be left out: another key of the vehicle file holds it", value)
        checked(location, value, float, 0.0)
        checks.not_negative(location, value)
    return {name: float(value) for name, value in values.items()}

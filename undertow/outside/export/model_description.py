"""The file modelDescription.xml of a unit of co-simulation, FMI 2.0."""

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from typing import NamedTuple

from undertow.outside.export.variables import Variable

# Exponents of the base units, and a factor.
_UNITS = {
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "m/s^2": {"m": 1, "s": -2},
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "rad/s^2": {"rad": 1, "s": -2},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N m": {"kg": 1, "m": 2, "s": -2},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "A": {"A": 1},
    "C": {"s": 1, "A": 1},
    "J": {"kg": 1, "m": 2, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "us": {"s": 1, "factor": 1e-6},
}

_ROLES = {  # causality, variability, initial
    "output": ("output", "discrete", "calculated"),
    "input": ("input", "discrete", None),
    "measured": ("input", "discrete", None),
    "parameter": ("parameter", "fixed", "exact"),
    "tunable": ("parameter", "tunable", "exact"),
}


class ModelDescription(NamedTuple):
    """What is described.

    Attributes:
        identifier: name of the model, of its library and of its main source.
        guid: that the sources have, too.
        description: in words.
        variables: their value references count from 0.
        sources: names of the files to compile.
        period: sampling time, s.
        duration: of a usual run, s.
    """

    identifier: str
    guid: str
    description: str
    variables: Sequence[Variable]
    sources: Sequence[str]
    period: float
    duration: float


def model_description(unit: ModelDescription, tool: str) -> str:
    """The file's text; `tool` made the unit."""
    root = ET.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=unit.identifier,
        guid=unit.guid,
        description=unit.description,
        generationTool=tool,
        variableNamingConvention="structured",
        numberOfEventIndicators="0",
    )
    simulation = ET.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=unit.identifier,
        canHandleVariableCommunicationStepSize="true",  # multiples of the sampling time
        canGetAndSetFMUstate="true",
        canSerializeFMUstate="true",
    )
    files = ET.SubElement(simulation, "SourceFiles")
    for name in unit.sources:
        ET.SubElement(files, "File", name=name)
    _units(root, sorted({variable.unit for variable in unit.variables} - {""}))
    categories = ET.SubElement(root, "LogCategories")
    ET.SubElement(categories, "Category", name="logStatusError", description="Why a call failed")
    times = {"startTime": "0", "stopTime": repr(float(unit.duration)), "stepSize": repr(float(unit.period))}
    ET.SubElement(root, "DefaultExperiment", times)
    variables, structure = ET.SubElement(root, "ModelVariables"), ET.SubElement(root, "ModelStructure")
    for reference, variable in enumerate(unit.variables):
        _variable(variables, variable, reference)
    outputs = [i + 1 for i, variable in enumerate(unit.variables) if variable.role == "output"]
    for name in ("Outputs", "InitialUnknowns"):
        unknowns = ET.SubElement(structure, name)
        for index in outputs:
            ET.SubElement(unknowns, "Unknown", index=str(index))
    ET.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _units(root: ET.Element, names: Sequence[str]) -> None:
    definitions = ET.SubElement(root, "UnitDefinitions")
    for name in names:
        element = ET.SubElement(definitions, "Unit", name=name)
        if name in _UNITS:
            ET.SubElement(element, "BaseUnit", {base: repr(power) for base, power in _UNITS[name].items()})


def _variable(parent: ET.Element, variable: Variable, reference: int) -> None:
    causality, variability, initial = _ROLES[variable.role]
    attributes = {"name": variable.name, "valueReference": str(reference), "description": variable.description}
    attributes |= {"causality": causality, "variability": variability}
    element = ET.SubElement(parent, "ScalarVariable", attributes | ({"initial": initial} if initial else {}))
    type_element = ET.SubElement(element, variable.kind)
    if variable.start is not None:
        type_element.set("start", str(variable.start).lower() if variable.kind == "Boolean" else repr(variable.start))
    if variable.unit:
        type_element.set("unit", variable.unit)

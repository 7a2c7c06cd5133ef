"""JSON schema of a scenario file for editors: its keys from `Scenario`, the parts and their options from the catalogue.

It completes and explains. What it lets pass is still checked by `undertow check`, which knows more.
"""

from typing import Any

from undertow.core import catalogue
from undertow.scenario import describing, factory
from undertow.scenario.schema import Scenario

# Kind of part -> the part that stands where its name is left out.
_DEFAULTS = {"plants": "hybrid_vehicle", "controllers": "robust", "vehicles": "odin", "thrusters": "paper_table3"}

_FILES = {"vehicles": r"\.ya?ml$", "": r"\.py:\w+$"}


def scenario_schema() -> dict[str, Any]:
    """JSON schema (draft 7) of a scenario file."""
    schema = Scenario.model_json_schema()
    for key, kind in catalogue.KIND_OF.items():
        part = _reference(kind)
        list_of_parts = {"type": "array", "items": part}
        shapes = {
            "disturbance": {"anyOf": [part, list_of_parts]},
            "metrics": list_of_parts,
            "supervisor": {"anyOf": [{"type": "boolean"}, part]},
        }
        property_schema = schema["properties"][key]
        schema["properties"][key] = {**shapes.get(key, part), "description": property_schema["description"]}
    mode = {name: schema["$defs"]["Fault"]["properties"]["mode"][name] for name in ("title", "description")}
    schema["$defs"]["Fault"]["properties"]["mode"] = {**mode, "anyOf": _names("faults")}
    definitions = {name: definition for name, definition in schema["$defs"].items() if name != "Part"}
    definitions |= {kind: _kind(kind) for kind in (*catalogue.KINDS, "metrics")}
    return {**schema, "$schema": "http://json-schema.org/draft-07/schema#", "$defs": definitions}


def _reference(kind: str) -> dict[str, Any]:
    return {"$ref": f"#/$defs/{kind}"}


def _kind(kind: str) -> dict[str, Any]:
    """A part by name, or a mapping whose further keys depend on the name."""
    parts, names = catalogue.names(kind), _names(kind)
    preset_parts = {
        preset: catalogue.presets_of(parts[name])[preset] for preset, name in catalogue.presets(kind).items()
    }
    mapping = {"type": "object", "properties": {"kind": {"anyOf": names}}}
    if kind not in _DEFAULTS and kind != "power":  # `battery` and `esc` have a default each
        mapping["required"] = ["kind"]
    schema = {"anyOf": [*names, mapping]}
    options = [
        {
            "if": {
                "properties": {"kind": {"const": name}},
                "required": [] if name == _DEFAULTS.get(kind) else ["kind"],
            },
            "then": {"properties": _options(kind, part)},
        }
        for name, part in sorted({**parts, **preset_parts}.items())
    ]
    return {**schema, "allOf": options} if options else schema


def _names(kind: str) -> list[dict[str, Any]]:
    """What may stand where a part is named: the names of the catalogue, and files."""
    catalogued = [{"const": name, "description": sentence} for name, sentence in describing.listed(kind)]
    return catalogued + [{"type": "string", "pattern": pattern} for key, pattern in _FILES.items() if key in (kind, "")]


def _options(kind: str, part: Any) -> dict[str, Any]:
    """Options of a part, those of all its presets."""
    presets = catalogue.presets_of(part)
    properties: dict[str, Any] = {"preset": {"enum": list(presets)}} if presets else {}
    for function in presets.values() or (part,):
        for option in describing.options_of(kind, function):
            properties.setdefault(option.name, _option(option))
    return properties


def _option(option: describing.Option) -> dict[str, Any]:
    if option.name in factory.INNER:
        part = _reference(factory.INNER[option.name][0])
        return {"type": "array", "items": part} if option.name == "sensors" else part
    is_literal = isinstance(option.default, bool | int | float | str) and option.default != "required"
    kind = {"type": "boolean"} if isinstance(option.default, bool) else {}
    default = {"default": option.default} if is_literal and option.default not in (float("inf"), -float("inf")) else {}
    return {"description": option.meaning, **kind, **default}

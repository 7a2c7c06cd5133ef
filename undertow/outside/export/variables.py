"""Variables of a unit of co-simulation: names, units and meanings of the numbers in the structs of a C program."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from undertow.core.contracts import AbstractPlant
from undertow.core.measurement import BODY_AXES, BODY_OUTPUTS
from undertow.core.signals import Signal
from undertow.outside.autopilot.measured_motion import Format
from undertow.physics.plants.hybrid_vehicle import HybridVehicle

_WORLD = (*BODY_OUTPUTS[:3], "about_north", "about_east", "about_down")
_FORCES = ("N", "N", "N", "N m", "N m", "N m")


class Variable(NamedTuple):
    """One variable.

    Attributes:
        name: with dots and indices.
        place: of its number in C, (struct, member, index); the struct is a member of the model.
        role: `output`, `input` (finite), `measured` (an input that may be NaN later), `parameter` or `tunable`.
        kind: `Real`, `Integer` or `Boolean`.
        unit: "" for none.
        description: in words.
        start: None for an output.
    """

    name: str
    place: tuple[str, str, int]
    role: str
    kind: str
    unit: str
    description: str
    start: Any = None


class Names(NamedTuple):
    """Names and units of everything that a plant takes and gives, with motions in a format."""

    plant: AbstractPlant
    form: Format | None  # None for a plant that is no vehicle

    def motion(self, struct: str, role: str, start: Any, meaning: str) -> Iterator[Variable]:
        """Position, attitude and velocity, of the members `motion_position`, ... of a struct."""
        plant, form = self.plant, self.form
        rates = _per_second(plant.output_units)
        position, attitude, velocity = (f"{meaning} {word}" for word in ("position", "attitude", "velocity"))
        if form is None:
            entries, units = plant.outputs, plant.output_units
            yield from group("position", struct, "motion_position", role, entries, units, position, start[0])
            yield from group("velocity", struct, "motion_velocity", role, entries, rates, velocity, start[2])
            return
        attitude_names, attitude_unit = (
            (("w", "x", "y", "z"), "") if form.attitude == "quaternion" else (BODY_OUTPUTS[3:], "rad")
        )
        velocity_names = {"body": BODY_AXES, "world": _WORLD, "rates": BODY_OUTPUTS}[form.velocity]
        axes = {"body": ", body axes", "world": ", world axes", "rates": ", rates of position and Euler angles"}
        velocity += axes[form.velocity]
        yield from group("position", struct, "motion_position", role, BODY_OUTPUTS[:3], "m", position, start[0])
        yield from group("attitude", struct, "motion_attitude", role, attitude_names, attitude_unit, attitude, start[1])
        yield from group("velocity", struct, "motion_velocity", role, velocity_names, rates, velocity, start[2])

    def outputs(
        self, name: str, member: str, role: str, start: Any, meaning: str, order: int = 0
    ) -> Iterator[Variable]:
        """The outputs of the plant, or their derivatives of an order, in a member of the input."""
        units = self.plant.output_units
        for _ in range(order):
            units = _per_second(units)
        yield from group(name, "input", member, role, self.plant.outputs, units, meaning, start)

    def actuators(self, name: str, struct: str, member: str, role: str, meaning: str) -> Iterator[Variable]:
        """One number for each input of the plant, in its unit."""
        yield from numbered(name, struct, member, role, self.plant.input_unit, meaning, self._owners())

    def reports(self, struct: str, role: str, report: Any, meaning: str) -> Iterator[Variable]:
        """What the actuators report, if anything: speeds of propellers, and their rates where these are known."""
        units = {"speed": "rad/s", "acceleration": "rad/s^2"}
        for word, unit in units.items():
            value = getattr(report, word, None)
            if value is not None:
                description = f"{meaning} {word} of the propeller of"
                member = f"actuator_{word}"
                yield from numbered(f"propeller_{word}", struct, member, role, unit, description, self._owners())

    def wrench(self, name: str, struct: str, member: str, role: str, meaning: str) -> Iterator[Variable]:
        """Force and moment on a vehicle, or what drives the outputs of another plant."""
        entries, units = (self.plant.outputs, "") if self.form is None else (BODY_AXES, _FORCES)
        yield from group(name, struct, member, role, entries, units, meaning, np.zeros(len(entries)))

    def _owners(self) -> Sequence[str]:
        """The thrusters, or the actuators of another plant."""
        if isinstance(self.plant, HybridVehicle):
            return tuple(f"thruster {name}" for name in self.plant.vehicle.thruster_names())
        return tuple(f"actuator {i + 1}" for i in range(self.plant.inputs()))


def group(
    name: str,
    struct: str,
    member: str,
    role: str,
    entries: Sequence[str],
    units: str | Sequence[str],
    meaning: str,
    start: Any,
) -> Iterator[Variable]:
    """Variables `name.entry` of an array."""
    of_each = [units] * len(entries) if isinstance(units, str) else units
    for i, (entry, unit) in enumerate(zip(entries, of_each, strict=True)):
        first = None if role == "output" else float(start[i])
        yield Variable(f"{name}.{entry}", (struct, member, i), role, "Real", unit, f"{meaning}: {entry}", first)


def numbered(
    name: str, struct: str, member: str, role: str, unit: str, meaning: str, owners: Sequence[str]
) -> Iterator[Variable]:
    """Variables `name[1]`, ... of an array, one for each owner."""
    start = None if role == "output" else 0.0
    for i, owner in enumerate(owners):
        yield Variable(f"{name}[{i + 1}]", (struct, member, i), role, "Real", unit, f"{meaning} {owner}", start)


def signals(struct: str, member: str, declared: Mapping[str, Signal]) -> Iterator[Variable]:
    """Outputs for signals that are numbers."""
    for name, signal in declared.items():
        unit = "" if signal.unit == "1" else signal.unit
        yield Variable(name, (struct, f"{member}_{name}", 0), "output", "Real", unit, signal.meaning)


def _per_second(units: Sequence[str]) -> tuple[str, ...]:
    """Units of the rates of quantities."""
    return tuple(f"{unit}^2" if unit.endswith("/s") else f"{unit}/s" for unit in units)

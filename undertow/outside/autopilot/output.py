"""What a vehicle takes from its controller: the input of the model, newtons, pulses of speed controllers, a wrench."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.actuator_model import force_of
from undertow.core.contracts import AbstractController, AbstractPlant, Inputs
from undertow.core.errors import BadInput
from undertow.core.numerics.linear_algebra import matvec
from undertow.physics.plants.hybrid_vehicle import HybridVehicle
from undertow.physics.power.esc import ESC, esc

OUTPUTS = ("input", "newtons", "pulses", "wrench")


class Output(NamedTuple):
    """Conversion of the input that a controller commands.

    Attributes:
        kind: `input` (as the plant takes it, volts for most thrusters), `newtons` (thrust of each thruster in steady
            state), `pulses` (us, for speed controllers) or `wrench` (force and moment of all thrusters, body axes).
        plant: that takes it.
        controller: whose model of the thrusters gives the thrust.
        esc: the speed controllers.
    """

    kind: str
    plant: AbstractPlant
    controller: AbstractController
    esc: ESC

    @property
    def unit(self) -> str:
        """Unit of the output."""
        return {"input": self.plant.input_unit, "newtons": "N", "pulses": "us", "wrench": "N, N m"}[self.kind]

    def of(self, u: Inputs) -> Float[Array, "..."]:
        """The output for an input."""
        if self.kind == "pulses":
            return self.esc.pulse(u, jnp.asarray(_thruster(self.plant, self.kind).supply))
        if self.kind == "input":
            return u
        thrust = jnp.broadcast_to(force_of(self.controller.model.actuators, u), u.shape)
        return thrust if self.kind == "newtons" else matvec(_vehicle(self.plant, self.kind).thruster_matrix, thrust)


def output_of(kind: str, plant: AbstractPlant, controller: AbstractController, speed_controllers: ESC | None) -> Output:
    """The conversion of a kind.

    Raises:
        BadInput: there is no such kind, or the plant has not what it needs.
    """
    checks.choice("output", kind, OUTPUTS)
    if kind != "input":
        _vehicle(plant, kind)
    if kind == "pulses":
        thruster = _thruster(plant, kind)
        if thruster.input_unit != "V":
            raise BadInput("output", "not be pulses for thrusters commanded in newtons", kind)
        if not bool(jnp.isfinite(jnp.asarray(thruster.supply)).all()):
            hint = "Give the thruster a `supply`, V"
            raise BadInput("output", "not be pulses without a supply voltage", kind, hint=hint)
    return Output(kind, plant, controller, speed_controllers or esc())


def _vehicle(plant: AbstractPlant, kind: str) -> HybridVehicle:
    if not isinstance(plant, HybridVehicle):
        raise BadInput("output", "be `input` for a plant that is no vehicle with thrusters", kind)
    return plant


def _thruster(plant: AbstractPlant, kind: str):
    return _vehicle(plant, kind).thruster

"""Two vehicles with a tether or a bar between them: 12 degrees of freedom, a large-scale MIMO hybrid system."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.composite_model import composite_model, split
from undertow.core.contracts import AbstractPlant, Effort, Load, Measurement, Model
from undertow.core.errors import BadInput
from undertow.core.numerics.rotations import rotation_from_quaternion
from undertow.core.signals import Signal
from undertow.core.status import Status
from undertow.physics.plants.hybrid_vehicle import HybridVehicle, VehicleState, hybrid_vehicle
from undertow.physics.plants.link import LinkForces, Place, SpringDamper
from undertow.physics.thrusters.thruster import AbstractThruster
from undertow.physics.vehicles.vehicle import VehicleModel

_SIGNALS = {
    "tension": Signal((), "N", "tension of the link between the vehicles"),
    "link_extension": Signal((), "m", "extension of the link; negative where a tether is slack"),
    "link_energy": Signal((), "J", "elastic energy of the link"),
    "link_loss": Signal((), "W", "power that the damping of the link takes"),
}


class PairState(NamedTuple):
    """State of both vehicles; the link has none."""

    first: VehicleState
    second: VehicleState


class TwoVehicles(AbstractPlant):
    """x = (x_1, x_2) and V = (V_1, V_2) of two vehicles, whose link is a load of each.

    The nominal model has a block for each vehicle and no link: its forces are part of d. Loads of the environment that
    depend on the pose of one body are not defined.
    """

    first: HybridVehicle
    second: HybridVehicle
    link: SpringDamper
    outputs: tuple[str, ...] = eqx.field(static=True)
    output_units: tuple[str, ...] = eqx.field(static=True)
    input_unit: str = eqx.field(static=True)

    def initial_state(self, position=None, velocity=None) -> PairState:
        halves = lambda values: (None, None) if values is None else split(values, (6, 6))
        (here, there), (own, other) = halves(position), halves(velocity)
        return PairState(self.first.initial_state(here, own), self.second.initial_state(there, other))

    def dynamics(self, t, x: PairState, u, d: Load) -> PairState:
        first, second = (one.dynamics(t, state, v, load) for one, state, v, load in self._each(x, u, d))
        return PairState(first, second)

    def output(self, t, x: PairState) -> Measurement:
        first, second = self.first.output(t, x.first), self.second.output(t, x.second)
        return Measurement(
            position=jnp.concatenate([first.position, second.position]),
            velocity=jnp.concatenate([first.velocity, second.velocity]),
            actuator=(first.actuator, second.actuator),
        )

    def acceleration(self, t, x: PairState, u, d: Load) -> Float[Array, "12"]:
        return jnp.concatenate([one.acceleration(t, state, v, load) for one, state, v, load in self._each(x, u, d)])

    def pose(self, x: PairState) -> None:
        return None

    def admissible(self, x: PairState, u):
        return jnp.concatenate([one.admissible(state, v) for one, state, v in self._with_inputs(x, u)])

    def effort(self, x: PairState, u) -> Effort:
        each = [one.effort(state, v) for one, state, v in self._with_inputs(x, u)]
        return Effort(*(jnp.concatenate(rows) for rows in zip(*each, strict=True)))

    def inputs(self) -> int:
        return sum(self._inputs())

    def status(self, x: PairState) -> Array:
        """That of the first vehicle, or of the second where the first is well."""
        first = self.first.status(x.first)
        return jnp.where(first == int(Status.OK), self.second.status(x.second), first)

    def advice(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(self.first.advice() + self.second.advice()))

    def model(
        self,
        *,
        speed_sensor: bool = False,
        rate_term: bool = False,
        regularisation: float | None = None,
        affine: bool = True,
        vehicle: VehicleModel | None = None,
        thruster: AbstractThruster | None = None,
    ) -> Model:
        """Nominal models of both vehicles side by side; the link is in neither.

        Args:
            speed_sensor: as of `hybrid_vehicle`, for both vehicles; so are the others.
            rate_term: whether J_dot nu is in F.
            regularisation: delta of Definition 2; None for the exact inverse.
            affine: whether thrust is taken as alpha V.
            vehicle: nominal vehicle of both; None for the true ones.
            thruster: nominal thruster of both; None for the true one.
        """
        models = tuple(
            one.model(
                speed_sensor=speed_sensor,
                rate_term=rate_term,
                regularisation=regularisation,
                affine=affine,
                vehicle=vehicle,
                thruster=thruster,
            )
            for one in (self.first, self.second)
        )
        return composite_model(models, self._inputs())

    def diagnostics(self, x: PairState, u):
        found = self.link_forces(x)
        energy, loss = self.link.energy(found.extension), self.link.loss(found)
        return {"tension": found.tension, "link_extension": found.extension, "link_energy": energy, "link_loss": loss}

    def signals(self):
        return _SIGNALS

    def link_forces(self, x: PairState) -> LinkForces:
        """What the link does in a state."""
        return self.link.forces(_place(x.first), _place(x.second))

    def _inputs(self) -> tuple[int, int]:
        return self.first.inputs(), self.second.inputs()

    def _with_inputs(self, x: PairState, u):
        return list(zip((self.first, self.second), x, split(u, self._inputs()), strict=True))

    def _each(self, x: PairState, u, d: Load):
        """Each vehicle with its state, its input and its load, that of the link included."""
        found = self.link_forces(x)
        parts = zip(split(d.acceleration, (6, 6)), split(d.wrench, (6, 6)), (found.first, found.second), strict=True)
        loads = [d._replace(acceleration=lumped, wrench=wrench - own) for lumped, wrench, own in parts]
        return [(*known, load) for known, load in zip(self._with_inputs(x, u), loads, strict=True)]


def _place(x: VehicleState) -> Place:
    return Place(x.position, rotation_from_quaternion(x.attitude), x.nu)


def two_vehicles(
    vehicle: VehicleModel,
    thruster: AbstractThruster,
    second_vehicle: VehicleModel | None = None,
    link: str = "tether",
    length: float = 5.0,
    stiffness: float = 200.0,
    damping: float = 20.0,
    first_point=(0.0, 0.0, 0.0),
    second_point=(0.0, 0.0, 0.0),
    inflow_loss: float | None = None,
) -> TwoVehicles:
    """Two vehicles with a tether or a bar between them, for decentralised control of a large-scale system.

    Outputs are those of the first vehicle, then those of the second. Batteries and energy ledgers are left out.

    Args:
        vehicle: hull and thruster layout of both, or of the first.
        thruster: what turns volts into thrust, of both.
        second_vehicle: hull and thruster layout of the second; None for the same.
        link: tether (pulls only), bar (pushes, too; with a joint at each end), or none.
        length: of the link without load, m.
        stiffness: N of tension per m of extension.
        damping: N of tension per m/s of extension, while there is tension.
        first_point: attachment on the first vehicle, m: forward, starboard, down.
        second_point: attachment on the second vehicle, m.
        inflow_loss: as of `hybrid_vehicle`, for both.

    Raises:
        BadInput: a value is out of its range.
    """
    if link not in ("tether", "bar", "none"):
        raise BadInput("link", "be tether, bar or none", link)
    one, other = (
        hybrid_vehicle(hull, thruster, ledger=False, inflow_loss=inflow_loss)
        for hull in (vehicle, second_vehicle or vehicle)
    )
    return TwoVehicles(
        first=one,
        second=other,
        link=SpringDamper(first_point, second_point, length, stiffness, damping, link),
        outputs=tuple(f"{name}_{i}" for i in (1, 2) for name in one.outputs),
        output_units=one.output_units * 2,
        input_unit=one.input_unit,
    )

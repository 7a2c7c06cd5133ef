"""Magnetic levitation of a ball between two coils: n = 1, m = 2, each coil pulls one way only."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.actuator_model import DirectActuator
from undertow.core.contracts import AbstractDynamics, Load, Measurement, Model
from undertow.core.coordinates import OutputCoordinates
from undertow.core.status import Status
from undertow.plants.levitation_rig import RIGS, LevitationRig, PerCoil
from undertow.plants.mechanism import AbstractMechanism, given_or_zero
from undertow.plants.nominal_parameters import nominal

FIDELITIES = ("ideal", "coil")


class LevitationState(NamedTuple):
    """Position of the ball (m, down from the upper magnet), its speed (m/s), and currents (A; none for `ideal`)."""

    z: Float[Array, "1"]
    speed: Float[Array, "1"]
    current: Float[Array, " coils"]


class SteadyCoils(AbstractDynamics):
    """F = g, G = the pull of each coil per squared current: the rig once its currents are where they should be."""

    rig: LevitationRig

    def drift(self, y: Measurement):
        return jnp.broadcast_to(self.rig.gravity, (1,))

    def gain(self, y: Measurement):
        return self.rig.pull(y.position)[None, :]

    def invert(self, y: Measurement, acceleration):
        """The coil that pulls the wanted way, alone: the smallest squared currents that are not negative."""
        return jnp.maximum(acceleration / self.rig.pull(y.position), 0.0)


class MagneticLevitation(AbstractMechanism):
    """z_ddot = g + pull(z) . I^2. The input is w, the squared current that each coil is asked for.

    A duty cycle U reaches the ball through I = k_i U + c_i, a lag, and I^2: neither affine nor of relative degree
    two. In w = (k_i U + c_i)^2 the steady plant is affine exactly, and the lag is all that the law does not know. The
    plant turns w into U and lets the current follow; w is limited to what U in [0, 1] gives.

    Args:
        rig: ball and coils.
        fidelity: `ideal`, currents follow at once, or `coil`, with the time constants of the coils.
    """

    rig: LevitationRig
    fidelity: str = eqx.field(static=True, default="coil")
    outputs: tuple[str, ...] = eqx.field(static=True, default=("z",))
    output_units: tuple[str, ...] = eqx.field(static=True, default=("m",))
    input_unit: str = eqx.field(static=True, default="A^2")

    def __check_init__(self):
        checks.choice("fidelity", self.fidelity, FIDELITIES)

    def initial_state(self, position=None, velocity=None) -> LevitationState:
        rest = jnp.broadcast_to(self.rig.smallest_current, (2,)) if self.fidelity == "coil" else jnp.zeros(0)
        return LevitationState(given_or_zero(position, 1), given_or_zero(velocity, 1), rest)

    def dynamics(self, t, x: LevitationState, u, d: Load) -> LevitationState:
        steady = self.rig.current_gain * self.rig.duty(u) + self.rig.current_offset
        flowing = (steady - x.current) / self.rig.lag(x.z) if self.fidelity == "coil" else x.current
        return LevitationState(x.speed, self.acceleration(t, x, u, d), flowing)

    def output(self, t, x: LevitationState) -> Measurement:
        return Measurement(x.z, x.speed)

    def acceleration(self, t, x: LevitationState, u, d: Load):
        magnets = (self.rig.pull(x.z) * self._squared_current(x, u)).sum(keepdims=True)
        return self.rig.gravity + magnets + d.acceleration - d.wrench / self.rig.mass

    def _squared_current(self, x: LevitationState, u) -> PerCoil:
        return x.current**2 if self.fidelity == "coil" else u

    def limits(self):
        low, high = self.rig.smallest_current**2, self.rig.largest_current**2
        return jnp.broadcast_to(low, (2,)), jnp.broadcast_to(high, (2,))

    def power(self, x: LevitationState, u):
        """Heat in the coils."""
        return self.rig.resistance * self._squared_current(x, u)

    def status(self, x: LevitationState) -> Array:
        touching = ((x.z < 0) | (x.z > self.rig.travel)).any()
        return jnp.where(touching, int(Status.OUT_OF_RANGE), int(Status.OK))

    def model(
        self,
        *,
        mass: float | None = None,
        force_factor: float | None = None,
        inductance: float | None = None,
        inductance_reach: float | None = None,
    ) -> Model:
        """What a controller is told of this plant; what is not given is the truth. The lag it is never told of.

        Args:
            mass: of the ball, kg.
            force_factor: 1/2 as physics has it, or 1 as the manual of the rig has it.
            inductance: gained by a coil that the ball touches, H.
            inductance_reach: gap over which it falls e times, m.
        """
        changed = {"inductance": inductance, "inductance_reach": inductance_reach}
        told = nominal(self.rig, mass=mass, force_factor=force_factor, **changed)
        return Model(SteadyCoils(told), OutputCoordinates((False,)), DirectActuator(1.0, *self.limits(), at_once=False))


def magnetic_levitation(rig: str = "balko_rosinova", fidelity: str = "coil") -> MagneticLevitation:
    """Ball between two electromagnets (INTECO MLS2EM), squared currents in; a run ends where it touches one.

    Args:
        rig: a published set of constants: balko_rosinova (ball of 39 g), balko_rosinova_23g, balko_rosinova_16g, or
            inteco_polimi (60.5 g).
        fidelity: ideal (currents follow at once) or coil (they lag by 31 ms at the magnet, 3.5 ms at 10 mm).

    Raises:
        BadInput: no such rig or fidelity.
    """
    checks.choice("rig", rig, tuple(RIGS))
    return MagneticLevitation(rig=RIGS[rig](), fidelity=fidelity)

"""Magnetic levitation of a ball between two coils: n = 1, m = 2; each coil pulls in one direction only."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.actuator_model import DirectActuator
from undertow.core.contracts import AbstractDynamics, Load, Measurement, Model
from undertow.core.coordinates import OutputCoordinates
from undertow.core.param import Param, Sources, param, sources_field
from undertow.core.status import Status
from undertow.physics.plants.mechanism import AbstractMechanism, given_or_zero, nominal

_BALKO = "Balko and Rosinova 2017"
_MILAN = "INTECO manual, as used at Politecnico di Milano (062020-Lab-Mechatronics)"

PerCoil = Float[Array, "2"]

# Balko and Rosinova 2017; which mass goes with which diameter is inferred from their order.
_BALLS = {"balko_rosinova_16g": (0.016, 0.033), "balko_rosinova_23g": (0.023, 0.040), "balko_rosinova": (0.039, 0.054)}
_COIL = {"current_gain": 4.4, "current_offset": -0.4, "smallest_current": 0.03884, "largest_current": 2.38}
_MANUAL_COIL = {
    "current_gain": 2.5165,
    "current_offset": 0.0243,
    "smallest_current": 0.0243,
    "largest_current": 2.5165 + 0.0243,
}


class LevitationRig(eqx.Module):
    """Ball and coils; z points down from the upper magnet to the ball. Coil 1 is above, coil 2 below.

    Raises:
        BadInput: a constant is not positive, or the ball does not fit between the magnets.
    """

    mass: Float[Param, ""] = param("kg", "mass of the ball", symbol="m")
    diameter: Float[Param, ""] = param("m", "diameter of the ball", symbol="2 r")
    magnet_distance: Float[Param, ""] = param("m", "distance between the magnets", symbol="H")
    force_factor: Float[Param, ""] = param("", "1/2 of F = 1/2 dL/dz I^2; the manual omits it", symbol="k_f")
    current_gain: Float[Param, ""] = param("A", "current per duty cycle", symbol="k_i")
    current_offset: Float[Param, ""] = param("A", "current at zero duty cycle, extrapolated", symbol="c_i")
    smallest_current: Float[Param, ""] = param("A", "smallest current", symbol="I_min")
    largest_current: Float[Param, ""] = param("A", "largest current of the drive", symbol="I_max")
    inductance: Float[Param, ""] = param(
        "H", "inductance gained by a coil in contact with the ball", symbol="FemP1", default=1.7521e-2
    )
    inductance_reach: Float[Param, ""] = param(
        "m", "gap over which it falls by the factor e", symbol="FemP2", default=5.8231e-3
    )
    lag_slope: Float[Param, ""] = param(
        "m s", "time constant at contact times `lag_reach`", symbol="fiP1", default=1.4142e-4
    )
    lag_reach: Float[Param, ""] = param("m", "gap for a fall by the factor e", symbol="fiP2", default=4.5626e-3)
    lag_range: Float[Param, ""] = param("m", "largest gap at which the lag is known; constant beyond", default=0.016)
    resistance: Float[Param, ""] = param("ohm", "of a coil", symbol="R", default=4.17, source=_MILAN)
    gravity: Float[Param, ""] = param("m/s^2", "gravity", symbol="g", default=9.81)
    sources: Sources = sources_field()

    def __check_init__(self):
        for name in self.__dataclass_fields__:
            if name not in ("current_offset", "sources"):
                checks.positive(name, getattr(self, name))
        checks.finite("current_offset", self.current_offset)
        checks.positive("magnet_distance - diameter", self.travel, "m")

    @property
    def travel(self) -> Float[Array, ""]:
        """Largest z, m, at which the ball touches the lower magnet."""
        return self.magnet_distance - self.diameter

    def gaps(self, z: Float[Array, "1"]) -> PerCoil:
        """Gap from each magnet to the ball, m."""
        return jnp.concatenate([z, self.travel - z])

    def pull(self, z: Float[Array, "1"]) -> PerCoil:
        """Acceleration of the ball per squared current, m/(s^2 A^2): negative (up) by coil 1, positive by coil 2."""
        slope = self.inductance / self.inductance_reach * jnp.exp(-self.gaps(z) / self.inductance_reach)
        return jnp.array([-1.0, 1.0]) * self.force_factor * slope / self.mass

    def lag(self, z: Float[Array, "1"]) -> PerCoil:
        """Time constants of the currents, s; they grow as the ball comes nearer.

        The published exponential tends to zero (12 us for coil 2 with the ball at 10 mm), which is impossible for a
        coil: beyond the 16 mm in which the rig measures z and was identified, it is constant.
        """
        return self.lag_slope / self.lag_reach * jnp.exp(-jnp.minimum(self.gaps(z), self.lag_range) / self.lag_reach)

    def demand(self, duty: PerCoil) -> PerCoil:
        """Squared steady current, A^2, of duty cycles U in [0, 1]: I = k_i U + c_i within the coil's limits."""
        current = self.current_gain * duty + self.current_offset
        return jnp.clip(current, self.smallest_current, self.largest_current) ** 2

    def duty(self, demand: PerCoil) -> PerCoil:
        """Duty cycles that give a squared current in steady state: the command of the drive."""
        return (jnp.sqrt(demand) - self.current_offset) / self.current_gain


def _balko(name: str) -> LevitationRig:
    mass, diameter = _BALLS[name]
    sources = {"*": _BALKO, "resistance": _MILAN}
    return LevitationRig(mass, diameter, magnet_distance=0.1, force_factor=0.5, **_COIL, sources=sources)


def _manual() -> LevitationRig:
    return LevitationRig(0.06054, 0.06125, 0.098, 1.0, **_MANUAL_COIL, sources={"*": _MILAN})


RIGS = {name: lambda name=name: _balko(name) for name in _BALLS} | {"inteco_polimi": _manual}


FIDELITIES = ("ideal", "coil")


class LevitationState(NamedTuple):
    """Position of the ball (m, down from the upper magnet), its speed (m/s), and currents (A; none for `ideal`)."""

    z: Float[Array, "1"]
    speed: Float[Array, "1"]
    current: Float[Array, " coils"]


class SteadyCoils(AbstractDynamics):
    """F = g, G = the pull of each coil per squared current: the rig without the lag of its currents."""

    rig: LevitationRig

    def drift(self, y: Measurement):
        return jnp.broadcast_to(self.rig.gravity, (1,))

    def gain(self, y: Measurement):
        return self.rig.pull(y.position)[None, :]

    def invert(self, y: Measurement, acceleration):
        """Smallest nonnegative squared currents: only the coil that pulls in the desired direction."""
        return jnp.maximum(acceleration / self.rig.pull(y.position), 0.0)


class MagneticLevitation(AbstractMechanism):
    """z_ddot = g + pull(z) . I^2. The input w is the commanded squared current of each coil.

    A duty cycle U reaches the ball through I = k_i U + c_i, a lag, and I^2: neither affine nor of relative degree
    two. In w = (k_i U + c_i)^2 the steady plant is exactly affine, and only the lag is unknown to the law. The plant
    computes U from w and lets the current follow; w is limited to the range that belongs to U in [0, 1].

    Args:
        rig: ball and coils.
        fidelity: `ideal`, currents without lag, or `coil`, with the time constants of the coils.
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
        """Nominal model for the controller, without lag; parameters that are not given have their true values.

        Args:
            mass: of the ball, kg.
            force_factor: 1/2 from physics, or 1 as in the manual of the rig.
            inductance: that gained by a coil in contact with the ball, H.
            inductance_reach: gap over which it falls by the factor e, m.
        """
        changed = {"inductance": inductance, "inductance_reach": inductance_reach}
        rig = nominal(self.rig, mass=mass, force_factor=force_factor, **changed)
        return Model(SteadyCoils(rig), OutputCoordinates((False,)), DirectActuator(1.0, *self.limits(), at_once=False))


def magnetic_levitation(rig: str = "balko_rosinova", fidelity: str = "coil") -> MagneticLevitation:
    """Ball between two electromagnets (INTECO MLS2EM), with squared currents as inputs; a run ends when it touches one.

    Args:
        rig: a published set of constants: balko_rosinova (ball of 39 g), balko_rosinova_23g, balko_rosinova_16g, or
            inteco_polimi (60.5 g).
        fidelity: ideal (currents without lag) or coil (a lag of 31 ms at the magnet, 3.5 ms at 10 mm).

    Raises:
        BadInput: no such rig or fidelity.
    """
    checks.choice("rig", rig, tuple(RIGS))
    return MagneticLevitation(rig=RIGS[rig](), fidelity=fidelity)

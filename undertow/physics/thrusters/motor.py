"""DC motor with a propeller: Eqs. (8)-(15) as parameters and the gains that follow from them."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from undertow.core import checks
from undertow.core.arrays import product, quotient
from undertow.core.param import Param, Sources, param, sources_field
from undertow.physics.thrusters.thruster import PerThruster, Powers


class DCMotor(eqx.Module):
    """Motor and propeller constants, one value for all thrusters or one per thruster.

    Thrust and torque in reverse have coefficients of their own, equal to the forward ones where None. The gains of
    the control law (`torque_per_thrust`, `voltage_gain`) are those of forward motion.

    Raises:
        BadInput: a constant is not positive (inductance, friction: negative).
    """

    resistance: Float[Param, "..."] = param("ohm", "winding resistance", symbol="R")
    inductance: Float[Param, "..."] = param("H", "winding inductance", symbol="L")
    torque_constant: Float[Param, "..."] = param("N m/A", "torque per current", symbol="k_t")
    back_emf_constant: Float[Param, "..."] = param("V s/rad", "voltage per speed", symbol="k_e")
    friction: Float[Param, "..."] = param("N m s/rad", "viscous friction", symbol="k_f")
    rotor_inertia: Float[Param, "..."] = param("kg m^2", "inertia of rotor and propeller", symbol="J")
    thrust_coefficient: Float[Param, "..."] = param("N s^2/rad^2", "thrust per speed squared", symbol="c_t")
    torque_coefficient: Float[Param, "..."] = param("N m s^2/rad^2", "shaft torque per speed squared", symbol="c_q")
    reverse_thrust_coefficient: Float[Param, "..."] = param(
        "N s^2/rad^2", "the same in reverse", symbol="c_t-", default=None
    )
    reverse_torque_coefficient: Float[Param, "..."] = param(
        "N m s^2/rad^2", "the same in reverse", symbol="c_q-", default=None
    )
    sources: Sources = sources_field()
    tested_voltage: float = eqx.field(static=True, default=float("inf"))  # V, up to which the data of the constants go

    def __post_init__(self):
        if self.reverse_thrust_coefficient is None:
            self.reverse_thrust_coefficient = self.thrust_coefficient
        if self.reverse_torque_coefficient is None:
            self.reverse_torque_coefficient = self.torque_coefficient

    def __check_init__(self):
        for name in ("inductance", "friction"):
            checks.not_negative(name, getattr(self, name))
        for name in ("resistance", "torque_constant", "back_emf_constant", "rotor_inertia"):
            checks.positive(name, getattr(self, name))
        for name in ("thrust_coefficient", "torque_coefficient"):
            checks.positive(name, getattr(self, name))
            checks.positive(f"reverse_{name}", getattr(self, f"reverse_{name}"))

    @property
    def k1(self) -> PerThruster:
        """R J / k_t, V s^2/rad. Eq. (13)."""
        return self.resistance * self.rotor_inertia / self.torque_constant

    @property
    def k2(self) -> PerThruster:
        """k_e + R k_f / k_t, V s/rad. Eq. (13); the paper prints k_e where Eqs. (8), (9) give k_f."""
        return self.back_emf_constant + self.resistance * self.friction / self.torque_constant

    @property
    def k3(self) -> PerThruster:
        """R / k_t, V/(N m). Eq. (13)."""
        return quotient(self.resistance, self.torque_constant)

    @property
    def torque_per_thrust(self) -> PerThruster:
        """c_tq = c_q / c_t, m. Eq. (12)."""
        return quotient(self.torque_coefficient, self.thrust_coefficient)

    @property
    def voltage_gain(self) -> PerThruster:
        """alpha = 1 / (k_3 c_tq), N/V. Eq. (15)."""
        return quotient(1.0, product(self.k3, self.torque_per_thrust))

    def torque(self, speed: PerThruster) -> PerThruster:
        """Shaft torque Q, N m, at a propeller speed in rad/s. Eq. (10)."""
        signed = jnp.where(speed < 0, -self.reverse_torque_coefficient, self.torque_coefficient)
        return signed * speed * speed

    def thrust(self, speed: PerThruster) -> PerThruster:
        """Thrust T, N, at a propeller speed in rad/s. Eq. (11)."""
        signed = jnp.where(speed < 0, -self.reverse_thrust_coefficient, self.thrust_coefficient)
        return signed * speed * speed

    def ideal_thrust(self, voltage: PerThruster) -> PerThruster:
        """Thrust, N, if all of the voltage overcame propeller torque: alpha V, with the alpha of each direction."""
        return self._gain(voltage) * voltage

    def ideal_voltage(self, thrust: PerThruster) -> PerThruster:
        """Voltage, V, for a thrust in N: the inverse of `ideal_thrust`."""
        return thrust / self._gain(thrust)

    def speed_at(self, thrust: PerThruster) -> PerThruster:
        """Propeller speed, rad/s, that gives a thrust in N: the inverse of Eq. (11)."""
        coefficient = jnp.where(thrust < 0, self.reverse_thrust_coefficient, self.thrust_coefficient)
        size = jnp.abs(thrust) / coefficient
        return jnp.sign(thrust) * jnp.sqrt(jnp.where(size > 0, size, 1.0))  # the root has no gradient at 0

    def steady_speed(self, voltage: PerThruster) -> PerThruster:
        """Speed, rad/s, with k_3 c_q speed|speed| + k_2 speed = voltage: Eq. (13) at rest."""
        quadratic = self.k3 * jnp.where(voltage < 0, self.reverse_torque_coefficient, self.torque_coefficient)
        root = jnp.sqrt(self.k2**2 + 4 * quadratic * jnp.abs(voltage))
        return 2 * voltage / (self.k2 + root)

    def steady_voltage(self, speed: PerThruster) -> PerThruster:
        """Voltage, V, that keeps a speed: Eq. (13) at rest."""
        return self.k2 * speed + self.k3 * self.torque(speed)

    def steady_current(self, speed: PerThruster) -> PerThruster:
        """Current, A, that keeps a speed: Eq. (8) without acceleration."""
        return (self.friction * speed + self.torque(speed)) * (1 / self.torque_constant)

    def speed_term(self, speed: PerThruster, acceleration: PerThruster) -> PerThruster:
        """phi = -alpha (k_1 speed_dot + k_2 speed), N. Eq. (15).

        In reverse the gain differs from the alpha that multiplies V; the difference is included here.
        """
        phi = -self.voltage_gain * (self.k1 * acceleration + self.k2 * speed)
        return phi + (1 - self.voltage_gain / self._gain(speed)) * self.thrust(speed)

    def powers(self, voltage: PerThruster, current: PerThruster, speed: PerThruster) -> Powers:
        """Power balance of the motor: Eqs. (8), (9) times Om, I."""
        return Powers(
            source=voltage * current,
            copper=self.resistance * current**2,
            friction=self.friction * speed**2,
            water=self.torque(speed) * speed,
            conversion=(self.torque_constant - self.back_emf_constant) * current * speed,
        )

    def rotor_energy(self, speed: PerThruster) -> PerThruster:
        """J Om^2 / 2, J."""
        return self.rotor_inertia * speed**2 / 2

    def advice(self) -> tuple[str, ...]:
        """Advice on implausible constants."""
        ratio = np.asarray(self.torque_constant) / np.asarray(self.back_emf_constant)
        if np.all(np.abs(ratio - 1) <= 0.05):
            return ()
        worst = float(np.ravel(ratio)[np.argmax(np.abs(np.log(np.ravel(ratio))))])
        return (
            f"torque constant / back-EMF constant is {worst:.3g}, but a DC motor in SI units has 1: "
            "the shaft would give more power than the supply puts in, or less. Check k_t and k_e.",
        )

    def _gain(self, direction: PerThruster) -> PerThruster:
        reverse = 1 / (self.k3 * (self.reverse_torque_coefficient / self.reverse_thrust_coefficient))
        return jnp.where(direction < 0, reverse, self.voltage_gain)

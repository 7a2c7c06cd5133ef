"""DC motor with a propeller: Eqs. (8)-(15) as parameters and the gains that follow from them."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.core import checks
from undertow.core.param import param, sources_field

Scalar = Float[Array, ""]
PerThruster = Float[Array, " N"]


class DCMotor(eqx.Module):
    """Motor and propeller constants, one value for all thrusters or one per thruster.

    Raises:
        BadInput: a constant is not positive (inductance, friction: negative).
    """

    resistance: Scalar = param("ohm", "winding resistance", symbol="R")
    inductance: Scalar = param("H", "winding inductance", symbol="L")
    torque_constant: Scalar = param("N m/A", "torque per current", symbol="k_t")
    back_emf_constant: Scalar = param("V s/rad", "voltage per speed", symbol="k_e")
    friction: Scalar = param("N m s/rad", "viscous friction", symbol="k_f")
    rotor_inertia: Scalar = param("kg m^2", "inertia of rotor and propeller", symbol="J")
    thrust_coefficient: Scalar = param("N s^2/rad^2", "thrust per speed squared", symbol="c_t")
    torque_coefficient: Scalar = param("N m s^2/rad^2", "shaft torque per speed squared", symbol="c_q")
    sources: tuple = sources_field()

    def __check_init__(self):
        for name in ("inductance", "friction"):
            checks.not_negative(name, getattr(self, name))
        for name in ("resistance", "torque_constant", "back_emf_constant", "rotor_inertia"):
            checks.positive(name, getattr(self, name))
        for name in ("thrust_coefficient", "torque_coefficient"):
            checks.positive(name, getattr(self, name))

    @property
    def k1(self) -> Scalar:
        """R J / k_t, V s^2/rad. Eq. (13)."""
        return self.resistance * self.rotor_inertia / self.torque_constant

    @property
    def k2(self) -> Scalar:
        """k_e + R k_f / k_t, V s/rad. Eq. (13); the paper prints k_e where Eqs. (8), (9) give k_f."""
        return self.back_emf_constant + self.resistance * self.friction / self.torque_constant

    @property
    def k3(self) -> Scalar:
        """R / k_t, V/(N m). Eq. (13)."""
        return self.resistance / self.torque_constant

    @property
    def torque_per_thrust(self) -> Scalar:
        """c_tq = c_q / c_t, m. Eq. (12)."""
        return self.torque_coefficient / self.thrust_coefficient

    @property
    def voltage_gain(self) -> Scalar:
        """alpha = 1 / (k_3 c_tq), N/V. Eq. (15)."""
        return 1 / (self.k3 * self.torque_per_thrust)

    def torque(self, speed: PerThruster) -> PerThruster:
        """Shaft torque Q, N m, at a propeller speed in rad/s. Eq. (10)."""
        return self.torque_coefficient * speed * jnp.abs(speed)

    def thrust(self, speed: PerThruster) -> PerThruster:
        """Thrust T, N, at a propeller speed in rad/s. Eq. (11)."""
        return self.thrust_coefficient * speed * jnp.abs(speed)

    def steady_speed(self, voltage: PerThruster) -> PerThruster:
        """Speed, rad/s, with k_3 c_q speed|speed| + k_2 speed = voltage: Eq. (13) at rest."""
        quadratic = self.k3 * self.torque_coefficient
        root = jnp.sqrt(self.k2**2 + 4 * quadratic * jnp.abs(voltage))
        return 2 * voltage / (self.k2 + root)

    def steady_current(self, speed: PerThruster) -> PerThruster:
        """Current, A, that keeps a speed: Eq. (8) without acceleration."""
        return (self.friction * speed + self.torque(speed)) / self.torque_constant

    def speed_term(self, speed: PerThruster, acceleration: PerThruster) -> PerThruster:
        """phi = -alpha (k_1 speed_dot + k_2 speed), N. Eq. (15)."""
        return -self.voltage_gain * (self.k1 * acceleration + self.k2 * speed)

    def advice(self) -> tuple[str, ...]:
        """What is odd about these constants."""
        ratio = np.asarray(self.torque_constant / self.back_emf_constant)
        if np.all(np.abs(ratio - 1) <= 0.05):
            return ()
        worst = float(np.ravel(ratio)[np.argmax(np.abs(np.log(np.ravel(ratio))))])
        return (
            f"torque constant / back-EMF constant is {worst:.3g}, but a DC motor in SI units has 1: "
            "the shaft would give more power than the supply puts in, or less. Check k_t and k_e.",
        )

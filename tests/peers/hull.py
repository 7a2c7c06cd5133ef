"""Drag and lift of slender hulls and fins, from Fossen (2021), ch. 6.4 and 9, and Beard and McLain (2012).

Checked against the golden values of PythonVehicleSimulator in tests/peers. Its cross-flow integral has half
a strip too much at bow and stern (21 strips of L/20); this one is the trapezoidal rule.
"""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from undertow.core.numerics.number import Number

Vector6 = Float[Array, "6"]

SEAWATER = 1026.0  # kg/m^3
_OSWALD = 0.7  # efficiency of a low-aspect wing, Beard and McLain (2012)

# Two-dimensional cross-flow drag coefficient against beam / (2 draft): Hoerner's curve as digitised by
# Fossen (2021), fig. 6.9.
_HALF_BEAM_TO_DRAFT = np.array(
    [0.0109, 0.1766, 0.3530, 0.4519, 0.4728, 0.4929, 0.4933, 0.5585, 0.6464, 0.8336]
    + [0.9880, 1.3081, 1.6392, 1.8600, 2.3129, 2.6000, 3.0088, 3.4508, 3.7379, 4.0031]
)
_CROSS_FLOW_COEFFICIENT = np.array(
    [1.9661, 1.9657, 1.8976, 1.7872, 1.5837, 1.2786, 1.2108, 1.0836, 0.9986, 0.8796]
    + [0.8284, 0.7599, 0.6914, 0.6571, 0.6307, 0.5962, 0.5868, 0.5859, 0.5599, 0.5593]
)


def cross_flow_coefficient(beam: Number, draft: Number) -> Float[Array, ""]:
    """Drag coefficient of a section in cross flow; beam and draft in m."""
    return jnp.interp(jnp.asarray(beam / (2 * draft)), _HALF_BEAM_TO_DRAFT, _CROSS_FLOW_COEFFICIENT)


def cross_flow_drag(
    length: float, beam: float, draft: float, nu: Vector6, *, density: float = SEAWATER, strips: int = 20
) -> Vector6:
    """Sway force and yaw moment of a hull moving sideways (N, N m), by strip theory. Fossen (2021), Eq. (6.91).

    Args:
        length, beam, draft: of the hull, m.
        nu: body velocity relative to the water, m/s and rad/s.
        density: of the water, kg/m^3.
        strips: number of strips along the hull.
    """
    x = length * jnp.linspace(-0.5, 0.5, strips + 1)
    weight = (length / strips) * jnp.ones(strips + 1).at[jnp.array([0, -1])].set(0.5)
    local = nu[1] + x * nu[5]
    force = -0.5 * density * draft * cross_flow_coefficient(beam, draft) * jnp.abs(local) * local * weight
    zero = jnp.zeros(())
    return jnp.stack([zero, force.sum(), zero, zero, zero, (x * force).sum()])


def lift_and_drag(
    span: float, area: float, parasitic: float, attack: Number, speed: Number, *, density: float = SEAWATER
) -> Vector6:
    """Body-frame force of a wing-like body at an angle of attack (N), without stall.

    Args:
        span, area: m, m^2.
        parasitic: drag coefficient at zero attack.
        attack: angle of attack, rad.
        speed: through the water, m/s.
        density: of the water, kg/m^3.
    """
    aspect = span**2 / area
    lift = jnp.pi * aspect / (1 + jnp.sqrt(1 + (aspect / 2) ** 2)) * jnp.asarray(attack)
    drag = parasitic + lift**2 / (jnp.pi * _OSWALD * aspect)
    pressure = 0.5 * density * speed**2 * area
    sine, cosine = jnp.sin(attack), jnp.cos(attack)
    surge = pressure * (-cosine * drag + sine * lift)
    heave = pressure * (-sine * drag - cosine * lift)
    zero = jnp.zeros(())
    return jnp.stack([surge, zero, heave, zero, zero, zero])

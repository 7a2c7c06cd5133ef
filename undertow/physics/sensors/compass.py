"""Compass: heading.

The deviation of a magnetic compass at a heading y is A + B sin y + C cos y + D sin 2y + E cos 2y: a constant, the hard
iron and the soft iron of the vehicle (F. J. Evans, A. Smith, Admiralty Manual for ascertaining and applying the
deviations of the compass, 1862). D. Gebre-Egziabher, G. H. Elkaim, J. D. Powell, B. W. Parkinson, Calibration of
strapdown magnetometers in magnetic field domain, J. Aerosp. Eng. 19 (2006), have the same in the components of the
field. The field of the thrusters' currents acts as hard iron in proportion to them.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.core.param import Param, param
from undertow.physics.sensors.gauss_markov import CorrelatedErrors, correlated_errors
from undertow.physics.sensors.motion import Motion
from undertow.physics.sensors.sampling import Sampling
from undertow.physics.sensors.sensor import AbstractDisturbedSensor

# s; the thrusters that carry the sum of the currents change, and with them where its field points. Chosen.
_INTERFERENCE_TIME = 60.0
# s; in which a sum of currents that no speed tells leaves its mean: between a wave and a turn of the vehicle. Chosen.
_VARIATION_TIME = 10.0


class ThrusterCurrents(eqx.Module):
    """Sum of the currents of the thrusters, as far as the speeds of their propellers tell it."""

    coefficient: Float[Param, ""] = param("A s^2/rad^2", "current of a thruster over the square of its speed")
    assumed: Float[Param, ""] = param("A", "sum of the currents where no speed tells it")
    variation: Float[Param, ""] = param("A", "standard deviation of that sum where no speed tells it")

    def unknown(self, motion: Motion):
        """Standard deviation of the sum, A: zero where speeds tell it."""
        return self.variation if motion.actuator is None else jnp.zeros(())

    def total(self, motion: Motion):
        """Sum, A."""
        if motion.actuator is None:
            return self.assumed
        return self.coefficient * (motion.actuator.speed**2).sum()


class Compass(AbstractDisturbedSensor):
    """Yaw, rad."""

    fixes = ("yaw",)
    angles = (0,)
    # Which errors `sampling.errors` has, in this order: "noise" for one, the others for a pair each.
    disturbed_by: tuple[str, ...] = eqx.field(static=True, default=())
    currents: ThrusterCurrents | None = None  # None where those of the thrusters do not disturb it

    def reading(self, motion: Motion):
        return motion.angles[2:]

    def error_slopes(self, motion: Motion):
        yaw = motion.angles[2]
        first = jnp.stack([jnp.sin(yaw), jnp.cos(yaw)])
        pairs = {"noise": jnp.ones(1), "hard iron": first, "soft iron": jnp.stack([jnp.sin(2 * yaw), jnp.cos(2 * yaw)])}
        if self.currents is not None:
            pairs["thrusters"] = self.currents.total(motion) * first
            pairs["unknown currents"] = self.currents.unknown(motion) * first
        return jnp.concatenate([pairs[name] for name in self.disturbed_by])[None, :]

    def check(self, motion: Motion):
        if self.currents is not None and motion.actuator is None:
            hint = "Take fidelity: shaft or electromechanical, or leave `interference` out"
            raise BadInput("interference", "be of propellers that turn", "of thrusters without a speed", hint=hint)


def compass(
    period: float = 0.05,
    noise: float = 0.01,
    bias: float = 0.0,
    resolution: float = 0.0,
    delay: float = 0.0,
    dropout: float = 0.0,
    correlated_noise: float | None = None,
    correlation_time: float | None = None,
    hard_iron: float | None = None,
    soft_iron: float | None = None,
    interference: float | None = None,
    assumed_current: float = 10.0,
    current_variation: float | None = None,
    current_coefficient: float = 1.86e-4,
) -> Compass:
    """Heading, from a magnetic or fibre-optic compass.

    Args:
        period: between samples, s.
        noise: standard deviation, rad.
        bias: standard deviation of a constant offset, sampled once per run, rad.
        resolution: step of the reading, rad; 0 for none.
        delay: until a sample is delivered, s.
        dropout: probability that a sample is lost.
        correlated_noise: standard deviation of a further error, a first-order Gauss-Markov process, rad.
        correlation_time: of it, s: time in which its correlation falls to 1/e.
        hard_iron: standard deviation of B and C, each sampled once per run, of an error B sin yaw + C cos yaw, rad.
        soft_iron: likewise of D and E of an error D sin 2 yaw + E cos 2 yaw, rad.
        interference: likewise of an error (F sin yaw + G cos yaw) I with the sum I of the currents of the thrusters,
            rad/A; F and G wander with a correlation time of 60 s, because the thrusters that carry it change.
        assumed_current: sum of the currents with which a filter reckons that has no `propeller_speed`, A.
        current_variation: standard deviation of that sum with which such a filter reckons, A; it changes within 10 s.
            None for as much as `assumed_current`.
        current_coefficient: current of a thruster over the square of the speed of its propeller, A s^2/rad^2; that of a
            T200 is its torque coefficient over its motor constant. Currents while a propeller speeds up are neglected.
    """
    checks.not_negative("assumed_current", assumed_current, "A")
    variation = assumed_current if current_variation is None else current_variation
    checks.not_negative("current_variation", variation, "A")
    checks.not_negative("current_coefficient", current_coefficient, "A s^2/rad^2")
    simple = correlated_errors(correlated_noise, correlation_time)
    pairs = {
        "hard iron": (hard_iron, np.inf),
        "soft iron": (soft_iron, np.inf),
        "thrusters": (interference, _INTERFERENCE_TIME),
        "unknown currents": (interference, _VARIATION_TIME),
    }
    disturbed_by = () if simple is None else ("noise",)
    deviations, times = ([], []) if simple is None else ([correlated_noise], [correlation_time])
    for name, (deviation, time) in pairs.items():
        if deviation is not None:
            disturbed_by += (name,)
            deviations += [deviation] * 2
            times += [time] * 2
    errors = CorrelatedErrors(deviations, times) if disturbed_by else None
    sampling = Sampling(period, noise, bias, resolution, delay, dropout, errors=errors)
    currents = None if interference is None else ThrusterCurrents(current_coefficient, assumed_current, variation)
    return Compass(sampling, disturbed_by, currents)

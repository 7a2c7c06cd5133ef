"""Gate for the samples of an IMU: what the vehicle cannot do is not believed at once, and never without distrust."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from undertow.core import checks
from undertow.core.arrays import as_array
from undertow.core.errors import BadInput
from undertow.core.numerics.number import Number
from undertow.core.param import Param, param
from undertow.physics.sensors.imu import IMU

Inertial = Float[Array, "6"]  # p, q, r, rad/s; specific force along forward, starboard, down, m/s^2

# Largest acceleration of a vehicle whose actuators are not known, m/s^2 and rad/s^2; and what waves and tethers do to
# one of which they are.
_UNKNOWN = 20.0, 100.0
_LEAST = 5.0, 20.0
_GRAVITY = 9.81  # m/s^2, which accelerometers of a vehicle at rest read
_FULL_SCALE = 35.0, 160.0  # of MEMS devices, rad/s and m/s^2: what is larger was not measured
_RISE = 0.05  # s in which thrusters reach their largest force
_DEVIATIONS = 8.0  # of the noise of a sample: the difference of two is below it
_PATIENCE = 0.25  # s for which the last believed value stands for what the gate rejects
_FORGETTING = 2.0  # s in which distrust of what was believed in the end falls to 1/e
_LASTING = 0.1  # s for which an error of a sample in distrust stays the same


class InertialMemory(NamedTuple):
    """What the gate remembers of each axis of gyroscopes and accelerometers."""

    values: Inertial  # last believed sample
    age: Inertial  # s since then
    suspected: Inertial  # 1 where a sample was rejected since, else 0
    distrust: Inertial  # standard deviation of the error of what was believed after rejections
    rejected: Int[Array, ""]  # samples so far of which an axis was rejected


class InertialGate(eqx.Module):
    """Compares each sample with the last believed one: thrusters and water bound how fast it can change.

    A sample beyond is rejected, and the last believed value stands in its place. When this has gone on for a quarter of
    a second, or the difference is one that the vehicle could have reached in the meantime, the samples are believed
    again, as after a collision, but with a standard deviation as large as the difference, which fades over two seconds.
    What is larger than the vehicle can ever do is never believed.
    """

    authority: Float[Param, "6"] = param(
        "m/s^2, rad/s^2", "acceleration that the actuators give; 0 where it is not known"
    )
    inertial_factor: Float[Param, ""] = param("", "largest acceleration over that of the actuators")
    largest_rate: Float[Param, ""] = param("rad/s", "angular rate beyond which no sample is believed")

    @property
    def _acceleration(self) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
        """The largest ones along and about the axes of the body, m/s^2 and rad/s^2."""
        linear, angular = (
            jnp.where(authority > 0, jnp.maximum(self.inertial_factor * authority, least), unknown)
            for authority, least, unknown in zip(
                (self.authority[:3], self.authority[3:]), _LEAST, _UNKNOWN, strict=True
            )
        )
        return linear, angular

    @property
    def slew(self) -> Inertial:
        """Largest rate of change of gyroscopes and accelerometers, rad/s^2 and m/s^3."""
        linear, angular = self._acceleration
        return jnp.concatenate([angular, linear / _RISE])

    @property
    def step(self) -> Inertial:
        """Largest change between two samples, however far apart, rad/s and m/s^2."""
        linear, _ = self._acceleration
        return jnp.concatenate([jnp.full(3, 2 * self.largest_rate), 2 * linear])

    @property
    def most(self) -> Inertial:
        """Largest value that a device reads and the vehicle reaches, rad/s and m/s^2."""
        linear, _ = self._acceleration
        rate, force = _FULL_SCALE
        rates = jnp.full(3, jnp.minimum(self.largest_rate, rate))
        return jnp.concatenate([rates, jnp.minimum(_GRAVITY + 2 * linear, force)])

    def start(self, values: Inertial) -> InertialMemory:
        """The memory of a vehicle whose first sample may be any."""
        zero = jnp.zeros(6)
        none = jnp.zeros((), dtype=int)
        return InertialMemory(values, zero + _PATIENCE, zero, zero, none)

    def received(
        self, memory: InertialMemory, elapsed: Number, sample: Inertial, fresh: Bool[Array, ""], noise: Inertial
    ) -> InertialMemory:
        """The memory `elapsed` (s) later.

        Args:
            memory: of before.
            elapsed: s.
            sample: of the IMU; entries that are not finite were not measured.
            fresh: whether it is new.
            noise: standard deviation of a sample.
        """
        age, suspected = memory.age + elapsed, memory.suspected > 0
        distrust = memory.distrust / (1 + elapsed / _FORGETTING)
        measured = fresh & (jnp.abs(sample) <= self.most)
        change = jnp.where(measured, jnp.abs(sample - memory.values), 0.0)
        possible = jnp.minimum(self.slew * age, self.step) + _DEVIATIONS * noise
        plausible = change <= possible + 2 * distrust
        believed = measured & (plausible | (suspected & (age >= _PATIENCE)))
        missed = fresh & jnp.isfinite(sample) & ~believed
        return InertialMemory(
            values=jnp.where(believed, sample, memory.values),
            age=jnp.where(believed, 0.0, age),
            suspected=jnp.where(~believed & (suspected | missed), 1.0, 0.0),
            distrust=jnp.where(believed & suspected, jnp.maximum(distrust, change), distrust),
            rejected=memory.rejected + jnp.where(missed.any(), 1, 0),
        )

    def uncertainty(self, memory: InertialMemory) -> Inertial:
        """Density of the further noise of what is believed, (rad/s)^2 s and (m/s^2)^2 s; zero after no rejection.

        What a value that stands for a rejected one may be off by is three standard deviations.
        """
        held = jnp.where(memory.suspected > 0, jnp.minimum(self.slew * memory.age, self.step) / 3, 0.0)
        return memory.distrust**2 * _LASTING + held**2 * memory.age


def gate_for(authority, inertial_factor, largest_rate) -> InertialGate:
    """The gate of a vehicle.

    Args:
        authority: acceleration that the actuators can give along and about the axes of the body, m/s^2 and rad/s^2: six
            numbers, 0 where it is not known; None for none of them.
        inertial_factor: largest acceleration over that of the actuators.
        largest_rate: rad/s.

    Raises:
        BadInput: not six numbers, or one of them negative; a factor or a rate that is not positive.
    """
    checks.positive("inertial_factor", inertial_factor)
    checks.positive("largest_rate", largest_rate, "rad/s")
    authority_per_axis = as_array(np.zeros(6) if authority is None else authority)
    if authority_per_axis.shape != (6,):
        raise BadInput("authority", "be six numbers, m/s^2 and rad/s^2", f"of shape {authority_per_axis.shape}")
    checks.not_negative("authority", authority_per_axis, "m/s^2, rad/s^2")
    return InertialGate(authority_per_axis, inertial_factor, largest_rate)


def inertial_deviation(imu: IMU, scale: Number = 1.0) -> Inertial:
    """Standard deviation of a sample of gyroscopes and accelerometers."""
    return jnp.broadcast_to(jnp.asarray(imu.sampling.noise, dtype=float), (8,))[2:] * scale

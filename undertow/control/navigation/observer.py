"""Observer with constant gains, which estimates the motion of a vehicle from its sensors at every control step."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.control.navigation.drift import drift_advice
from undertow.control.navigation.estimate import Estimate, estimate_of
from undertow.control.navigation.from_sensors import AbstractFilter, SensorNavigation, check_sensors
from undertow.control.navigation.inertial_gate import (
    Inertial,
    InertialGate,
    InertialMemory,
    gate_for,
    inertial_deviation,
)
from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.core.numerics.linear_algebra import matvec
from undertow.core.numerics.rotations import Vector3, quaternion_from_euler
from undertow.core.param import Param, param
from undertow.core.signals import Signal
from undertow.physics.sensors.compass import Compass
from undertow.physics.sensors.depth import Depth
from undertow.physics.sensors.dvl import DVL
from undertow.physics.sensors.imu import IMU
from undertow.physics.sensors.motion import gravity
from undertow.physics.sensors.position_fix import PositionFix
from undertow.physics.sensors.propeller_speed import PropellerSpeed
from undertow.physics.sensors.received import Received
from undertow.physics.sensors.sensor import AbstractSensor


class NavigationObserverState(NamedTuple):
    """State of the observer."""

    estimate: Estimate
    inertial: InertialMemory  # samples of gyroscopes, rad/s, and accelerometers, m/s^2


class Observer(AbstractFilter):
    """Strapdown inertial navigation, corrected by every other sensor with a constant gain.

    Between readings the estimate is integrated from rates and acceleration of the IMU. A delayed reading is compared
    with the estimate of the time at which it was taken. There is no covariance and no estimate of a bias: an offset
    of the accelerometers, or of roll or pitch (times gravity), causes an error of the velocity: its growth between two
    readings of the DVL, divided by `dvl_blend`. A reading that is not finite counts as lost. Gyroscopes and
    accelerometers pass an `InertialGate`; other readings have none.

    Raises:
        BadInput: no IMU, a sensor that the observer does not know, or a blend outside (0, 1].
    """

    sensors: tuple[AbstractSensor, ...]
    inertial: InertialGate
    imu_blend: Float[Param, ""] = param("", "share of each new inclination in the estimated one")
    dvl_blend: Float[Param, ""] = param("", "share of each new velocity in the estimated one")
    compass_blend: Float[Param, ""] = param("", "share of each new heading in the estimated one")
    depth_blend: Float[Param, ""] = param("", "alpha of the alpha-beta filter of depth")
    fix_blend: Float[Param, ""] = param("", "alpha of the alpha-beta filter of north and east")
    propeller_blend: Float[Param, ""] = param("", "share of each new speed of the propellers in the estimated one")

    def __check_init__(self):
        check_sensors(self.sensors)
        for i, sensor in enumerate(self.sensors):
            if not isinstance(sensor, tuple(_CORRECTIONS)):
                kind, hint = type(sensor).__name__, "Take `kind: kalman`, which works with every sensor"
                raise BadInput(f"sensors[{i}]", "be one that the observer has a gain for", kind, hint=hint)
        for name in ("imu", "dvl", "compass", "depth", "fix", "propeller"):
            blend = getattr(self, f"{name}_blend")
            checks.positive(f"{name}_blend", blend)
            if not checks.assumed(lambda share: (share <= 1).all(), blend):
                raise BadInput(f"{name}_blend", "be at most 1", f"{float(blend):g}")

    def start(self, y) -> NavigationObserverState:
        estimate = estimate_of(y)
        if not any(isinstance(sensor, PropellerSpeed) for sensor in self.sensors):
            estimate = estimate._replace(actuator=None)
        at_rest = matvec(estimate.rotation().T, -gravity())
        return NavigationObserverState(estimate, self.inertial.start(jnp.concatenate([estimate.rates, at_rest])))

    def update(
        self, state: NavigationObserverState, elapsed, received: tuple[Received, ...]
    ) -> NavigationObserverState:
        readings = [
            (sensor, delivery.reading, delivery.fresh & jnp.isfinite(delivery.reading).all(), delivery.age)
            for sensor, delivery in zip(self.sensors, received, strict=True)
        ]
        estimate, memory = state
        for sensor, reading, new, _ in readings:
            if isinstance(sensor, IMU):
                memory = self.inertial.received(memory, elapsed, reading[2:], new, inertial_deviation(sensor))
                estimate = _either(new, _with_inertial(estimate, memory.values), estimate)
        estimate = estimate.predicted(elapsed)
        for sensor, reading, new, age in readings:
            correct = next(_CORRECTIONS[kind] for kind in _CORRECTIONS if isinstance(sensor, kind))
            estimate = _either(new, correct(self, sensor, estimate, reading, age), estimate)
        return NavigationObserverState(estimate, memory)

    def measurement(self, state: NavigationObserverState):
        return state.estimate.measurement()

    def signals(self):
        meaning = "samples of the IMU so far that no motion of the vehicle explains"
        return {"rejected_inertial": Signal((), "1", meaning)}

    def diagnostics(self, state: NavigationObserverState):
        return {"rejected_inertial": state.inertial.rejected}

    def advice(self, duration):
        return drift_advice(self.sensors, self.dvl_blend, duration)


def _with_inertial(estimate: Estimate, sample: Inertial) -> Estimate:
    """Rates and acceleration as gyroscopes and accelerometers read them."""
    acceleration = matvec(estimate.rotation(), sample[3:]) + gravity()
    return estimate._replace(rates=sample[:3], acceleration=acceleration)


def _inclination(observer: Observer, sensor, estimate: Estimate, reading, age) -> Estimate:
    return _turned(estimate, jnp.concatenate([reading[:2], estimate.angles()[2:]]), observer.imu_blend)


def _heading(observer: Observer, sensor, estimate: Estimate, reading, age) -> Estimate:
    heading = reading + age * estimate.rates[2]
    return _turned(estimate, jnp.concatenate([estimate.angles()[:2], heading]), observer.compass_blend)


def _velocity(observer: Observer, sensor, estimate: Estimate, reading, age) -> Estimate:
    """Compare the reading with the velocity at its time, from the acceleration since."""
    past_velocity = estimate.velocity - age * estimate.acceleration
    error = matvec(estimate.rotation(), reading) - past_velocity
    return estimate._replace(velocity=estimate.velocity + observer.dvl_blend * error)


def _down(observer: Observer, sensor, estimate: Estimate, reading, age) -> Estimate:
    return _fixed(estimate, slice(2, 3), reading, age, sensor.sampling.period, observer.depth_blend)


def _level(observer: Observer, sensor, estimate: Estimate, reading, age) -> Estimate:
    return _fixed(estimate, slice(0, 2), reading, age, sensor.sampling.period, observer.fix_blend)


def _propellers(observer: Observer, sensor, estimate: Estimate, reading, age) -> Estimate:
    """Speeds; their rate of change is the difference of successive readings."""
    before = estimate.actuator.speed
    speed = before + observer.propeller_blend * (reading - before)
    report = estimate.actuator._replace(speed=speed)
    if report.acceleration is not None:
        report = report._replace(acceleration=(speed - before) / sensor.sampling.period)
    return estimate._replace(actuator=report)


# How a reading of each sensor corrects the estimate; called after the prediction.
_CORRECTIONS = {
    IMU: _inclination,
    DVL: _velocity,
    Compass: _heading,
    Depth: _down,
    PositionFix: _level,
    PropellerSpeed: _propellers,
}


def _turned(estimate: Estimate, angles: Vector3, share) -> Estimate:
    """The estimate with its attitude turned by a share of the way towards Euler angles (rad)."""
    goal = quaternion_from_euler(angles)
    aligned = jnp.where((goal * estimate.attitude).sum() < 0, -goal, goal)
    between = (1 - share) * estimate.attitude + share * aligned
    return estimate._replace(attitude=between / jnp.sqrt((between * between).sum()))


def _fixed(estimate: Estimate, axes: slice, reading: Float[Array, " k"], age, period, share) -> Estimate:
    """Position and velocity corrected on some axes by a position that was read `age` ago: an alpha-beta filter.

    beta = alpha^2 / (2 - alpha) is that of Benedict and Bordner (1962), optimal for a given noise.
    """
    past_position = estimate.position[axes] - age * estimate.velocity[axes]
    error, beta = jnp.zeros(3).at[axes].set(reading - past_position), share**2 / (2 - share)
    return estimate._replace(
        position=estimate.position + share * error, velocity=estimate.velocity + beta / period * error
    )


def _either(fresh, new: Estimate, old: Estimate) -> Estimate:
    return jax.tree.map(lambda a, b: jnp.where(fresh, a, b), new, old)


def observer(
    sensors,
    imu_blend: float = 0.05,
    dvl_blend: float = 0.3,
    compass_blend: float = 0.05,
    depth_blend: float = 0.2,
    fix_blend: float = 0.2,
    propeller_blend: float = 1.0,
    authority=None,
    inertial_factor: float = 2.0,
    largest_rate: float = 10.0,
) -> SensorNavigation:
    """Navigation of a vehicle from its sensors, by an observer with constant gains. For the sampled loop.

    Args:
        sensors: any of imu, dvl, depth, position_fix, compass, propeller_speed; an IMU must be among them.
        imu_blend: share of each new inclination in the estimated one; the rest comes from the rates.
        dvl_blend: share of each new velocity in the estimated one; the rest comes from the accelerometers.
        compass_blend: share of each new heading in the estimated one; the rest comes from the rates.
        depth_blend: alpha of the alpha-beta filter of depth and its rate.
        fix_blend: alpha of the alpha-beta filter of north and east and their rates.
        propeller_blend: share of each new reading of propeller speeds in the estimate; 1 for no filter.
        authority: acceleration that the thrusters can give along and about the axes of the body, m/s^2 and rad/s^2; six
            numbers, 0 for one that is not known. It bounds how fast samples of the IMU change. None for that of the
            nominal model in a scenario, and for unknown elsewhere (20 m/s^2, 100 rad/s^2).
        inertial_factor: largest acceleration of the vehicle over that of the thrusters.
        largest_rate: angular rate beyond which no sample is believed, rad/s.
    """
    blends = imu_blend, dvl_blend, compass_blend, depth_blend, fix_blend, propeller_blend
    sensors = tuple(sensors)
    check_sensors(sensors)
    gate = gate_for(authority, inertial_factor, largest_rate)
    return SensorNavigation(filter=Observer(sensors, gate, *blends))

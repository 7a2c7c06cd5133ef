"""The cascade of autopilots: gains by pole placement, or the published ones of ArduSub and PX4."""

import math
from typing import Any

import jax.numpy as jnp
import numpy as np

from undertow.control.controllers.actuation import actuation_for
from undertow.control.controllers.bandwidths import axes_of, pid_frequency, scalar_if_uniform
from undertow.control.controllers.cascade_law import Cascade
from undertow.control.controllers.options import ActuationOptions, DesignConditions
from undertow.core import checks
from undertow.core.catalogue import by_preset
from undertow.core.contracts import Model
from undertow.core.errors import BadInput
from undertow.core.option_groups import flat_options
from undertow.core.runtime import double_outside_runs

# p / w of a cascade with the double pole of `pid`: 2 p^2 - w p + w^2 / 10 = 0; then k = 2 w and k_i = w^3 / (10 p).
_OUTER_SHARE = (1 + math.sqrt(0.2)) / 4
_GRAVITY = 9.80665  # m/s^2, GRAVITY_MSS of ArduPilot
_LEAN = math.radians(45.0)  # rad, ANGLE_MAX: 4500 cdeg
_THROTTLE = 0.2  # demand per m/s^2 and unit of PSC_ACCZ_P: 100 cm/m, thousandths of throttle, demand 2 per throttle
_AXES = 6
_UNFILTERED = 1e6  # rad/s: infinity has no gradient
_UNLIMITED = 1e6  # m/s^2, rad/s^2
_BLUEROV2_HEAVY = np.array([6.85, 6.60, 5.98, 119.2, 94.9, 61.4])  # m/s^2, rad/s^2: vonbenzon2022, T200s at 16 V


@flat_options()
def placed(
    model: Model,
    *,
    conditions: DesignConditions = DesignConditions(),
    outer=None,
    inner=None,
    integral=None,
    derivative=0.0,
    derivative_filter=_UNFILTERED,
    rate_limit=jnp.inf,
    actuation: ActuationOptions = ActuationOptions(),
) -> Cascade:
    """Cascade with the poles of `pid`: critically damped, with the frequency of least predicted cost.

    Args:
        model: nominal model, from `plant.model()`.
        outer: p, rate demanded per error, 1/s; one number or one per axis. None: 0.36 w, with the frequency w that
            `pid` chooses.
        inner: k, acceleration per error of the rate, 1/s; None: 2 w.
        integral: k_i, 1/s^2; None: 0.28 w^2. 0 for none.
        derivative: k_d, acceleration per derivative of the error of the rate.
        derivative_filter: bandwidth of its filter, rad/s; by default far beyond that of the sampling: none.
        rate_limit: largest rate demanded for an error, m/s and rad/s.
        reference_frequency: that of the filter of reference jumps, rad/s; None: half of sqrt(k p), 2 at most; 0 for
            no filter.

    Raises:
        BadInput: a value is out of its range.
    """
    model = model.in_body_axes()
    if any(gain is None for gain in (outer, inner, integral)):
        axes = axes_of(model, conditions)
        w = jnp.asarray(scalar_if_uniform([pid_frequency(axis) for axis in axes]), dtype=float)
        outer = _OUTER_SHARE * w if outer is None else outer
        inner = 2 * w if inner is None else inner
        integral = 0.1 / _OUTER_SHARE * w**2 if integral is None else integral
    return _cascade(
        model,
        conditions.sampling_time,
        actuation,
        outer=outer,
        inner=inner,
        integral=integral,
        derivative=derivative,
        derivative_filter=derivative_filter,
        rate_limit=rate_limit,
    )


@flat_options("velocity_noise", "load_rate", "delay", "feedforward", "motor", "actuator_rate")
def ardusub(
    model: Model,
    *,
    conditions: DesignConditions = DesignConditions(),
    authority=None,
    actuation: ActuationOptions = ActuationOptions(feedforward=False),
) -> Cascade:
    """Position and attitude control of ArduSub 4.5 with its default gains, for a vehicle with six degrees of freedom.

    ArduSub's gains act on a demand of -1 to 1 per axis, where 1 is full thrust of every thruster that acts on the axis.
    Here a demand of 1 is `authority`, the acceleration of that thrust on the nominal vehicle. In order surge and sway,
    heave, roll and pitch, yaw (file, parameter, value, and the factor with which it enters):

    - `libraries/AC_AttitudeControl/AC_PosControl.cpp`, PSC_POSXY_P = 1 and PSC_POSZ_P = 3: p, 1/s. PSC_VELXY_I = 0.5
      and, from `ArduSub/Parameters.h`, PSC_VELXY_P = 6: an acceleration, m/s^2, of which ArduSub makes a lean angle
      atan(a / g) and of this, over ANGLE_MAX = 45 degrees, the demand; here linear, 1 / (0.785 g) per m/s^2.
    - PSC_VELZ_P = 8, and the loop of the vertical acceleration, PSC_ACCZ_P = 0.5 and PSC_ACCZ_I = 0.1 in thousandths of
      throttle per cm/s^2: here in steady state, h / (1 + h) times the demanded acceleration with h = 0.1 A_z and
      A_z in m/s^2, for nothing measures the acceleration.
    - `AC_AttitudeControl_Sub.h`: ATC_ANG_*_P = 6, 1/s; ATC_RAT_RLL and PIT P = 0.135, I = 0.090, D = 0.0036, FLTD = 30
      Hz, IMAX = 0.444; ATC_RAT_YAW P = 0.18, I = 0.018, D = 0, IMAX = 0.222: demand per rad/s.
    - `ArduSub/Parameters.h`: WPNAV_SPEED = 100 and PILOT_SPEED_UP = 100 cm/s, ATC_RATE_Y_MAX = 180 degrees/s: limits of
      the demanded rates.

    Not comparable: ArduSub runs at 400 Hz with filters of 5 to 30 Hz on targets and errors, shapes its targets by
    limits of acceleration and jerk, treats thrust as linear in the demand, and inverts no model. Here the rates of the
    reference are fed forward, its jumps are filtered, and forces are allocated as for every other law.

    Args:
        model: nominal model, from `plant.model()`.
        authority: acceleration of a demand of 1 in each axis, m/s^2 and rad/s^2; one number or six. None: from the
            nominal model, or that of a BlueROV2 Heavy at 16 V where nothing limits the inputs.
        reference_frequency: that of the filter of reference jumps, rad/s; None: half of sqrt(k p), 2 at most; 0 for
            no filter.

    Raises:
        BadInput: a plant that is not a vehicle with six axes, or a value is out of its range.
    """
    model = model.in_body_axes()
    full_demand = _authority(model, conditions, authority)
    level = full_demand[:2] / (_LEAN * _GRAVITY)
    vertical, tilt, yaw = full_demand[2:3], full_demand[3:5], full_demand[5:]
    loop = 1 + _THROTTLE * 0.5 * vertical
    joined = lambda *parts: jnp.concatenate([jnp.broadcast_to(jnp.asarray(gain, dtype=float), n) for gain, n in parts])
    per_axis = lambda a, b, c, d: joined((a, 2), (b, 1), (c, 2), (d, 1))
    return _cascade(
        model,
        conditions.sampling_time,
        actuation,
        outer=per_axis(1.0, 3.0, 6.0, 6.0),
        inner=per_axis(6.0 * level, 8.0 * (loop - 1) / loop, 0.135 * tilt, 0.18 * yaw),
        integral=per_axis(0.5 * level, 8.0 * _THROTTLE * 0.1 * vertical / loop, 0.09 * tilt, 0.018 * yaw),
        derivative=per_axis(0.0, 0.0, 0.0036 * tilt, 0.0),
        derivative_filter=2 * math.pi * 30.0,
        rate_limit=per_axis(1.0, 1.0, jnp.inf, math.pi),
        integral_limit=per_axis(10.0 * level, vertical, 0.444 * tilt, 0.222 * yaw),
    )


@flat_options("velocity_noise", "load_rate", "delay", "feedforward", "motor", "actuator_rate")
def px4(
    model: Model,
    *,
    conditions: DesignConditions = DesignConditions(),
    authority=None,
    saturation=(0.1, 0.3),
    actuation: ActuationOptions = ActuationOptions(feedforward=False),
) -> Cascade:
    """Position and attitude control of PX4 for underwater vehicles with its default gains, for six degrees of freedom.

    PX4's modules demand a thrust and a torque of -1 to 1, as `ardusub`. They are proportional to the error and to the
    velocity, without integral; in a cascade, p is the first over the second (file, parameter, value):

    - `src/modules/uuv_pos_control/uuv_pos_control_params.yaml`: UUV_GAIN_X_P, Y_P, Z_P = 1, demand per metre;
      UUV_GAIN_X_D, Y_D, Z_D = 0.2, demand per m/s.
    - `src/modules/uuv_att_control/uuv_att_control_params.yaml`: UUV_ROLL_P, PITCH_P, YAW_P = 4, demand per rad;
      UUV_ROLL_D = 1.5, UUV_PITCH_D and UUV_YAW_D = 2, demand per rad/s; UUV_THRUST_SAT = 0.1 and UUV_TORQUE_SAT = 0.3,
      the largest demands.

    Not comparable: PX4's attitude error is the sine of the angle, its velocity is not relative to a reference, and a
    demand of 1 is normalised by its control allocation. The gains of the attitude suit fast thrusters and small
    authority: with thrusters that lag by 0.1 s they chatter between the largest demands. Nothing removes the error of a
    constant load, and a thrust of a tenth does not hold a BlueROV2 Heavy in a current of 0.4 m/s.

    Args:
        model: nominal model, from `plant.model()`.
        authority: acceleration of a demand of 1 in each axis, m/s^2 and rad/s^2; one number or six. None: from the
            nominal model, or that of a BlueROV2 Heavy at 16 V where nothing limits the inputs.
        saturation: largest demands of thrust and of torque; earlier releases have 1 and 1.
        reference_frequency: that of the filter of reference jumps, rad/s; None: half of sqrt(k p), 2 at most; 0 for
            no filter.

    Raises:
        BadInput: a plant that is not a vehicle with six axes, or a value is out of its range.
    """
    model = model.in_body_axes()
    full_demand = _authority(model, conditions, authority)
    proportional = jnp.asarray([1.0, 1.0, 1.0, 4.0, 4.0, 4.0])
    damping = jnp.asarray([0.2, 0.2, 0.2, 1.5, 2.0, 2.0])
    checks.positive("saturation", saturation)
    checks.length("saturation", saturation, 2, "thrust and torque")
    return _cascade(
        model,
        conditions.sampling_time,
        actuation,
        outer=proportional / damping,
        inner=damping * full_demand,
        limit=jnp.repeat(jnp.asarray(saturation, dtype=float), 3) * full_demand,
    )


PRESETS = {
    "placed": double_outside_runs(placed),
    "ardusub": double_outside_runs(ardusub),
    "px4": double_outside_runs(px4),
}


def cascade(model: Model, *, preset: str = "placed", **options: Any) -> Cascade:
    """Position P, velocity PID, attitude P, rate PID: the cascade that autopilots use. Body axes and quaternions.

    Args:
        model: nominal model, from `plant.model()`.
        preset: `placed`, with the poles of `pid`, or `ardusub` or `px4`, with the default gains of these autopilots.
        options: those of the preset; see `undertow.control.controllers.cascade`.

    Raises:
        BadInput: no such preset or option, or a value is out of its range.
    """
    return by_preset(PRESETS, preset, model, options)


cascade.presets = PRESETS  # pyright: ignore[reportFunctionMemberAccess] - a scenario and `describe` find their options here


def _authority(model: Model, conditions: DesignConditions, authority):
    """Acceleration of a demand of 1 in each of the six axes."""
    if len(model.coordinates.axes) != _AXES:
        raise BadInput("preset", "be `placed` for a plant that is not a vehicle with six axes", "that of an autopilot")
    if authority is not None:
        checks.positive("authority", authority, "m/s^2, rad/s^2")
        checks.per_axis("authority", authority, _AXES)
        return jnp.broadcast_to(jnp.asarray(authority, dtype=float), _AXES)
    default = np.array([axis.authority for axis in axes_of(model, conditions)])
    return jnp.asarray(default if (default < _UNLIMITED).all() else _BLUEROV2_HEAVY)


def _cascade(
    model: Model,
    sampling_time: float,
    actuation: ActuationOptions,
    *,
    outer,
    inner,
    integral: Any = 0.0,
    derivative: Any = 0.0,
    derivative_filter: Any = _UNFILTERED,
    rate_limit: Any = jnp.inf,
    integral_limit: Any = jnp.inf,
    limit: Any = jnp.inf,
) -> Cascade:
    """The law with its path."""
    for name, value in (("outer", outer), ("inner", inner)):
        checks.positive(name, value, "1/s")
    frequency = jnp.sqrt(jnp.asarray(outer, dtype=float) * jnp.asarray(inner, dtype=float))
    return Cascade(
        model=model,
        actuation=actuation_for(sampling_time, frequency, actuation),
        outer=outer,
        inner=inner,
        integral=integral,
        derivative=derivative,
        derivative_filter=derivative_filter,
        rate_limit=rate_limit,
        integral_limit=integral_limit,
        limit=limit,
    )

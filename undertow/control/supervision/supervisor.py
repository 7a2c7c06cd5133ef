"""The supervisor with its defaults: gates, limits and times for a controller and a plant."""

from typing import Any

import jax.numpy as jnp
import numpy as np

from undertow.control.supervision.condition_values import ConditionValues
from undertow.control.supervision.fault_tolerant_law import fault_tolerant
from undertow.control.supervision.innovations import InnovationMonitor
from undertow.control.supervision.measurement_gate import MeasurementGate
from undertow.control.supervision.reported_input import ReportedInput
from undertow.control.supervision.stuck_readings import StuckReadings
from undertow.control.supervision.supervised_controller import Supervised
from undertow.control.supervision.tracking_allowance import TrackingAllowance
from undertow.core import checks
from undertow.core.authority import BEYOND, authority_of, limits_of
from undertow.core.contracts import AbstractController, AbstractPlant, Outputs
from undertow.core.errors import BadInput

_EQUAL = 10  # readings of the same bits, from which on they may be stuck
_PERIODS = 3  # the same where readings are rarer than control steps
_SHARE = 10.0  # of the largest acceleration of the actuators that an estimate may have
_LEAST = 1.0  # m/s^2 or rad/s^2 that an estimate may have in any case
_UNLIMITED = 500.0  # the same without limits of the actuators
_DECAY = 10.0  # s in which an allowed tracking error of the size of its limit decays


def supervisor(
    law: AbstractController,
    plant: AbstractPlant,
    fallback: AbstractController | None = None,
    *,
    sampling_time: float = 1e-2,
    update_period: float = 0.0,
    safe_output: Any = 0.0,
    slew: float = 1.0,
    max_distance: float = 1e4,
    max_speed: float = 10.0,
    max_rate: float = 10.0,
    jump_position: float = 1.0,
    jump_angle: float = 0.5,
    jump_velocity: float = 1.0,
    jump_rate: float = 1.0,
    stuck_distance: float = 0.02,
    stuck_angle: float = 0.02,
    max_position_error: float = 1.0,
    max_angle_error: float = 0.8,
    max_estimate: float | None = None,
    max_variation: float = 10.0,
    thruster_faults: bool = True,
    restarts: int = 3,
    stop_after: float = 60.0,
    hold_after_jump: bool = True,
) -> Supervised:
    """A supervisor around a controller.

    Args:
        law: the controller.
        plant: for the limits of its inputs, and for the accelerations that they can give.
        fallback: controller that takes over where the law fails again and again, or chatters; None for none.
        sampling_time: that of the loop, s; a scenario sets it.
        update_period: longest time between two readings of a sensor, s; 0 for one at every step.
        safe_output: input where nobody controls; one number or one per actuator, in the unit of the input.
        slew: fastest change of the input when control begins or changes hands, ranges from limit to limit per second.
        max_distance: largest plausible coordinate, m.
        max_speed: largest plausible velocity, m/s.
        max_rate: largest plausible angular velocity, rad/s.
        jump_position: largest plausible difference between a measured position and its prediction, m.
        jump_angle: the same of the attitude, rad.
        jump_velocity: the same of velocity, m/s.
        jump_rate: the same of angular velocity, rad/s.
        stuck_distance: motion missing from a reading of the same bits from which on it is stuck, m.
        stuck_angle: the same of rotation, rad.
        max_position_error: tracking error that is always allowed, m.
        max_angle_error: the same of the attitude, rad.
        max_estimate: largest plausible estimate of the uncertainty, m/s^2 and rad/s^2; None for ten times the
            acceleration that the actuators can give, and 500 where they have no limit.
        max_variation: variation of the input that counts as chattering, ranges from limit to limit per second.
        thruster_faults: whether failed thrusters of a vehicle are looked for, and replaced by the others.
        restarts: of the law within ten minutes; one more, and the fallback takes over, or the state is SAFE.
        stop_after: time in SAFE after which control does not begin again by itself, s.
        hold_after_jump: whether control that begins again after readings have jumped holds the present place until the
            operator asks for `run` or gives another target; if not, it goes on to its reference.

    Raises:
        BadInput: a value is out of its range.
    """
    x = plant.initial_state()
    low, high, start = *limits_of(plant, x), plant.output(jnp.zeros(()), x)
    checks.positive("sampling_time", sampling_time, "s")
    checks.not_negative("update_period", update_period, "s")
    if restarts < 0:
        raise BadInput("restarts", "not be negative", restarts)
    count = low.shape[0]
    if np.shape(safe_output) not in ((), (count,)):
        raise BadInput("safe_output", f"be one number or {count}, one per actuator", safe_output)
    within_limits = lambda safe, low, high: ((safe >= low) & (safe <= high)).all()
    if not checks.assumed(within_limits, safe_output, low, high):
        limits = f"{float(low.min()):g} to {float(high.max()):g} {plant.input_unit}"
        raise BadInput("safe_output", f"be within the limits of the input, {limits}", safe_output)
    vehicle = start.body is not None
    of_vehicle = lambda limit: limit if vehicle else np.inf
    readings = max(_EQUAL, int(np.ceil(_PERIODS * update_period / sampling_time)))
    gate = MeasurementGate(
        StuckReadings(stuck_distance, stuck_angle, float(readings), law.model.coordinates.angles),
        InnovationMonitor(),
        max_distance=of_vehicle(max_distance),
        max_speed=of_vehicle(max_speed),
        max_rate=of_vehicle(max_rate),
        jump_position=of_vehicle(jump_position),
        jump_angle=of_vehicle(jump_angle),
        jump_velocity=of_vehicle(jump_velocity),
        jump_rate=of_vehicle(jump_rate),
    )
    if thruster_faults and vehicle:
        law = fault_tolerant(law, sampling_time, (low, high))
        fallback = None if fallback is None else fault_tolerant(fallback, sampling_time, (low, high))
    authority = authority_of(law.model, plant)
    estimate = largest_estimate(authority) if max_estimate is None else max_estimate
    lowest, highest = jnp.maximum(low, -BEYOND), jnp.minimum(high, BEYOND)
    return Supervised(
        law=law,
        fallback=fallback,
        gate=gate,
        report=ReportedInput(authority, highest - lowest),  # pyright: ignore[reportArgumentType] - arrays are Params
        tracking=TrackingAllowance(max_position_error, max_angle_error, _DECAY),
        watch=ConditionValues(lowest, highest, estimate, max_variation, restarts),
        model=law.model,
        sampling_time=sampling_time,
        safe_output=jnp.broadcast_to(jnp.asarray(safe_output, dtype=float), (count,)),
        slew=slew,
        stop_after=stop_after,
        hold_after_jump=hold_after_jump,
    )


def largest_estimate(authority: Outputs) -> Outputs:
    """Largest plausible estimate of the uncertainty along each axis of a model, m/s^2 and rad/s^2.

    It is ten times the acceleration that the actuators can give, and 500 where they have no limit.
    """
    limited = jnp.isfinite(authority) & (authority > 0)
    return jnp.where(limited, jnp.maximum(_SHARE * authority, _LEAST), _UNLIMITED)

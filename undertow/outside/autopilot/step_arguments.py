"""What a caller gives a step of a controller: checked, and in the form that the compiled step takes."""

from typing import Any

import jax
import numpy as np

from undertow.core import checks
from undertow.core.checks import numbers
from undertow.core.contracts import Target
from undertow.core.errors import BadInput
from undertow.outside.autopilot.functions import StepInputs
from undertow.outside.autopilot.measured_motion import MeasuredMotion

_NO_ROTATION = 1e-6  # largest entry of a quaternion that is none


class StepArguments:
    """Arguments of `Autopilot.start` and `Autopilot.step`; each method raises BadInput where one has a wrong shape.

    Args:
        form: inputs of the compiled step, of which the shapes count.
        actuators: their number.

    Attributes:
        no_report: of the propellers, where they were not measured.
    """

    def __init__(self, form: StepInputs, actuators: int):
        self._form = form
        self._motion_shapes = [leaf.shape for leaf in form.motion]
        self._input_shape = (actuators,)
        self.no_report = self.report(None, missing=np.nan)

    def motion(self, position: Any, velocity: Any, attitude: Any) -> MeasuredMotion:
        """The measured motion."""
        parts = zip(MeasuredMotion._fields, (position, attitude, velocity), self._motion_shapes, strict=True)
        return MeasuredMotion(*(numbers(name, value, shape) for name, value, shape in parts))

    def report(self, propellers: Any, missing: float) -> Any:
        """What the propellers report, of the form that the plant has; `missing` stands for everything not given."""
        leaves, form = jax.tree.flatten(self._form.actuator)
        if propellers is None:
            return jax.tree.unflatten(form, [np.full(leaf.shape, missing) for leaf in leaves])
        parts = propellers if isinstance(propellers, tuple) else (propellers,)
        if not leaves:
            raise BadInput("propellers", "be left out: the actuators of this plant report nothing", "given")
        if len(parts) != len(leaves):
            must = "be the speeds alone" if len(leaves) == 1 else "be (speeds, accelerations)"
            raise BadInput("propellers", must, f"{len(parts)} parts")
        values = [numbers("propellers", part, leaf.shape) for part, leaf in zip(parts, leaves, strict=True)]
        return jax.tree.unflatten(form, values)

    def health(self, health: Any) -> Any:
        """Health of the actuators, of the form that the loop has; all work unless it is given."""
        like = self._form.health
        if like is None and health is not None:
            raise BadInput("health", "be left out: no actuator of this scenario announces a failure", "given")
        if like is None:
            return None
        return np.ones(like.shape) if health is None else numbers("health", health, like.shape)

    def target(self, target: Any) -> Target:
        """Outputs to reach, or (outputs, rates, accelerations), all finite."""
        shape = np.shape(self._form.target.position)
        has_parts = isinstance(target, tuple | list) and len(target) and np.ndim(target[0]) > 0
        parts = target if has_parts or np.ndim(target) == 2 else (target,)
        if len(parts) > 3:
            raise BadInput("target", "be outputs, or (outputs, rates, accelerations)", f"{len(parts)} parts")
        values: list[Any] = [numbers("target", part, shape) for part in parts]
        for part in values:
            checks.finite("target", part)
        return Target(*values, *[np.zeros(shape)] * (3 - len(values)))

    def input(self, applied: Any) -> np.ndarray:
        """An applied input, all finite."""
        values = numbers("applied", applied, self._input_shape)
        checks.finite("applied", values)
        return values

    def reported(self, applied: Any, commanded: np.ndarray) -> np.ndarray:
        """An applied input; for entries that are not finite the commanded one."""
        values = numbers("applied", applied, self._input_shape)
        return np.where(np.isfinite(values), values, commanded)


def is_no_rotation(attitude: np.ndarray) -> bool:
    """Whether it is a quaternion of no length, or of one that no rounding gives."""
    return attitude.shape == (4,) and not _NO_ROTATION <= np.abs(attitude).max() <= 1 / _NO_ROTATION

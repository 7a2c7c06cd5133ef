"""The thruster commands of a log, whatever the vehicle does: open loop."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from undertow.control.controllers.elapsed_time import EARLY, ElapsedTime, time_at_begin
from undertow.core import checks
from undertow.core.contracts import AbstractController, Measurement, Model, Target
from undertow.core.errors import BadInput
from undertow.core.param import Param, param
from undertow.logs.log import Log
from undertow.logs.motion import inputs_of


class Replay(AbstractController):
    """Inputs from samples, held or linear in between; the first before, the last after all of them. State z: the time.

    Raises:
        BadInput: fewer than two samples, not finite, times that do not increase, or another number of inputs.
    """

    model: Model
    linear: bool = eqx.field(static=True)
    commands: Float[Param, "rows columns"] = param("s, then V or N", "rows (t, u1, u2, ...)")
    early: Float[Param, ""] = param("s", "time by which a sample counts early, computed from all rows")

    def __init__(self, model: Model, commands, linear: bool):
        rows = np.asarray(commands, dtype=float)
        checks.rows_over_time("commands", rows, "t, u1, u2, ...")
        inputs = _inputs(model)
        if rows.shape[1] != 1 + inputs:
            must = f"have {inputs} inputs, as many as the vehicle has thrusters"
            raise BadInput("commands", must, f"those of {rows.shape[1] - 1}", hint="Is it the log of another vehicle?")
        self.model, self.linear = model, linear
        self.commands, self.early = jnp.asarray(rows), jnp.asarray(EARLY * np.median(np.diff(rows[:, 0])))

    def init(self, y: Measurement, r: Target) -> ElapsedTime:
        return time_at_begin(y.position)

    def command(self, z: ElapsedTime, y: Measurement, r: Target):
        times, inputs = self.commands[:, 0], self.commands[:, 1:]
        if not self.linear:
            i = jnp.clip(jnp.searchsorted(times, z.time + self.early, side="right") - 1, 0, times.shape[0] - 1)
            return inputs[i], {}
        t = jnp.clip(z.time, times[0], times[-1])
        i = jnp.clip(jnp.searchsorted(times, t, side="right") - 1, 0, times.shape[0] - 2)
        share = (t - times[i]) / (times[i + 1] - times[i])
        return inputs[i] + share * (inputs[i + 1] - inputs[i]), {}

    def advance(self, z: ElapsedTime, y: Measurement, r: Target, u_applied, dt) -> ElapsedTime:
        return z.after(dt)

    def signals(self):
        return {}


def _inputs(model: Model) -> int:
    """Number of inputs of a plant, from its nominal model; only shapes are computed."""
    zero = jnp.zeros(len(model.coordinates.angles))
    return jax.eval_shape(lambda x: model.dynamics.gain(model.coordinates.measurement(x, x)), zero).shape[1]


def replay(model: Model, commands, interpolation: str = "hold") -> Replay:
    """Thruster commands of a log, in open loop; in a scenario, `file: dive.mcap` gives them, and a `mapping`.

    From `commanded_input` of the log, or else `input`. The run begins at the first sample of the log.

    Args:
        model: nominal model, from `plant.model()`; only its number of inputs matters.
        commands: rows of time (s) and one value per input (the unit of the plant's input).
        interpolation: hold (each sample until the next one) or linear.
    """
    checks.choice("interpolation", interpolation, ("hold", "linear"))
    return Replay(model.in_body_axes(), commands, interpolation == "linear")


def _of_log(log: Log, model: Model) -> np.ndarray:
    """Rows of a log, from its first sample on; the motors of a frame of ArduSub become the thrusters of the model."""
    dynamics = getattr(model.dynamics, "affine", model.dynamics)
    series = inputs_of(log, thruster_matrix=getattr(dynamics, "thruster_matrix", None))
    return np.column_stack([series.time - series.time[0], series.values])


replay.rows_of_log = _of_log  # pyright: ignore[reportFunctionMemberAccess] - as `presets` of others

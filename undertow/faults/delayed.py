"""A signal that arrives late."""

import math

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from undertow.core import checks
from undertow.core.errors import BadInput
from undertow.core.param import Param, param
from undertow.faults.mode import READINGS, AbstractMode, Altered, Severity

_MOST = 512  # control steps that are remembered


class Delayed(AbstractMode):
    """The signal of a whole number of control steps ago, the nearest to the severity; before t = 0 the first one.

    Raises:
        BadInput: sampling time not positive, or a delay of more than 512 control steps.
    """

    slots: int = eqx.field(static=True)  # control steps that are remembered
    sampling_time: Float[Param, ""] = param("s", "sampling time of the loop")
    targets = (*READINGS, "thruster")
    severity = Severity("delay", "s", 0.1, 0.0, 10.0)
    delays = True

    def __check_init__(self):
        checks.positive("sampling_time", self.sampling_time, "s")

    def init(self, value):
        return jnp.broadcast_to(value, (self.slots, *value.shape))

    def apply(self, memory, moment, value):
        newest = (jnp.arange(self.slots) == moment.step % self.slots)[:, None]
        memory = jnp.where(newest, value, memory)
        late = jnp.clip(jnp.round(moment.severity / self.sampling_time), 0, self.slots - 1).astype(int)
        return Altered(memory[(moment.step - late) % self.slots], jnp.asarray(True)), memory


def delayed(longest: float = 0.1, sampling_time: float = 1e-3) -> Delayed:
    """The signal as it was some time ago. A navigation filter takes a late reading for a new one.

    Args:
        longest: largest severity, s; a scenario sets it.
        sampling_time: that of the loop, s; a scenario sets it.

    Raises:
        BadInput: `longest` is negative, or more than 511 control steps.
    """
    checks.positive("sampling_time", sampling_time, "s")
    checks.not_negative("longest", longest, "s")
    steps = math.ceil(float(np.asarray(longest)) / float(np.asarray(sampling_time)) - 1e-6)
    if steps >= _MOST:
        limit = f"{(_MOST - 1) * sampling_time:g} s"
        raise BadInput("severity", f"be at most {_MOST - 1} control steps ({limit}) for a delay", f"{longest:g} s")
    return Delayed(steps + 1, sampling_time)

"""What is counted inside a loop at every control step: inputs beyond their limits, values that are not finite, errors.

It needs a few numbers, however long a run is, so that a day of simulated time fits in memory.
"""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.simulation.loop.recorded_signals import Signals
from undertow.simulation.loop.sampled import AbstractAccumulator

# Relative share by which a limit may be exceeded: rounding of a clip in the precision of the run.
_ROUNDING = 1e-6


class Counts(NamedTuple):
    """Counts of a run so far; on the host with a leading axis over runs."""

    steps: Float[Array, ""]
    undefined_inputs: Float[Array, ""]  # steps whose input on the plant is not finite
    exceeded_limits: Float[Array, ""]  # steps whose input on the plant is beyond a limit
    undefined_outputs: Float[Array, ""]  # steps whose position or velocity is not finite
    samples: Float[Array, " windows"]  # steps in each window of time
    squares: Float[Array, "windows n"]  # of the tracking error, summed over each window
    weights: Float[Array, " windows"]  # largest weight of the law in each window; zero for a law without weights


class Watch(AbstractAccumulator):
    """Counts never-events, and the tracking error in windows of equal length.

    Attributes:
        least, largest: limits of the plant's inputs, shape (m,), in their unit.
        length: of a window, s.
        windows: how many; the last one takes what is later.
    """

    least: Float[Array, " m"]
    largest: Float[Array, " m"]
    length: Float[Array, ""]
    windows: int = eqx.field(static=True)

    def init(self, signals: Signals) -> Counts:
        zero, zero_per_window = jnp.zeros(()), jnp.zeros(self.windows)
        return Counts(
            zero, zero, zero, zero, zero_per_window, jnp.zeros((self.windows, *signals["error"].shape)), zero_per_window
        )

    def update(self, state: Counts, t: Float[Array, ""], signals: Signals) -> Counts:
        acting = signals.get("acting_input", signals["input"])
        margin = _ROUNDING * (jnp.abs(self.least) + jnp.abs(self.largest))
        within = (acting >= self.least - margin) & (acting <= self.largest + margin)
        outputs = jnp.isfinite(signals["position"]).all() & jnp.isfinite(signals["velocity"]).all()
        finite = jnp.isfinite(acting).all() & jnp.isfinite(signals["commanded_input"]).all()
        now = jnp.minimum(jnp.floor(t / self.length + 1e-9), self.windows - 1.0)
        in_window = jnp.where(jnp.arange(self.windows, dtype=t.dtype) == now, 1.0, 0.0)
        largest = jnp.abs(signals["weights_peak"]).max() if "weights_peak" in signals else jnp.zeros(())
        return Counts(
            state.steps + 1.0,
            state.undefined_inputs + jnp.where(finite, 0.0, 1.0),
            state.exceeded_limits + jnp.where(finite & ~within.all(), 1.0, 0.0),
            state.undefined_outputs + jnp.where(outputs, 0.0, 1.0),
            state.samples + in_window,
            state.squares + in_window[:, None] * signals["error"][None, :] ** 2,
            jnp.maximum(state.weights, in_window * largest),
        )

"""Result of a loop, and how compiled code reports failure."""

from typing import Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float, Int, PyTree

from undertow.core.contracts import Inputs
from undertow.core.expected_measurement import all_finite
from undertow.core.status import Status
from undertow.simulation.loop.closed_loop import ClosedLoop
from undertow.simulation.loop.recorded_signals import Signals


class Ending(NamedTuple):
    """How and when a run ended; it continues while the status is OK."""

    status: Int[Array, ""]  # a Status code
    time: Float[Array, ""]  # s; when it failed
    input: Int[Array, ""]  # number, from 1, of the first commanded input that is not finite; 0 for none

    def until(self, end: Any) -> "Ending":
        """The ending with time `end` (s) if the run has not failed."""
        return self._replace(time=jnp.where(self.status == int(Status.OK), end, self.time))

    def blamed(self, command: Inputs, t: Any) -> "Ending":
        """The ending with the cause if the run failed at `t` (s) by a command that is not finite."""
        failed = (self.status == int(Status.NOT_FINITE)) | (self.status == int(Status.STEPS_EXHAUSTED))
        input_number = wrong_input(command)
        by_command = Ending(jnp.asarray(int(Status.COMMAND_NOT_FINITE)), jnp.asarray(t, dtype=float), input_number)
        return Ending(
            *(jnp.where(failed & (input_number > 0), new, old) for new, old in zip(by_command, self, strict=True))
        )


def running() -> Ending:
    """Ending of a run that begins."""
    return Ending(jnp.asarray(int(Status.OK)), jnp.zeros(()), jnp.zeros((), dtype=int))


class Outcome(NamedTuple):
    """One run: recorded signals, accumulated statistics and ending."""

    time: Float[Array, " records"]  # s
    signals: Signals  # one entry per record, the end included
    accumulated: Any  # final states of the accumulators
    final: Any  # states (x, z) of plant and controller at the end
    status: Int[Array, ""]  # a Status code
    ended: Float[Array, ""]  # s; when it failed, else the duration
    input: Int[Array, ""]  # number, from 1, of the first commanded input that is not finite; 0 for none

    def sentence(self) -> str:
        """How the run ended, in a sentence."""
        status, detail = Status(int(self.status)), ""
        if status is Status.COMMAND_NOT_FINITE:
            detail = f" It is input {int(self.input)}, at {float(self.ended):.6g} s."
        return status.sentence + detail


def status_of(loop: ClosedLoop, x: PyTree, z: PyTree) -> Array:
    """Status code of an instant; a status that the coordinates of the controller's model tolerate is no failure."""
    code = loop.plant.status(x)
    for tolerated in loop.controller.model.coordinates.tolerated_status:
        code = jnp.where(code == int(tolerated), int(Status.OK), code)
    return jnp.where(all_finite((x, z)), code, int(Status.NOT_FINITE))


def wrong_input(command: Inputs) -> Int[Array, ""]:
    """Number, from 1, of the first input that is not finite; 0 for none."""
    numbers = jnp.arange(1, command.shape[0] + 1)
    first = jnp.where(jnp.isfinite(command), command.shape[0] + 1, numbers).min()
    return jnp.where(first > command.shape[0], 0, first)

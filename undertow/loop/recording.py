"""Recording of the fixed-step loops, and a run as a labelled dataset."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Array, Float, Int

from undertow.core.contracts import AbstractPlant, Inputs
from undertow.core.signals import Signal
from undertow.core.status import Status
from undertow.loop.closed_loop import ClosedLoop, Realization, Signals
from undertow.loop.outcome import Ending, Outcome, status_of, wrong_input


def record(
    realization: Realization,
    control_step: Callable[[Any, Int[Array, ""]], Any],
    carry: Any,
    dt: Float[Array, ""],
    steps: int,
    every: int,
) -> tuple[Any, tuple[Float[Array, " records"], Signals]]:
    """Run `steps` steps and record every `every`-th instant, the first included.

    Args:
        realization: closed loop to run.
        control_step: carry and number k of the control step -> carry one step later.
        carry: carried between control steps; the states (x, z, ...) first.
        dt: time between steps, s.
        steps: how many.
        every: steps per record.
    """

    def block(carry, first):
        """Record, then run to the next record or to the end."""
        t, until = instant(first, dt), jnp.minimum(first + every, steps)
        sample = realization.record(t, *carry[0])
        return jax.lax.fori_loop(first, until, lambda k, c: control_step(c, k), carry), (t, sample)

    return jax.lax.scan(block, carry, jnp.arange(0, steps + 1, every))


def freeze_on_failure(
    loop: ClosedLoop,
    old: Any,
    new: Any,
    ending: Ending,
    t: Float[Array, ""],
    dt: Float[Array, ""],
    command: Inputs | None = None,
) -> tuple[Any, Ending]:
    """States (x, z, ...) at t + dt: the new ones, or the last valid ones after a failure.

    Args:
        loop: closed loop.
        old, new: states before and after.
        ending: of the run so far.
        t, dt: s.
        command: of the control step, where a command that is not finite ends the run.
    """
    code, time, wrong = status_of(loop, *new[:2]), t + dt, jnp.zeros((), dtype=int)
    if command is not None:
        wrong = wrong_input(command)
        code = jnp.where(wrong > 0, int(Status.COMMAND_NOT_FINITE), code)
        time = jnp.where(wrong > 0, t, time)
    failing = (ending.status == int(Status.OK)) & (code != int(Status.OK))
    ending = Ending(*(jnp.where(failing, now, was) for now, was in zip((code, time, wrong), ending, strict=True)))
    valid = ending.status == int(Status.OK)
    return jax.tree.map(lambda n, o: jnp.where(valid, n, o), new, old), ending


def instant(control_step: Int[Array, ""], dt: Float[Array, ""]) -> Float[Array, ""]:
    """Time of a control step, s."""
    return jnp.asarray(control_step, dtype=float) * dt


def to_dataset(outcome: Outcome, loop: ClosedLoop) -> xr.Dataset:
    """Recorded series with coordinates `time` (s), `axis` (names of the outputs) and `actuator` (numbers from 1)."""
    variables = {
        name: series(dimensions(signal), np.asarray(outcome.signals[name]), *meaning(signal, loop.plant))
        for name, signal in loop.signals().items()
    }
    status = Status(int(outcome.status))
    return xr.Dataset(
        variables,
        coords=coordinates(np.asarray(outcome.time), loop.plant),
        attrs={"status": status.word, "status_sentence": outcome.sentence(), "ended": float(outcome.ended)},
    )


def coordinates(time: np.ndarray, plant: AbstractPlant) -> dict[str, xr.Variable]:
    """Coordinates of the dimensions `time` (s), `axis` (names of the outputs) and `actuator` (numbers from 1)."""
    axis = series(("axis",), np.array(plant.outputs), "output")
    axis.attrs["unit_of_each"] = ", ".join(plant.output_units)
    return {
        "time": series(("time",), time, "time", "s"),
        "axis": axis,
        "actuator": series(("actuator",), np.arange(1, plant.inputs() + 1), "input"),
    }


def dimensions(signal: Signal) -> tuple[str, ...]:
    """Names of the dimensions of a series."""
    return ("time", *signal.dimensions)


def meaning(signal: Signal, plant: AbstractPlant) -> tuple[str, str]:
    """Meaning of a signal and its unit; the units of all axes where they differ."""
    return signal.meaning, signal.unit_for(plant.output_units, plant.input_unit)


def series(dims: tuple[str, ...], values: np.ndarray, meaning: str, unit: str | None = None) -> xr.Variable:
    """One variable of a dataset; as a plain array, for which xarray does not import dask."""
    units = {} if unit is None else {"units": unit}
    return xr.Variable(dims, values, {"long_name": meaning, **units}, fastpath=True)

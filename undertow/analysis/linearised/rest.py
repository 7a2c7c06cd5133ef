"""Where a closed loop rests under a constant load: found by Newton's method, whether the loop is stable or not."""

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from undertow.analysis.linearised.pieces import Local, Parts, take_apart
from undertow.core.contracts import AbstractModel, Measurement
from undertow.loop.closed_loop import ClosedLoop

_STEPS = 30
_LENGTHS = (1.0, 0.5, 0.25, 0.1)  # of a step
_FIRST_SHARE, _SMALLEST_SHARE = 0.25, 0.02  # of a load that is put on little by little
_WORSE = 100.0  # times the residual before: further than this nothing is looked for
_AT_REST = 1e-8  # of what moves, in SI units
_SETTLING = 400  # sampling times that an actuator is given to come to a force


class Rest(NamedTuple):
    """A loop at rest.

    Attributes:
        parts: the loop.
        at: vectors of states, input, load; see `Parts.differentiate`.
        local: values and slopes there.
        moving: what still moves, largest rate in SI units; not small where no input can hold the load.
        acting: which entries of the plant's state act on anything; the others (counters of energy) only follow.
    """

    parts: Parts
    at: dict[str, np.ndarray]
    local: Local
    moving: float
    acting: np.ndarray

    @property
    def found(self) -> bool:
        """Whether it rests."""
        return self.moving < 1e-5


def rest(loop: ClosedLoop, dt: float, position: Any, load: Any) -> Rest:
    """The loop at rest at a reference, under a constant load.

    Args:
        loop: the five roles; reference, disturbance and sensor are left out.
        dt: sampling time, s.
        position: of the reference, m and rad.
        load: acceleration of the outputs, m/s^2 and rad/s^2.
    """
    parts, start = take_apart(loop, position)
    load = np.asarray(load, dtype=float)
    acting = _acting(parts.differentiate(start, dt))
    found = _from_afar(parts, start, load, dt, acting)
    # Where that fails, the load is put on little by little, from a share that can be held.
    share, step = 0.0, _FIRST_SHARE
    held = found if found.found else _from_afar(parts, start, share * load, dt, acting)
    while not found.found and held.found and step > _SMALLEST_SHARE:
        further = _onward(held, min(1.0, share + step) * load, dt)
        if further.found:
            share, held = min(1.0, share + step), further
            found = held if share == 1.0 else found
        else:
            step /= 2
    return found


def _from_afar(parts: Parts, start: dict, load: np.ndarray, dt: float, acting: np.ndarray) -> Rest:
    """Rest under a load, from actuators that stand still."""
    loop = parts.loop
    y = loop.plant.output(jnp.zeros(()), parts.plant_state(jnp.asarray(start["plant"])))
    held = np.asarray(_holding_input(loop.controller.model.own_axes(), y, jnp.asarray(load)))
    at = start | {"load": load, "u": held}
    solve = partial(_newton, parts, dt=dt, acting=acting)
    # The plant first, so that actuators turn (with the input held, else the shortest way to rest is to switch them
    # off); then what the law learns and believes at that plant; then both together.
    at = solve(at, unknown=("plant",), still=("plant", "outputs"))
    at = solve(at, unknown=("plant", "u"), still=("plant", "outputs"))
    at = solve(at, unknown=("law",), still=("law",))
    return _together(parts, at, dt, acting)


def _onward(held: Rest, load: np.ndarray, dt: float) -> Rest:
    """Rest under a load, from rest under another."""
    return _together(held.parts, held.at | {"load": load}, dt, held.acting)


def _together(parts: Parts, at: dict, dt: float, acting: np.ndarray) -> Rest:
    unknown, still = ("plant", "law", "u"), ("plant", "law", "command")
    at = _newton(parts, at, unknown, still, dt, acting)
    local = parts.differentiate(at, dt)
    remaining = _residual(local, at, dt, acting, unknown, still)[0]
    return Rest(parts, at, local, float(np.abs(remaining).max(initial=0.0)), acting)


@jax.jit
def _holding_input(model: AbstractModel, y: Measurement, load):
    """Input that gives the forces against drift and load, once the actuators have come to them."""
    needed = -model.drift(y) - (model.seen(y, load) - model.seen(y, jnp.zeros_like(load)))
    drive, forces = model.drive(), model.spread(y, needed)
    rate, step = jnp.asarray(20.0), jnp.asarray(5e-3)
    settle = lambda _, state: drive.advance(state, drive.command(state, forces, rate), step)
    return drive.command(jax.lax.fori_loop(0, _SETTLING, settle, drive.init()), forces, rate)


def _acting(local: Local) -> np.ndarray:
    """Entries of the plant's state that something else depends on."""
    acts = np.ones(len(local.values["plant"]), dtype=bool)
    others = [slopes["plant"] for name, slopes in local.slopes.items() if name not in ("plant", "law", "flow")]
    while True:
        rows = np.vstack([local.slopes["plant"]["plant"][acts], local.slopes["law"]["plant"], *others])
        now = acts & (rows != 0).any(axis=0)
        if (now == acts).all():
            return acts
        acts = now


def _residual(local: Local, at: dict, dt: float, acting: np.ndarray, unknown: tuple[str, ...], still: tuple[str, ...]):
    """What must vanish, and its slopes with respect to the unknown."""
    values, slopes = local.values, local.slopes
    own = lambda name, by: np.eye(len(at[name])) if name == by else 0
    equations = {
        "plant": lambda: (values["plant"][acting], [slopes["plant"][by][acting] for by in unknown]),
        "outputs": lambda: (values["error"], [slopes["error"][by] for by in unknown]),
        "law": lambda: (
            (values["law"] - at["law"]) / dt,
            [(slopes["law"][by] - own("law", by)) / dt for by in unknown],
        ),
        "command": lambda: (values["u"] - at["u"], [slopes["u"][by] - own("u", by) for by in unknown]),
    }
    residuals, rows = zip(*(equations[name]() for name in still), strict=True)
    return np.concatenate(residuals), np.block(list(rows))


def _newton(
    parts: Parts, at: dict, unknown: tuple[str, ...], still: tuple[str, ...], dt: float, acting: np.ndarray
) -> dict:
    """Smallest steps that solve the linearised equations, shortened while they make it worse."""

    def look(at: dict):
        local = parts.differentiate(at, dt)
        residual, jacobian = _residual(local, at, dt, acting, unknown, still)
        sound = np.isfinite(residual).all() and np.isfinite(jacobian).all()
        return residual, jacobian, float(np.abs(residual).max(initial=0.0)) if sound else np.inf

    residual, jacobian, size = look(at)
    ends = np.cumsum([len(at[name]) for name in unknown])[:-1]
    for _ in range(_STEPS):
        if not _AT_REST < size < np.inf:
            break
        scale = np.abs(jacobian).max(axis=1, keepdims=True)
        scale[scale == 0] = 1.0
        step = np.split(-np.linalg.lstsq(jacobian / scale, residual / scale[:, 0], rcond=1e-11)[0], ends)
        for length in _LENGTHS:
            trial = at | {name: at[name] + length * part for name, part in zip(unknown, step, strict=True)}
            found = look(trial)
            if found[2] < size:
                break
        else:  # whatever the length: far from rest a larger residual may still be the way
            trial = at | {name: at[name] + part for name, part in zip(unknown, step, strict=True)}
            found = look(trial)
            if not found[2] < _WORSE * size:
                break
        at, (residual, jacobian, size) = trial, found
    return at

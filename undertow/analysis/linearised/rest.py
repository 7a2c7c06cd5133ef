"""Where a closed loop rests under a constant load: found by Newton's method, whether the loop is stable or not."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from undertow.analysis.linearised.pieces import Local, Parts, take_apart
from undertow.core.contracts import AbstractModel, Measurement
from undertow.loop.closed_loop import ClosedLoop

_STEPS = 40
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
    model = loop.controller.model.own_axes()
    at = start | {"load": np.asarray(load, dtype=float)}
    x = parts.plant_state(jnp.asarray(at["plant"]))
    y = loop.plant.output(jnp.zeros(()), x)
    at["u"] = np.asarray(_holding_input(model, y, jnp.asarray(at["load"])))
    first = parts.differentiate(at, dt)
    acting = _acting(first)
    # The plant first, so that actuators turn (with the input held, else the shortest way to rest is to switch them
    # off); then the law for that plant; then both together.
    at = _newton(parts, at, dt, acting, ("plant",))
    at = _newton(parts, at, dt, acting, ("plant", "u"))
    at = _newton(parts, at, dt, acting, ("law",))
    at = _newton(parts, at, dt, acting, ("plant", "law", "u"))
    local = parts.differentiate(at, dt)
    remaining = _residual(local, at, dt, acting, ("plant", "law", "u"))[0]
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


def _residual(local: Local, at: dict, dt: float, acting: np.ndarray, unknown: tuple[str, ...]):
    """What must vanish, and its slopes with respect to the unknown."""
    values, slopes = local.values, local.slopes
    identity = {name: np.eye(len(at[name])) for name in ("law", "u")}
    blank = lambda name, by: 0 if name != by else identity[name]
    residual, rows = [], []
    if "plant" in unknown:  # at rest
        residual.append(values["plant"][acting])
        rows.append([slopes["plant"][by][acting] for by in unknown])
    if "law" in unknown:
        residual.append((values["law"] - at["law"]) / dt)
        rows.append([(slopes["law"][by] - blank("law", by)) / dt for by in unknown])
        residual.append(values["u"] - at["u"])
        rows.append([slopes["u"][by] - blank("u", by) for by in unknown])
    else:
        residual.append(values["error"])
        rows.append([slopes["error"][by] for by in unknown])
    return np.concatenate(residual), np.block(rows)


def _newton(parts: Parts, at: dict, dt: float, acting: np.ndarray, unknown: tuple[str, ...]) -> dict:
    """Smallest steps that solve the linearised equations, until nothing moves or steps do not help any more."""
    local = parts.differentiate(at, dt)
    best, kept = np.inf, at
    for _ in range(_STEPS):
        residual, jacobian = _residual(local, at, dt, acting, unknown)
        size = np.abs(residual).max(initial=0.0)
        if not np.isfinite(jacobian).all() or not np.isfinite(size):
            break
        if size < best:
            best, kept = size, at
        if size < _AT_REST:
            break
        scale = np.abs(jacobian).max(axis=1, keepdims=True)
        scale[scale == 0] = 1.0
        step = -np.linalg.lstsq(jacobian / scale, residual / scale[:, 0], rcond=1e-11)[0]
        ends = np.cumsum([len(at[name]) for name in unknown])[:-1]
        at = at | {name: at[name] + part for name, part in zip(unknown, np.split(step, ends), strict=True)}
        local = parts.differentiate(at, dt)
    return kept

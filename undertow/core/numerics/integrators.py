"""One step of the classical fixed-step methods, on any pytree."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import PyTree

from undertow.core.numerics.number import Number

# Stage times are moved into the step by this share of it. A disturbance or reference that jumps exactly at a
# step boundary is then evaluated on the inner side in both steps, and the jump is not smeared.
_INWARD = 1e-9

Field = Callable[[Number, PyTree], PyTree]


def first_stage(t: Number, dt: Number) -> Number:
    """Time of the first stage of a step."""
    return t + _INWARD * dt


def euler(field: Field, t: Number, y: PyTree, dt: Number) -> PyTree:
    """Explicit Euler step y(t) -> y(t + dt) of dy/dt = field(t, y); order 1."""
    return _move(y, field(first_stage(t, dt), y), dt)


def rk4(field: Field, t: Number, y: PyTree, dt: Number) -> PyTree:
    """Classical Runge-Kutta step y(t) -> y(t + dt) of dy/dt = field(t, y); order 4."""
    t1, t2, t3, t4 = _stage_times(t, dt)
    k1 = field(t1, y)
    k2 = field(t2, _move(y, k1, dt / 2))
    k3 = field(t3, _move(y, k2, dt / 2))
    k4 = field(t4, _move(y, k3, dt))
    return jax.tree.map(lambda y, a, b, c, d: y + dt / 6 * (a + 2 * b + 2 * c + d), y, k1, k2, k3, k4)


def rk4_compact(field: Field, t: Number, y: PyTree, dt: Number) -> PyTree:
    """The step of `rk4`, to the last bit, with its stages in a loop: a fourth of the program, and as fast.

    A `while_loop`, which both compilers keep as a loop (a scan of four rounds the batch compiler would write out). It
    has no reverse derivative, which is why `rk4` remains.
    """
    when = jnp.stack([jnp.asarray(stage_time, dtype=float) for stage_time in _stage_times(t, dt)])
    reach, weight = jnp.array([0.0, 0.5, 0.5, 1.0]), jnp.array([1.0, 2.0, 2.0, 1.0])

    def stage(carry):
        i, slope, total = carry
        slope = field(when[i], _move(y, slope, reach[i] * dt))
        return i + 1, slope, jax.tree.map(lambda sums, k: sums + weight[i] * k, total, slope)

    # The sum starts from -0.0, which changes no number it is added to, not even 0.
    negative_zeros = jax.tree.map(lambda leaf: jnp.full_like(leaf, -0.0), y)
    start = (jnp.zeros((), int), negative_zeros, negative_zeros)
    _, _, total = jax.lax.while_loop(lambda carry: carry[0] < 4, stage, start)
    return _move(y, total, dt / 6)


def _stage_times(t: Number, dt: Number) -> tuple[Number, Number, Number, Number]:
    return first_stage(t, dt), t + dt / 2, t + dt / 2, t + dt - _INWARD * dt


METHODS = {"euler": euler, "rk4": rk4}
COMPACT_METHODS = {"euler": euler, "rk4": rk4_compact}


def _move(y: PyTree, slope: PyTree, dt: Number) -> PyTree:
    return jax.tree.map(lambda y, k: y + dt * k, y, slope)

"""One step of trajectory optimisation over a horizon: a linear-quadratic regulator with inputs within limits.

The motion is that of second-order error dynamics, e'' = a_d - a with a = F + G f + d, over steps of equal length with
forces f held. The cost of a step is half of h (q_e e^2 + q_v e_dot^2 + e''^2) summed over the axes, and a little f^2;
at the end that of the regulator of the double integrator, which is exact where no limit binds any more.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from undertow.core.numerics.linear_algebra import inverse_symmetric, matvec

State = Float[Array, " states"]  # e and e_dot
# Of a time within the horizon (s) and a state: e'' without forces, and its change per force -G.
Motion = Callable[[Float[Array, ""], State], tuple[Float[Array, " n"], Float[Array, "n m"]]]

_DOUBLINGS = 10  # of the horizon of the regulator at the end: 1024 steps
_LEAST = 1e-8  # cost of a force relative to that of its largest acceleration: forces that cancel stay small


class Horizon(NamedTuple):
    """What is optimised over.

    Attributes:
        step: h, s.
        position, rate: q_e and q_v, per axis, 1/s^4 and 1/s^2.
        low, high: limits of the forces.
    """

    step: Float[Array, ""]
    position: Float[Array, " n"]
    rate: Float[Array, " n"]
    low: Float[Array, " m"]
    high: Float[Array, " m"]


class Improved(NamedTuple):
    """Result of one step of optimisation.

    Attributes:
        forces: within limits.
        start: state for which they are.
        gain: change of the first force per change of that state.
    """

    forces: Float[Array, "steps m"]
    start: State
    gain: Float[Array, "m states"]


def improved(motion: Motion, horizon: Horizon, start: State, forces: Float[Array, "steps m"]) -> Improved:
    """Forces after one Gauss-Newton step from given ones; limits by clipping, with the forces at a limit held there.

    Repeated, it ends at a minimum; for linear motion without limits once is enough. Tassa, Mansard and Todorov (2014),
    section III, with one projected Newton step for the limits.
    """
    h, low, high = horizon.step, horizon.low, horizon.high
    weight = h * jnp.concatenate([horizon.position, horizon.rate])
    times = h * jnp.arange(forces.shape[0], dtype=forces.dtype)

    def moved(s, bend):
        error, rate = jnp.split(s, 2)
        return jnp.concatenate([error + h * rate + h**2 / 2 * bend, rate + h * bend])

    def bending(t, s, force):
        free, per_force = motion(t, s)
        return free + matvec(per_force, force)

    def rolled(s, stage):
        t, force = stage
        return moved(s, bending(t, s, force)), s

    last, states = jax.lax.scan(rolled, start, (times, forces))

    def linear(t, s, force):
        return bending(t, s, force), jax.jacfwd(lambda s: bending(t, s, force))(s), motion(t, s)[1]

    def backward(after, stage):
        slope, curve = after
        s, force, bend, by_state, by_force = stage
        axes, ridge = bend.shape[0], _LEAST * h * (by_force**2).sum(0).max()
        spread = h * jnp.concatenate([h / 2 * jnp.eye(axes), jnp.eye(axes)])
        a = jnp.eye(2 * axes) + h * jnp.eye(2 * axes, k=axes) + _product(spread, by_state)
        # By the bending b of the error: gradient, and second derivatives by b and by b and the state.
        of_bend = h * bend + matvec(spread.T, slope)
        curved = _product(curve, spread)
        hessian, mixed = h * jnp.eye(axes) + _product(spread.T, curved), h * by_state + _product(curved.T, a)
        of_force = matvec(by_force.T, of_bend) + ridge * force
        held = ((force <= low) & (of_force > 0)) | ((force >= high) & (of_force < 0))
        free = by_force * jnp.where(held, 0.0, 1.0)[None, :]
        # (r I + B^T H B)^-1 B^T = B^T (r H^-1 + B B^T)^-1 H^-1, which redundant forces do not make singular.
        inverse = inverse_symmetric(hessian)
        back = _product(free.T, inverse_symmetric(ridge * inverse + _product(free, free.T)))
        surplus = jnp.where(held, 0.0, force)
        step = matvec(back, matvec(free, surplus) - matvec(inverse, of_bend)) - surplus
        gain = -_product(back, _product(inverse, mixed))
        slope = weight * s + h * matvec(by_state.T, bend) + matvec(a.T, slope) + matvec(mixed.T, matvec(free, step))
        curve = jnp.diag(weight) + h * _product(by_state.T, by_state) + _product(_product(a.T, curve), a)
        curve = curve + _product(mixed.T, _product(free, gain))
        return (slope, (curve + curve.T) / 2), (step, gain)

    end = _end(horizon)
    trajectory = (states, forces, *jax.vmap(linear)(times, states, forces))
    _, (steps, gains) = jax.lax.scan(backward, (matvec(end, last), end), trajectory, reverse=True)

    def forward(s, stage):
        t, nominal_state, force, step, gain = stage
        new_force = jnp.clip(force + step + matvec(gain, s - nominal_state), low, high)
        return moved(s, bending(t, s, new_force)), new_force

    _, improved_forces = jax.lax.scan(forward, start, (times, states, forces, steps, gains))
    return Improved(improved_forces, start, gains[0])


def regulator(horizon: Horizon) -> tuple[Float[Array, "n 2 2"], Float[Array, "n 2"]]:
    """Cost of the end per axis, and the gains (1/s^2, 1/s) of the regulator of the double integrator with this step.

    By doubling: Chu, Fan and Lin (2005).
    """
    h, identity = horizon.step, jnp.eye(2)
    a = identity + h * jnp.eye(2, k=1)
    b = jnp.stack([h**2 / 2, h])
    cost = h * jnp.stack([horizon.position, horizon.rate], -1)[:, :, None] * identity[None, :, :]

    def double(_, matrices):
        a, reach, cost = matrices
        within = _inverse(identity[None, :, :] + _each(reach, cost))
        back = _each(a, within)
        turned = jnp.swapaxes(a, 1, 2)
        return (
            _each(back, a),
            reach + _each(_each(back, reach), turned),
            cost + _each(_each(turned, cost), _each(within, a)),
        )

    start = (jnp.broadcast_to(a, cost.shape), jnp.broadcast_to(b[:, None] * b[None, :] / h, cost.shape), cost)
    _, _, cost = jax.lax.fori_loop(0, _DOUBLINGS, double, start)
    by_input = (cost * b[None, None, :]).sum(-1)
    gain = (by_input[:, :, None] * a[None, :, :]).sum(1) / (h + (by_input * b[None, :]).sum(-1))[:, None]
    return cost, gain


def _end(horizon: Horizon) -> Float[Array, "states states"]:
    cost = regulator(horizon)[0]
    blocks = [[jnp.diag(cost[:, i, j]) for j in range(2)] for i in range(2)]
    return jnp.concatenate([jnp.concatenate(row, axis=1) for row in blocks])


def _product(left: Float[Array, "a b"], right: Float[Array, "b c"]) -> Float[Array, "a c"]:
    """Product of small matrices, as a sum of products."""
    return (left[:, :, None] * right[None, :, :]).sum(1)


def _each(left: Float[Array, "n 2 2"], right: Float[Array, "n 2 2"]) -> Float[Array, "n 2 2"]:
    """Products of pairs of matrices."""
    return (left[:, :, :, None] * right[:, None, :, :]).sum(2)


def _inverse(matrix: Float[Array, "n 2 2"]) -> Float[Array, "n 2 2"]:
    (p, q), (r, s) = (tuple(matrix[:, i, j] for j in range(2)) for i in range(2))
    rows = jnp.stack([jnp.stack([s, -q], -1), jnp.stack([-r, p], -1)], 1)
    return rows / (p * s - q * r)[:, None, None]

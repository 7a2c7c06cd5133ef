"""JAX alone: `jax.vmap` of the same loops, and diffrax's adaptive steps."""

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import rows
from pendulum import ANGLES, DURATION, LIMIT, SAMPLE, SAMPLES, STIFFNESS, command, rk4
from steps import dop853

jax.config.update("jax_enable_x64", True)


def alone(step):
    def run(angle, steps, h):
        go = lambda k, carry: step(*carry, 0.0, h, jnp.sin)
        return jax.lax.fori_loop(0, steps, go, (angle, jnp.zeros_like(angle)))[0]

    batch = jax.jit(jax.vmap(run, (0, None, None)))
    return lambda steps: lambda: np.asarray(batch(ANGLES, steps, DURATION / steps))


def controlled(parts):
    def run(angle):
        def sample(k, carry):
            torque = jnp.clip(command(jnp.sin(k * SAMPLE), *carry), -LIMIT, LIMIT)
            for _ in range(parts):
                carry = rk4(*carry, torque, SAMPLE / parts, jnp.sin)
            return carry

        return jax.lax.fori_loop(0, SAMPLES, sample, (angle, jnp.zeros_like(angle)))[0]

    batch = jax.jit(jax.vmap(run))
    return lambda: np.asarray(batch(ANGLES))


def adaptive():
    field = diffrax.ODETerm(lambda t, y, args: (y[1], -STIFFNESS * jnp.sin(y[0])))

    def run(angle, tolerance):
        steps = diffrax.PIDController(rtol=tolerance, atol=tolerance)
        start = (angle, jnp.zeros_like(angle))
        options = {"stepsize_controller": steps, "max_steps": None}
        return diffrax.diffeqsolve(field, diffrax.Dopri8(), 0.0, DURATION, None, start, **options).ys[0][0]

    batch = jax.jit(jax.vmap(run, (0, None)))
    return lambda tolerance: lambda: np.asarray(batch(ANGLES, tolerance))


rows.print_cheapest("alone", "XLA, vmap, order 4", rows.STEPS, alone(rk4))
rows.print_cheapest("alone", "XLA, vmap, order 8", rows.STEPS, alone(dop853))
rows.print_cheapest("alone", "diffrax, vmap, Dopri8", rows.TOLERANCES, adaptive())
rows.print_cheapest("controlled", "XLA, vmap, order 4", rows.PARTS, controlled)

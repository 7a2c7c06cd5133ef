"""simdjit, with steps of order 4 and 8."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import rows
from pendulum import ANGLES, DURATION, LIMIT, SAMPLE, SAMPLES, command, rk4
from steps import dop853

import simdjit

jax.config.update("jax_enable_x64", True)


def ends(step):
    """Angles at the end by a step of one run, compiled for all: a function of the length and the number of steps."""
    start = lambda numbers: (numbers["angle"], jnp.zeros_like(numbers["angle"]))
    example = {"angle": np.zeros(()), "h": np.zeros(())}
    program = simdjit.Loop(lambda numbers: numbers, start, step, lambda numbers, carry, k: carry[0], example)
    return lambda h, steps: np.asarray(program.run({"angle": ANGLES, "h": np.full(ANGLES.size, h)}, steps, 0)[0][0])


def alone(step):
    of_steps = ends(lambda numbers, carry, k: step(*carry, 0.0, numbers["h"], jnp.sin))
    return lambda steps: partial(of_steps, DURATION / steps, steps)


def controlled(parts):
    def sample(numbers, carry, k):
        torque = jnp.clip(command(jnp.sin(k * SAMPLE), *carry), -LIMIT, LIMIT)
        for _ in range(parts):
            carry = rk4(*carry, torque, numbers["h"], jnp.sin)
        return carry

    return partial(ends(sample), SAMPLE / parts, SAMPLES)


rows.print_cheapest("alone", "simdjit, order 4", rows.STEPS, alone(rk4))
rows.print_cheapest("alone", "simdjit, order 8", rows.STEPS, alone(dop853))
rows.print_cheapest("controlled", "simdjit, order 4", rows.PARTS, controlled)

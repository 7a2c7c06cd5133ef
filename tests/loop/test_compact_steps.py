"""Steps with their stages in a loop, as single and few runs have them, have the bits of those written out."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import simdjit
from undertow.core.numerics.integrators import rk4, rk4_compact
from undertow.simulation.loop.simd_batch import SimdBatchRunner
from undertow.studies.speed import workload
from undertow.studies.speed.workload import W1


def stepped(method):
    """A step of a pendulum with a load that jumps at the end of the step, compiled for batches."""
    field = lambda t, y: (y[1], -9.81 * jnp.sin(y[0]) + jnp.where(t < 0.125, 1.0, 5.0) * y[0])
    return simdjit.compile(lambda t, y: method(field, t, y, 0.025), np.zeros(()), (np.zeros(()), np.zeros(())))


def test_a_step_to_the_last_bit_and_to_the_sign_of_zero():
    rng = np.random.default_rng(0)
    times = rng.choice([0.0, 0.1, 0.125], 64)
    states = tuple(np.concatenate([rng.normal(size=60), [0.0, -0.0, 0.0, -0.0]]) for _ in range(2))
    own, wanted = (stepped(method)(times, states) for method in (rk4_compact, rk4))
    for each, other in zip(own, wanted, strict=True):
        assert np.asarray(each).tobytes() == np.asarray(other).tobytes()


@pytest.mark.full
@pytest.mark.parametrize("runs", [1.0, np.inf], ids=["few", "many"])
def test_a_single_run_has_the_bits_of_a_batch(runs):
    """ODIN with eight full motor models for 0.2 s."""
    one = workload.workload(W1 | {"loop": W1["loop"] | {"duration": 0.2}})
    numbers = workload.several(one.run, 4)
    constant = [False] * len(jax.tree.leaves(numbers))
    batch = SimdBatchRunner(one.run, one.plan, constant, width=4, runs=runs).run(numbers)
    single = SimdBatchRunner(one.run, one.plan, constant, width=1, runs=1.0)
    alone = single.run(jax.tree.map(lambda leaf: leaf[:1], numbers))
    for each, other in zip(jax.tree.leaves(alone.final), jax.tree.leaves(batch.final), strict=True):
        assert np.asarray(each)[0].tobytes() == np.asarray(other)[0].tobytes()

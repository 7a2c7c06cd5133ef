"""crazyflow's quadrotor under crazyflow's controller: its own compiled loop, and the same functions by simdjit.

Every run is a world with one drone that goes to a point of its own, in single precision, with one step of dynamics and
controller at 500 Hz.
"""

import os

os.environ["SCIPY_ARRAY_API"] = "1"  # as crazyflow asks, before SciPy is imported

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import rows
from crazyflow.control import Control
from crazyflow.sim import Sim
from rows import shortest

import simdjit

RUNS, STEPS = 1024, 1000
RATE = 500  # Hz, crazyflow's default
SAME = 1e-5  # m; roundings of single precision in 2 s
PROBLEM = "quadrotor of crazyflow"


def simulation(worlds: int) -> Sim:
    commands = np.zeros((worlds, 1, 16), np.float32)
    commands[..., :3] = np.random.default_rng(0).uniform(-0.2, 0.2, (worlds, 1, 3)) + [0, 0, 0.5]  # m
    commands[..., 12] = 1  # the quaternion of no rotation
    sim = Sim(n_worlds=worlds, control=Control.state, freq=RATE)
    sim.state_control(jnp.asarray(commands))
    return sim


def by_itself(sim: Sim):
    start = sim.data

    def work():
        sim.data = start
        sim.step(STEPS)
        return np.asarray(sim.data.states.pos[:, 0])

    return work


def by_simdjit(sim: Sim):
    """The steps of one world of `sim`, compiled for all: what differs between worlds is the command."""
    alone = simulation(1)
    functions = tuple(alone.step_pipeline.values())
    numeric = lambda leaf: eqx.is_array(leaf) and not jnp.issubdtype(leaf.dtype, jax.dtypes.prng_key)
    moving, still = eqx.partition(alone.data, numeric)
    command = sim.data.controls.state.staged_cmd

    def started(goal):
        law = moving.controls.replace(state=moving.controls.state.replace(staged_cmd=goal))
        return moving.replace(controls=law)

    def step(goal, carry, k):
        data = eqx.combine(carry, still)
        for function in functions:
            data = function(data)
        return eqx.filter(data, numeric)

    program = simdjit.Loop(lambda goal: goal, started, step, lambda goal, carry, k: carry.states.pos[0, 0], command[:1])
    return lambda: np.asarray(program.run(np.asarray(command)[:, None], STEPS, STEPS)[1][:, -1])


def compared():
    sim = simulation(RUNS)
    works = {"crazyflow": by_itself(sim), "simdjit": by_simdjit(sim)}
    ends = [work() for work in works.values()]
    apart = float(np.abs(ends[0] - ends[1]).max())
    assert apart < SAME, apart
    for tool, work in works.items():
        ns = 1e9 * shortest(work) / RUNS / (STEPS / RATE)
        yield rows.Row(PROBLEM, tool, f"{RUNS} worlds", apart, ns)


rows.print_rows(compared())

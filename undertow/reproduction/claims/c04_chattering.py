"""C4: RCAFC chatters less."""

import jax
import numpy as np

from undertow.reproduction.claims.finding import EQUAL_GAIN, Finding, Runs, at_table_1
from undertow.reproduction.horizons import Long
from undertow.reproduction.setup import law_of
from undertow.scenario.execute import Executed

CLAIM = "RCAFC reduces chattering considerably."


def scenarios(quick: bool) -> dict:
    """No runs besides those of C2."""
    return {}


def judge(runs: Runs, long: Long) -> Finding:
    """Total variation of the voltages above that of a law that knows d, which must follow the load, too."""
    text, numbers = at_table_1(runs, "input_variation", "total variation of the voltages", "V/s")
    needed = perfect_variation(runs["ideal_rcafc"])
    excess = {law: value - needed for law, value in numbers.items()}
    text += (
        f" Perfect cancellation of U1 alone varies by {needed:.1f} V/s, so the excess is {excess['rcafc']:.1f} V/s for "
        f"RCAFC, {excess['rafc']:.1f} for RAFC, which follows less of d, and {excess[EQUAL_GAIN]:.1f} for RAFC with "
        "gamma raised."
    )
    verdict = "fails" if numbers["rcafc"] >= numbers["rafc"] else "holds"
    numbers |= {"needed": needed} | {f"excess_{law}": value for law, value in excess.items()}
    return Finding(verdict, text, "ideal_rcafc", "level ideal, U1, 20 s", numbers)


def perfect_variation(run: Executed) -> float:
    """Total variation, V/s, of the voltages that cancel the prescribed d at the goal, over the steady window."""
    loop, model = run.built.closed_loop, law_of(run).model
    late = run.dataset["reference"].sel(time=slice(*run.built.window()))
    path, x = loop.realize(jax.random.PRNGKey(0)).disturbance_realization, loop.plant.initial_state()

    @jax.jit
    @jax.vmap
    def cancelling(t, goal):
        y = model.coordinates.measurement(goal, 0 * goal)
        load = loop.disturbance.at(path, t, loop.plant.pose(x), loop.plant.no_load())
        return model.dynamics.invert(y, -model.dynamics.drift(y) - load.acceleration)

    # Between the records: the law follows a jump of d after its record, and simultaneous jumps count as one.
    time = late["time"].values - run.built.scenario.loop.record / 2
    volts = np.asarray(cancelling(time, late.values))
    return float(np.abs(np.diff(volts, axis=0)).mean(1).sum() / (time[-1] - time[0]))

"""C4: RCAFC chatters less."""

import jax
import numpy as np

from undertow.core.contracts import Measurement
from undertow.scenario.execute import Executed
from undertow.studies.paper.claims.finding import EQUAL_GAIN, Finding, Runs, at_table_1
from undertow.studies.paper.horizons import Long
from undertow.studies.paper.setup import law_of

CLAIM = "RCAFC reduces chattering considerably."


def scenarios(quick: bool) -> dict:
    """Nothing beyond C2."""
    return {}


def judge(runs: Runs, long: Long) -> Finding:
    """Total variation of the voltages beyond that of a law that knows d: the load itself must be followed."""
    text, numbers = at_table_1(runs, "voltage_variation", "total variation of the voltages", "V/s")
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
    """Total variation, V/s, of the voltages that cancel the d of a run at its goal at rest; over its steady window."""
    model = law_of(run).model
    late = run.dataset.sel(time=slice(*run.built.window()))
    late = late.isel(time=slice(None, -1))  # where d jumps at the very end no law has followed it yet
    goal, d = late["target"].values, late["uncertainty"].values

    @jax.jit
    @jax.vmap
    def cancelling(position, load):
        y = Measurement(position, 0 * position)
        return model.invert(y, -model.drift(y) - load)

    volts = np.asarray(cancelling(goal, d))
    time = late["time"].values
    return float(np.abs(np.diff(volts, axis=0)).mean(1).sum() / (time[-1] - time[0]))

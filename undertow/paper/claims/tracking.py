"""The claims on tracking and chattering."""

import jax
import numpy as np

from undertow.paper.claims.finding import EQUAL_GAIN, ClaimVerdict, Runs, at_table_1, claim
from undertow.paper.horizons import Long, name_of
from undertow.paper.lag_map import windings
from undertow.paper.setup import FIDELITIES, law_of
from undertow.scenario.results.run_result import ScenarioResult

_SMALL = 1e-3  # m, rad; rms


@claim("C1", "The tracking error converges to a small neighbourhood of zero.")
def tracking(runs: Runs, long: Long) -> ClaimVerdict:
    """At every fidelity level, for 20 s and for the long horizon; and against the inductance of the winding."""
    lasting = {level: long[name] for level in FIDELITIES if (name := name_of(level, "rcafc")) in long}
    short = {level: run.windows[0] for level, run in lasting.items()}
    horizon = max(run.built.scenario.loop.duration for run in lasting.values())
    sentences = []
    for level, run in lasting.items():
        metrics, last = run.windows[0], run.windows[-1]
        if metrics is None:
            sentences.append(f"{level}: ends at {run.ended:.2f} s")
            continue
        ending = "lasts" if run.lasted else f"ends at {run.ended:.0f} s"
        late = f", {last['tracking_rms']:.2g} at its end" if last else ""
        sentences.append(
            f"{level}: {metrics['tracking_rms']:.2g} m and rad rms at 10 to 20 s with {metrics['input_variation']:.0f} "
            f"V/s of chattering, {ending}{late}"
        )
    survived = {value: run for value, run in windings(long).items() if run.windows[0] is not None}
    lost = {value: run for value, run in windings(long).items() if run.windows[0] is None}
    text = f"RCAFC at Table 1, 1 kHz, U2 for {horizon:g} s. " + "; ".join(sentences) + ". Inductance of the winding: "
    text += ", ".join(f"{1e3 * value:g} mH {_ending(run)}" for value, run in windings(long).items())
    text += " (Table 3: 10 mH). With a lag only, weights that drift apart add damping, unknown to the theorem."
    numbers = {
        "tracking_rms_short": {level: metrics and metrics["tracking_rms"] for level, metrics in short.items()},
        "ended": {level: None if run.lasted else run.ended for level, run in lasting.items()},
        "windings_ended": {f"{value:g}": None if run.lasted else run.ended for value, run in windings(long).items()},
    }
    simulated = f"levels {', '.join(lasting)}, U2 at 1 kHz, {horizon:g} s"
    good = [level for level, metrics in short.items() if metrics and metrics["tracking_rms"] < _SMALL]
    if len(good) == len(short) and not lost:
        return ClaimVerdict("holds", text, "ideal_rcafc", simulated, numbers)
    if not good:
        return ClaimVerdict("fails", text, "electromechanical_rcafc", simulated, numbers)
    verdict = f"holds if the winding has at most {1e3 * max(survived, default=0):g} mH and 20 s are enough"
    early = [f"{level} ends at {run.ended:.0f} s" for level, run in lasting.items() if level in good and not run.lasted]
    completed = [level for level in good if lasting[level].lasted]
    verdict += f"; for {horizon:g} s only at fidelity {' and '.join(completed)}" if completed else ""
    verdict += f" ({', '.join(early)})" if early else ""
    return ClaimVerdict(verdict, text, "electromechanical_rcafc", simulated, numbers)


def _ending(run) -> str:
    return "lasts" if run.lasted else f"ends at {run.ended:.3g} s"


@claim("C4", "RCAFC reduces chattering considerably.")
def chattering(runs: Runs, long: Long) -> ClaimVerdict:
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
    return ClaimVerdict(verdict, text, "ideal_rcafc", "level ideal, U1, 20 s", numbers)


def perfect_variation(run: ScenarioResult) -> float:
    """Total variation, V/s, of the voltages that cancel the prescribed d at the goal, over the steady window."""
    loop = run.built.closed_loop
    model = law_of(run).model
    late = run.dataset["reference"].sel(time=slice(*run.built.window()))
    path = loop.realize(jax.random.PRNGKey(0)).disturbance_realization
    x = loop.plant.initial_state()

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

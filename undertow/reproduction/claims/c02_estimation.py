"""C2: RCAFC estimates d better than RAFC."""

from undertow.reproduction.all_outputs import with_all_outputs
from undertow.reproduction.claims import conditions
from undertow.reproduction.claims.finding import EQUAL_GAIN, Finding, Runs, at_table_1
from undertow.reproduction.horizons import Long
from undertow.reproduction.setup import RAFC, equal_gain, scenario

CLAIM = "RCAFC estimates the lumped uncertainty better than RAFC."


def scenarios(quick: bool) -> dict:
    """RAFC at equal loop gain."""
    words = "RAFC with gamma raised to the loop gain of RCAFC"
    return {EQUAL_GAIN: scenario(words, composite=RAFC, controller=equal_gain())}


def batched(quick: bool) -> dict:
    """The same with limits and with noise, also used by C3."""
    return conditions.scenarios()


def judge(runs: Runs, long: Long) -> Finding:
    """At the paper's gains, at equal tuning effort, and at that under limits and noise."""
    return compared(runs, long, "estimation_rms", "rms estimation error", "m/s^2")


def compared(runs: Runs, long: Long, metric: str, what: str, unit: str) -> Finding:
    """Verdict on `RCAFC has a smaller <metric> than RAFC`."""
    text, numbers = at_table_1(runs, metric, what, unit)
    rcafc, rafc, fair = numbers.values()
    tracking = steady_tracking(runs)
    text += f" Its tracking error is {100 * (1 - tracking[1] / tracking[0]):.1f} % smaller than that of RCAFC."
    more, found = conditions.sentences(long, metric, unit)
    numbers, text = numbers | found, f"{text} {more}"
    simulated = "level ideal, U1, 20 s"
    if rcafc >= rafc:
        return Finding("fails", text, "ideal_rcafc", simulated, numbers)
    if rcafc < fair:
        return Finding("holds", text, "ideal_rcafc", simulated, numbers)
    where = []
    if conditions.lost_by_limits(long):
        where.append(f"voltages are limited to {max(conditions.LIMITS):g} V or less and weights are not")
    if conditions.worse_by_noise(long, metric):
        where.append("velocities are noisy (1 cm/s)")
    else_where = f"; at equal loop gain only where {' or '.join(where)}" if where else "; not at equal loop gain"
    return Finding(f"holds if both use the gamma of Table 1{else_where}", text, EQUAL_GAIN, simulated, numbers)


def steady_tracking(runs: Runs) -> tuple[float, float]:
    """Tracking rms of RCAFC, and of RAFC at equal loop gain."""
    of = lambda name: with_all_outputs(runs[name].steady)["tracking_rms"]
    return of("ideal_rcafc"), of(EQUAL_GAIN)

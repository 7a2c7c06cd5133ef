"""C8: voltage control needs no torque-to-voltage step."""

import numpy as np

from undertow.core.arrays import as_array
from undertow.reproduction.claims.finding import Finding, Runs
from undertow.reproduction.horizons import Long
from undertow.reproduction.setup import plant_of

CLAIM = "With voltage as the control input no step from thrust to voltage is needed."


def scenarios(quick: bool) -> dict:
    """No runs besides Example 2."""
    return {}


def judge(runs: Runs, long: Long) -> Finding:
    """Difference of the thrust from alpha V, which G assumes, in Example 2."""
    run = runs["static_rcafc"]
    thruster = plant_of(run).thruster
    late = run.dataset.sel(time=slice(run.built.window()[0], None))
    voltage = late["input"].values
    thrust = np.asarray(thruster.thrust(np.zeros(0), as_array(voltage)))
    assumed = float(thruster.voltage_gain()) * voltage
    share = float(np.sqrt(((thrust - assumed) ** 2).mean() / (thrust**2).mean()))
    text = (
        f"The step is inside G, which assumes a thrust alpha V with alpha = {float(thruster.voltage_gain()):.2f} N/V. "
        f"In Example 2 the remainder T - alpha V is {100 * share:.0f} % of the thrust (rms), and the estimator has to "
        "compensate it."
    )
    verdict = "holds if the fixed ratio alpha inside G is not counted as such a step"
    return Finding(verdict, text, "static_rcafc", "level static, U1, 20 s", {"thrust_not_alpha_v": share})

"""The claims on thrusters: speed sensors, voltage as the input, models of thrusters."""

import equinox as eqx
import numpy as np

from undertow.core.arrays import as_array
from undertow.core.status import Status
from undertow.paper.claims.finding import ClaimVerdict, Runs, claim, steady
from undertow.paper.horizons import Long, name_of
from undertow.paper.setup import plant_of, scenario
from undertow.paper.thruster_response import thruster_response

_SENSOR = "c07_speed_sensor"


def _speed_sensor_scenarios(quick: bool) -> dict:
    """The full motor model with measured propeller speeds, sampled at 1 kHz like a real sensor."""
    return {
        _SENSOR: scenario(
            "RCAFC with measured propeller speeds, full motor model, 1 kHz",
            fidelity="electromechanical",
            model={"speed_sensor": True},
            loop={"kind": "sampled", "duration": 20.0},
        )
    }


@claim(
    "C7",
    "Speed-sensorless control performs like control with propeller-speed sensors.",
    scenarios=_speed_sensor_scenarios,
)
def speed_sensor(runs: Runs, long: Long) -> ClaimVerdict:
    """Perfect sensor (ideal) against none (static, shaft), and both with the full motor model."""
    with_sensor, without = (steady(runs[name])["tracking_rms"] for name in ("ideal_rcafc", "static_rcafc"))
    full = {"sensor": runs[_SENSOR], "sensorless": runs["electromechanical_rcafc"]}
    numbers = {"tracking_rms_sensor": with_sensor, "tracking_rms_sensorless": without}
    text = (
        f"Tracking rms {with_sensor:.3g} with a perfect sensor (ideal), {without:.3g} without (motor in steady state): "
        f"{100 * (without / with_sensor - 1):.0f} % more. "
    )
    shaft = long[name_of("shaft", "rcafc")]
    if (shaft_metrics := shaft.windows[0]) is not None:
        numbers["tracking_rms_shaft"] = shaft_metrics["tracking_rms"]
        text += (
            f"Without, and with a rotor that has inertia (shaft): {shaft_metrics['tracking_rms']:.3g}, but with "
            f"{shaft_metrics['input_variation']:.0f} V/s of chattering and weights up to "
            f"{shaft_metrics['weights_peak']:.0f}; there the sensor is useless, since Eq. (23) becomes an algebraic "
            "loop of gain 1. "
        )
    for name, run in full.items():
        if run.status is Status.OK:
            text += f"With the full motor model the {name} variant tracks to {steady(run)['tracking_rms']:.3g}. "
        else:
            numbers[f"ended_{name}"] = float(run.outcome.ended)
            text += f"With the full motor model the {name} variant fails (ends at {float(run.outcome.ended):.2f} s). "
    verdict = "holds if the winding has almost no inductance (C1) and the chattering is acceptable, for 20 s"
    if all(run.status is not Status.OK for run in full.values()):
        verdict += "; with the full motor model both end within seconds"
    simulated = "levels ideal, static and electromechanical, U1, 20 s; shaft at 1 kHz"
    return ClaimVerdict(verdict, text.strip(), _SENSOR, simulated, numbers)


@claim("C8", "With voltage as the control input no step from thrust to voltage is needed.")
def voltage_as_input(runs: Runs, long: Long) -> ClaimVerdict:
    """Difference of the thrust from alpha V, which G assumes, in Example 2."""
    run = runs["static_rcafc"]
    thruster = plant_of(run).thruster
    late = run.dataset.sel(time=slice(run.built.window()[0], None))
    voltage = late["input"].values
    thrusts = eqx.filter_jit(thruster.thrust)  # one program, not ten small ones
    thrust = np.asarray(thrusts(np.zeros(0), as_array(voltage)))
    assumed = float(thruster.voltage_gain()) * voltage
    share = float(np.sqrt(((thrust - assumed) ** 2).mean() / (thrust**2).mean()))
    text = (
        f"The step is inside G, which assumes a thrust alpha V with alpha = {float(thruster.voltage_gain()):.2f} N/V. "
        f"In Example 2 the remainder T - alpha V is {100 * share:.0f} % of the thrust (rms), and the estimator has to "
        "compensate it."
    )
    verdict = "holds if the fixed ratio alpha inside G is not counted as such a step"
    return ClaimVerdict(verdict, text, "static_rcafc", "level static, U1, 20 s", {"thrust_not_alpha_v": share})


# A model with a smaller error than this share of the signal counts as valid.
_VALID = 10.0  # %


@claim("C11", "T = c_0 V, T = c_V V|V| and I = c_I T hold only for long-period inputs.")
def thruster_models(runs: Runs, long: Long) -> ClaimVerdict:
    """Error of each model, fitted to V = 10 sin t, at V = 10 sin t and V = 10 sin 10t."""
    laws = thruster_response().laws
    numbers = {law.text: {"long": law.error_long, "short": law.error_short} for law in laws}
    text = "rms error in % of the signal at V = 10 sin t and 10 sin 10t: "
    text += "; ".join(f"{law.text} {law.error_long:.0f} and {law.error_short:.0f}" for law in laws)
    ends = {
        level: long[name_of(level, "rcafc")]
        for level in ("static", "shaft", "electromechanical")
        if name_of(level, "rcafc") in long
    }
    text += (
        ". The same difference acts in the loop of RCAFC at Table 1, U2 at 1 kHz: "
        + ", ".join(
            f"{level} lasts {run.ended:g} s" if run.lasted else f"{level} ends at {run.ended:.1f} s"
            for level, run in ends.items()
        )
        + "."
    )
    valid = [law.text for law in laws if law.error_long < _VALID]
    fails_short = all(law.error_short > _VALID for law in laws)
    if len(valid) == len(laws) and fails_short:
        verdict = "holds"
    elif fails_short and valid:
        verdict = f"holds if only {' and '.join(valid)} is meant: the others are wrong at long periods too"
    else:
        verdict = "fails"
    return ClaimVerdict(
        verdict, text, "electromechanical_rcafc", "the motor alone, 8 periods; the loop as stated", numbers
    )

"""C7: speed-sensorless control works as well as control with speed sensors."""

from undertow.core.status import Status
from undertow.reproduction.claims.finding import Finding, Runs, steady
from undertow.reproduction.horizons import Long, name_of
from undertow.reproduction.setup import scenario

CLAIM = "Speed-sensorless control performs like control with propeller-speed sensors."

_SENSOR = "c07_speed_sensor"


def scenarios(quick: bool) -> dict:
    """The full motor model with measured propeller speeds, sampled at 1 kHz like a real sensor."""
    return {
        _SENSOR: scenario(
            "RCAFC with measured propeller speeds, full motor model, 1 kHz",
            fidelity="electromechanical",
            model={"speed_sensor": True},
            loop={"kind": "sampled", "duration": 20.0},
        )
    }


def judge(runs: Runs, long: Long) -> Finding:
    """Perfect sensor (ideal) against none (static, shaft), and both with the full motor model."""
    with_sensor, without = (steady(runs[name])["tracking_rms"] for name in ("ideal_rcafc", "static_rcafc"))
    full = {"sensor": runs[_SENSOR], "sensorless": runs["electromechanical_rcafc"]}
    numbers = {"tracking_rms_sensor": with_sensor, "tracking_rms_sensorless": without}
    text = (
        f"Tracking rms {with_sensor:.3g} with a perfect sensor (ideal), {without:.3g} without (motor in steady state): "
        f"{100 * (without / with_sensor - 1):.0f} % more. "
    )
    shaft = long[name_of("shaft", "rcafc")]
    if (found := shaft.windows[0]) is not None:
        numbers["tracking_rms_shaft"] = found["tracking_rms"]
        text += (
            f"Without, and with a rotor that has inertia (shaft): {found['tracking_rms']:.3g}, but with "
            f"{found['input_variation']:.0f} V/s of chattering and weights up to {found['weights_peak']:.0f}; there "
            "the sensor is useless, since Eq. (23) becomes an algebraic loop of gain 1. "
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
    return Finding(verdict, text.strip(), _SENSOR, simulated, numbers)

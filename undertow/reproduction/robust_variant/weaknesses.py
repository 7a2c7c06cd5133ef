"""Where the paper's law loses, and where the sound version is no better: one sentence per function."""

from undertow.reproduction.robust_variant.lookup import Numbers

_RECOVERED = 0.01  # m, rad


def _motor(n: Numbers) -> str:
    paper, sound = n.fidelity("electromechanical", "rcafc"), n.fidelity("electromechanical", "robust")
    if paper["status"] == "ok":
        return ""
    kept = sound["steady"]["tracking_rms"]
    return (
        f"A motor. With all of Eqs. (8) to (11) Table 1 ends after {paper['diverged_at']:.2g} s; preset `robust`, "
        f"which knows the motor, tracks to {kept:.2g} without propeller speeds (20 s; 2,000 s: see the ladder)."
    )


def _supply(n: Numbers) -> str:
    paper, sound = (n.fidelity("24V_03", law)["steady"] for law in ("rcafc", "robust"))
    return (
        f"A supply. At 24 V and U1 x 0.3 Table 1 is at its limit {100 * paper['saturated_fraction']:.0f} % of the time "
        f"and {paper['tracking_rms']:.2g} off; `robust` {100 * sound['saturated_fraction']:.0f} % and "
        f"{sound['tracking_rms']:.2g}."
    )


def _noise(n: Numbers) -> str:
    paper, slow = (n.median("A9", f"{law}, 1 mm/s", "input_rms") / 1e-3 for law in ("Table 1", "robust 10 rad/s"))
    return (
        f"Noise. Table 1 passes velocity noise into the input times {paper:.0f} 1/s, an observer of 10 rad/s times "
        f"{slow:.1f} (A9)."
    )


def _drift(n: Numbers) -> str:
    lost, seeds = n.failures("A18", "nothing")
    kept, weight = n.median("A18", "projection 6"), n.median("A18", "one set", "weights_peak")
    return (
        f"Drift. With sets spaced 0.1 and 1 cm/s of noise {lost} of {seeds} runs end within 20 s; projected weights "
        f"keep {kept:.2g} m, and a single set, the linear observer, has no drift at all (|theta| {weight:.2g}; A18)."
    )


def _delay(n: Numbers) -> str:
    lost, seeds = n.failures("A8", "Table 1, 6 ms")
    slow = n.median("A8", "robust 20 rad/s, 15 ms")
    return (
        f"Delay. Measurements 6 ms late end {lost} of {seeds} runs of Table 1; an observer of 20 rad/s bears 15 ms, "
        f"for an error of {slow:.2g} m (A8)."
    )


def _frequency(n: Numbers) -> str:
    low, high = (n.median("A7", f"{rate} rad/s", "share") for rate in (10, 150))
    return f"High frequency. The estimate misses {100 * low:.2g} % of d at 10 rad/s and {100 * high:.0f} % at 150 (A7)."


def _at_sea(n: Numbers) -> str:
    paper, hand, sound = (n.fidelity("sea", law) for law in ("table1", "hand_tuned", "robust"))
    if paper["status"] == "ok":
        return ""
    return (
        f"At sea. On BlueROV2 Heavy Table 1 ends after {paper['diverged_at']:.2g} s. The paper's law tuned by hand "
        f"holds {hand['steady']['tracking_rms']:.3g}; `robust`, not tuned, "
        f"{sound['steady']['tracking_rms']:.3g}."
    )


def _navigation(n: Numbers) -> str:
    pid, sound = (n.fidelity("station", law) for law in ("pid", "robust"))
    known = [n.fidelity("station_known", law) for law in ("pid", "robust")]
    if not all(row["steady"] for row in (pid, sound, *known)):
        return ""
    without, ours = (row["position_rms"] for row in known)
    centimetres = lambda metres: f"{100 * metres:.2g} cm"
    return (
        f"Beyond its navigation. Keeping station in waves with position fixes of 5 cm, navigation itself is off by "
        f"{centimetres(sound['navigation_rms'])}: a tuned PID holds {centimetres(pid['position_rms'])}, `robust` "
        f"{centimetres(sound['position_rms'])}. Better fixes help here, not a better law; where position and velocity "
        f"are known, they hold {centimetres(without)} and {centimetres(ours)}."
    )


def _recovery(n: Numbers) -> str:
    paper, sound = n.fidelity("overload", "rcafc"), n.fidelity("overload", "robust")
    if not (sound["steady"] and paper["steady"]):
        return ""
    after = sound["steady"]["tracking_rms"]
    how = "back to" if after < _RECOVERED else "not back yet, but at"
    return (
        f"Too much for 1.5 s. Pushed beyond its motors at 24 V, `robust` is up to {sound['largest_after']:.2g} off, "
        f"and after 7.5 s {how} {after:.2g}; Table 1 up to {paper['largest_after']:.2g}, then "
        f"{paper['steady']['tracking_rms']:.2g}."
    )


def _beyond(n: Numbers) -> str:
    paper, sound = (n.fidelity("24V", law)["steady"]["tracking_rms"] for law in ("rcafc", "robust"))
    return (
        f"What nobody can do. U1 at full size asks for more than 24 V gives: Table 1 is {paper:.2g} off, `robust` "
        f"{sound:.2g}; no law holds it."
    )


def _slow_rate(n: Numbers) -> str:
    paper, sound = (n.median("A8", f"{law}, 100 Hz") for law in ("Table 1", "robust"))
    if not sound > paper:
        return ""
    return (
        f"Slow sampling of plain axes. At 100 Hz, velocities exact and no motor, Table 1 tracks to {paper:.2g} m for "
        f"the 10 s of A8, on drifting weights; `robust` keeps room for three sampling times of delay, and tracks to "
        f"{sound:.2g} m."
    )


def _noisy_motor(n: Numbers) -> str:
    own, searched = (n.median("A20", law, "input_variation") for law in ("robust", "robust, searched"))
    if not own > 2 * searched:
        return ""
    return (
        f"Noise it is not told of. With 2 mm/s of velocity noise `robust` moves the voltage by {own:.2g} V/s; with a "
        f"bandwidth and an actuator rate found by search by {searched:.2g} V/s (A20)."
    )


LOSES = (_motor, _supply, _noise, _drift, _delay, _frequency)
NEITHER = (_at_sea, _navigation, _recovery, _beyond, _slow_rate, _noisy_motor)

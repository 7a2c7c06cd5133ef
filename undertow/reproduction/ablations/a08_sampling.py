"""A8: control rate and delay."""

from functools import partial

from undertow.controllers.presets.paper import paper
from undertow.controllers.presets.robust import robust
from undertow.reproduction.ablations.ablation import Answer, Schedule, Variant, answer
from undertow.reproduction.ablations.on_axes import loop
from undertow.reproduction.ablations.rough_sensor import RoughSensor

QUESTION = "How slow may the controller be, and how late its measurement?"
PREDICTION = "Table 1 is lost below 141 Hz and beyond 4.75 ms of delay; `robust` at every rate."
LONG = True
METRICS = ("tracking_rms", "estimation_rms", "weights_peak")
LEFT_OUT = "jitter: the loop has one sampling time"

_RATES, _QUICK = (1000, 100, 50), (1000, 50)  # Hz
_DELAYS = (4, 6, 15)  # ms


def variants(quick: bool) -> tuple[Variant, ...]:
    """Both presets at every rate, and at 1 kHz with every delay; `robust` slow enough for it."""
    found = []
    for rate in _QUICK if quick else _RATES:
        own = partial(robust, sampling_time=1 / rate, reference_frequency=0)
        schedule = Schedule(dt=1 / rate)
        found.append(Variant(f"Table 1, {rate} Hz", f"dt: {1 / rate:g}", loop(paper), schedule))
        found.append(Variant(f"robust, {rate} Hz", f"preset: robust, dt: {1 / rate:g}", loop(own), schedule))
    slow = partial(robust, reference_frequency=0, bandwidth=20.0)
    for delay in _DELAYS:
        late, text = RoughSensor(delay=float(delay)), f"all measured {delay} ms late, 1 kHz"
        found.append(Variant(f"Table 1, {delay} ms", text, loop(paper, navigation=late)))
        found.append(Variant(f"robust 20 rad/s, {delay} ms", f"bandwidth: 20, {text}", loop(slow, navigation=late)))
    return tuple(found)


def judge(found) -> Answer:
    """Which lasted, and how well."""
    ended = [name for name, one in found.items() if one.failures]
    kept = [f"{name} {one['tracking_rms']:.2g}" for name, one in found.items() if not one.failures]
    text = f"Ended early: {', '.join(ended) or 'none'}. Kept, tracking rms in m: {', '.join(kept)}."
    if "Table 1, 100 Hz" in found and "Table 1, 100 Hz" not in ended:
        text += (
            " At 100 Hz the linearised loop is unstable, but the weights drift until the loop is damped again: "
            f"|theta| {found['Table 1, 100 Hz']['weights_peak']:.0f} instead of "
            f"{found['Table 1, 1000 Hz']['weights_peak']:.0f} m/s^2."
        )
    predicted = {"Table 1, 100 Hz", "Table 1, 50 Hz", "Table 1, 6 ms", "Table 1, 15 ms"} & set(found)
    return answer(set(ended) == predicted, text, partly=not any(name.startswith("robust") for name in ended))

"""A9: noise, bias, resolution and slow readings of the velocity."""

from functools import partial

from undertow.controllers.presets.paper import paper
from undertow.controllers.presets.robust import robust
from undertow.disturbances.random_suite import random_suite
from undertow.reproduction.ablations.ablation import Answer, Variant, answer
from undertow.reproduction.ablations.on_axes import loop
from undertow.reproduction.ablations.rough_sensor import RoughSensor

QUESTION = "How well must the velocity be measured?"
PREDICTION = "Table 1 multiplies noise by 110 into the input and cannot use a 5 Hz DVL; the fewer rad/s, the better."
LONG = True
METRICS = ("tracking_rms", "input_rms", "input_variation", "weights_peak")
LEFT_OUT = "drift to divergence, which takes longer: see A18 and A21"

# White noise alone, without a load, tells the noise in the input; the others meet the load of every ablation.
_NOISES = {"1 mm/s": 1e-3, "1 cm/s": 1e-2, "5 cm/s": 5e-2}
_OTHERS = {
    "exact": RoughSensor(),
    "bias 1 cm/s": RoughSensor(bias=1e-2),
    "steps of 1 cm/s": RoughSensor(resolution=1e-2),
    "5 Hz": RoughSensor(every=200.0),
}

_LAWS = {
    "Table 1": paper,
    "robust": partial(robust, reference_frequency=0),
    "robust 10 rad/s": partial(robust, reference_frequency=0, bandwidth=10.0),
}


def variants(quick: bool) -> tuple[Variant, ...]:
    """Every law with every sensor."""
    calm, rough = random_suite(0.0, step=0.0), random_suite()
    cases = {name: (calm, RoughSensor(noise=noise)) for name, noise in _NOISES.items()}
    cases |= {name: (rough, sensor) for name, sensor in _OTHERS.items()}
    return tuple(
        Variant(f"{law}, {name}", f"{law}; velocity {name}", loop(make, load, sensor))
        for law, make in _LAWS.items()
        for name, (load, sensor) in cases.items()
    )


def judge(found) -> Answer:
    """Input noise per velocity noise, and what 5 Hz does."""
    amplified = {law: found[f"{law}, 1 mm/s"]["input_rms"] / 1e-3 for law in _LAWS}
    large = {law: found[f"{law}, 5 cm/s"] for law in _LAWS}
    slow = {law: found[f"{law}, 5 Hz"] for law in _LAWS}
    text = "Noise in the input per velocity noise, 1/s: " + ", ".join(f"{k} {v:.3g}" for k, v in amplified.items())
    text += ". With 5 cm/s: " + ", ".join(f"{k} {_end(v)}" for k, v in large.items())
    text += ". With readings at 5 Hz: " + ", ".join(f"{k} {_end(v)}" for k, v in slow.items()) + "."
    lost = slow["Table 1"].failures == slow["Table 1"].seeds
    return answer(lost and abs(amplified["Table 1"] / 110 - 1) < 0.15, text, partly=lost)


def _end(one) -> str:
    return "ends early" if one.failures > one.seeds / 2 else f"error {one['tracking_rms']:.2g} m"

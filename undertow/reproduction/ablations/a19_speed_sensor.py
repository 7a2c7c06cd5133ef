"""A19: propeller speeds measured or not."""

from undertow.controllers.presets.paper import paper
from undertow.controllers.presets.robust import robust
from undertow.reproduction.ablations.ablation import Answer, Variant, answer
from undertow.reproduction.ablations.on_odin import loop

QUESTION = "Do propeller-speed sensors help?"
PREDICTION = (
    "As printed the variant with sensors is ill-posed and unstable; an inner loop of computed voltage uses them."
)
LONG = True
METRICS = ("tracking_rms", "input_rms", "input_variation")

_MOTOR = {"fidelity": "electromechanical", "supply": 24.0}


def variants(quick: bool) -> tuple[Variant, ...]:
    """Both presets on the whole motor at 24 V, with and without."""
    found = [
        Variant("Table 1, sensorless", "supply: 24", loop(paper, **_MOTOR)),
        Variant("robust, sensorless", "preset: robust, supply: 24", loop(robust, **_MOTOR)),
    ]
    if not quick:
        told = "speed_sensor: true, supply: 24"
        found.append(Variant("Table 1, measured", told, loop(paper, **_MOTOR, speed_sensor=True)))
        found.append(Variant("robust, measured", f"preset: robust, {told}", loop(robust, **_MOTOR, speed_sensor=True)))
    return tuple(found)


def judge(found) -> Answer:
    """Error and how much the voltage moves."""
    text = "Tracking rms and variation of the voltage: " + "; ".join(
        f"{name} {one['tracking_rms']:.3g}, {one['input_variation']:.3g} V/s" for name, one in found.items()
    )
    bad = all(one["tracking_rms"] > 5e-3 for name, one in found.items() if name.startswith("Table 1"))
    good = all(one["tracking_rms"] < 5e-3 for name, one in found.items() if name.startswith("robust"))
    return answer(bad and good, text + ".", partly=bad or good)

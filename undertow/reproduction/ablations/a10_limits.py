"""A10: limits of the input, and what the law is told of them."""

from undertow.controllers.presets.paper import paper
from undertow.controllers.presets.robust import robust
from undertow.disturbances.random_suite import random_suite
from undertow.reproduction.ablations import on_axes, on_odin
from undertow.reproduction.ablations.ablation import Answer, Schedule, Variant, answer
from undertow.reproduction.ablations.command_fed import CommandFed
from undertow.reproduction.setup import GOAL

QUESTION = "What do limits of the input do, and what if the law is not told that they bind?"
PREDICTION = (
    "RCAFC fed with the applied input survives a step; fed with its own command it winds up and is lost at 3 m/s^2 "
    "and below; RAFC is lost at 5 m/s^2 already."
)
METRICS = ("tracking_rms", "estimation_rms", "weights_peak", "saturated_fraction")
LEFT_OUT = "slew rate; dead band (the static motor has one, see the ladder)"

_LIMITS, _VOLTS = (5.0, 3.0, 1.5), (48.0, 24.0)
_LONG = Schedule(duration=20.0)
_LAWS = {
    "RCAFC": paper,
    "RCAFC, command fed": lambda model: CommandFed(paper(model)),
    "RAFC": lambda model: paper(model, composite=0.0),
    "robust": robust,
}


def variants(quick: bool) -> tuple[Variant, ...]:
    """A step of 2 m on six axes at each limit; the paper's step on ODIN, fidelity `ideal`, at each voltage."""
    gentle = random_suite(0.2, 0.3, 1.0, step=0.3)
    axes = [
        Variant(
            f"{name}, {limit:g} m/s^2",
            f"six axes, |u| <= {limit:g} m/s^2",
            on_axes.loop(law, gentle, goal=2.0, limit=limit),
            _LONG,
        )
        for limit in _LIMITS
        for name, law in _LAWS.items()
        if not (quick and name == "robust")
    ]
    laws = {} if quick else {name: _LAWS[name] for name in ("RCAFC", "RAFC", "robust")}
    vehicle = [
        Variant(
            f"{name}, {volts:g} V",
            f"ODIN, fidelity: ideal, supply: {volts:g}",
            on_odin.loop(law, supply=volts, size=0.2, goal=GOAL),
            _LONG,
        )
        for volts in _VOLTS
        for name, law in laws.items()
    ]
    return (*axes, *vehicle)


def judge(found) -> Answer:
    """Which come back to less than 0.1 m and rad."""
    lost = [name for name, one in found.items() if not one["tracking_rms"] < 0.1]
    text = f"Not back within 0.1 m (rad) after 10 s: {'; '.join(lost) or 'none'}."
    on_rails = {name for name in lost if "m/s^2" in name}
    expected = {"RCAFC, command fed, 3 m/s^2", "RCAFC, command fed, 1.5 m/s^2"}
    expected |= {f"RAFC, {limit:g} m/s^2" for limit in _LIMITS}
    best = not any(name.startswith(("robust", "RCAFC, 5", "RCAFC, 3", "RCAFC, 1.5")) for name in on_rails)
    return answer(on_rails == expected, text, partly=best)

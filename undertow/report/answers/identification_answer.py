"""The answer of `undertow identify`: whether the model predicts better than the file, and what it does not know."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from undertow.core.number_text import plain
from undertow.report.answers.plain_answer import PlainAnswer
from undertow.report.quantities import quantity

_SHOWN = 4  # parameters named in a line
_ALIKE = 1.0  # difference of mean fits, %, that is none
_FAR = 4.0  # deviations beforehand, from which on an estimate is not believable
_VELOCITIES = {"u": "surge", "v": "sway", "w": "heave", "p": "roll rate", "q": "pitch rate", "r": "yaw rate"}
# Groups of numbers that stay as the file has them where none of them is estimated.
_GROUPS = {
    "added mass": ("added_mass",),
    "linear damping": ("linear_damping",),
    "quadratic damping": ("quadratic_damping",),
    "centre of buoyancy": ("r_b",),
    "net buoyancy": ("net_buoyancy",),
    "thrusters": ("thruster_gain", "reverse_gain", "lag", "axis_gain", "axis_lag"),
}
_AS_BEFORE = "their intervals are as wide as what was known before"


def answer_of_identification(data: Mapping[str, Any], folder: Path | None = None) -> PlainAnswer:
    """The answer of an identification.

    Args:
        data: contents of identification.json.
        folder: of its files; None where there are none.
    """
    fits = mean_fits(data)
    seconds = sum(dive["duration"] for dive in data["dives"])
    dives = f"{len(data['dives'])} dives" if len(data["dives"]) > 1 else "one dive"
    better, verdict = _compared(fits)
    far = [name for name, p in data["parameters"].items() if abs(p["shift"]) > _FAR]
    if far:
        better = False
        verdict = "The identified model is not believable: do not use it."
    lines = (
        *_far_line(far),
        f"{len(data['parameters'])} numbers were estimated from {dives}, {seconds:.0f} s together.",
        *_fit_line(fits),
        *_convergence(data),
        *_best_known(data),
        *_not_estimated(data),
        *_refused(data),
        *_unknown(data),
        *_ratios(data),
        *_pushes(data),
        *(_hints(data) if better is False else ()),
        *_next(better, folder),
    )
    return PlainAnswer(better, verdict, lines)


def _hints(data: Mapping[str, Any]) -> Iterator[str]:
    """What the checks of the logs have found, where the result cannot be used."""
    for finding in data["findings"][:_SHOWN]:
        yield f"Seen in the logs: {finding}"


def _next(better: bool | None, folder: Path | None) -> Iterator[str]:
    if folder is None:
        return
    if better is False:
        yield f"Next: see on {folder / 'identification.html'} what the logs lack; identified.yaml is for tests only."
    else:
        yield f"Next: undertow simulate {folder / 'identified.yaml'}"


def _compared(fits: Mapping[str, tuple[float, float]]) -> tuple[bool | None, str]:
    """Whether the model is as good as the vehicle file or better; None without a dive to judge it on."""
    if not fits:
        return None, "The model was not judged on a dive that it has not seen."
    own, before = (float(np.mean([pair[i] for pair in fits.values()])) for i in (0, 1))
    predicts = "The identified model predicts dives that it has not seen"
    if abs(own - before) < _ALIKE:
        return True, f"{predicts} as well as the vehicle file."
    if own > before:
        return True, f"{predicts} better than the vehicle file."
    return False, f"{predicts} worse than the vehicle file: do not use it."


def mean_fits(data: Mapping[str, Any]) -> dict[str, tuple[float, float]]:
    """Mean free-run fit of each axis, %: of the identified model, and of the vehicle file.

    Over the dives that were not used at all where there are any, otherwise over those left out in turn.
    """
    collected: dict[str, tuple[list[float], list[float]]] = {}
    unseen = [validation for validation in data["validation"] if validation["is_unseen"]]
    for validation in unseen or data["validation"]:
        for axis, fit in validation["identified"]["free_run_fit"].items():
            both = collected.setdefault(axis, ([], []))
            both[0].append(fit)
            both[1].append(validation["prior"]["free_run_fit"].get(axis, float("-inf")))
    return {axis: (float(np.mean(own)), float(np.mean(before))) for axis, (own, before) in collected.items()}


def _far_line(far: Sequence[str]) -> Iterator[str]:
    if far:
        names = f"{'; '.join(in_words(name) for name in far[:_SHOWN])}{' and more' if len(far) > _SHOWN else ''}"
        yield (
            f"{names[0].upper()}{names[1:]}: more than {_FAR:.0f} standard deviations away from what was known before. "
            "The log may be of another vehicle, have late or coarse inputs, or the model lacks something."
        )


def _fit_line(fits: Mapping[str, tuple[float, float]]) -> Iterator[str]:
    if fits:
        both = {_VELOCITIES[axis]: f"{_or_worse(own)} ({_or_worse(before)})" for axis, (own, before) in fits.items()}
        pairs = ", ".join(f"{name} {fit}" for name, fit in both.items())
        scale = "100 % is perfect, 0 % no better than the mean"
        yield f"Predicted speeds, with those of the file in brackets: {pairs}; {scale}."


def _or_worse(fit: float) -> str:
    return f"{fit:.0f} %" if fit > -100 else "below -100 %"


def _convergence(data: Mapping[str, Any]) -> Iterator[str]:
    if not data["converged"]:
        iterations = data["iterations"]
        yield f"The estimate had not come to rest after {iterations} iterations: do not trust its intervals."


def _pushes(data: Mapping[str, Any]) -> Iterator[str]:
    """What pushed the vehicle besides its thrusters, and for how long."""
    if disturbance := data["disturbance"]:
        sizes = [(axis, size) for axis, size in disturbance["deviations"].items() if axis not in data["refused_axes"]]
        units = {axis: "rad/s^2" if axis in ("roll", "pitch", "yaw") else "m/s^2" for axis, _ in sizes}
        words = ", ".join(f"{axis} {quantity(size, units[axis])}" for axis, size in sizes)
        yield (
            f"Besides its thrusters something pushed it that lasts {quantity(disturbance['correlation_time'], 's')} "
            f"(rms of the acceleration): {words}."
        )


def _best_known(data: Mapping[str, Any]) -> Iterator[str]:
    known = {name: p for name, p in data["parameters"].items() if p["verdict"] == "determined"}
    if known:
        order = sorted(known, key=lambda name: known[name]["deviation_left"])[:_SHOWN]
        shown = "; ".join(_found(name, known[name]) for name in order)
        yield f"{len(known)} of them are determined, best: {shown}. In 95 of 100 cases the brackets hold the truth."


def _found(name: str, parameter: Mapping[str, Any]) -> str:
    return f"{in_words(name)} {interval_words(parameter)}, in the file {plain(parameter['prior'])}"


def _not_estimated(data: Mapping[str, Any]) -> Iterator[str]:
    """Numbers on which the others rest."""
    estimated = {name.partition(".")[0] for name in data["parameters"]}
    kept = [words for words, names in _GROUPS.items() if not estimated & set(names)]
    if kept:
        yield f"As the file has them: {', '.join(kept)}. Where these are wrong, the others may be."


def _refused(data: Mapping[str, Any]) -> Iterator[str]:
    if data["refused_axes"]:
        yield f"Not identified, as the dives do not excite or measure it: {', '.join(data['refused_axes'])}."


def _unknown(data: Mapping[str, Any]) -> Iterator[str]:
    unknown = [in_words(name) for name, p in data["parameters"].items() if p["verdict"] == "unknown"]
    if unknown:
        more = f" and {len(unknown) - _SHOWN} more" if len(unknown) > _SHOWN else ""
        yield f"The dives say hardly anything of {'; '.join(unknown[:_SHOWN])}{more}: {_AS_BEFORE}."


def _ratios(data: Mapping[str, Any]) -> Iterator[str]:
    for combination in data["undetermined"][:1]:
        if len(combination["parameters"]) > 1:
            yield f"{combination_in_words(combination)}: weigh the vehicle, or measure a thrust, to separate them."


def combination_in_words(combination: Mapping[str, Any]) -> str:
    """Which parameters dives do not separate, without a full stop at the end."""
    sentence = combination["sentence"]
    for name in combination["parameters"]:
        sentence = sentence.replace(name, in_words(name))
    return f"{sentence[0].upper()}{sentence[1:]}"


def in_words(name: str) -> str:
    """Name of a parameter for people: `quadratic damping, surge`."""
    group, _, axis = name.partition(".")
    words = {"r_b": "centre of buoyancy", "lag": "lag of the thrusters"}.get(group, group.replace("_", " "))
    return f"{words}, {axis}" if axis else words


def interval_words(parameter: Mapping[str, Any]) -> str:
    """An interval with its unit: `13.1 [11.4, 14.9] N s/m`."""
    value, low, high = (plain(parameter[key]) for key in ("value", "low", "high"))
    return f"{value} [{low}, {high}] {parameter['unit']}".rstrip()


def profile_words(parameter: Mapping[str, Any]) -> str:
    """The interval by the profile of the likelihood; empty where it was not asked for."""
    if "profile" not in parameter:
        return ""
    low, high = parameter["profile"]
    return f"{'none' if low is None else plain(low)} to {'none' if high is None else plain(high)}"

"""The answer of `undertow identify-design`: which numbers the experiment determines, and how it is carried out."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from undertow.core.number_text import plain
from undertow.report.answers.identification_answer import combination_in_words, in_words
from undertow.report.answers.plain_answer import PlainAnswer

_SHOWN = 4  # parameters named in a line


def answer_of_design(data: Mapping[str, Any], folder: Path) -> PlainAnswer:
    """The answer of a design.

    Args:
        data: contents of experiment.json.
        folder: of its files.
    """
    of_interest = {name: p for name, p in data["parameters"].items() if p["of_interest"]}
    halved = [name for name, p in of_interest.items() if p["halved"]]
    verdict = (
        f"A script of {data['duration']:.0f} s is expected to make {len(halved)} of {len(of_interest)} numbers twice "
        "as sure, or more."
    )
    experiment = folder / "experiment.yaml"
    lines = (
        *_gains(of_interest),
        *_kept(of_interest),
        *_ratios(data),
        _room(data),
        "These deviations are for a model of the right form and the noise of the scenario; waves, a tether or what the "
        "model lacks leave more.",
        *data["notes"],
        f"Rehearse it: undertow simulate {experiment}. Carry it out: undertow run {experiment} --link udp:HOST:PORT, "
        f"or undertow mavlink {experiment} --log dive.mcap; the controller keeps the place, and Ctrl-C ends it. Then "
        "give the log to `undertow identify`.",
    )
    return PlainAnswer(None if 0 < len(halved) < len(of_interest) else bool(halved), verdict, lines)


def _gains(of_interest: Mapping[str, Any]) -> Iterator[str]:
    order = sorted(of_interest, key=lambda name: of_interest[name]["deviation_left"])
    order = [name for name in order if of_interest[name]["halved"]]
    if order:
        shown = "; ".join(
            f"{in_words(name)} from {_before_and_after(of_interest[name])}" for name in order[::-1][:_SHOWN]
        )
        yield f"The least of these gains: {shown} (give or take, one standard deviation)."


def _before_and_after(parameter: Mapping[str, Any]) -> str:
    unit = parameter["unit"]
    return f"{plain(parameter['before'])} to {plain(parameter['after'])} {unit}".rstrip()


def _kept(of_interest: Mapping[str, Any]) -> Iterator[str]:
    kept = [name for name, p in of_interest.items() if not p["halved"]]
    if kept:
        shown = "; ".join(f"{in_words(name)} ({100 * of_interest[name]['deviation_left']:.0f} % left)" for name in kept)
        yield f"These gain less: {shown}."


def _ratios(data: Mapping[str, Any]) -> Iterator[str]:
    for combination in data["undetermined"][:1]:
        sentence = combination_in_words(combination)
        alone = f"{sentence[0].lower()}{sentence[1:]}"
        yield f"By this experiment alone {alone}. Weighing the vehicle, or measuring a thrust, separates them."


def _room(data: Mapping[str, Any]) -> str:
    along, across, vertical = data["farthest"]
    others = np.array(data["largest_use_of_limits"][1:])
    staying = int((others <= 1).sum())
    least, most = data["limits"]["depth"]
    return (
        f"In the rehearsal the centre of the vehicle stays within {along:.2f} m forward and back, {across:.2f} m "
        f"sideways and {vertical:.2f} m up and down of where it begins; its hull needs half its size more. It begins "
        f"{data['station'][2]:.3g} m deep, and above {least:.3g} m or below {most:.3g} m the script ends. If the "
        f"numbers are as wrong as they may be, {len(others) - staying} of {len(others)} tries leave the room, and the "
        "script ends by itself."
    )

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
        f"A script of {data['duration']:.0f} s is expected to halve the deviations of {len(halved)} of "
        f"{len(of_interest)} numbers, or more."
    )
    lines = (
        *_gains(of_interest),
        *_kept(of_interest),
        *_ratios(data),
        _room(data),
        "These deviations are for a model of the right form and the noise of the scenario; waves, a tether or what the "
        "model lacks leave more.",
        *data["notes"],
        f"Rehearse it: undertow simulate {folder / 'experiment.yaml'}",
        "Carry it out with `undertow run` or `undertow mavlink` and the same file; then give the log to "
        "`undertow identify`.",
    )
    return PlainAnswer(len(halved) == len(of_interest), verdict, lines)


def _gains(of_interest: Mapping[str, Any]) -> Iterator[str]:
    order = sorted(of_interest, key=lambda name: of_interest[name]["deviation_left"])
    order = [name for name in order if of_interest[name]["halved"]]
    if order:
        shown = "; ".join(f"{in_words(name)} from {_before_and_after(of_interest[name])}" for name in order[-_SHOWN:])
        yield f"Of these, the least: {shown} (one standard deviation)."


def _before_and_after(parameter: Mapping[str, Any]) -> str:
    unit = parameter["unit"]
    return f"{plain(parameter['before'])} to {plain(parameter['after'])} {unit}".rstrip()


def _kept(of_interest: Mapping[str, Any]) -> Iterator[str]:
    kept = [name for name, p in of_interest.items() if not p["halved"]]
    if kept:
        shown = "; ".join(f"{in_words(name)} ({100 * of_interest[name]['deviation_left']:.0f} % left)" for name in kept)
        yield f"Not halved: {shown}."


def _ratios(data: Mapping[str, Any]) -> Iterator[str]:
    for combination in data["undetermined"][:1]:
        yield f"{combination_in_words(combination)}: weigh the vehicle, or measure a thrust, to separate them."


def _room(data: Mapping[str, Any]) -> str:
    along, across, vertical = data["farthest"]
    others = np.array(data["largest_use_of_limits"][1:])
    staying = int((others <= 1).sum())
    return (
        f"In the rehearsal the vehicle stays within {along:.2f} m along its heading, {across:.2f} m across and "
        f"{vertical:.2f} m vertically of its station. Of {len(others)} other vehicles within the deviations {staying} "
        "stay within the limits, which end the script where one does not."
    )

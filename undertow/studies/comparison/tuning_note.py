"""How the gains of a controller came about, in a sentence: a comparison with an untuned rival is no fair one."""

import inspect
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from undertow.control.controllers.actuation import AbstractAccelerationLaw
from undertow.core import catalogue
from undertow.core.contracts import AbstractController
from undertow.scenario import factory
from undertow.studies.campaign.labels import words
from undertow.studies.tuning.cost import times_other
from undertow.studies.tuning.tunable_parameters import law_of

_RULE = "gains from the rule of `controllers/bandwidths.py`"
_OWN_PATH = "; it commands the inputs in a way of its own"
_TABLE_1 = ("rcaf", "paper")
_NO_GAINS = ("kind", "preset", "sampling_time", "velocity_noise")  # the last two follow from the rest of a scenario


class TuningNote(NamedTuple):
    """How the gains of a controller came about."""

    sentence: str
    tuned: bool  # by `undertow tune`, or by a rule for this plant


def tuning_note(
    part: Mapping[str, Any], law: AbstractController, dt: float, folder: Path, source: Path | None
) -> TuningNote:
    """How the gains of a controller came about.

    Args:
        part: the controller as its scenario has it: kind, preset and options.
        law: the controller itself.
        dt: its sampling time, s.
        folder: where relative file names of the scenario start.
        source: the scenario file that the gains come from, if any.
    """
    note = _searched(part, source) or _unsearched(part, law, dt, folder, source)
    of_user = catalogue.is_user_code(part["kind"]) and not isinstance(law, AbstractAccelerationLaw)
    return note._replace(sentence=f"{note.sentence}{_OWN_PATH}") if of_user else note


def _unsearched(
    part: Mapping[str, Any], law: AbstractController, dt: float, folder: Path, source: Path | None
) -> TuningNote:
    """The note on gains that `undertow tune` did not find."""
    kind, preset, gains, main = _given(part, law, dt, folder)
    short = kind.rpartition("/")[2]
    source_words = f" in {source}" if source else ""
    options = ", ".join(f"{name} {words(value)}" for name, value in gains.items())
    if main is not None:
        instead = {main, *law_of(kind, preset, law).instead.get(main, ())}
        if not instead & set(gains):
            return TuningNote(f"{_RULE}{f', with {options} given{source_words}' if gains else ''}", True)
    if gains:
        return TuningNote(f"gains given{source_words} ({options}), not tuned by `undertow tune`", False)
    if (kind, preset) == _TABLE_1:
        return TuningNote("gains of Table 1 of the paper, not tuned for this scenario", False)
    return TuningNote(f"default gains of `{short}`, not tuned", False)


def tells_of_search(sentence: str) -> bool:
    """Whether a sentence on gains says that they were searched for: by `undertow tune`, or with an equal budget."""
    return sentence.startswith("tuned ")


def takes_own_path(sentence: str) -> bool:
    """Whether a sentence on gains says that a law commands the inputs in a way of its own."""
    return sentence.endswith(_OWN_PATH)


def _given(
    part: Mapping[str, Any], law: AbstractController, dt: float, folder: Path
) -> tuple[str, str | None, dict[str, Any], str | None]:
    """Kind, preset, the gains that do not have their default value, and the gain that a rule sets unless it is given.

    A rule sets the first tunable gain of a law of the catalogue, where its default is None.
    """
    kind = part["kind"]
    function = catalogue.find("controllers", kind, folder)
    presets = catalogue.presets_of(function)
    preset = part.get("preset", catalogue.usual_preset(function)) if presets else None
    defaults = inspect.signature(presets[preset] if preset else function).parameters
    law_parameters = law_of(kind, preset, law)
    tunable = [name.partition("[")[0] for name in law_parameters.ranges(dt)]
    in_catalogue = kind in catalogue.names("controllers")
    ruled = [name for name in tunable[:1] if in_catalogue and name in defaults and defaults[name].default is None]
    names = set(tunable)
    names |= {option for equivalents in law_parameters.instead.values() for option in equivalents}
    gains = [name for name in part if name in names or (not names and name not in _NO_GAINS)]
    changed = lambda name: name not in defaults or factory.listed(defaults[name].default) != part[name]
    changed_gains = {name: part[name] for name in gains if part[name] is not None and changed(name)}
    return kind, preset, changed_gains, ruled[0] if ruled else None


def _searched(part: Mapping[str, Any], source: Path | None) -> TuningNote | None:
    """What tuning.json beside a scenario says, if its gains are those of the controller; None otherwise."""
    try:
        tuning = json.loads((source or Path()).with_name("tuning.json").read_text(encoding="utf-8"))
        gains = tuning["gains"][tuning["kept"]]
        if any(part.get(name) != value for name, value in gains["options"].items()):
            return None
        cost, before = gains["held_out_cost"], tuning["gains"]["given"]["held_out_cost"]
        relation = f"{times_other(cost, before)} with the gains before"
        if tuning["kept"] == "given":
            relation = "the gains before, which no others that were found are better than"
        effort = f"{tuning['evaluations']} evaluations in {tuning['elapsed']:.0f} s"
    except (OSError, ValueError, KeyError, TypeError, AttributeError, ZeroDivisionError):
        return None  # of another program, or none
    ending = "" if tuning.get("finished") else ", stopped by its time budget"
    return TuningNote(
        f"tuned by `undertow tune` ({tuning['method']}, {effort}{ending}; held-out cost {cost:.3g}, {relation})", True
    )

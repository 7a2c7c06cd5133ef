"""Tune every controller of a comparison with the same optimiser and the same number of evaluations.

Each law is tuned on the training runs of the scenario's section `tune` by mutation and selection, which needs no
gradient and therefore treats a law with switching like any other. What is found is kept in a folder, a file for each
law, so that an interrupted comparison is resumed and gives what it would have given.
"""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from undertow.core.atomic_io import write_whole
from undertow.core.errors import BadInput
from undertow.core.json_text import to_json
from undertow.scenario.build import build
from undertow.scenario.provenance import text_hash, versions
from undertow.scenario.reading import Text, dump
from undertow.studies.comparison.candidates import Candidate, file_stem, scenario_with
from undertow.studies.tuning.problem import is_tunable
from undertow.studies.tuning.stability import NoCertificate
from undertow.studies.tuning.training_runs import PlantVariants
from undertow.studies.tuning.tune import INITIAL_DESIGN, Tuned, tune

METHOD = "evolution"

FOLDER = "tuning"  # beside the results

_NO_GAINS = "it has no tunable gains"
_DIVERGED = "no gains of the initial design have a certificate of stability"


class Runs(NamedTuple):
    """One set of runs.

    Attributes:
        seeds: number of seeds.
        sizes: factors on the disturbance.
        sets: published parameter sets of the plant; empty where there is one only.
        runs: number of runs.
    """

    seeds: int
    sizes: tuple[float, ...]
    sets: tuple[str, ...]
    runs: int


GAINS_KEPT = "none of the others has a lower cost"


class TunedLaw(NamedTuple):
    """What tuning found for one law.

    Attributes:
        name: of the candidate.
        gains: options of the controller; empty where it is judged as it is.
        untuned: why it is judged as it is; empty for a tuned law.
        parameters: number of tuned numbers.
        evaluations: gains that were evaluated; 0 for a law that was not tuned.
        train: cost on the training runs, before and after; None for a law that was not tuned.
        held_out: the same on the held-out runs.
        radius: spectral radius of the tuned loop over one control step; None for a law that was not tuned.
    """

    name: str
    gains: dict[str, Any]
    untuned: str
    parameters: int
    evaluations: int
    train: tuple[float, float] | None
    held_out: tuple[float, float] | None
    radius: float | None

    @property
    def sentence(self) -> str:
        """How the gains came about."""
        if self.untuned or self.train is None or self.held_out is None:
            return f"judged as it is: {self.untuned}"
        words = ", ".join(f"{name} {_short(value)}" for name, value in self.gains.items() if value is not None)
        words = words or f"the gains before are kept: {GAINS_KEPT}"
        return (
            f"tuned with {self.evaluations} evaluations of {self.parameters} numbers, cost on training runs "
            f"{self.train[0]:.3g} before and {self.train[1]:.3g} after, on held-out runs {self.held_out[0]:.3g} and "
            f"{self.held_out[1]:.3g} ({words})"
        )


class EqualBudgets(NamedTuple):
    """Tuning of all laws of a comparison.

    Attributes:
        budget: evaluations of gains for each law.
        laws: in the order of the candidates.
        train: runs that the gains are tuned on; None where no law was tuned.
        held_out: runs for the held-out cost of the tuned gains; None where no law was tuned.
    """

    budget: int
    laws: tuple[TunedLaw, ...]
    train: Runs | None
    held_out: Runs | None

    def data(self) -> dict[str, Any]:
        """The same as numbers, words and lists; equal for equal results."""
        sets = {name: runs and runs._asdict() for name, runs in (("train", self.train), ("held_out", self.held_out))}
        return {"budget": self.budget, "method": METHOD, "laws": [law._asdict() for law in self.laws], **sets}


Say = Callable[[str], None]


def check_budget(budget: int) -> None:
    """Check a number of evaluations.

    Raises:
        BadInput: it does not suffice for the initial design.
    """
    if budget < INITIAL_DESIGN:
        hint = f"A law with k gains needs about {INITIAL_DESIGN} + 10 k"
        raise BadInput("--tune", f"be at least {INITIAL_DESIGN} evaluations, the initial design", budget, hint=hint)


def equal_budgets(
    candidates: Sequence[Candidate], scenario: Text, budget: int, folder: Path, say: Say = lambda stage: None
) -> tuple[list[Candidate], EqualBudgets]:
    """Tune every candidate; one without tunable gains, or without certified ones, stays as it is.

    Args:
        candidates: controllers.
        scenario: that they are compared on; the options of its section `tune` hold for all of them, `parameters` only
            for a controller of its own kind.
        budget: evaluations for each.
        folder: for finished tunings and the checkpoint of one that is interrupted; what is there is used.
        say: called with the current law and stage.

    Returns:
        The candidates with tuned gains, and what was found.

    Raises:
        BadInput: the scenario, a controller or the budget cannot be used; or the folder is of another tuning.
    """
    check_budget(budget)
    folder.mkdir(parents=True, exist_ok=True)
    tuned_laws: list[TunedLaw] = []
    sets: dict[str, Any] = {}
    for number, candidate in enumerate(candidates):
        file = folder / file_stem(number, candidate.name)
        entry = _tuned(candidate, scenario_with(candidate, scenario), budget, file, say)
        sets = entry.pop("sets") or sets
        costs: Any = {name: tuple(entry[name]) for name in ("train", "held_out") if entry[name] is not None}
        tuned_laws.append(TunedLaw(**{**entry, **costs}))
    pairs = zip(candidates, tuned_laws, strict=True)
    changed = [candidate._replace(changes=_with_gains(candidate, law)) for candidate, law in pairs]
    runs = {
        name: Runs(**data | {"sizes": tuple(data["sizes"]), "sets": tuple(data["sets"])}) for name, data in sets.items()
    }
    return changed, EqualBudgets(budget, tuple(tuned_laws), runs.get("train"), runs.get("held_out"))


def _with_gains(candidate: Candidate, law: TunedLaw) -> dict[str, Any]:
    return candidate.changes | {"controller": candidate.changes["controller"] | law.gains}


def _tuned(candidate: Candidate, text: Text, budget: int, file: Path, say: Say) -> dict[str, Any]:
    """The entry of a law: from its file, or tuned now and written."""
    say(f"{candidate.name}: building")
    built = build(text)
    fingerprint = text_hash(
        dump({"evaluations": budget, "tune": built.scenario.tune.model_dump(), **built.resolved} | versions())
    )
    finished, checkpoint = file.with_suffix(".json"), file.with_suffix(".jsonl")
    if finished.exists():
        return _read(finished, fingerprint)
    interrupted = checkpoint.exists()
    untuned = "" if is_tunable(built) else _NO_GAINS
    entry: dict[str, Any] | None = None
    if not untuned:
        watch = lambda best, count: say(f"{candidate.name}: {count} of {budget} evaluations, best cost {best.cost:.4g}")
        stage = lambda words: say(f"{candidate.name}: {words}")
        try:
            run = tune(text, checkpoint, method=METHOD, evaluations=budget, resume=interrupted, say=stage, watch=watch)
            entry = _entry(candidate.name, run)
        except NoCertificate:
            untuned = _DIVERGED
    if entry is None:
        empty_fields = dict.fromkeys(("train", "held_out", "radius", "sets"))
        entry = {
            "name": candidate.name,
            "gains": {},
            "untuned": untuned,
            "parameters": 0,
            "evaluations": 0,
            **empty_fields,
        }
    write_whole(finished, to_json({"about": fingerprint, **entry}, indent=1) + "\n")
    checkpoint.unlink(missing_ok=True)
    return _read(finished, fingerprint)


def _entry(name: str, run: Tuned) -> dict[str, Any]:
    """What is kept of a tuning; nothing that depends on the speed of the machine."""
    initial, *_, best = run.evaluated
    if best.train_cost > initial.train_cost:  # by rounding, or because the given gains are outside the ranges
        best = initial
    gains = run.problem.gains(best.options) if best.options is not None else {}
    return {
        "name": name,
        "gains": gains,
        "untuned": "",
        "parameters": len(run.problem.parameters),
        "evaluations": run.evaluations,
        "train": [initial.train_cost, best.train_cost],
        "held_out": [initial.held_out_cost, best.held_out_cost],
        "radius": best.certificate.worst,
        "sets": {"train": _runs(run.problem.train), "held_out": _runs(run.problem.held_out)},
    }


def _runs(trials: PlantVariants) -> dict[str, Any]:
    sets = list(dict.fromkeys(name for name in trials.variants if name))
    sizes = list(dict.fromkeys(np.asarray(trials.sizes).tolist()))
    return {"seeds": trials.number // max(1, len(sets)), "sizes": sizes, "sets": sets, "runs": trials.number}


def _read(file: Path, fingerprint: str) -> dict[str, Any]:
    try:
        entry = json.loads(file.read_text(encoding="utf-8"))
        mismatch = entry.pop("about") != fingerprint
    except (OSError, ValueError, KeyError, AttributeError) as error:
        raise BadInput("--resume", "find tunings that can be read", f"{file}: {error!r}", hint="Remove it") from None
    if mismatch:
        hint = "Choose another folder, or start again with --overwrite"
        raise BadInput(
            "--resume", "continue with the same scenario, budget and versions", "given with others", hint=hint
        )
    return entry


def _short(value: Any) -> str:
    """Gains as text; equal gains of several axes are shown once."""
    if not isinstance(value, list):
        return f"{value:.3g}"
    rows = list(dict.fromkeys(map(_short, value)))
    return rows[0] if len(rows) == 1 else f"({', '.join(rows)})"

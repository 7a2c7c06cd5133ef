"""Tables of the report, made from results.json."""

from typing import Any

from undertow.paper.all_outputs import unit_of
from undertow.report.formats import (
    chip,
    condition,
    ending,
    meets_default_criterion,
    number,
    outcome,
    percent,
    prose,
    unit,
)
from undertow.report.page import Html, join, table, tag

# An independent solution of Example 1, steady window: the project's benchmark definitions, section 4.
REFERENCE = {
    "rcafc": {"tracking_rms": 1.6e-4, "estimation_rms": 0.201, "uncertainty_rms": 3.224, "robust_rms": 0.144},
    "rafc": {"tracking_rms": 7.22e-3, "estimation_rms": 1.607, "uncertainty_rms": 3.224, "robust_rms": 1.579},
}

COLOURS = (
    "Green: the claim holds in the runs named with it. Amber: it holds under the stated condition only. Red: it fails. "
    "Grey: these runs do not decide it."
)

NAMES = {"rcafc": "RCAFC", "rafc": "RAFC"}

_COLUMNS = {
    "rcafc_error": prose("RCAFC, input $\\varepsilon$"),
    "rcafc_state": prose("RCAFC, input $X$"),
    "rafc_error": prose("RAFC, input $\\varepsilon$"),
    "rafc_state": prose("RAFC, input $X$"),
}

# Metric -> the row of the paper's Table 2 that it quantifies, and the paper's words for the four columns.
_TABLE2 = {
    "tracking_rms": ("steady state error e", ("very small", "exist/favorable", "exist/favorable", "exist")),
    "tracking_max": ("largest error", None),
    "estimation_rms": ("estimation of uncertainties", ("excellent", "fair", "fair", "poor")),
    "robust_rms": ("robust control signals", ("small", "small/meddle", "large/meddle", "large")),
    "input_variation": ("chattering", ("very small", "small/meddle", "small/meddle", "serious/meddle")),
    "model_rms": ("trajectories of the identification model", ("very good", "favorable", "favorable", "unavailable")),
    "rules": ("number of fuzzy rules per axis", ("few", "numerous", "few", "numerous")),
    "input_rms": ("voltage", None),
    "weights_peak": ("largest weight", None),
    "settling_time": ("settling to 2 %", None),
}
_ROBUSTNESS = ("very good", "fair", "fair", "poor/fair")

_LEVELS = {
    "ideal": "thrust proportional to voltage (Example 1)",
    "static": "quasi-static motor (Example 2)",
    "shaft": "rotor inertia, without winding inductance",
    "electromechanical": "full motor model, Eqs. (8) to (11)",
}


def reference_table(example: dict[str, Any]) -> Html:
    """This run compared with the independent solution."""
    rows = []
    for key, expected in REFERENCE.items():
        metrics = (example.get(key) or {}).get("steady") or {}
        for metric, independent in expected.items():
            reproduced = metrics.get(metric)
            difference = None if reproduced is None else 100 * (reproduced / independent - 1)
            cells = (NAMES[key], _named(metric), number(reproduced, 4), number(independent, 4), percent(difference))
            rows.append(cells)
    return table(("controller", "metric", "this run", "independent", "difference"), rows, numeric=(2, 3, 4))


def table2(results: dict[str, Any]) -> Html:
    """Table 2 in numbers, with the paper's words below them."""
    keys = [key for key in _COLUMNS if key in results]
    places = [list(_COLUMNS).index(key) for key in keys]
    rows = []
    for metric, (row, words) in _TABLE2.items():
        values = [(results[key].get("steady") or {}).get(metric) for key in keys]
        cells = [_worded(number(v), words[p] if words else "") for v, p in zip(values, places, strict=True)]
        rows.append((join(row, Html("<br>"), unit(unit_of(metric))), *cells))
    endings = [_worded(ending(results[key]), _ROBUSTNESS[p]) for key, p in zip(keys, places, strict=True)]
    rows.append(("robustness: how the run ended", *endings))
    return table(("", *(_COLUMNS[key] for key in keys)), rows, numeric=range(1, 5), wide=True)


def fidelity_levels(results: dict[str, Any]) -> Html:
    """Both controllers on every fidelity level, with the reason of a failure."""
    rows = []
    for fidelity, entries in results.items():
        for key, entry in entries.items():
            steady = entry.get("steady") or {}
            figures = [number(steady.get(m)) for m in ("tracking_rms", "estimation_rms", "input_variation")]
            lasted = entry["status"] == "completed"
            words = f"lasts {entry['simulated_s']:g} s" if lasted else ending(entry)
            ended = outcome(words, lasted, meets_default_criterion(entry["steady"]))
            level = join(tag("b", fidelity), tag("span", _LEVELS.get(fidelity, ""), class_="said"))
            rows.append((level, NAMES.get(key, key), ended, *figures, prose(entry.get("why") or "")))
    metrics = map(_named, ("tracking_rms", "estimation_rms", "input_variation"))
    head = ("fidelity", "controller", "status", *metrics, "reason")
    return table(head, rows, numeric=(3, 4, 5), wide=True)


def audit(claims: list[dict[str, Any]]) -> Html:
    """Claims with their verdicts, the evidence and the command that reproduces it."""
    rows = []
    for claim in claims:
        verdict = join(chip(claim["verdict"]), _condition(claim["verdict"]))
        name = claim.get("scenario")
        command = tag("div", tag("code", f"undertow simulate {name}")) if name else ""
        identity = tag("b", claim["id"], id=claim["id"])
        simulated = tag("div", prose(f"Simulated: {claim['simulated']}."), class_="small")
        rows.append((identity, prose(claim["claim"]), verdict, join(prose(claim["evidence"]), simulated, command)))
    return table(("", "claim", "verdict", "evidence, and the run behind it"), rows, wide=True)


def glance(claims: list[dict[str, Any]]) -> Html:
    """Summary of the verdicts."""
    items = []
    for claim in claims:
        link = tag("a", claim["id"], href=f"#{claim['id']}")
        simulated = tag("span", prose(f"Simulated: {claim['simulated']}."), class_="said")
        words = join(prose(claim["claim"]), _condition(claim["verdict"]), simulated)
        items.append(tag("li", link, tag("span", chip(claim["verdict"])), tag("span", words)))
    return join(tag("p", COLOURS, class_="small"), tag("ul", *items, class_="verdicts"))


def provenance(results: dict[str, Any]) -> Html:
    """Versions and hashes."""
    rows = [(key.replace("_", " "), _plain(value)) for key, value in results.items()]
    return tag("div", table(("", ""), rows), class_="small")


def _named(metric: str) -> Html:
    return join(metric.replace("_", " "), Html(" "), unit(unit_of(metric)))


def _condition(verdict: str) -> Html:
    words = condition(verdict)
    return tag("span", prose(words), class_="said") if words else Html("")


def _worded(value: Any, word: str) -> Html:
    return join(value, tag("span", word, class_="said")) if word else join(value)


def _plain(value: Any) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key} {_plain(entry)}" for key, entry in value.items())
    return ", ".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)

"""The page of a campaign: status, requirements, distributions, sensitivities, the worst trials, the configuration."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from undertow.analysis.metrics import titled_name
from undertow.core.atomic_io import write_whole
from undertow.core.number_text import display_units, infinite
from undertow.core.status import Status
from undertow.report.answers.campaign_answer import answer_of_campaign, by_xla
from undertow.report.answers.plain_answer import answer_block
from undertow.report.figures.campaign import SHOWN, distributions_figure, sensitivity_figure, shown_inputs
from undertow.report.figures.writing import Plots, Saved, save_all
from undertow.report.formats import captioned, chip, ending, number, prose, quantity, unit
from undertow.report.page import Html, bullets, document, join, section, table, tag
from undertow.report.replay.replay_data import ReplayData
from undertow.report.replay.replay_section import replay_looks, replay_section
from undertow.studies.campaign.campaign_schema import Distribution
from undertow.studies.campaign.columns import ENDINGS
from undertow.studies.campaign.labels import words
from undertow.studies.campaign.store_results import Results

_CAPTIONS = {
    "distributions": "Empirical cumulative distribution functions, with one step per trial. A curve that ends below 1 "
    "has failed trials. Smaller values are better. Metrics are computed over the steady window: the second half of a "
    "run, unless `steady` of the scenario says otherwise.",
    "sensitivity": "Spearman's rank correlation over the completed trials, the first 100 000 at most, mean over the "
    "combinations: +1 where a metric increases with an input, -1 where it decreases, 0 where they are unrelated. Above "
    "the line are the keys of `vary`, below it scalars that the seed of a trial determines: sensors' offsets, factors "
    "of a parameter error and the like, those with the largest correlation first.",
}
_REPLAY = "The worst of the trials of the table above, in one scene."
_INTERVALS = (
    "Share of the trials that keep each requirement, with its 95 % Clopper-Pearson interval. The interval is exact for "
    "random samples and conservative for Latin hypercube and Sobol samples, which are more even. A failed trial does "
    "not keep the requirement; an invalid trial is not counted. The verdict `open` means that more trials are needed: "
    "increase `trials` and use `--resume`. The interval assumes that the number of trials was fixed beforehand. Green: "
    "the whole interval is above the required share. Red: it is below it. Grey: open."
)


def write_campaign(
    title: str,
    results: Results,
    summary: Mapping[str, Any],
    folder: Path,
    pdf: str | None = None,
    replays: Sequence[ReplayData] = (),
) -> tuple[Path, list[str]]:
    """Write `campaign.html`, and every figure into `figures/`; return a sentence for each failed figure.

    `pdf` is the width of PDF files, None for none; `replays` are those of the worst trials, none for no replay.

    Raises:
        OSError: the folder cannot be written.
    """
    saved = save_all(lambda: _plots(results, summary), folder / "figures", pdf)
    plotted = _figures(saved)
    page = document(
        title,
        tag("h1", prose(title)),
        answer_block(answer_of_campaign(results, summary)),
        plotted["distributions"],
        *(tag("p", prose(sentence)) for sentence in saved.failures),
        section("status", "Status of the trials", *_endings(summary)),
        *_optional("requirements", "Requirements", tag("p", prose(_INTERVALS)), requirements(results, summary)),
        section("metrics", "Distributions", distributions(results, summary)),
        *_optional(
            "sensitivity", "Sensitivity", *_chance(summary), plotted["sensitivity"], *_choices(results, summary)
        ),
        section("worst", "The worst trials", _how(summary), worst(results, summary)),
        *([replay_section(replays, _REPLAY)] if replays else []),
        section("configuration", "Configuration", *asked(results)),
        looks=replay_looks() if replays else "",
    )
    path = folder / "campaign.html"
    write_whole(path, page)
    return path, saved.failures


def _endings(summary: Mapping[str, Any]) -> list[Html]:
    ended = endings(summary)
    if not summary["invalid"]:
        return [ended]
    errors = [prose(f"{error['trials']} with this error: {error['why']}") for error in summary["invalid"]]
    return [ended, tag("p", "The following trials are invalid and did not run:"), bullets(errors)]


def _chance(summary: Mapping[str, Any]) -> list[Html]:
    """What unrelated inputs reach by chance, and how many inputs the figure leaves out."""
    completed = [combination["status"].get("completed", 0) for combination in summary["combinations"]]
    if not summary["sensitivity"] or max(completed, default=0) < 3:
        return []
    chance = join("With ", str(max(completed)), " trials, 95 % of the correlations of unrelated quantities are within ")
    size = join(Html("&plusmn;"), number(min(1.96 / math.sqrt(max(completed) - 1), 1.0), 2), ".")
    hidden = len(summary["sensitivity"]) - len(shown_inputs(summary["sensitivity"]))
    omitted = f" {hidden} further inputs with smaller correlations are in summary.json." if hidden else ""
    return [tag("p", join(chance, size, omitted))]


def _choices(results: Results, summary: Mapping[str, Any]) -> list[Html]:
    tables = by_choice(results, summary)
    sentence = "Median [5 %, 95 %] of the completed trials for each choice, over all combinations."
    return [tag("p", prose(sentence)), *tables] if tables else []


def _optional(identity: str, title: str, *content: Html) -> list[Html]:
    """A section, unless the last part of its content is empty."""
    return [section(identity, title, *content)] if any(content[-1:]) else []


def _how(summary: Mapping[str, Any]) -> Html:
    order = "Failed trials come first, the earliest at the top, then those with the largest tracking rms."
    repeat_hint = "To repeat one, run `undertow simulate worst/trial-NUMBER.yaml` in the folder of this page."
    return tag("p", prose(f"{order} {repeat_hint} {by_xla(summary)}".rstrip()))


def _plots(results: Results, summary: Mapping[str, Any]) -> Plots:
    """What makes each figure; nothing where there is nothing to sample."""
    values = _values(results, summary)
    units = {name: _people(results, name)[1] for name in results.metrics}
    varied = sum(key in results.campaign.vary for key in summary["sensitivity"])
    ran = {
        named(combination): combination["trials"] - combination["invalid"] for combination in summary["combinations"]
    }
    figures = {
        "distributions": (lambda: distributions_figure(values, ran, units)) if values else None,
        "sensitivity": (lambda: sensitivity_figure(summary["sensitivity"], varied)) if summary["sensitivity"] else None,
    }
    return {name: make for name, make in figures.items() if make is not None}


def _figures(saved: Saved) -> dict[str, Html]:
    """Figures by name, for the page."""
    return dict.fromkeys(_CAPTIONS, Html("")) | captioned(saved.vectors, _CAPTIONS)


def _values(results: Results, summary: Mapping[str, Any]) -> dict[str, dict[str, np.ndarray]]:
    """Finite values of each metric that is plotted, by combination; angles in degrees."""
    values: dict[str, dict[str, np.ndarray]] = {}
    indices = np.unique(results.combinations)
    for index, combination in zip(indices, summary["combinations"], strict=True):
        in_combination = results.combinations == index
        for metric in (name for name in combination["metrics"] if name in SHOWN):
            scaled = _people(results, metric)[0] * results.rows[metric].values[in_combination]
            if np.isfinite(scaled).any():
                values.setdefault(metric, {})[named(combination)] = scaled[np.isfinite(scaled)]
    return values


_DIGITS = 4


def named(combination: Mapping[str, Any]) -> str:
    """A combination of `cross` as text; numbers with the name of their key."""
    parts = (
        f"{key.split('.')[-1]} {value}" if _numeric(value) else value for key, value in combination["values"].items()
    )
    return ", ".join(parts) or "all trials"


def endings(summary: Mapping[str, Any]) -> Html:
    """Number of trials by status and number of successes, one column per combination."""
    combinations = summary["combinations"]
    rows = [
        (word, *(str(combination["status"].get(word, 0)) for combination in combinations)) for word in summary["status"]
    ]
    if any(combination["success"]["within"] or combination["success"]["not_within"] for combination in combinations):
        rows.append(
            (
                "within the criterion of success",
                *(str(combination["success"]["within"]) for combination in combinations),
            )
        )
    head = ("trials", *map(named, combinations))
    return table(head, rows, numeric=range(1, len(head)), wide=len(combinations) > 3)


def requirements(results: Results, summary: Mapping[str, Any]) -> Html:
    """The requirements and their verdicts; empty where there are none."""
    rows = []
    for combination in summary["combinations"]:
        for requirement in combination["requirements"]:
            low, high = requirement["interval"]
            share = f"{100 * requirement['kept']:.1f} % [{100 * low:.1f}, {100 * high:.1f}]"
            share_words = f" in {100 * requirement['share']:g} % of the trials"
            if requirement["formula"] is None:
                bound = quantity(requirement["below"], results.unit(requirement["metric"]))
                description = join(_metric(requirement["metric"]), " < ", bound, share_words)
            else:
                description = join(
                    f"{requirement['metric']}: ", tag("code", prose(requirement["formula"])), share_words
                )
            rows.append((description, named(combination), chip(requirement["verdict"]), share))
    head = ("requirement", "combination", "verdict", "share of the trials [95 % interval]")
    return table(head, rows) if rows else Html("")


def distributions(results: Results, summary: Mapping[str, Any]) -> Html:
    """Quantiles of every metric, side by side for the combinations."""
    combinations = summary["combinations"]
    names = dict.fromkeys(name for combination in combinations for name in combination["metrics"])
    rows = []
    for name in names:
        cells = (_spread(results, name, combination["metrics"].get(name)) for combination in combinations)
        rows.append((_headed(results, name), *cells))
    head = ("median [5 %, 95 %]", *map(named, combinations))
    return table(head, rows, numeric=range(1, len(head)), wide=len(combinations) > 1)


def by_choice(results: Results, summary: Mapping[str, Any]) -> list[Html]:
    """For each choice, a table of the median and the 5 % to 95 % range."""
    tables = []
    metrics = [*results.tracking, "input_rms"]
    for key, entries in summary["choices"].items():
        rows = []
        for word, statistics in entries.items():
            cells = (_spread(results, name, statistics["metrics"].get(name)) for name in metrics)
            rows.append((word, str(statistics["trials"]), str(statistics["failed"]), *cells))
        head = (prose(f"`{key}`"), "trials", "failed", *(_headed(results, name) for name in metrics))
        tables.append(table(head, rows, numeric=range(1, len(head))))
    return tables


def worst(results: Results, summary: Mapping[str, Any]) -> Html:
    """The worst trials with their sampled values."""
    rows = []
    for trial in summary["worst"]:
        row = results.rows.sel(trial=trial)
        swept = results.swept(trial)
        sampled = [
            number(value, _DIGITS) if isinstance(value, float) else value for value in results.sampled(trial).values()
        ]
        completed = int(row["status"]) == int(Status.OK)
        ended = ending(
            {"status": ENDINGS[int(row["status"])], "diverged_at": None if completed else float(row["ended"])}
        )
        errors = [_shown(results, name, float(row[name]) if completed else None) for name in results.tracking]
        rows.append((str(trial), ended, *errors, *swept, *sampled))
    keys = [prose(f"`{key}`") for key in (*results.campaign.axes, *results.campaign.vary)]
    heads = [_headed(results, name) for name in results.tracking]
    return table(("trial", "ended", *heads, *keys), rows, numeric=range(2, 2 + len(heads)), wide=len(keys) > 1)


def asked(results: Results) -> list[Html]:
    """The configuration: sampling, versions and the campaign file."""
    campaign = results.campaign
    attributes = results.rows.attrs
    rows = [(prose(f"`{key}`"), prose(_words(spread))) for key, spread in campaign.vary.items()]
    rows += [(prose(f"`{key}`"), ", ".join(entries)) for key, entries in campaign.axes.items()]
    sampling = f"{campaign.trials} samples ({campaign.design}), seed {campaign.seed}"
    sampling += ", each for every combination below." if campaign.axes else "."
    versions = ", ".join(
        f"{key.removeprefix('version_')} {value}" for key, value in attributes.items() if key.startswith("version_")
    )
    file = tag("details", tag("summary", "The complete campaign file"), tag("pre", attributes["campaign"]))
    return [
        tag("p", sampling),
        *([table(("key", "values"), rows)] if rows else []),
        tag("p", f"{versions}; {attributes['machine']}", class_="small"),
        file,
    ]


def _numeric(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _metric(name: str) -> str:
    return name.replace("_", " ")


def _words(spread: Distribution) -> str:
    """A distribution as text."""
    if spread.choice is not None:
        return "one of " + ", ".join(map(words, spread.choice))
    if spread.normal is not None:
        return "normal, mean {:g}, standard deviation {:g}".format(*spread.normal)
    if spread.uniform is not None:
        return "uniform, {:g} to {:g}".format(*spread.uniform)
    if spread.log_normal is not None:
        return "log-normal, median {:g}, standard deviation of the logarithm {:g}".format(*spread.log_normal)
    if spread.cut_normal is not None:
        return "normal, mean {:g}, standard deviation {:g}, at least {:g}".format(*spread.cut_normal)
    return "log-uniform, {:g} to {:g}".format(*(spread.log_uniform or ()))


def _headed(results: Results, name: str) -> Html:
    """A metric and its unit; angles in degrees."""
    return join(titled_name(name), " ", unit(_people(results, name)[1]))


def _people(results: Results, name: str) -> tuple[float, str]:
    """Factor from a metric to what people read, and its unit."""
    return display_units(1.0, results.unit(name))


def _shown(results: Results, name: str, value: float | None) -> Html:
    return number(None if value is None else display_units(value, results.unit(name))[0], _DIGITS)


def _spread(results: Results, name: str, quantiles: Mapping[str, float] | None) -> Html:
    if quantiles is None:
        return number(None)
    metric_unit = results.unit(name)
    formatted = lambda value: infinite(metric_unit) if np.isinf(value) else number(display_units(value, metric_unit)[0])
    low, middle, high = map(formatted, quantiles.values())
    return join(middle, " [", low, ", ", high, "]")

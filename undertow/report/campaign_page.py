"""The page of a campaign: status, requirements, distributions, sensitivities, the worst trials, the configuration."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from undertow.analysis.metrics import for_people, infinite, titled_name
from undertow.core.atomic_io import write_whole
from undertow.core.status import Status
from undertow.report.figures.campaign import SHOWN, distributions_figure, sensitivity_figure, shown_inputs
from undertow.report.figures.writing import Plots, Saved, save_all
from undertow.report.formats import chip, ending, number, prose, quantity, unit
from undertow.report.page import Html, bullets, document, figure, join, section, table, tag
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
    found: Mapping[str, Any],
    folder: Path,
    pdf: str | None = None,
    replays: Sequence[ReplayData] = (),
) -> tuple[Path, list[str]]:
    """Write `campaign.html`, and every figure into `figures/`; return a sentence for each failed figure.

    `pdf` is the width of PDF files, None for none; `replays` are those of the worst trials, none for no replay.

    Raises:
        OSError: the folder cannot be written.
    """
    saved = save_all(lambda: _plots(results, found), folder / "figures", pdf)
    plotted = _figures(saved)
    page = document(
        title,
        tag("h1", prose(title)),
        tag("p", f"{found['done']} of {found['trials']} trials", class_="lead"),
        *([tag("p", prose(found["nominal_model"]))] if found["nominal_model"] else []),
        *(tag("p", prose(sentence)) for sentence in saved.failures),
        section("status", "Status of the trials", *_endings(found)),
        *_optional("requirements", "Requirements", tag("p", prose(_INTERVALS)), requirements(results, found)),
        section("metrics", "Distributions", plotted["distributions"], distributions(results, found)),
        *_optional("sensitivity", "Sensitivity", *_chance(found), plotted["sensitivity"], *_choices(results, found)),
        section("worst", "The worst trials", _how(found), worst(results, found)),
        *([replay_section(replays, _REPLAY)] if replays else []),
        section("configuration", "Configuration", *asked(results)),
        looks=replay_looks() if replays else "",
    )
    path = folder / "campaign.html"
    write_whole(path, page)
    return path, saved.failures


def _endings(found: Mapping[str, Any]) -> list[Html]:
    ended = endings(found)
    if not found["invalid"]:
        return [ended]
    errors = [prose(f"{one['trials']} with this error: {one['why']}") for one in found["invalid"]]
    return [ended, tag("p", "The following trials are invalid and did not run:"), bullets(errors)]


def _chance(found: Mapping[str, Any]) -> list[Html]:
    """What unrelated inputs reach by chance, and how many inputs the figure leaves out."""
    lasted = [one["status"].get("completed", 0) for one in found["combinations"]]
    if not found["sensitivity"] or max(lasted, default=0) < 3:
        return []
    chance = join("With ", str(max(lasted)), " trials, 95 % of the correlations of unrelated quantities are within ")
    size = join(Html("&plusmn;"), number(min(1.96 / math.sqrt(max(lasted) - 1), 1.0), 2), ".")
    hidden = len(found["sensitivity"]) - len(shown_inputs(found["sensitivity"]))
    more = f" {hidden} further inputs with smaller correlations are in summary.json." if hidden else ""
    return [tag("p", join(chance, size, more))]


def _choices(results: Results, found: Mapping[str, Any]) -> list[Html]:
    tables = by_choice(results, found)
    sentence = "Median [5 %, 95 %] of the completed trials for each choice, over all combinations."
    return [tag("p", prose(sentence)), *tables] if tables else []


def _optional(identity: str, title: str, *content: Html) -> list[Html]:
    """A section, unless the last part of its content is empty."""
    return [section(identity, title, *content)] if any(content[-1:]) else []


def _how(found: Mapping[str, Any]) -> Html:
    order = "Failed trials come first, the earliest at the top, then those with the largest tracking rms."
    again = "To repeat one, run `undertow simulate worst/trial-NUMBER.yaml` in the folder of this page."
    return tag("p", prose(f"{order} {again} {by_xla(found)}".rstrip()))


def _plots(results: Results, found: Mapping[str, Any]) -> Plots:
    """What makes each figure; nothing where there is nothing to sample."""
    values, units = _values(results, found), {name: _people(results, name)[1] for name in results.metrics}
    varied = sum(key in results.campaign.vary for key in found["sensitivity"])
    ran = {named(one): one["trials"] - one["invalid"] for one in found["combinations"]}
    figures = {
        "distributions": (lambda: distributions_figure(values, ran, units)) if values else None,
        "sensitivity": (lambda: sensitivity_figure(found["sensitivity"], varied)) if found["sensitivity"] else None,
    }
    return {name: make for name, make in figures.items() if make is not None}


def _figures(saved: Saved) -> dict[str, Html]:
    """Figures by name, for the page."""
    return dict.fromkeys(_CAPTIONS, Html("")) | {
        name: figure(vector.read_text(encoding="utf-8"), name, _CAPTIONS[name], prose(_CAPTIONS[name]))
        for name, vector in saved.vectors.items()
    }


def _values(results: Results, found: Mapping[str, Any]) -> dict[str, dict[str, np.ndarray]]:
    """Finite values of each metric that is plotted, by combination; angles in degrees."""
    values: dict[str, dict[str, np.ndarray]] = {}
    numbers = np.unique(results.combinations)
    for combination, one in zip(numbers, found["combinations"], strict=True):
        own = results.combinations == combination
        for metric in (name for name in one["metrics"] if name in SHOWN):
            whole = _people(results, metric)[0] * results.rows[metric].values[own]
            if np.isfinite(whole).any():
                values.setdefault(metric, {})[named(one)] = whole[np.isfinite(whole)]
    return values


_DIGITS = 4


def named(combination: Mapping[str, Any]) -> str:
    """A combination of `cross` as text; numbers with the name of their key."""
    parts = (
        f"{key.split('.')[-1]} {value}" if _numeric(value) else value for key, value in combination["values"].items()
    )
    return ", ".join(parts) or "all trials"


def endings(found: Mapping[str, Any]) -> Html:
    """Number of trials by status and number of successes, one column per combination."""
    several = found["combinations"]
    rows = [(word, *(str(one["status"].get(word, 0)) for one in several)) for word in found["status"]]
    if any(one["success"]["within"] or one["success"]["not_within"] for one in several):
        rows.append(("within the criterion of success", *(str(one["success"]["within"]) for one in several)))
    head = ("trials", *map(named, several))
    return table(head, rows, numeric=range(1, len(head)), wide=len(several) > 3)


def by_xla(found: Mapping[str, Any]) -> str:
    """A sentence about trials that used the XLA backend; empty where none did."""
    if not found["by_xla"]:
        return ""
    consequence = "which is slower, and a single run repeats such a trial only up to rounding"
    return (
        f"{found['by_xla']} trials used the XLA backend, {consequence}. `undertow simulate` of one states the reason."
    )


def requirements(results: Results, found: Mapping[str, Any]) -> Html:
    """The requirements and their verdicts; empty where there are none."""
    rows = []
    for one in found["combinations"]:
        for required in one["requirements"]:
            low, high = required["interval"]
            share = f"{100 * required['kept']:.1f} % [{100 * low:.1f}, {100 * high:.1f}]"
            of = f" in {100 * required['share']:g} % of the trials"
            if required["formula"] is None:
                bound = quantity(required["below"], results.unit(required["metric"]))
                words = join(_metric(required["metric"]), " < ", bound, of)
            else:
                words = join(f"{required['metric']}: ", tag("code", prose(required["formula"])), of)
            rows.append((words, named(one), chip(required["verdict"]), share))
    head = ("requirement", "combination", "verdict", "share of the trials [95 % interval]")
    return table(head, rows) if rows else Html("")


def distributions(results: Results, found: Mapping[str, Any]) -> Html:
    """Quantiles of every metric, side by side for the combinations."""
    several = found["combinations"]
    names = dict.fromkeys(name for one in several for name in one["metrics"])
    rows = []
    for name in names:
        cells = (_spread(results, name, one["metrics"].get(name)) for one in several)
        rows.append((_headed(results, name), *cells))
    head = ("median [5 %, 95 %]", *map(named, several))
    return table(head, rows, numeric=range(1, len(head)), wide=len(several) > 1)


def by_choice(results: Results, found: Mapping[str, Any]) -> list[Html]:
    """For each choice, a table of the median and the 5 % to 95 % range."""
    tables, shown = [], [*results.tracking, "input_rms"]
    for key, entries in found["choices"].items():
        rows = []
        for word, one in entries.items():
            cells = (_spread(results, name, one["metrics"].get(name)) for name in shown)
            rows.append((word, str(one["trials"]), str(one["failed"]), *cells))
        head = (prose(f"`{key}`"), "trials", "failed", *(_headed(results, name) for name in shown))
        tables.append(table(head, rows, numeric=range(1, len(head))))
    return tables


def worst(results: Results, found: Mapping[str, Any]) -> Html:
    """The worst trials with their sampled values."""
    rows = []
    for trial in found["worst"]:
        row, swept = results.rows.sel(trial=trial), results.swept(trial)
        sampled = [number(one, _DIGITS) if isinstance(one, float) else one for one in results.sampled(trial).values()]
        lasted = int(row["status"]) == int(Status.OK)
        how = ending({"status": ENDINGS[int(row["status"])], "diverged_at": None if lasted else float(row["ended"])})
        errors = [_shown(results, name, float(row[name]) if lasted else None) for name in results.tracking]
        rows.append((str(trial), how, *errors, *swept, *sampled))
    keys = [prose(f"`{key}`") for key in (*results.campaign.axes, *results.campaign.vary)]
    heads = [_headed(results, name) for name in results.tracking]
    return table(("trial", "ended", *heads, *keys), rows, numeric=range(2, 2 + len(heads)), wide=len(keys) > 1)


def asked(results: Results) -> list[Html]:
    """The configuration: sampling, versions and the campaign file."""
    campaign, attributes = results.campaign, results.rows.attrs
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
    return "log-uniform, {:g} to {:g}".format(*(spread.log_uniform or ()))


def _headed(results: Results, name: str) -> Html:
    """A metric and its unit; angles in degrees."""
    return join(titled_name(name), " ", unit(_people(results, name)[1]))


def _people(results: Results, name: str) -> tuple[float, str]:
    """Factor from a metric to what people read, and its unit."""
    return for_people(1.0, results.unit(name))


def _shown(results: Results, name: str, value: float | None) -> Html:
    return number(None if value is None else for_people(value, results.unit(name))[0], _DIGITS)


def _spread(results: Results, name: str, quantiles: Mapping[str, float] | None) -> Html:
    if quantiles is None:
        return number(None)
    of = results.unit(name)
    said = lambda value: infinite(of) if np.isinf(value) else number(for_people(value, of)[0])
    low, middle, high = map(said, quantiles.values())
    return join(middle, " [", low, ", ", high, "]")

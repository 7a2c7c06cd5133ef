"""The page of a comparison: the findings, how each controller was tuned, figures, differences and configuration."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import xarray as xr

from undertow.core.atomic_io import write_whole
from undertow.report.answers.comparison_answer import answer_of_comparison
from undertow.report.answers.notebook import in_notebook
from undertow.report.answers.plain_answer import answer_block
from undertow.report.campaign_page import asked
from undertow.report.figures.comparison import alike, comparison_plots
from undertow.report.figures.writing import save_all, small_png
from undertow.report.formats import prose
from undertow.report.page import Html, bullets, document, figure, section, table, tag
from undertow.report.replay.replay_data import ReplayData
from undertow.report.replay.replay_section import replay_looks, replay_section
from undertow.studies.campaign.store_results import Results
from undertow.studies.comparison.budget_tables import budget_rows, budget_sentences
from undertow.studies.comparison.comparison import ComparisonResult
from undertow.studies.comparison.equal_budgets import EqualBudgets
from undertow.studies.comparison.findings import Findings
from undertow.studies.comparison.sentences import HOW, sentences
from undertow.studies.comparison.step_time import HOW_LONG, StepTime
from undertow.studies.comparison.tables import NOTE, TextTable, medians, paired, titled, value_in

_CAPTIONS = {
    "differences": "Each point is one trial: the metric of a {noun} less that of the first {noun}, with the same "
    "sample and seed. The diamond is the median, the bar its 95 % bootstrap interval. Left of zero the {noun} has the "
    "smaller value.",
    "pareto": "Medians over the completed trials with their 95 % intervals. A {noun} is on the front (bold, joined by "
    "a line) if no other one is at least as good in both and better in one; the others are pale. A hollow point is a "
    "{noun} that did not complete every trial, and is not judged.",
    "histories": "Tracking error per axis: the root of its mean square over the axes, whose rms over the steady window "
    "is the metric of the table. Lines end where a run failed. The area holds 5 % to 95 % of the trials that were "
    "running at that time.",
    "plan": "Positions north and east in the first trial, with the same seed for each {noun}, on axes that fit the "
    "completed runs. A dot marks the end of the reference, a cross a failure.",
    "distributions": "Empirical cumulative distribution functions, with one step per trial. A curve that ends below 1 "
    "has failed trials.",
}
_COMPARED = ("controller", "scenario")  # what is compared, by name; else values of a key or variants of a campaign
_REPLAY = "The first trial, as in the figures of time histories and paths, with the same seed for all."

_FAIR = (
    "A comparison with a controller that was not tuned says little. The folder `scenarios` beside this page has the "
    "scenario of each {noun}: `undertow tune scenarios/NAME.yaml` tunes its gains, and `--controllers` takes the "
    "`tuned.yaml` that this writes."
)


def write_comparison(
    comparison: ComparisonResult,
    results: Results,
    subject: str,
    folder: Path,
    pdf: str | None = None,
    replays: Sequence[ReplayData] = (),
    times: Mapping[str, StepTime] | None = None,
    budgets: EqualBudgets | None = None,
) -> tuple[Path, list[str]]:
    """Write `comparison.html`, and every figure into `figures/`; return a sentence for each figure that failed.

    Args:
        comparison: what is shown.
        results: of its campaign.
        subject: what is simulated, in words.
        folder: of the page.
        pdf: width of PDF files; None for none.
        replays: of one trial of the controllers; none for a page without a replay.
        times: computing time of a step of each law; None where it was not measured.
        budgets: tuning of the controllers with equal budgets; None without.

    Raises:
        OSError: the folder cannot be written.
    """
    findings = comparison.findings
    noun = noun_of(findings)
    saved = save_all(lambda: comparison_plots(comparison.dataset, findings), folder / "figures", pdf)
    title = f"Comparison: {', '.join(findings.names)}"
    figures = [
        figure(vector.read_text(encoding="utf-8"), name, caption, prose(caption))
        for name, vector in saved.vectors.items()
        for caption in [_CAPTIONS[name].format(noun=noun)]
    ]
    further_figures = figures[1:]
    if alike_sentence := _alike(comparison.dataset, findings):
        further_figures.insert(0, tag("p", prose(alike_sentence)))
    page = document(
        title,
        tag("h1", prose(title)),
        tag("p", prose(_lead(findings, subject)), class_="lead"),
        answer_block(answer_of_comparison(findings, noun)),
        *(tag("p", prose(sentence)) for sentence in saved.failures),
        *figures[:1],
        _rows(medians(findings, times)),
        tag("p", prose(f"{NOTE}{f' {HOW_LONG}' if times else ''}"), class_="small"),
        bullets([prose(sentence) for sentence in sentences(findings)]),
        *([_differing(findings)] if findings.differing else []),
        *([replay_section(replays, _replayed(replays, findings))] if replays else []),
        section("tuning", "Tuning", *_how_tuned(noun, findings, budgets)),
        *([section("figures", "More figures", *further_figures)] if further_figures else []),
        section("endings", "Status of the trials", _endings(findings)),
        section("differences", "Paired differences", tag("p", prose(HOW)), _rows(paired(findings), words=2)),
        section("configuration", "Configuration", *asked(results)),
        looks=replay_looks() if replays else "",
    )
    path = folder / "comparison.html"
    write_whole(path, page)
    return path, saved.failures


def in_notebook_of(comparison: ComparisonResult) -> Html:
    """A comparison as a notebook shows it: the answer and the first of its figures."""
    findings = comparison.findings
    noun, pictures = noun_of(findings), []
    for name, make in list(comparison_plots(comparison.dataset, findings).items())[:1]:
        caption = _CAPTIONS[name].format(noun=noun)
        pictures.append(figure(small_png(make()), name, caption, prose(caption)))
    title = f"Comparison: {', '.join(findings.names)}"
    return in_notebook(title, answer_of_comparison(findings, noun), *pictures)


def noun_of(findings: Findings) -> str:
    """What is compared, in a word."""
    return findings.dimension if findings.dimension in _COMPARED else "variant"


def _lead(findings: Findings, subject: str) -> str:
    prefix = f"{subject}: " if subject and not findings.differing else ""
    if findings.all_equal:
        trials = "one trial" if findings.trials == 1 else f"{findings.trials} trials, which are all equal,"
        return f"{prefix}{trials} for each, because nothing in the scenario is random."
    return f"{prefix}{findings.trials} trials for each, with the same samples and seeds."


def _alike(dataset: xr.Dataset, findings: Findings) -> str:
    """A sentence on the metrics that no figure shows, because they have one value only; empty without any."""
    constant_metrics = alike(dataset, findings)
    metrics_and_values = ", ".join(
        f"{titled(findings, metric)}: {value_in(value, findings.units[metric])}"
        for metric, value in constant_metrics.items()
    )
    return (
        f"The same in all completed trials, and therefore not shown in figures: {metrics_and_values}."
        if constant_metrics
        else ""
    )


def _replayed(replays: Sequence[ReplayData], findings: Findings) -> str:
    labels = ", ".join(replay.label for replay in replays)
    return _REPLAY if len(replays) == len(findings.names) else f"{_REPLAY} Shown: {labels}."


def _rows(rows: TextTable, words: int = 1) -> Html:
    """A table; its first columns hold words, the others numbers."""
    cells = [tuple(map(_cell, row)) for row in rows.rows]
    return table(rows.head, cells, numeric=range(words, len(rows.head)))


def _cell(content: str) -> Html:
    """A cell with its numbers typeset."""
    return prose(re.sub(r"\binf\b", "\u221e", content))


def _differing(findings: Findings) -> Html:
    """What differs between scenarios."""
    rows = [(prose(f"`{key}`"), *values) for key, values in findings.differing.items()]
    return section("scenarios", "What differs", table(("key", *findings.names), rows, wide=len(findings.names) > 2))


def _how_tuned(noun: str, findings: Findings, budgets: EqualBudgets | None) -> list[Html]:
    if budgets is None:
        return [tag("p", prose(_FAIR.format(noun=noun))), _tuning(noun, findings.tuning)]
    rows = budget_rows(budgets)
    return [
        *(tag("p", prose(sentence)) for sentence in budget_sentences(budgets)),
        _rows(rows),
        _tuning(noun, findings.tuning),
    ]


def _tuning(noun: str, tuning: Mapping[str, str]) -> Html:
    return table((noun, "gains"), [(name, prose(sentence)) for name, sentence in tuning.items()])


def _endings(findings: Findings) -> Html:
    words = dict.fromkeys(word for counts in findings.endings.values() for word in counts)
    rows = [
        (word.replace("_", " "), *(str(findings.endings[name].get(word, 0)) for name in findings.names))
        for word in words
    ]
    return table(("trials", *findings.names), rows, numeric=range(1, 1 + len(findings.names)))

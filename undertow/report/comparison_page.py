"""The page of a comparison: the findings, how each contestant was tuned, figures, differences and configuration."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from undertow.campaign.store_results import Results
from undertow.comparison.comparison import Comparison
from undertow.comparison.findings import Findings
from undertow.comparison.sentences import HOW, sentences
from undertow.comparison.tables import NOTE, Rows, medians, paired
from undertow.report.campaign_page import asked
from undertow.report.figures.comparison import comparison_plots
from undertow.report.figures.writing import save_all
from undertow.report.formats import prose
from undertow.report.page import Html, bullets, document, figure, section, table, tag
from undertow.report.replay.replay_data import Replay
from undertow.report.replay.replay_section import replay_looks, replay_section

_CAPTIONS = {
    "differences": "Each point is one trial: the metric of the contestant less that of the first one, with the same "
    "sample and seed. The diamond is the median, the bar its 95 % bootstrap interval. Left of zero the contestant has "
    "the smaller value.",
    "histories": "Euclidean norm of the tracking error. Lines end where a run failed. The area holds 5 % to 95 % of "
    "the trials that were running at that time.",
    "plan": "Positions north and east in the first trial, with the same seed for all. A cross marks a failure.",
    "distributions": "Empirical cumulative distribution functions, with one step per trial. A curve that ends below 1 "
    "has failed trials. Smaller values are better.",
}
_REPLAY = "The first trial, as in the figures of time histories and paths, with the same seed for all."

_FAIR = (
    "A comparison with a rival that was not tuned says little. The folder `scenarios` beside this page has the "
    "scenario of each contestant: `undertow tune scenarios/NAME.yaml` tunes its gains, and `--controllers` takes the "
    "`tuned.yaml` that this writes."
)


def write_comparison(
    comparison: Comparison,
    results: Results,
    subject: str,
    folder: Path,
    pdf: str | None = None,
    replays: Sequence[Replay] = (),
) -> tuple[Path, list[str]]:
    """Write `comparison.html`, and every figure into `figures/`; return a sentence for each figure that failed.

    Args:
        comparison: what is shown.
        results: of its campaign.
        subject: what is simulated, in words.
        folder: of the page.
        pdf: width of PDF files; None for none.
        replays: of one trial of the contestants; none for a page without a replay.

    Raises:
        OSError: the folder cannot be written.
    """
    found = comparison.findings
    saved = save_all(lambda: comparison_plots(comparison.dataset, found), folder / "figures", pdf)
    title = f"Comparison: {', '.join(found.names)}"
    figures = [
        figure(vector.read_text(encoding="utf-8"), name, _CAPTIONS[name], prose(_CAPTIONS[name]))
        for name, vector in saved.vectors.items()
    ]
    page = document(
        title,
        tag("h1", prose(title)),
        tag("p", prose(_lead(found, subject)), class_="lead"),
        *(tag("p", prose(sentence)) for sentence in saved.failures),
        _rows(medians(found)),
        tag("p", prose(NOTE), class_="small"),
        bullets([prose(sentence) for sentence in sentences(found)]),
        *([_differing(found)] if found.differing else []),
        *([replay_section(replays, _replayed(replays, found))] if replays else []),
        section("tuning", "Tuning", tag("p", prose(_FAIR)), _tuning(found.tuning)),
        section("figures", "Figures", *figures),
        section("endings", "Status of the trials", _endings(found)),
        section("differences", "Paired differences", tag("p", prose(HOW)), _rows(paired(found), words=2)),
        section("configuration", "Configuration", *asked(results)),
        looks=replay_looks() if replays else "",
    )
    path = folder / "comparison.html"
    path.write_text(page, encoding="utf-8")
    return path, saved.failures


def _lead(found: Findings, subject: str) -> str:
    of = f"{subject}: " if subject and not found.differing else ""
    if found.all_equal:
        trials = "one trial" if found.trials == 1 else f"{found.trials} trials, which are all equal,"
        return f"{of}{trials} for each, because nothing in the scenario is random."
    return f"{of}{found.trials} trials for each, with the same samples and seeds."


def _replayed(replays: Sequence[Replay], found: Findings) -> str:
    shown = ", ".join(replay.label for replay in replays)
    return _REPLAY if len(replays) == len(found.names) else f"{_REPLAY} Shown: {shown}."


def _rows(rows: Rows, words: int = 1) -> Html:
    """A table; its first columns hold words, the others numbers."""
    cells = [tuple(map(_cell, row)) for row in rows.rows]
    return table(rows.head, cells, numeric=range(words, len(rows.head)), wide=len(rows.head) > 3)


def _cell(content: str) -> Html:
    """A cell with its numbers typeset."""
    return prose(re.sub(r"\binf\b", "\u221e", content))


def _differing(found: Findings) -> Html:
    """What differs between scenarios."""
    rows = [(prose(f"`{key}`"), *values) for key, values in found.differing.items()]
    return section("scenarios", "What differs", table(("key", *found.names), rows, wide=len(found.names) > 2))


def _tuning(tuning: Mapping[str, str]) -> Html:
    return table(("contestant", "gains"), [(name, prose(sentence)) for name, sentence in tuning.items()])


def _endings(found: Findings) -> Html:
    words = dict.fromkeys(word for each in found.endings.values() for word in each)
    rows = [
        (word.replace("_", " "), *(str(found.endings[name].get(word, 0)) for name in found.names)) for word in words
    ]
    return table(("trials", *found.names), rows, numeric=range(1, 1 + len(found.names)))

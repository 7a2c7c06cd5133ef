"""The page of one run: the answer, one picture, the replay, and details folded away; one file that opens anywhere."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from undertow.core.atomic_io import write_whole
from undertow.report.answers.notebook import in_notebook
from undertow.report.answers.plain_answer import answer_block
from undertow.report.answers.run_answer import answer_of_run
from undertow.report.formats import number, prose
from undertow.report.page import Html, bullets, document, figure, folded, join, section, table, tag, text
from undertow.report.plotted import Plotted, Shown
from undertow.report.replay.replay_data import ReplayData, replay_of
from undertow.report.replay.replay_section import not_made, replay_looks, replay_section
from undertow.report.run_tables import (
    WORDS,
    RunTable,
    certificate_rows,
    fault_rows,
    memory_rows,
    metrics_rows,
    navigation_rows,
    transition_rows,
)
from undertow.report.signal_names import input_names, lost_thrusters
from undertow.scenario.reading import dump
from undertow.scenario.results.run_facts import RunFacts
from undertow.scenario.results.run_result import RunRecord, RunResult

_DIGITS = 4

_CAPTIONS = {
    "summary": "The path on a map, the error (rms of the axes) beside its limit, and the largest input.",
    "tracking": "Desired and actual outputs.",
    "error": "Size of the tracking error; for attitude, of the difference of the angles.",
    "estimate": "Lumped uncertainty, measured from the true acceleration (grey), and the controller's estimate of it.",
    "effort": "Commanded input, and the input that was applied within the limits.",
    "certificate": "Lyapunov function of the stability proof and its rate along the run, and the fuzzy weights.",
    "measurement": "What the controller received less the true outputs and rates.",
}


class RunPageContents(NamedTuple):
    """What a run looks like: figures by name, the replay (None for a plant that is no vehicle), and failures."""

    figures: Mapping[str, str | bytes]
    replay: ReplayData | None
    failures: list[str]  # a sentence for each part that could not be made


def shown_of(run: RunRecord) -> Shown:
    """What the figures of a run show."""
    facts = run.facts
    criterion = {} if facts.success is None else facts.success.criterion
    return Shown(run.series, list(facts.faults), facts.certificate, criterion, facts.supply)


def page_contents(result: RunResult, plotted: Callable[[], Plotted]) -> RunPageContents:
    """What the page of a run shows. A failed part affects neither the others nor the results.

    Args:
        result: of the run.
        plotted: gives its figures; called last, as another process may still be plotting.
    """
    failures: list[str] = []
    try:
        replay = replay_of(result.series, result.loop, result.facts.seed, result.facts.hull)
    except Exception as error:  # a user's part may run and yet not be differentiable
        replay = None
        failures.append(not_made(error))
    figures = plotted()
    return RunPageContents(figures.pictures, replay, [*figures.failures, *failures])


def write_run_page(
    path: Path, run: RunRecord, contents: RunPageContents, predicted: Mapping[str, float] | None = None
) -> None:
    """Write the page of a run.

    Args:
        path: of the page.
        run: its record.
        contents: what it shows.
        predicted: predicted metrics of the steady window, where there are any.

    Raises:
        OSError: the file cannot be written.
    """
    replay = Html("") if contents.replay is None else replay_section([contents.replay])
    write_whole(path, _page(run, contents.figures, replay, predicted))


def _page(
    run: RunRecord, figures: Mapping[str, str | bytes], replay: Html, predicted: Mapping[str, float] | None
) -> str:
    facts = run.facts
    plotted = {name: _figure(picture, name) for name, picture in figures.items()}
    first = plotted.pop("summary", Html(""))
    return document(
        facts.title,
        tag("h1", prose(facts.title)),
        answer_block(answer_of_run(run)),
        first,
        replay,
        *_what_happened(run),
        *_details(run, predicted),
        folded("figures", "More figures", *plotted.values()) if plotted else "",
        folded("configuration", "Configuration", *_configuration(facts)),
        looks=replay_looks() if replay else "",
    )


def run_in_notebook(run: RunRecord, summary: bytes) -> Html:
    """A run as a notebook shows it: the answer and one picture.

    Args:
        run: its record.
        summary: figure `summary`, PNG.
    """
    return in_notebook(run.facts.title, answer_of_run(run), _figure(summary, "summary"))


def _figure(picture: str | bytes, name: str) -> Html:
    caption = _CAPTIONS.get(name, name)
    return figure(picture, name, caption, prose(caption))


def _what_happened(run: RunRecord) -> Iterator[Html]:
    """Faults, and what the supervisor did."""
    facts = run.facts
    if facts.faults:
        yield section("faults", "Faults", _table(fault_rows(facts.faults, input_names(run.series))))
    if facts.transitions is not None:
        supervision = transition_rows(facts.transitions, lost_thrusters(run.series))
        yield section("supervision", supervision.title, *_with_sentences(supervision))


def _details(run: RunRecord, predicted: Mapping[str, float] | None) -> Iterator[Html]:
    """All numbers, which open on demand."""
    facts, certificate = run.facts, run.facts.certificate
    measured = metrics_rows(facts.steady, facts.whole, facts.window, facts.meanings, predicted)
    yield folded("metrics", "All metrics", _table(measured), _meanings(measured))
    if facts.navigation is not None:
        navigation = navigation_rows(facts.navigation)
        yield folded("navigation", navigation.title, *_with_sentences(navigation))
    if certificate is not None:
        hypotheses = certificate_rows(certificate, facts.window)
        yield folded("certificate", hypotheses.title, *_with_sentences(hypotheses))
        if "memory" in certificate:
            memory = memory_rows(certificate)
            yield folded("memory", memory.title, *_with_sentences(memory))


def _with_sentences(rows: RunTable) -> list[Html]:
    return [_table(rows), *(tag("p", prose(sentence)) for sentence in rows.sentences)]


def _table(rows: RunTable) -> Html:
    """A table of a run. Units stand beside the names, where a narrow screen shows them without scrolling."""
    formatted = lambda cell: prose(cell) if isinstance(cell, str) else number(cell, _DIGITS)
    named = lambda name: _explained(name, rows.meanings[name]) if name in rows.meanings else prose(name)
    columns = sorted(range(len(rows.head)), key=lambda column: (column > 0, rows.head[column] != "unit"))
    cells = [[named(row[i]) if not i else formatted(row[i]) for i in columns] for row in rows.rows]
    numeric = [column for column, i in enumerate(columns) if i and rows.head[i] not in WORDS]
    return table([prose(rows.head[i]) for i in columns], cells, numeric=numeric)


def _explained(name: str, meaning: str) -> Html:
    """The name of a metric, which may break at its underscores, with its meaning for a pointer that rests on it."""
    return tag("abbr", Html(text(name).replace("_", "_<wbr>")), title=meaning)


def _meanings(rows: RunTable) -> Html:
    """The meanings of the metrics as a list that opens, for screens without a pointer."""
    listed = bullets([join(tag("code", name), ": ", prose(meaning)) for name, meaning in rows.meanings.items()])
    return tag("details", tag("summary", "What the metrics mean"), listed)


def _configuration(facts: RunFacts) -> Sequence[Html]:
    """Versions and seed, and the scenario where there is one."""
    versions = ", ".join(
        f"{name.removeprefix('version_')} {value}" for name, value in facts.versions.items() if name != "machine"
    )
    origin = tag("p", f"seed {facts.seed}; {versions}; {facts.versions.get('machine', '')}", class_="small")
    if not facts.scenario:
        return [origin]
    scenario = tag("details", tag("summary", "The complete scenario"), tag("pre", dump(facts.scenario)))
    return [origin, scenario]

"""The page of one run: status, replay, metrics, certificate, figures and scenario, in one file that opens anywhere."""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import xarray as xr

from undertow.analysis.success import Success
from undertow.core.disk import write_whole
from undertow.loop.closed_loop import ClosedLoop
from undertow.report.figures.recorded import input_names
from undertow.report.formats import number, prose
from undertow.report.page import Html, bullets, document, figure, join, section, table, tag, text
from undertow.report.plotting import Plotted
from undertow.report.replay.replay_data import Replay, replay_of
from undertow.report.replay.replay_section import not_made, replay_looks, replay_section
from undertow.report.run_tables import (
    RunTable,
    certificate_rows,
    fault_rows,
    memory_rows,
    metrics_rows,
    navigation_rows,
    transition_rows,
)
from undertow.scenario.finished_run import (
    certificate_of,
    faults_of,
    losses_of,
    metrics_of,
    navigation_of,
    transitions_of,
    window_of,
)

_DIGITS = 4

_CAPTIONS = {
    "tracking": "Desired and actual outputs.",
    "error": "Size of the tracking error on a logarithmic scale; for attitude, of the difference of the angles.",
    "estimate": "Lumped uncertainty, measured from the true acceleration (grey), and the controller's estimate of it.",
    "effort": "Commanded input, and the input that was applied within the limits.",
    "certificate": "Lyapunov function of the stability proof and its rate along the run, and the fuzzy weights.",
    "measurement": "What the controller received less the true outputs and rates.",
}


class Shown(NamedTuple):
    """What a run looks like: figures by name, the replay (None for a plant that is no vehicle), and failures."""

    figures: Mapping[str, str | bytes]
    replay: Replay | None
    failures: list[str]  # a sentence for each part that could not be made


def shown(run: xr.Dataset, loop: ClosedLoop, plotted: Callable[[], Plotted]) -> Shown:
    """What the page and the video of a run show. A failed part affects neither the others nor the results.

    Args:
        run: dataset of the run.
        loop: the closed loop that was run.
        plotted: gives its figures; called last, as another process may still be plotting.
    """
    failures: list[str] = []
    try:
        replay = replay_of(run, loop)
    except Exception as error:  # a user's part may run and yet not be differentiable
        replay = None
        failures.append(not_made(error))
    figures = plotted()
    return Shown(figures.pictures, replay, [*figures.failures, *failures])


def write_run_page(path: Path, run: xr.Dataset, shown: Shown, predicted: Mapping[str, float] | None = None) -> None:
    """Write the page of a run.

    Args:
        path: of the page.
        run: dataset of the run.
        shown: what it looks like.
        predicted: predicted metrics of the steady window, where there are any.

    Raises:
        OSError: the file cannot be written.
    """
    replay = Html("") if shown.replay is None else replay_section([shown.replay])
    write_whole(path, _page(run, shown.figures, replay, predicted))


def _page(
    run: xr.Dataset, figures: Mapping[str, str | bytes], replay: Html, predicted: Mapping[str, float] | None
) -> str:
    title, window = str(run.attrs.get("title", "a closed loop")), window_of(run)
    metrics = json.loads(run.attrs["metrics"])
    measured = metrics_rows(metrics["steady"], metrics["whole"], window, metrics_of(run), predicted)
    certificate = certificate_of(run)
    sections = [replay, section("metrics", measured.title, _table(measured), _meanings(measured))]
    if faults := faults_of(run):
        sections.append(section("faults", "Faults", _table(fault_rows(faults, input_names(run)))))
    if (transitions := transitions_of(run)) is not None:
        supervision = transition_rows(transitions, losses_of(run))
        below = [tag("p", prose(one)) for one in supervision.sentences]
        sections.append(section("supervision", supervision.title, _table(supervision), *below))
    if (navigated := navigation_of(run)) is not None:
        assumed = navigation_rows(navigated)
        below = [tag("p", prose(one)) for one in assumed.sentences]
        sections.append(section("navigation", assumed.title, _table(assumed), *below))
    if certificate is not None:
        hypotheses = certificate_rows(certificate, window)
        below = [tag("p", prose(one)) for one in hypotheses.sentences]
        sections.append(section("certificate", hypotheses.title, _table(hypotheses), *below))
        if "memory" in certificate:
            learnt = memory_rows(certificate)
            below = [tag("p", prose(one)) for one in learnt.sentences]
            sections.append(section("memory", learnt.title, _table(learnt), *below))
    plotted = [
        figure(picture, name, _CAPTIONS.get(name, name), prose(_CAPTIONS.get(name, name)))
        for name, picture in figures.items()
    ]
    if plotted:
        sections.append(section("figures", "Figures", *plotted))
    return document(
        title,
        tag("h1", prose(title)),
        tag("p", prose(_status(run)), class_="lead"),
        *sections,
        section("configuration", "Configuration", *_configuration(run)),
        looks=replay_looks() if replay else "",
    )


def _table(rows: RunTable) -> Html:
    """A table of a run. Units stand beside the names, where a narrow screen shows them without scrolling."""
    shown = lambda cell: prose(cell) if isinstance(cell, str) else number(cell, _DIGITS)
    named = lambda name: _explained(name, rows.meanings[name]) if name in rows.meanings else prose(name)
    columns = sorted(range(len(rows.head)), key=lambda place: (place > 0, rows.head[place] != "unit"))
    cells = [[named(row[i]) if not i else shown(row[i]) for i in columns] for row in rows.rows]
    numeric = [place for place, i in enumerate(columns) if i and rows.head[i] != "unit"]
    return table([prose(rows.head[i]) for i in columns], cells, numeric=numeric)


def _explained(name: str, meaning: str) -> Html:
    """The name of a metric, which may break at its underscores, with its meaning for a pointer that rests on it."""
    return tag("abbr", Html(text(name).replace("_", "_<wbr>")), title=meaning)


def _meanings(rows: RunTable) -> Html:
    """The meanings of the metrics as a list that opens, for screens without a pointer."""
    listed = bullets([join(tag("code", name), ": ", prose(meaning)) for name, meaning in rows.meanings.items()])
    return tag("details", tag("summary", "What the metrics mean"), listed)


def _status(run: xr.Dataset) -> str:
    """How the run ended, and whether control succeeded."""
    word, ended = str(run.attrs["status"]).replace("_", " "), float(run.attrs["ended"])
    said = f"Status: {word} at {ended:.4g} s. {run.attrs['status_sentence']}"
    judged = json.loads(run.attrs.get("success", "null"))
    if judged is None:
        return said
    verdict = Success(**judged).sentence(metrics_of(run))
    return f"{said} {verdict[:1].upper()}{verdict[1:]}."


def _configuration(run: xr.Dataset) -> Sequence[Html]:
    """Versions and seed, and the scenario where there is one."""
    versions = [
        f"{key.removeprefix('version_')} {value}" for key, value in run.attrs.items() if key.startswith("version_")
    ]
    facts = f"seed {run.attrs.get('seed')}; {', '.join(versions)}; {run.attrs.get('machine', '')}"
    if not run.attrs.get("scenario"):
        return [tag("p", facts, class_="small")]
    scenario = tag("details", tag("summary", "The complete scenario"), tag("pre", run.attrs["scenario"]))
    return [tag("p", facts, class_="small"), scenario]

"""The report of `undertow reproduce`: two self-contained pages, and the figures as files."""

from collections.abc import Mapping
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from undertow.core.atomic_io import write_whole
from undertow.paper.figures.ablations import ablations_figure
from undertow.paper.figures.fidelity import fidelity_figure, robust_fidelity_figure
from undertow.paper.figures.horizons import horizons_figure
from undertow.paper.figures.lags import drifting_figure, lags_figure
from undertow.paper.figures.paper import paper_figures
from undertow.paper.figures.sweep import sweep_figure
from undertow.paper.pages import ablations_page, horizon_section, tables
from undertow.paper.pages.background import ASSUMED, INTRODUCTION, LEFT_OPEN
from undertow.paper.pages.captions import captions
from undertow.paper.pages.robust_section import CAPTIONS, TITLE, robust_section
from undertow.paper.reproduce import Reproduction
from undertow.report.figures.writing import save
from undertow.report.formats import CRITERION, prose
from undertow.report.page import Html, bullets, document, figure, section, table, tag

_TITLE = "Reproduction of the paper and check of its claims"

# Figures with a section of their own; all others are in the first section.
_ELSEWHERE = ("fidelity", "sweep", *horizon_section.CAPTIONS, *CAPTIONS)


def write_report(
    results: Mapping[str, Any],
    figures: Mapping[str, Figure],
    folder: Path,
    pdf: str | None = None,
    pool: Executor | None = None,
) -> Path:
    """Write `report.html`, `ablations.html` if they were run, and every figure into `figures/`.

    Args:
        results: contents of results.json; missing parts are left out of the page.
        figures: by name: fig02, fig06, ..., fig13, fidelity, sweep; others are shown after the paper's.
        folder: where to write, created if missing.
        pdf: width of PDF files; None for none.
        pool: executor of `worker_processes` that writes the figures; None to write them here.

    Returns:
        The first page.

    Raises:
        OSError: the folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    texts = captions(dict(results)) | horizon_section.CAPTIONS | CAPTIONS
    texts |= {"ablations": ablations_page.CAPTION}
    arguments = [(plot, folder / "figures", name, pdf) for name, plot in figures.items()]
    # All are submitted before the first is waited for; without a pool each is written when its turn comes.
    pending = None if pool is None else [pool.submit(save, *call) for call in arguments]
    written = (save(*call) for call in arguments) if pending is None else (future.result() for future in pending)
    elements = {}
    for (name, plot), (vector, _) in zip(figures.items(), written, strict=True):
        alternative = _alternative(plot, name)
        elements[name] = figure(vector.read_text(encoding="utf-8"), name, alternative, texts.get(name, name))
    page = folder / "report.html"
    overview = elements.pop("ablations", Html(""))
    write_whole(page, document(_TITLE, *_content(results, elements)))
    if robust := results.get("robust_variant"):
        second = ablations_page.ablations_page(robust, overview, page.name)
        write_whole(folder / ablations_page.NAME, second)
    return page


def _content(results: Mapping[str, Any], figures: Mapping[str, Html]) -> list[Html]:
    claims = list(results.get("claims") or [])
    parts = {
        "figures": ("Figures", _figures(results, figures)),
        "table2": ("Table 2 in numbers", _table2(results)),
        "fidelity": ("Fidelity levels of the thruster model", _fidelity(results, figures)),
        "audit": ("Check of the claims", _audit(claims, figures)),
        "robust_variant": (TITLE, robust_section(results.get("robust_variant") or {}, figures)),
        "open": ("Open points and misprints of the paper", _left_open()),
        "provenance": ("Provenance", _provenance(results)),
    }
    sections = {name: (title, content) for name, (title, content) in parts.items() if content}
    links = [tag("a", title, href=f"#{name}") for name, (title, _) in sections.items()]
    if "robust_variant" in sections:
        links.insert(-2, tag("a", "Ablations", href=ablations_page.NAME))
    first = [tag("h1", _TITLE), tag("p", INTRODUCTION, class_="lead"), tag("nav", *links)]
    verdicts = tag("div", tag("h3", "Summary of the verdicts"), tables.glance(claims)) if claims else Html("")
    assumed = tag("div", tag("h3", "Assumptions"), bullets(ASSUMED), class_="assumed")
    first.append(tag("div", verdicts, assumed, class_="first"))
    return [*first, *(section(name, title, *content) for name, (title, content) in sections.items())]


def _figures(results: Mapping[str, Any], figures: Mapping[str, Html]) -> list[Html]:
    content = [element for name, element in figures.items() if name not in _ELSEWHERE]
    if content:
        note = (
            "Dotted lines are desired or true values, solid lines RCAFC, dashed lines RAFC. Figures 1 and 3 to 5 of "
            "the paper are block diagrams."
        )
        content = [tag("p", note), *content]
    if results.get("example1"):
        text = (
            "A separate script solves Example 1 independently with a fixed step of 1 ms. The two solutions should "
            "agree within 2 %; because of the jumps in $d$ the last digit depends on how the run is sampled."
        )
        content += [tag("h3", "Comparison with an independent solution"), tag("p", prose(text))]
        content.append(tables.reference_table(results["example1"]))
    return content


def _table2(results: Mapping[str, Any]) -> list[Html]:
    if not results.get("table2"):
        return []
    text = (
        "Example 1, 10 s to 20 s, rms over the six axes. The paper's own words are below each number. "
        "The input of the fuzzy system is the modelling error $\\varepsilon$ or the state $X$."
    )
    return [tag("p", prose(text)), tables.table2(results["table2"])]


def _fidelity(results: Mapping[str, Any], figures: Mapping[str, Html]) -> list[Html]:
    if not results.get("fidelity"):
        return []
    text = (
        "Both controllers, with the gains of Table 1, control the same vehicle under the same disturbance on four "
        "fidelity levels of the thruster model. First, 20 s of U1 as one differential equation, with metrics from 10 s "
        "to 20 s. A run that completes 20 s can still diverge later."
    )
    return [
        tag("p", prose(text)),
        tag("p", prose(CRITERION)),
        figures.get("fidelity", Html("")),
        tables.fidelity_levels(results["fidelity"]),
        *horizon_section.horizon_section(results, figures),
    ]


def _audit(claims: list[dict[str, Any]], figures: Mapping[str, Html]) -> list[Html]:
    if not claims:
        return []
    text = (
        "Each verdict names the run behind it, with the fidelity levels and the simulated time. It does not extend "
        "beyond these. Run the commands in the folder of this page."
    )
    return [tag("p", prose(text)), tag("p", tables.COLOURS), tables.audit(claims), figures.get("sweep", Html(""))]


def _left_open() -> list[Html]:
    rows = [[prose(cell) for cell in row] for row in LEFT_OPEN]
    return [table(("location", "problem", "treatment here"), rows, wide=True)]


def _provenance(results: Mapping[str, Any]) -> list[Html]:
    provenance = results.get("provenance")
    return [tables.provenance(provenance)] if provenance else []


def _alternative(figure: Figure, name: str) -> str:
    """Title of a figure, as its alternative text."""
    return figure.texts[0].get_text() if figure.texts else name


def write(reproduction: Reproduction, folder: Path, pdf: str | None = None, pool: Executor | None = None) -> Path:
    """Write the pages and `figures/`; returns the first page. Arguments of `write_report`.

    Raises:
        OSError: the folder cannot be written.
    """
    return write_report(reproduction.results, make_figures(reproduction), folder, pdf, pool)


def make_figures(reproduction: Reproduction) -> dict[str, Figure]:
    """Every figure of the report, by name."""
    numbers = {claim["id"]: claim["numbers"] for claim in reproduction.results["claims"]}
    levels = reproduction.results["fidelity"]
    figures = paper_figures(reproduction.datasets("ideal"), reproduction.datasets("static"), reproduction.response) | {
        "fidelity": fidelity_figure(levels, {fidelity: reproduction.datasets(fidelity) for fidelity in levels}),
        "sweep": sweep_figure(numbers["C6"]["sweep"]),
        "horizons": horizons_figure(
            reproduction.results["horizons"]["rows"], reproduction.results["horizons"]["duration"]
        ),
        "lags": lags_figure(reproduction.results["lags"], reproduction.results["horizons"]["windows"]),
        "drifting": drifting_figure(reproduction.results["drifting"]),
    }
    if robust := reproduction.results.get("robust_variant"):
        rows = robust["fidelity"]
        datasets = {(row["place"], row["law"]): reproduction.runs[Path(row["scenario"]).stem].dataset for row in rows}
        figures["robust_fidelity"] = robust_fidelity_figure(rows, datasets)
        figures["ablations"] = ablations_figure(robust["ablations"])
    return figures

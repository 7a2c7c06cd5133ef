"""The report of `undertow reproduce`: one page that stands alone, and the figures as files."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from undertow.report.figures.writing import save
from undertow.report.formats import prose
from undertow.report.page import Html, bullets, document, figure, section, table, tag
from undertow.report.reproduction import horizon_section, tables
from undertow.report.reproduction.background import ASSUMED, INTRODUCTION, LEFT_OPEN
from undertow.report.reproduction.captions import captions
from undertow.report.reproduction.robust_section import CAPTIONS, FIGURES, TITLE, robust_section

_TITLE = "The paper, reproduced and audited"

# Figures that stand in a section of their own; all others stand in the first.
_ELSEWHERE = ("fidelity", "sweep", *horizon_section.FIGURES, *FIGURES)


def write_report(results: Mapping[str, Any], figures: Mapping[str, Figure], folder: Path) -> Path:
    """Write `report.html`, and every figure as SVG and PNG into `figures/`.

    Args:
        results: what stands in results.json; parts that are missing are left out of the page.
        figures: by name: fig02, fig06, ..., fig13, fidelity, sweep; others are shown after the paper's.
        folder: where to write, made if need be.

    Returns:
        The page.

    Raises:
        OSError: the folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    said = captions(dict(results)) | horizon_section.CAPTIONS | CAPTIONS
    drawn = {}
    for name, one in figures.items():
        vector, _ = save(one, folder / "figures", name)
        drawn[name] = figure(vector.read_text(encoding="utf-8"), name, _alternative(one, name), said.get(name, name))
    page = folder / "report.html"
    page.write_text(document(_TITLE, *_content(results, drawn)), encoding="utf-8")
    return page


def _content(results: Mapping[str, Any], drawn: Mapping[str, Html]) -> list[Html]:
    claims = list(results.get("claims") or [])
    parts = {
        "figures": ("Figures", _figures(results, drawn)),
        "table2": ("Table 2 in numbers", _table2(results)),
        "fidelity": ("Fidelities: how much of the thruster is modelled", _fidelity(results, drawn)),
        "audit": ("Audit of the claims", _audit(claims, drawn)),
        "robust_variant": (TITLE, robust_section(results.get("robust_variant") or {}, drawn)),
        "open": ("What the paper leaves open, and misprints", _left_open()),
        "provenance": ("Provenance", _provenance(results)),
    }
    shown = {name: (title, content) for name, (title, content) in parts.items() if content}
    links = tag("nav", *(tag("a", title, href=f"#{name}") for name, (title, _) in shown.items()))
    first = [tag("h1", _TITLE), tag("p", INTRODUCTION, class_="lead"), links]
    verdicts = tag("div", tag("h3", "Verdicts at a glance"), tables.glance(claims)) if claims else Html("")
    assumed = tag("div", tag("h3", "What was assumed"), bullets(ASSUMED), class_="assumed")
    first.append(tag("div", verdicts, assumed, class_="first"))
    return [*first, *(section(name, title, *content) for name, (title, content) in shown.items())]


def _figures(results: Mapping[str, Any], drawn: Mapping[str, Html]) -> list[Html]:
    content = [one for name, one in drawn.items() if name not in _ELSEWHERE]
    if content:
        note = (
            "Dotted: wanted or true. Solid: RCAFC. Dashed: RAFC. Figures 1 and 3 to 5 of the paper are block diagrams."
        )
        content = [tag("p", note), *content]
    if results.get("example1"):
        told = (
            "Example 1 solved a second time, independently, by a plain script with a fixed step of 1 ms. "
            "The two should agree within 2 %; the jumps in d make the last digit depend on how the run is sampled."
        )
        content += [tag("h3", "Beside an independent solution"), tag("p", prose(told))]
        content.append(tables.reference_table(results["example1"]))
    return content


def _table2(results: Mapping[str, Any]) -> list[Html]:
    if not results.get("table2"):
        return []
    told = (
        "Example 1, 10 s to 20 s, rms over the six axes. The paper's own words stand below each number. "
        "The input of the fuzzy system is the modelling error or the state."
    )
    return [tag("p", prose(told)), tables.table2(results["table2"])]


def _fidelity(results: Mapping[str, Any], drawn: Mapping[str, Html]) -> list[Html]:
    if not results.get("fidelity"):
        return []
    told = (
        "Both controllers at the gains of Table 1 meet the same vehicle and the same disturbance on four levels: each "
        "takes more of the motor for real. First 20 s of U1, as one differential equation, tracking rms in m and rad, "
        "estimation rms in m/s^2, rad/s^2, 10 s to 20 s; what lasts for so long need not last."
    )
    return [
        tag("p", prose(told)),
        *(drawn[name] for name in ("fidelity",) if name in drawn),
        tables.fidelity(results["fidelity"]),
        *horizon_section.horizon_section(results, drawn),
    ]


def _audit(claims: list[dict[str, Any]], drawn: Mapping[str, Html]) -> list[Html]:
    if not claims:
        return []
    told = (
        "Each verdict names the run behind it, and says on which levels and for how long was simulated; it says "
        "nothing beyond. The commands are to be typed in the folder of this page."
    )
    return [tag("p", prose(told)), tables.audit(claims), *(drawn[name] for name in ("sweep",) if name in drawn)]


def _left_open() -> list[Html]:
    return [table(("where", "what", "here"), [[prose(cell) for cell in row] for row in LEFT_OPEN], wide=True)]


def _provenance(results: Mapping[str, Any]) -> list[Html]:
    found = results.get("provenance")
    return [tables.provenance(found)] if found else []


def _alternative(drawing: Figure, name: str) -> str:
    """What the drawing is called, for those who cannot see it."""
    return drawing.texts[0].get_text() if drawing.texts else name

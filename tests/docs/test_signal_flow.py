"""The directive `{signal-flow}`: who sends what to whom, as boxes and labelled arrows."""

import importlib
import io
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest

pytestmark = pytest.mark.docs

DOCS = Path(__file__).parents[2] / "docs"
_FLOW = re.compile(r"^```\{signal-flow\} (?P<caption>[^\n]+)\n(?P<lines>.*?)^```", re.M | re.S)
LOOP = (
    "reference -> controller: desired motion",
    "controller -> plant: command",
    "plant -> controller: motion",
    "plant -> log: records",
    "log -> reference: a saved path",
)


@pytest.fixture
def signal_flow(monkeypatch):
    pytest.importorskip("sphinx")
    monkeypatch.syspath_prepend(DOCS / "_ext")
    return importlib.import_module("signal_flow")


@pytest.fixture
def flow_svg(signal_flow):
    return importlib.import_module("flow_svg")


def shapes(svg, name):
    """Elements of an SVG, which must be well-formed, of a name."""
    return list(ElementTree.fromstring(svg).iter(name))


def of_class(svg, name):
    """Texts in groups of a class."""
    return [" ".join(group.itertext()) for group in shapes(svg, "g") if group.get("class") == name]


def test_boxes_and_arrows_are_those_of_the_lines(signal_flow):
    svg = signal_flow.svg_of(signal_flow.arrows_of(LOOP, "page", 1), "A loop.")
    assert of_class(svg, "box") == ["reference", "controller", "plant", "log"]
    assert sorted(of_class(svg, "label")) == sorted(["desired motion", "command", "motion", "records", "a saved path"])
    assert len(shapes(svg, "polyline")) == len(shapes(svg, "polygon")) == len(LOOP)


def test_rows_follow_the_order_of_the_lines(signal_flow):
    arrows = signal_flow.arrows_of(LOOP, "page", 1)
    assert signal_flow.row_numbers(arrows) == {"reference": 0, "controller": 1, "plant": 2, "log": 3}
    late = signal_flow.arrows_of(["law -> plant: force", "sea -> plant: load", "pilot -> law: target"], "page", 1)
    assert signal_flow.row_numbers(late) == {"law": 1, "plant": 2, "sea": 1, "pilot": 0}


def test_an_arrow_ends_at_its_receiver(signal_flow):
    svg = signal_flow.svg_of(signal_flow.arrows_of(["a -> b: x", "b -> a: y"], "page", 1), "Two ways.")
    heights = [re.findall(r",([\d.]+)", line.attrib["points"]) for line in shapes(svg, "polyline")]
    (down_from, down_to), (up_from, up_to) = [map(float, pair) for pair in heights]
    assert down_from < down_to
    assert up_from > up_to


def test_labels_do_not_hide_each_other(signal_flow):
    lines = ["a -> b: one signal with a long name", "b -> a: another one", "a -> c: a third signal", "d -> c: a fourth"]
    svg = signal_flow.svg_of(signal_flow.arrows_of(lines, "page", 1), "Many signals.")
    labels = [group[0].attrib for group in shapes(svg, "g") if group.get("class") == "label"]
    corners = [[float(label[key]) for key in ("x", "y", "width", "height")] for label in labels]
    overlapping = [
        (one, other)
        for number, one in enumerate(corners)
        for other in corners[:number]
        if all(one[k] < other[k] + other[k + 2] and other[k] < one[k] + one[k + 2] for k in (0, 1))
    ]
    assert len(corners) == len(lines)
    assert overlapping == []


def test_text_is_escaped_and_read_aloud(signal_flow):
    arrows = signal_flow.arrows_of(['<b> & "c" -> d: 1 < 2'], "page", 1)
    svg = signal_flow.svg_of(arrows, "A & B.")
    assert of_class(svg, "box") == ['<b> & "c"', "d"]
    root = ElementTree.fromstring(svg)
    assert root.get("role") == "img"
    assert root.get("aria-label") == 'A & B. <b> & "c" to d: 1 < 2.'


@pytest.mark.parametrize("line", ["a -> b", "a: b", "-> b: c", "a -> : c", "a -> b:", "a <- b: c", "a -> b -> c: d"])
def test_a_line_that_cannot_be_read_is_named(signal_flow, line):
    with pytest.raises(ValueError) as error:
        signal_flow.arrows_of(["a -> b: c", "", line], "how-to/mavlink", 7)
    assert str(error.value) == f"how-to/mavlink, line 9: must be `SENDER -> RECEIVER: SIGNAL`, got `{line}`."


def test_sphinx_names_the_page_and_the_line(signal_flow, tmp_path):
    pytest.importorskip("myst_nb")
    from sphinx.application import Sphinx

    (tmp_path / "conf.py").write_text("extensions = ['myst_nb', 'signal_flow']\nhtml_theme = 'basic'\n")
    page = tmp_path / "index.md"
    page.write_text("# Page\n\n```{signal-flow} A caption.\na -> b: x\nb <- a: y\n```\n")
    warnings = io.StringIO()
    site = Sphinx(tmp_path, tmp_path, tmp_path / "site", tmp_path / "cache", "html", status=None, warning=warnings)
    site.build()
    assert "index.md, line 5: must be `SENDER -> RECEIVER: SIGNAL`, got `b <- a: y`." in warnings.getvalue()
    page.write_text(page.read_text().replace("<-", "->"))
    site.build()
    html = (tmp_path / "site" / "index.html").read_text("utf-8")
    assert html.count("<polyline") == 2
    assert '<span class="caption-text">A caption.</span>' in html


def test_boxes_of_one_row_have_no_arrow(signal_flow):
    with pytest.raises(ValueError, match=r"page, line 3: `b` and `c` must stand in different rows.*line upwards"):
        signal_flow.arrows_of(["a -> b: x", "a -> c: y", "b -> c: z"], "page", 1)


def test_arrows_along_the_side_meet_no_other_box(signal_flow, flow_svg):
    lines = ["a -> b: x", "a -> c: x", "b -> d: x", "d -> e: x", "e -> a: x", "e -> c: x"]
    arrows = signal_flow.arrows_of(lines, "page", 1)
    assert flow_svg._sides(arrows, flow_svg.row_numbers(arrows)) == {arrows[5]: "right", arrows[4]: "left"}


@pytest.mark.parametrize("page", sorted(DOCS.rglob("*.md")), ids=lambda page: str(page.relative_to(DOCS)))
def test_flows_of_the_pages_can_be_read(signal_flow, page):
    for flow in _FLOW.finditer(page.read_text("utf-8")):
        arrows = signal_flow.arrows_of(flow["lines"].splitlines(), page.name, 1)
        assert len(shapes(signal_flow.svg_of(arrows, flow["caption"]), "polyline")) == len(arrows) > 0

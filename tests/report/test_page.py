import re
from html.parser import HTMLParser

import pytest

from undertow.paper.figures.sweep import sweep_figure
from undertow.paper.pages.report import write_report
from undertow.report.formats import chip, number, percent, prose
from undertow.report.page import Html, document, join, table, tag, text

pytestmark = pytest.mark.full

VOID = {"meta", "img", "br", "wbr"}


class Checked(HTMLParser):
    """Collects elements and text, and fails on tags that do not close."""

    def __init__(self):
        super().__init__(convert_charrefs=True)
        self.open, self.elements, self.words = [], [], []

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)


def parsed(page):
    parser = Checked()
    parser.feed(page)
    assert parser.open == []
    return parser


def test_text_is_escaped_and_markup_is_not():
    assert text("<a & 'b'>") == "&lt;a &amp; &#x27;b&#x27;&gt;"
    assert join("<", Html("<b>")) == "&lt;<b>"
    assert tag("a", "x<y", href='"q"') == '<a href="&quot;q&quot;">x&lt;y</a>'
    assert "<script>" not in document("<script>", tag("p", "<script>"))
    assert "&lt;i&gt;" in table(["<i>"], [["<i>"]])


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (None, "&ndash;"),
        (0.0, "0"),
        (3.14159, "3.14"),
        (-2.0, "\u22122"),
        (1234.4, "1234"),
        (1.593e-4, "1.59&thinsp;&times;&thinsp;10<sup>\u22124</sup>"),
        (4.4e7, "4.40&thinsp;&times;&thinsp;10<sup>7</sup>"),
        (float("inf"), "inf"),
    ],
)
def test_numbers(value, shown):
    assert number(value) == shown


def test_percent_has_a_sign_but_no_negative_zero():
    assert percent(1.25) == "+1.2&nbsp;%"
    assert percent(-0.04) == "0.0&nbsp;%"


def test_prose_sets_powers_indices_and_code():
    assert prose("m/s^2 of k_e < `sign`") == "m/s<sup>2</sup> of k<sub>e</sub> &lt; <code>sign</code>"
    assert prose("c01_x, tracking_rms, x_ddotted") == "c01_x, tracking_rms, x_ddotted"


def test_chip_says_its_verdict_in_words():
    assert ">holds if<" in chip("holds if d < 3")
    assert ">fails<" in chip("fails")


def test_page_stands_alone(page):
    assert len(page) < 4_000_000
    for name, attributes in parsed(page).elements:
        assert name not in ("script", "link", "iframe")
        assert not any(key.startswith("on") for key in attributes)
        if name == "img":
            assert attributes["src"].startswith("data:image/svg+xml;base64,")
            assert attributes["alt"]
        if "href" in attributes:
            assert attributes["href"].startswith("#")
    assert not re.search(r"url\(|@import|https?://", page)


def test_links_lead_somewhere(page):
    elements = parsed(page).elements
    targets = [attributes["id"] for _, attributes in elements if "id" in attributes]
    assert len(targets) == len(set(targets))
    assert {attributes["href"][1:] for _, attributes in elements if "href" in attributes} <= set(targets)


def test_page_shows_every_figure_and_claim(page, results):
    parser = parsed(page)
    shown = [attributes.get("id") for name, attributes in parser.elements if name == "figure"]
    assert shown == ["figure-fig06", "figure-fidelity"]
    words = "".join(parser.words)
    for claim in results["claims"]:
        assert words.count(claim["claim"]) == 2  # at a glance and in the audit
        if claim["scenario"]:
            assert f"undertow simulate {claim['scenario']}" in words
    assert "d < 103 rad/s" in words
    assert "Ghavidel and Kalat" in words and "Nonlinear Dynamics, 2017, DOI 10.1007/s11071-017-3590-2" in words
    assert page.count("<math>") > 20, "formulas are typeset"
    assert words.index("Assumptions") < words.index("Dotted lines are desired or true values")
    assert "9.8.7" in words


def test_numbers_of_the_run_stand_beside_the_reference(page):
    row = next(part for part in page.split("<tr>") if "0.2010" in part or ">0.201<" in part)
    assert "0.0&nbsp;%" in row
    assert "+900.0&nbsp;%" not in row


def test_table2_has_numbers_and_the_papers_words(page):
    row = next(part for part in page.split("<tr>") if 'scope="row">estimation of uncertainties' in part)
    assert re.findall(r">(0\.\d+)<", row) == ["0.201", "0.402", "0.603", "0.804"]
    assert [word for word in ("excellent", "fair", "poor") if word in row] == ["excellent", "fair", "poor"]


def test_diverged_level_says_when_and_why(page):
    row = next(part for part in page.split("<tr>") if "diverged at" in part and "RCAFC" in part)
    assert "diverged at 3.29 s" in row
    assert "motor lag" in row
    assert row.count("&ndash;") == 3


def test_figures_are_written_as_files_too(results, tmp_path):
    points = {"frequency": [1.0], "measured": [0.5]}
    write_report(results, {"sweep": sweep_figure({"rcafc": points})}, tmp_path / "new")
    written = sorted(path.relative_to(tmp_path / "new").as_posix() for path in (tmp_path / "new").rglob("*.*"))
    assert written == ["figures/sweep.png", "figures/sweep.svg", "report.html"]


@pytest.mark.parametrize("gone", ["example1", "example2", "table2", "fidelity", "claims", "provenance"])
def test_missing_parts_are_left_out(results, tmp_path, gone):
    del results[gone]
    parsed(write_report(results, {}, tmp_path).read_text(encoding="utf-8"))


def test_nothing_at_all_is_still_a_page(tmp_path):
    words = "".join(parsed(write_report({}, {}, tmp_path).read_text(encoding="utf-8")).words)
    assert "Assumptions" in words
    assert "Audit" not in words

"""The documentation site: every page is in a table of contents, every relative link leads somewhere, and it builds.

The directives in docs/_ext are tested by values that the code has too.
"""

import importlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

from undertow.core import catalogue

pytestmark = pytest.mark.docs

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(path for path in DOCS.rglob("*.md") if "_build" not in path.parts and "gallery" not in path.parts)
OUTSIDE = ("README.md", "CONTRIBUTING.md", "SECURITY.md", "CODE_OF_CONDUCT.md", "paper.md")
READ = [*(ROOT / name for name in OUTSIDE), *PAGES]

_TOCTREE = re.compile(r"^```\{toctree\}\n(.*?)^```", re.M | re.S)
_CODE = re.compile(r"^```.*?^```|`[^`\n]*`", re.M | re.S)
_LINK = re.compile(r"\]\(([^)\s]+)\)")


def listed(page):
    """Pages that the tables of contents of a page name."""
    for contents in _TOCTREE.findall(page.read_text("utf-8")):
        entries = [line.strip() for line in contents.splitlines() if line.strip() and not line.startswith(":")]
        for entry in entries:
            yield from page.parent.glob(f"{entry}.md")


def test_every_page_is_in_a_table_of_contents():
    assert set(PAGES) - {DOCS / "index.md"} == {found for page in PAGES for found in listed(page)} - {DOCS / "index.md"}


@pytest.mark.parametrize("page", READ, ids=lambda page: str(page.relative_to(ROOT)))
def test_relative_links_lead_to_files(page):
    text = _CODE.sub("", page.read_text("utf-8"))
    targets = [link.partition("#")[0] for link in _LINK.findall(text) if "://" not in link]
    made = DOCS / "gallery"  # by the build
    broken = [to for to in targets if to and not (page.parent / to).exists() and made not in (page.parent / to).parents]
    assert not broken


@pytest.mark.parametrize("page", READ, ids=lambda page: str(page.relative_to(ROOT)))
def test_named_code_files_exist(page):
    named = set(re.findall(r"`([\w-]+/(?!my_)[\w/-]+\.py)`", page.read_text("utf-8")))
    assert [
        name for name in named if not any((ROOT / place / name).exists() for place in ("", "undertow", "simdjit"))
    ] == []


# What a reader sees at once: a figure of a run, boxes and arrows, the layers of the package, or an image.
_PICTURE = re.compile(r"^(```\{(picture|signal-flow|layers)\}|!\[)", re.M)


@pytest.mark.parametrize("folder", ["tutorials", "how-to", "explanation"])
def test_every_page_has_a_picture(folder):
    tables = (DOCS / "explanation" / "index.md").read_text("utf-8").split("These pages hold tables")[1].split()
    pages = [page for page in (DOCS / folder).glob("*.md") if page.stem not in ("index", "simdjit", *tables)]
    assert [page.name for page in pages if not _PICTURE.search(page.read_text("utf-8"))] == []


def test_every_kind_of_part_has_a_page():
    assert {path.stem for path in (DOCS / "reference" / "parts").glob("*.md")} - {"index"} == set(catalogue.KINDS)


def test_every_hypothesis_is_explained():
    folder = ROOT / "undertow" / "analysis" / "certificate"
    names = re.findall(r'Hypothesis\("(\w+)"', (folder / "hypotheses.py").read_text("utf-8"))
    page = (DOCS / "explanation" / "certificate.md").read_text("utf-8")
    assert len(names) >= 10
    assert [name for name in names if f"| `{name}` |" not in page] == []


def extension(name, monkeypatch):
    """A module of docs/_ext."""
    pytest.importorskip("sphinx")
    monkeypatch.syspath_prepend(DOCS / "_ext")
    return importlib.import_module(name)


def test_formulas_are_mathml(monkeypatch):
    mathml = extension("mathml", monkeypatch).mathml
    letters = '<mover accent="true"><mi>x</mi><mo stretchy="false">\u02d9</mo></mover><mi>i</mi>'
    assert re.sub(r">\s+<", "><", mathml(r"\dot x_i")).endswith(f"><msub>{letters}</msub></math>")
    with pytest.raises(ValueError, match=r"\\unknown.*in the formula \\unknown x"):
        mathml(r"\unknown x")


def test_layers_are_those_of_the_import_contract(monkeypatch):
    layers = extension("layers", monkeypatch)
    assert (layers.layers()[0], layers.layers()[-1]) == (["cli"], ["core"])
    assert ["control", "simulation"] in layers.layers()
    assert layers.purpose("report") == "Self-contained HTML pages, tables, figures and the replay."
    assert layers.purpose("run").startswith("One closed loop from Python")


def test_fields_say_what_the_code_says_beside_them(monkeypatch):
    from undertow.core.contracts import Load, Target
    from undertow.physics.thrusters.motor import DCMotor

    meaning = extension("api", monkeypatch).field_meaning
    assert meaning(Load, "wrench").startswith("w_d of Eq. (2), on the left side: it opposes; N, N m")
    assert meaning(DCMotor, "inductance") == "winding inductance, H"
    assert (meaning(Target, "position"), meaning(None, "position")) == ("", "")


def test_a_part_is_described_with_its_values_units_and_sources(monkeypatch):
    from undertow.scenario.describing import describe

    (motor,) = describe("thrusters/paper_table3")
    said = extension("reference", monkeypatch).described(motor).astext().split("\n\n")
    row = said.index("motor.inductance")
    assert said[row : row + 6] == ["motor.inductance", "0.01", "H", "L", "winding inductance", "the paper, Table 3"]
    assert said[said.index("fidelity") + 1] == "electromechanical"


def test_a_picture_runs_what_its_command_reads(monkeypatch):
    pictures = extension("pictures", monkeypatch)
    page = (
        "```yaml\n# dive.yaml\nloop: {}\n```\n```bash\nundertow init --own-vehicle\nundertow list\n```\n"
        "```python\nPath('real.yaml').write_text('')\n```\n```python\nprint('more')\n```\n```bash\n"
        "undertow simulate dive.yaml --out runs/dive\nundertow identify my.yaml runs/dive/run.mcap --out runs/rov\n"
        "undertow tune runs/rov/identified.yaml --out runs/rov-tuned\n```\n"
    )
    files, commands = pictures._blocks(page)
    assert files == {"dive.yaml": "# dive.yaml\nloop: {}\n"}
    ran = [
        words[2] if words[0] == "-m" else words[1]
        for words in pictures._needed(commands, "runs/rov-tuned/figures/tuning.png")
    ]
    assert ran == ["init", "Path('real.yaml').write_text('')\n", "simulate", "identify", "tune"]
    assert pictures._needed(commands, "runs/other/figures/summary.png") == []


@pytest.mark.slow
def test_the_site_builds_without_a_warning_and_needs_no_network(tmp_path):
    command = [
        sys.executable,
        "-m",
        "sphinx",
        "-W",
        "-q",
        "-b",
        "html",
        "-d",
        tmp_path / "cache",
        DOCS,
        tmp_path / "site",
    ]
    made = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert made.returncode == 0, made.stderr
    text = lambda name: (tmp_path / "site" / f"{name}.html").read_text("utf-8")
    assert "--no-prediction" in text("reference/commands")
    assert "weights_at_bound" in text("reference/parts/controllers")
    assert "held_out.seeds" in text("reference/scenario")
    assert (tmp_path / "site" / "drive" / "index.html").stat().st_size > 1e6
    for page in (tmp_path / "site").rglob("*.html"):
        loaded = re.findall(
            r'<(?:script|link|img|iframe)[^>]*(?:src|href)="(?:https?:)?//[^"]*"', page.read_text("utf-8")
        )
        assert not loaded, page

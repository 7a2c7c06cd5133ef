"""Every Python block, and every `undertow` command, that README.md and docs/*.md show runs as it stands.

Blocks of one page run in order, in one folder, with one namespace. A block that cannot run here (a set-up command,
an output) is not marked python or bash, or stands after a line `<!-- not run -->`. A block of Python or YAML whose
first line is `# my_part.py` is that file: it is written into the folder.

Blocks of text on a page of docs/tutorials are what the command before them prints: each of their lines must occur in the
output, in this order; `...` stands for anything. Where they show an error, the command must fail with exit code 2.

By default a run is not put beside its prediction or, on most pages, its scenario is checked only, once for all lines
and pages that name it; blank figures and no replay are written, and PID stands for the preset `robust`: most of the time
of a short run. Of a tutorial, only `undertow init` runs, and the scenarios are validated. Slow tests run everything as
it stands.
"""

import functools
import re
import shlex
from pathlib import Path
from typing import NamedTuple

import pytest

from undertow.cli.main import run
from undertow.report import run_page
from undertow.report.figures import run_files, writing
from undertow.scenario.reading import read
from undertow.scenario.validation import validate
from undertow.studies.campaign.prepare import prepare
from undertow.studies.comparison.prepare import prepare_comparison

pytestmark = pytest.mark.docs

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("**/*.md"))]
BLOCK = re.compile(
    r"(?P<skip><!-- not run -->\s*\n)?^```(?P<language>python|yaml|bash|text)\n(?P<code>.*?)^```", re.S | re.M
)
FILE = re.compile(r"# (?P<name>\w+\.(?:py|yaml))\n")

# Commands with tests of their own that take minutes.
LONG = {"reproduce"}


BLANK = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1 1"></svg>'


class Block(NamedTuple):
    language: str
    code: str
    line: int


def blocks(page: Path) -> list[Block]:
    text = page.read_text(encoding="utf-8")
    return [
        Block(found["language"], found["code"], text[: found.start("code")].count("\n") + 1)
        for found in BLOCK.finditer(text)
        if not found["skip"]
    ]


def commands(code: str) -> list[list[str]]:
    """Arguments of the lines that are nothing but an undertow command."""
    lines = [shlex.split(line, comments=True) for line in code.replace("\\\n", " ").splitlines()]
    return [words[1:] for words in lines if words[:1] == ["undertow"] and not LONG & set(words) and "&&" not in words]


ROBUST, QUICKER = "{kind: rcaf, preset: robust}", "{kind: pid, frequency: 1}"


def without_a_run(arguments: list[str], page: str) -> int:
    """The same command without a prediction; or the check of its scenario, which builds everything and runs nothing."""
    if arguments[0] == "simulate" and page in SIMULATED:
        return run([*arguments, "--no-prediction"])
    arguments = ["check", arguments[1]] if arguments[0] == "simulate" else arguments
    path = Path(arguments[-1])
    if arguments[:-1] == ["check"] and path.is_file():
        return checked(path.resolve(), path.read_bytes())
    return run(arguments)


@functools.cache
def checked(path: Path, contents: bytes) -> int:
    """Exit code of the check of a file, for all lines that name it as long as it stays the same."""
    return run(["check", str(path)])


def compared(arguments: list[str]) -> None:
    """Build the controllers of a comparison, with the scenario's own for the preset `robust`, and run nothing."""
    entries = arguments[arguments.index("--controllers") + 1].replace("robust", "scenario").split(",")
    assert prepare_comparison([Path(arguments[1])], entries).campaign.number > 1


# Pages that run by default as users run them, those whose scenarios are simulated, and those whose campaign is built
# but not run.
WHOLE, SIMULATED = {"your-own-plant"}, {"README", "your-own-controller", "logs"}
BUILT = {"campaign", "compare"}


def lines_of(text: str) -> list[str]:
    """Lines without the width of their columns."""
    return [" ".join(line.split()) for line in text.splitlines() if line.strip()]


def absent(shown: str, printed: str) -> list[str]:
    """Lines of a block that the output does not have after those before them."""
    output, missing = iter(lines_of(printed)), []
    for line in lines_of(shown):
        pattern = re.escape(line).replace(re.escape("..."), ".*")
        if not any(re.fullmatch(pattern, one) for one in output):
            missing.append(line)
    return missing


def begun(arguments: list[str]) -> None:
    """Run `init`; of other commands, validate the scenario that they name, unless an earlier command writes it."""
    if arguments[0] == "init":
        assert run(arguments) == 0
    elif arguments[1].startswith("runs/"):
        return
    elif arguments[1].endswith(".yaml") and "plant" in (text := read(Path(arguments[1]))).data:
        validate(text)


@pytest.mark.filterwarnings("ignore:FigureCanvasAgg is non-interactive")
@pytest.mark.parametrize(
    ("page", "whole"),
    [
        pytest.param(page, whole, id=f"{page.stem}-{whole}", marks=pytest.mark.slow if slow else ())
        for page in PAGES
        for whole, slow in ([(True, False)] if page.stem in WHOLE else [(False, False), (True, True)])
    ],
)
def test_blocks_run(page, whole, tmp_path, monkeypatch, capsys):
    if not whole:
        monkeypatch.setattr(writing, "svg", lambda figure: BLANK)
        monkeypatch.setattr(writing, "png", lambda figure: b"blank")
        monkeypatch.setattr(run_files, "small_png", lambda figure: b"blank")
        monkeypatch.setattr(run_page, "replay_of", lambda *_: None)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    namespace = {"__name__": "__docs__"}
    several = blocks(page)
    tutorial, shown, before = page.parent.name == "tutorials", {}, 0
    for block in several:
        if block.language == "text" and tutorial:
            shown[before] = shown.get(before, "") + block.code
        before = before if block.language == "text" else block.line
    for block in several:
        if file := FILE.match(block.code):
            code = block.code if whole or not file["name"].endswith(".yaml") else block.code.replace(ROBUST, QUICKER)
            (tmp_path / file["name"]).write_text(code, encoding="utf-8")
        elif not whole and page.stem in BUILT:
            for arguments in commands(block.code):
                if arguments[0] == "compare":
                    compared(arguments)
                elif arguments[1].endswith(".yaml"):
                    assert prepare(tmp_path / arguments[1]).trials.number > 0
        elif not whole and tutorial:
            for arguments in commands(block.code) if block.language == "bash" else ():
                begun(arguments)
        elif block.language == "python":
            exec(compile("\n" * (block.line - 1) + block.code, str(page), "exec"), namespace)
        elif block.language == "bash":
            for arguments in commands(block.code):
                if not whole and arguments[0] == "compare":
                    compared(arguments)
                    continue
                allowed = (2,) if "Error:" in shown.get(block.line, "") else (0, 1)
                code = run(arguments) if whole else without_a_run(arguments, page.stem)
                assert code in allowed, f"{page.name}, line {block.line}: undertow {shlex.join(arguments)}"
        printed = "".join(capsys.readouterr())
        if whole and block.line in shown:
            assert not absent(shown[block.line], printed), f"{page.name}, line {block.line}, printed:\n{printed}"


def test_absent_lines():
    printed = "\n| a |  1.5 | m |\nReading 0.3 s\nDone.\n"
    assert absent("| a | 1.5 | m |\n\nDone.\n", printed) == []
    assert absent("Reading ... s\n", printed) == []
    assert absent("| a | 1.6 | m |\nDone.\n| a | 1.5 | m |\n", printed) == [
        "| a | 1.6 | m |",
        "Done.",
        "| a | 1.5 | m |",
    ]


def test_blocks_are_found(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(
        "a\n```python\nx = 1\n```\n<!-- not run -->\n```bash\nrm\n```\n```bash\nundertow list  # all\npip\n```\n"
    )
    assert blocks(page) == [Block("python", "x = 1\n", 3), Block("bash", "undertow list  # all\npip\n", 10)]
    assert commands("undertow list  # all\nundertow reproduce\npip install undertow\n") == [["list"]]

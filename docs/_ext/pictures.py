"""Directive that shows a figure which the commands of the page write.

`{picture} runs/first/figures/summary.png` runs the command of the page whose `--out` is `runs/first`, before it those
whose results it reads, with the files that the page shows and those that its Python writes. The figure is kept until
undertow or the page changes.
"""

import hashlib
import os
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective
from sphinx.util.logging import getLogger

ROOT = Path(__file__).parents[2]
_BLOCK = re.compile(r"^```(?P<language>python|yaml|bash)\n(?P<code>.*?)^```", re.S | re.M)
_FILE = re.compile(r"# (?P<name>\w+\.(?:py|yaml))\n")


class Picture(SphinxDirective):
    """A figure of a run; the content is its caption."""

    required_arguments = 1
    has_content = True

    def run(self) -> list[nodes.Node]:
        caption = " ".join(self.content)
        figure = nodes.figure()
        if self.config.pictures:
            page = Path(self.env.doc2path(self.env.docname)).read_text(encoding="utf-8")
            made = _made(page, self.arguments[0], Path(self.config.nb_execution_cache_path))
            figure += nodes.image(uri=f"/{os.path.relpath(made, self.env.srcdir)}", alt=caption)
        figure += nodes.caption("", caption)
        return [figure]


def _made(page: str, figure: str, cache: Path) -> Path:
    """The figure, from an earlier build or from the commands of the page."""
    files, commands = _blocks(page)
    needed = _needed(commands, figure)
    if not needed:
        raise ValueError(f"no command on the page writes {figure}")
    key = hashlib.sha256(repr((sorted(files.items()), needed, figure)).encode()).hexdigest()[:16]
    kept = cache / "pictures" / f"{key}.png"
    if kept.is_file():
        return kept
    getLogger(__name__).info("making %s", figure)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "examples").symlink_to(ROOT / "examples")
        for name, content in files.items():
            (Path(folder) / name).write_text(content, encoding="utf-8")
        for command in needed:
            subprocess.run([sys.executable, *command], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        kept.parent.mkdir(parents=True, exist_ok=True)
        kept.write_bytes((Path(folder) / figure).read_bytes())
    return kept


def _blocks(page: str) -> tuple[dict[str, str], list[list[str]]]:
    """Files that a page shows, and, as arguments of Python, its commands and its code that writes files, in order."""
    files, commands = {}, []
    for block in _BLOCK.finditer(page):
        code = block["code"]
        name = _FILE.match(code)
        if name is not None:
            files[name["name"]] = code
        elif block["language"] == "bash":
            lines = [shlex.split(line, comments=True) for line in code.replace("\\\n", " ").splitlines()]
            commands += [["-m", *words] for words in lines if words[:1] == ["undertow"]]
        elif ".write_text(" in code:
            commands.append(["-c", code])
    return files, commands


def _needed(commands: Sequence[list[str]], path: str) -> list[list[str]]:
    """What has to run for a file: the command that writes it, those that it reads, every `init` and the Python."""
    for number, words in enumerate(commands):
        out = words[words.index("--out") + 1] if "--out" in words else None
        if out is not None and path.startswith(f"{out}/"):
            before = commands[:number]
            begins = [command for command in before if command[0] == "-c" or command[2] == "init"]
            read = [command for word in words[3:] for command in _needed(before, word)]
            return [command for command in commands[: number + 1] if command in (*begins, *read, words)]
    return []


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive; `-D pictures=0` leaves the figures out."""
    app.add_config_value("pictures", True, "env", bool)
    app.add_directive("picture", Picture)
    return {"parallel_read_safe": True}

"""The examples of the gallery: every name exists, every example runs, shows a figure and prints what its text claims.

By default two examples run, and the names that the others use are looked up; slow tests run all of them.
"""

import ast
import importlib
import re
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

GALLERY = Path(__file__).parents[2] / "examples" / "gallery"
EXAMPLES = sorted(GALLERY.glob("plot_*.py"))

QUICK = {"plot_fuzzy_basis", "plot_t200"}


def named(tree: ast.Module):
    """Modules and their attributes that a file names: imports, and chains that begin at `ut`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            yield from ((node.module, [one.name]) for one in node.names)
        elif isinstance(node, ast.Attribute):
            chain, base = [node.attr], node.value
            while isinstance(base, ast.Attribute):
                chain, base = [base.attr, *chain], base.value
            if isinstance(base, ast.Name) and base.id == "ut":
                yield "undertow", chain


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_names_exist(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    found = list(named(tree))
    assert found
    for module, chain in found:
        thing = importlib.import_module(module)
        for name in chain:
            thing = getattr(thing, name) if hasattr(thing, name) else importlib.import_module(f"{module}.{name}")


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_form(path):
    """A title, cells, one figure at least, and no number that is typed into a printed sentence."""
    text = path.read_text(encoding="utf-8")
    title, line = ast.get_docstring(ast.parse(text)).splitlines()[:2]
    assert set(line) == {"="} and len(line) == len(title)
    assert "\n# %%\n" in text and "plt.show()" in text
    assert re.search(r"print\(\s*f", text)


@pytest.mark.parametrize(
    "path",
    [pytest.param(path, marks=() if path.stem in QUICK else pytest.mark.slow) for path in EXAMPLES],
    ids=lambda path: path.stem,
)
def test_runs(path, capsys, monkeypatch):
    figures = []
    monkeypatch.setattr(plt, "show", lambda: figures.extend(plt.get_fignums()))
    try:
        exec(compile(path.read_text(encoding="utf-8"), str(path), "exec"), {"__name__": "__main__"})
    finally:
        plt.close("all")
    printed = capsys.readouterr().out
    assert figures and path.stem in PRINTED
    for pattern, low, high in PRINTED[path.stem]:
        found = re.search(pattern, printed)
        assert found, printed
        assert low <= float(found[1]) <= high, found[0]


NUMBER = r"([-+\d.e]+)"
# Example -> patterns of what it prints, with the limits between which the number must lie.
PRINTED = {
    "plot_fuzzy_basis": [(rf"Squared norm at zero: {NUMBER}", 0.404, 0.406), (rf"from one: {NUMBER}", 0, 1e-15)],
    "plot_t200": [(rf"16 V: {NUMBER} N forward", 48.0, 48.2), (rf"up to {NUMBER} V", 1.2, 1.2)],
}

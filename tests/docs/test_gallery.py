"""The examples of the gallery: every name exists, every example runs, shows a figure and prints what its text claims.

By default two examples run, and the names that the others use are looked up; slow tests run all of them.
"""

import ast
import importlib
import re
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

pytestmark = pytest.mark.docs

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


def test_every_example_is_compared():
    assert {path.stem for path in EXAMPLES} == set(PRINTED)


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
    assert figures
    for pattern, low, high in PRINTED[path.stem]:
        found = re.search(pattern, printed, re.MULTILINE)
        assert found, printed
        assert low <= float(found[1]) <= high, found[0]


NUMBER = r"([-+\d.e]+)"
# Example -> patterns of what it prints, with the limits between which the number must lie. The limits are those of the
# claims in its text, or near a value known otherwise.
PRINTED = {
    "plot_certificate": [(rf"rank.*: held {NUMBER}%", 100, 100), (rf"d is constant.*: held {NUMBER}%", 0, 0)],
    "plot_controllers": [(rf"{law}: {NUMBER} mm", 10, 100) for law in ("PID", "ADRC", "INDI", "robust")],
    "plot_currents": [(rf"seed 0: mean {NUMBER} m/s", 0.1, 0.5), (rf"deviation {NUMBER} m/s", 0.05, 0.2)],
    "plot_delay_margin": [
        (rf"margin: {NUMBER} ms", 300, 350),
        (rf"decays, from .* to {NUMBER} mm", 0, 0.1),
        (rf"grows, from .* to {NUMBER} mm", 8, 100),
    ],
    "plot_divergence": [(rf"\n?10 mH: diverged at {NUMBER} s", 0.5, 1.5)],
    "plot_energy": [(rf"balance: {NUMBER} of", 0, 1e-12), (rf"water: {NUMBER} J", 10, 1e5)],
    "plot_fidelity_levels": [
        (rf"ideal: completed at {NUMBER} s", 20, 20),
        (rf"electromechanical: \w+ at {NUMBER} s", 0.5, 1.5),
    ],
    "plot_fuzzy_basis": [(rf"Squared norm at zero: {NUMBER}", 0.404, 0.406), (rf"from one: {NUMBER}", 0, 1e-15)],
    "plot_inverted_pendulum": [(rf"window: {NUMBER} mrad", 0, 0.01)],
    "plot_magnetic_levitation": [(rf"10 mm: .*most {NUMBER} mm", 0, 0.05), (rf"^6 mm: .*most {NUMBER} mm", 0.3, 1)],
    "plot_monte_carlo": [(rf"better in {NUMBER}%", 95, 100)],
    "plot_navigation": [(rf"north: {NUMBER} mm", 5, 200), (rf"down: {NUMBER} mm", 0, 50)],
    "plot_own_controller": [(rf"1 rad/s: {NUMBER} mm", 71, 73), (rf"4 rad/s: {NUMBER} mm", 4.5, 4.8)],
    "plot_poles": [(rf"10 rad/s: .* margin {NUMBER} ms", 50, 110), (rf"40 rad/s: .* margin {NUMBER} ms", 10, 30)],
    "plot_precision": [(rf"at most {NUMBER}", 0.01, 1000)],
    "plot_references": [
        (rf"lawn_mower: at most {NUMBER} m/s", 0.5, 0.5),
        (rf"helix: .* and {NUMBER} m/s", 0.049, 0.0495),
    ],
    "plot_setpoint": [(rf"RCAFC: .* {NUMBER} mm", 0.19, 0.21), (rf"^RAFC: .* error {NUMBER} mm", 0.19, 10)],
    "plot_t200": [(rf"16 V: {NUMBER} N forward", 48.0, 48.2), (rf"up to {NUMBER} V", 1.2, 1.2)],
    "plot_thruster_loss": [(rf"100% .* most {NUMBER} mm", 0, 10), (rf"^0% .* most {NUMBER} mm", 1, 100)],
    "plot_two_link_arm": [(rf"shoulder: {NUMBER} mrad", 0.3, 0.4), (rf"elbow: {NUMBER} mrad", 0.7, 0.8)],
    "plot_voltage_limits": [(rf"24 V: {NUMBER} m", 0.05, 100), (rf"96 V: {NUMBER} m", 0, 0.05)],
    "plot_waves": [(rf"realization: {NUMBER} m", 0.45, 0.55)],
    "plot_weight_drift": [
        (rf"without a bound: .* {NUMBER} m/s", 100, 1000),
        (rf"bounded .* weight {NUMBER} m/s", 4.9, 5),
    ],
}

"""Figures as matplotlib objects, made from datasets and plain numbers, and their files.

They are imported when first used, because matplotlib takes as long to import as JAX.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from undertow.report.figures.run import run_figures as run_figures
    from undertow.report.figures.run import run_plots as run_plots
    from undertow.report.figures.run_files import plot_run as plot_run
    from undertow.report.figures.writing import png as png
    from undertow.report.figures.writing import save as save
    from undertow.report.figures.writing import save_all as save_all
    from undertow.report.figures.writing import small_png as small_png
    from undertow.report.figures.writing import svg as svg

_MODULE_OF = {
    "plot_run": "undertow.report.figures.run_files",
    "png": "undertow.report.figures.writing",
    "run_figures": "undertow.report.figures.run",
    "run_plots": "undertow.report.figures.run",
    "save": "undertow.report.figures.writing",
    "save_all": "undertow.report.figures.writing",
    "small_png": "undertow.report.figures.writing",
    "svg": "undertow.report.figures.writing",
}


def __getattr__(name: str) -> Any:
    if name in _MODULE_OF:
        return getattr(importlib.import_module(_MODULE_OF[name]), name)
    raise AttributeError(f"undertow.report.figures has no `{name}`")

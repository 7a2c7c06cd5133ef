"""Figures as matplotlib objects, made from datasets and plain numbers, and their files."""

from undertow.report.figures.run import run_figures as run_figures
from undertow.report.figures.run import run_plots as run_plots
from undertow.report.figures.writing import png as png
from undertow.report.figures.writing import save as save
from undertow.report.figures.writing import save_all as save_all
from undertow.report.figures.writing import svg as svg

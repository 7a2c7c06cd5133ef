"""Temporal requirements: formulas of signal temporal logic, their text and their robustness."""

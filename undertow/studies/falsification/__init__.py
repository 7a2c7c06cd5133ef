"""Falsification: the smallest departure from a scenario, within stated bounds, that breaks a requirement."""

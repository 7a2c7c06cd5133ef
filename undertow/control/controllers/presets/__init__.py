"""Presets of the law: the paper's gains, and the robust variant."""

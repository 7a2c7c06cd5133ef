"""Comparison of the robust variant with the paper's law: every fidelity level, the ablations, and conclusions."""

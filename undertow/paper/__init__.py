"""Ghavidel and Kalat 2017: examples, figures, claims, ablations, and what the robust variant changes."""

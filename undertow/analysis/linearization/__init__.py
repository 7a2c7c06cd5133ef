"""Exact linearisation of a whole closed loop: equilibrium, stability margins and predicted response."""

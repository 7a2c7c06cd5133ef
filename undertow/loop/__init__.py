"""Loops: sampled (a scan) and continuous (one ODE), and what they record."""

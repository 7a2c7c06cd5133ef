"""Closed loops: sampled (a scan) and continuous (one ODE), and their recording."""

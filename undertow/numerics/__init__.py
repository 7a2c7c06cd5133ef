"""Rotations, integrators, inverses, Lyapunov, smoothing: mathematics without vehicles."""

"""Lyapunov functions of the controllers from recorded signals, and the hypotheses of the stability proof."""

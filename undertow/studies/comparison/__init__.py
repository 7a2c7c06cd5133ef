"""Comparison of controllers, or of whole scenarios, trial by trial on the same samples and seeds."""

"""Prediction of a scenario from its linearised closed loop."""

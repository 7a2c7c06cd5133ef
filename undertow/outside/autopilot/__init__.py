"""The controller by itself: stepped by somebody else's clock, with measurements and outputs in their formats."""

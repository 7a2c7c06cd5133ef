"""Checks of vehicles, thrusters, other parts and scenarios: plausible numbers, and contracts of parts."""

"""Checks: whether a vehicle, a thruster, another part or a whole scenario is possible and keeps its contract."""

"""Attacks on undertow itself that are counted: hostile input, kills, simulated hours, faults, negative controls."""

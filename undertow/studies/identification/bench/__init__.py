"""Identification of a thruster from the records of a test bench."""

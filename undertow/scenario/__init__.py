"""Scenario files: schema, reading, building."""

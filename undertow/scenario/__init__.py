"""Scenario files: schema, reading, building and running."""

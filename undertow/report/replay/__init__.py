"""Replay of runs in three dimensions: what is shown, its compact form, and the script that shows it."""

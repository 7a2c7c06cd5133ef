"""Replay of runs in three dimensions: what is shown, its compact form, the script that shows it, and a video of it."""

"""Logs of runs and vehicles, in the formats of other programs, as named time series in our frames and units."""

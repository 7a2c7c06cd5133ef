"""Recorded logs of runs and vehicles, in others' formats, as named time series in our frames and units."""

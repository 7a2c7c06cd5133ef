"""Thousands of runs of a scenario: what varies, how it is flown in batches, where the results stand, what they say."""

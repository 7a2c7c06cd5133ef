"""Gains found by running the loop: what is tuned, on what it is tried, what it costs, and how the best is found."""

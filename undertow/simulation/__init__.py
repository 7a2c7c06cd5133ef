"""A scenario or a closed loop run once: what is known of the run, its result file, and repetitions of it."""

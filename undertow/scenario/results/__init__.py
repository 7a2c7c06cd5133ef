"""One run of a scenario and its result: made, written, read and repeated here alone."""

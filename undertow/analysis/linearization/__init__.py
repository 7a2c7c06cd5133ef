"""A whole closed loop, linearised exactly: where it rests, how it is stable there, and what it will do."""

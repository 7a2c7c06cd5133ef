"""A scenario: its file read, checked and built, its run and the result of it."""

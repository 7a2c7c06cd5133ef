"""How fast undertow is, beside what anyone would write in NumPy."""

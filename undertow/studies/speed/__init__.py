"""Speed of undertow, compared with plain NumPy."""

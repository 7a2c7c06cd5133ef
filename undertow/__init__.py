"""undertow: robust adaptive control of underwater vehicles, from volts to trajectory, that shows its own limits."""

"""The report of `undertow reproduce`."""

"""The report of `undertow reproduce`: its page, chapter by chapter."""

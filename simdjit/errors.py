"""What lanes cannot do."""


class Unsupported(Exception):
    """A function uses something that has no rule; says what."""

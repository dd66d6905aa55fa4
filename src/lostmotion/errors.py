"""The one exception that bad input ends in."""


class InputError(ValueError):
    """Input that cannot be used. Its text is one line: the file, the key, the value and the remedy."""

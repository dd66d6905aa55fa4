"""The one exception that bad input ends in."""


class InputError(ValueError):
    """Input that cannot be used. Its text is one line: the file, the key, the value and the remedy."""

    def __init__(self, text: str = "") -> None:
        super().__init__("".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text))

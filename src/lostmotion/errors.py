"""The exceptions that bad input and missing libraries end in."""

from __future__ import annotations

from importlib.util import find_spec


class InputError(ValueError):
    """Input that cannot be used. Its text is one line: the file, the key, the value and the remedy."""

    def __init__(self, text: str = "") -> None:
        super().__init__("".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in str(text)))


class MissingLibraryError(ImportError):
    """A library that is not part of the plain installation. Its text is one line that says what to install."""


def need(module: str, purpose: str, extra: str) -> None:
    """Check that a library is there which only some functions need.

    Parameters
    ----------
    module
        What will be imported, such as ``"pyarrow"``.
    purpose
        What needs it, as the beginning of a sentence.
    extra
        The extra of this package that brings it.

    Raises
    ------
    MissingLibraryError
        It is not installed.
    """
    if find_spec(module) is None:
        raise MissingLibraryError(f'{purpose} needs {module}; install it: pip install "lostmotion[{extra}]"')

"""The exceptions that bad input and missing libraries end in."""

from __future__ import annotations

from importlib.util import find_spec
from unicodedata import category


def visible(text: str, kept: str = "") -> str:
    """A text with escapes in place of what a terminal would obey or not show.

    Parameters
    ----------
    kept
        Characters that stay, such as the end of a line.
    """
    if text.isprintable():
        return text
    return "".join(
        c if c.isprintable() or c in kept or category(c) == "Zs" else c.encode("unicode_escape").decode() for c in text
    )


class InputError(ValueError):
    """Input that cannot be used. Its text is one line: the file, the key, the value and the remedy.

    Examples
    --------
    >>> import lostmotion as lm
    >>> try:
    ...     lm.Load(inertia=-1.0)
    ... except lm.InputError as error:
    ...     print(error)
    key inertia: -1.0 must be greater than 0
    """

    def __init__(self, text: str = "") -> None:
        super().__init__(visible(str(text)))


class ArgumentError(InputError, TypeError):
    """A call with an argument that the function does not have, or without one that it needs."""


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

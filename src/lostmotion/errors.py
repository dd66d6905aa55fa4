"""The exceptions that bad input and missing libraries end in."""

from __future__ import annotations

from importlib import import_module
from typing import Any


class InputError(ValueError):
    """Input that cannot be used. Its text is one line: the file, the key, the value and the remedy."""


class MissingLibraryError(ImportError):
    """A library that is not part of the plain installation. Its text is one line that says what to install."""


def optional(module: str, purpose: str, extra: str) -> Any:
    """A library that only some functions need.

    Parameters
    ----------
    module
        What to import, such as ``"pyarrow"``.
    purpose
        What needs it, as the beginning of a sentence.
    extra
        The extra of this package that brings it.

    Raises
    ------
    MissingLibraryError
        It is not installed.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError:
        library = module.partition(".")[0]
        raise MissingLibraryError(f'{purpose} needs {library}; install it: pip install "lostmotion[{extra}]"') from None

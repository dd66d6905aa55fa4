"""The exceptions that bad input and missing libraries end in."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from importlib.util import find_spec
from typing import NamedTuple
from unicodedata import category


def visible(text: str, kept: str = "") -> str:
    """A text with escapes in place of what a terminal would obey or not show.

    kept: characters that stay, such as the end of a line.
    """
    if text.isprintable():
        return text
    return "".join(
        c if c.isprintable() or c in kept or category(c) == "Zs" else c.encode("unicode_escape").decode() for c in text
    )


class Problem(NamedTuple):
    """Fault of a value, or of several."""

    keys: tuple[str, ...]  # dotted keys of these; none where it concerns all that was given
    reason: str  # the value, what is wrong with it, and the remedy
    table: str = ""  # the table that a record fills, where the record is at fault
    record: str = ""  # this record, as messages name it

    def sentence(self) -> str:
        """Keys, record and reason as messages have them."""
        if self.table:
            return f"{self.table}{' from ' if self.record else ''}{self.record}: {self.reason}"
        if not self.keys:
            return self.reason
        return f"{'key' if len(self.keys) == 1 else 'keys'} {', '.join(self.keys)}: {self.reason}"

    def of_any_record(self) -> str:
        """The sentence without the name of the record."""
        return self._replace(record="").sentence()


class InputError(ValueError):
    """Input that cannot be used. Its text is one line: the file, the key, the value and the remedy.

    Parameters
    ----------
    text : str or Exception
        What is wrong, or the reason alone where keys are given.
    *keys : str
        Dotted keys of the values.
    table, record : str
        Where a record is at fault: the table that it fills, and its name.
    where : str or Path
        File, log or function that the text begins with.
    problems : sequence of Problem, optional
        All that is wrong, in place of text and keys.
    more : int
        Problems that are not among them.

    Examples
    --------
    >>> import lostmotion as lm
    >>> try:
    ...     lm.Load(inertia=-1.0)
    ... except lm.InputError as error:
    ...     print(error)
    key inertia: -1.0 must be greater than 0
    """

    def __init__(
        self,
        text: object = "",
        *keys: str,
        table: str = "",
        record: str = "",
        where: object = "",
        problems: Sequence[Problem] | None = None,
        more: int = 0,
    ) -> None:
        self.where, self.more = str(where), more
        own = Problem(tuple(map(str, keys)), str(text), table, record)
        self.problems = (own,) if problems is None else tuple(problems)
        said = "; ".join(problem.sentence() for problem in self.problems) + (f"; and {more} more" if more else "")
        super().__init__(visible(f"{where}: {said}" if where else said))

    @property
    def reason(self) -> str:
        """The text without `where`."""
        return visible(str(InputError(problems=self.problems, more=self.more))) if self.where else str(self)

    def with_keys(self, change: Callable[[str], str]) -> InputError:
        """The same error of values that have other keys."""
        problems = [p._replace(keys=tuple(map(change, p.keys))) for p in self.problems]
        return InputError(where=self.where, problems=problems, more=self.more)


@contextmanager
def _raised_as(change: Callable[[InputError], InputError]) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        raise change(error) from None


def inside(table: str) -> AbstractContextManager[None]:
    """Errors of values within a table have its name before their keys."""
    return _raised_as(lambda error: error.with_keys(lambda key: f"{table}.{key}"))


def prefixed(where: object) -> AbstractContextManager[None]:
    """Errors within begin with a file, log or function, or with a key."""

    def change(error: InputError) -> InputError:
        whole = f"{where}: {error.where}" if error.where else str(where)
        return InputError(where=whole, problems=error.problems, more=error.more)

    return _raised_as(change)


class ArgumentError(InputError, TypeError):
    """A call with an argument that the function does not have, or without one that it needs."""


class MissingLibraryError(ImportError):
    """A library that is not part of the plain installation. Its text is one line that says what to install."""


def need(module: str, purpose: str, extra: str) -> None:
    """Check that a library is there which only some functions need.

    module: what will be imported, such as ``"pyarrow"``.
    purpose: what needs it, as the beginning of a sentence.
    extra: the extra of this package that brings it.

    Raises MissingLibraryError: it is not installed.
    """
    if find_spec(module) is None:
        raise MissingLibraryError(f'{purpose} needs {module}; install it: pip install "lostmotion[{extra}]"')

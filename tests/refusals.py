"""How a test looks at an error: one line, in plain words."""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

import lostmotion as lm


def assert_plain(message: str) -> None:
    """Nothing of the language or of a library shows through."""
    assert not re.search(r"Input should|https?:|pydantic|\b(tuple|dict|float|int|str|bool|NoneType|model)\b|[TF]alse|True", message)


def refused(make: Callable[[], object]) -> str:
    """The one line by which something is refused."""
    with pytest.raises(lm.InputError) as caught:
        make()
    message = str(caught.value)
    assert "\n" not in message
    return message


def assert_file_refused(path: Path, text: str, old: str, new: str, words: list[str]) -> None:
    """A scenario file is refused, with its name and these words, once `new` stands in it for `old`."""
    assert old in text
    path.write_text(text.replace(old, new, 1))
    message = refused(lambda: lm.load(path))
    for word in (str(path), *words):
        assert word in message, message
    assert_plain(message)


@contextmanager
def refuses(*keys: str) -> Iterator[None]:
    """What is within is refused, with these keys as data of the error."""
    with pytest.raises(lm.InputError) as caught:
        yield
    assert [problem.keys for problem in caught.value.problems if problem.keys] == [keys], str(caught.value)

"""How a test looks at an error: one line, in plain words, with keys and reasons as data."""

import inspect
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import lostmotion as lm


def assert_plain(message: str) -> None:
    """Nothing of the language or of a library shows through."""
    assert not re.search(r"Input should|https?:|pydantic|\b(tuple|dict|float|int|str|bool|NoneType|model)\b|[TF]alse|True", message)


def refused(make: Callable[[], object], *keys: str, reason: str = "", match: str = "") -> str:
    """The one line by which something is refused: by these keys and with this reason as data, or with a text that matches."""
    with refuses(*keys, reason=reason, match=match) as told:
        make()
    return told[0]


def assert_file_refused(path: Path, text: str, old: str, new: str, words: list[str]) -> None:
    """A scenario file is refused, with its name and these words, once `new` stands in it for `old`."""
    assert old in text
    path.write_text(text.replace(old, new, 1))
    message = refused(lambda: lm.load(path))
    for word in (str(path), *words):
        assert word in message, message
    assert_plain(message)


@contextmanager
def refuses(*keys: str, reason: str = "", match: str = "") -> Iterator[list[str]]:
    """What is within is refused in one line, as by `refused`."""
    told: list[str] = []
    with pytest.raises(lm.InputError) as caught:
        yield told
    told.append(str(caught.value))
    assert "\n" not in told[0]
    assert not keys or [problem.keys for problem in caught.value.problems if problem.keys] == [keys], told[0]
    assert any(reason in problem.reason for problem in caught.value.problems), f"{told[0]} lacks {reason}"
    assert re.search(match, told[0]), f"{told[0]} lacks {match}"


def file_of(path: Path, text: str) -> Path:
    """A file with this text."""
    path.write_text(text)
    return path


def refusals_of(make: Callable[..., object], *cases: tuple[Any, ...]) -> Callable[..., None]:
    """A test that `make` refuses the arguments of each case, whose last entry says by which data, as `keys: reason`.

    The keys are all those of one problem of the error, and the reason is part of its reason; either may be left out. A keyword
    of `make` is a fixture.
    """

    @pytest.mark.parametrize("case", cases, ids=[case[-1][:60] for case in cases])
    def test(case: tuple[Any, ...], request: pytest.FixtureRequest) -> None:
        fixtures = {name: request.getfixturevalue(name) for name in inspect.getfullargspec(make).kwonlyargs}
        keys, _, reason = case[-1].partition(": ")
        with pytest.raises(lm.InputError) as caught:
            make(*case[:-1], **fixtures)
        problems = caught.value.problems
        assert any(keys in ("", ", ".join(p.keys)) and reason in p.reason for p in problems), f"{case[-1]}: not in {problems}"
        assert "\n" not in str(caught.value)

    return test


def refusals(*cases: tuple[Callable[[], object], str]) -> Callable[..., None]:
    """A test that each call is refused by the data that follow it, as in `refusals_of`."""
    return refusals_of(lambda call: call(), *cases)

"""What counts as a failure: messages, values and ends that no input may lead to."""

from __future__ import annotations

import os
import re
import signal
import time
from collections.abc import Callable, Iterable
from typing import TypeVar

import lostmotion as lm

MAX_MESSAGE = 300  # characters
INTERRUPTED = 1.0  # [s] within which an interruption ends a run
R = TypeVar("R")
# Words of libraries and of the language, which say nothing to a user.
RAW = re.compile(
    r"Traceback|pydantic|Input should|errno|<class|object at 0x|NoneType|\bdtype\b|\bndarray\b|[A-Z]\w+Error\b"
    r"|std::|positional argument|has no attribute|not subscriptable|division by zero|incompatible function arguments"
)


class Failure(Exception):  # noqa: N818
    """The product fails on this input."""


def check_message(text: str, names: Iterable[str] = ()) -> None:
    """Refuse a message that is no line of at most 300 characters, is a library's, or names neither file nor key.

    Parameters
    ----------
    names
        One of which it contains; left out, any.
    """
    names = list(names)
    if not text.strip() or len(text.strip().splitlines()) != 1:
        raise Failure(f"the message is not one line: {text!r}")
    if len(text.strip()) > MAX_MESSAGE:
        raise Failure(f"the message has {len(text.strip())} characters: {text!r}")
    if found := RAW.search(text):
        raise Failure(f"the message shows {found[0]!r}: {text!r}")
    if names and not any(name in text for name in names):
        raise Failure(f"the message names none of {', '.join(names)}: {text!r}")


def refused(make: Callable[[], R], names: Iterable[str] = (), *others: type[Exception]) -> R | None:
    """The result, or None where it is refused plainly, by an `InputError` or one of the others."""
    try:
        return make()
    except (lm.InputError, *others) as error:
        check_message(str(error), names)
        return None


class Alarm(BaseException):
    """Interrupts a run in place of Ctrl-C."""


def ends(make: Callable[[], R], seconds: float) -> R | None:
    """The result, or None after an interruption, which must end the work within a second of processor time."""

    def ring(*_: object) -> None:
        raise Alarm

    before = signal.signal(signal.SIGVTALRM, ring)
    begin, processor = time.monotonic(), time.process_time()
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        return make()
    except Alarm:
        # Of each thread at most: on a busy machine the clock runs on while the process waits.
        taken = (time.process_time() - processor - seconds) / (os.cpu_count() or 1)
        late = min(time.monotonic() - begin - seconds, taken)
        if late > INTERRUPTED:
            raise Failure(f"an interruption is obeyed after {late:.1f} s") from None
        return None
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)

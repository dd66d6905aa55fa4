"""What commands show while they work: errors as one line, progress bars."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from typing import TYPE_CHECKING, Any, NoReturn, Protocol, TextIO

from ..errors import visible

if TYPE_CHECKING:
    from rich.console import Console


class _Visible:
    """A stream to which texts of files may be printed: what a terminal would obey becomes visible."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream

    def __getattr__(self, name: str) -> Any:
        return getattr(self.stream, name)

    def write(self, text: str) -> int:
        return self.stream.write(visible(text, "\n\t"))


@contextmanager
def harmless_output() -> Iterator[None]:
    """Titles, names and notes of files reach the terminal as text, whatever they contain."""
    with redirect_stdout(_Visible(sys.stdout)), redirect_stderr(_Visible(sys.stderr)):
        yield


def console(stream: Any, width: int | None = None) -> Console:
    """For tables and bars of our own, which command the terminal."""
    from rich.console import Console

    return Console(file=getattr(stream, "stream", stream), width=width)


def fail(text: str, code: int = 1) -> NoReturn:
    """One line on stderr, and the end."""
    print(f"lostmotion: {text}", file=sys.stderr)
    sys.exit(code)


class Step(Protocol):
    """Notifies a progress bar of one more piece of work, or of how many are done."""

    def __call__(self, done: int | None = None) -> None: ...


@contextmanager
def progress(total: int, what: str) -> Iterator[Step]:
    """A progress bar with rate and remaining time on stderr, where that is a terminal."""
    if not sys.stderr.isatty():
        yield _unseen
        return
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        ProgressColumn,
        Task,
        TextColumn,
        TimeRemainingColumn,
    )

    class Rate(ProgressColumn):
        def render(self, task: Task) -> str:
            return f"{task.speed:.0f}/s" if task.speed else ""

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), Rate(), TimeRemainingColumn())
    with Progress(*columns, console=console(sys.stderr), transient=True) as bar:
        task = bar.add_task(what, total=total)

        def step(done: int | None = None) -> None:
            if done is None:
                bar.advance(task)
            else:
                bar.update(task, completed=done)

        yield step


def _unseen(done: int | None = None) -> None:
    """No terminal, no bar."""


SILENCE = 0.5  # [s] after which something must be seen
REFRESH = 0.2  # [s]


@contextmanager
def busy(what: str) -> Iterator[Callable[[str], None]]:
    """What is being done and since when, on stderr where that is a terminal, for work whose length is not known.

    Gives a function that takes how far it has got.
    """
    words = [what]

    def tell(how_far: str) -> None:
        words[0] = f"{what}: {how_far}"

    if not sys.stderr.isatty():
        yield tell
        return

    def show() -> None:
        from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

        columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
        with Progress(*columns, console=console(sys.stderr), transient=True) as bar:
            task = bar.add_task(what, total=None)
            while not done.wait(REFRESH):
                bar.update(task, description=words[0])

    def wait() -> None:
        if not done.wait(SILENCE):
            show()

    done = threading.Event()
    shown = threading.Thread(target=wait, daemon=True)
    shown.start()
    try:
        yield tell
    finally:
        done.set()
        shown.join()

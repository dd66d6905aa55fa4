"""What the commands share: errors as one line, progress bars, directories that are written to, workers."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, Protocol

import typer

if TYPE_CHECKING:
    from concurrent.futures import Executor


def fail(text: str, code: int = 1) -> NoReturn:
    """One line on stderr, and the end."""
    print(f"lostmotion: {text}", file=sys.stderr)
    sys.exit(code)


def number(unit: str = "") -> Callable[[str], float]:
    """Reads the value of an option: a bare number in `unit`, or one with a unit, as in a scenario."""

    def read(text: str) -> float:
        from .units import si_value
        from .validation import shown

        try:
            return si_value(text, unit)
        except ValueError as error:
            raise typer.BadParameter(f"{shown(text)} {error}") from None

    return read


def count(text: str) -> int:
    """Reads the value of an option that counts something."""
    if not (text.isascii() and text.isdecimal() and int(text) > 0):
        raise typer.BadParameter(f'"{text}" must be a whole number above 0')
    return int(text)


class Step(Protocol):
    """Tells a progress bar of one more piece of work, or of how many are done."""

    def __call__(self, done: int | None = None) -> None: ...


@contextmanager
def progress(total: int, what: str) -> Iterator[Step]:
    """A progress bar with rate and remaining time on stderr, where that is a terminal."""
    from rich.console import Console
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

    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), Rate(), TimeRemainingColumn())
    with Progress(*columns, console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task(what, total=total)

        def step(done: int | None = None) -> None:
            if done is None:
                bar.advance(task)
            else:
                bar.update(task, completed=done)

        yield step


@contextmanager
def writing(directory: Path, then: str = "") -> Iterator[None]:
    """What goes wrong with a directory that is written to, as one line."""
    from .errors import InputError

    try:
        yield
    except OSError as error:
        raise InputError(f"{directory}: cannot be written: {error.strerror}{then}") from None


@contextmanager
def workers(processes: int | None, scheduler: str | None) -> Iterator[Executor]:
    """Worker processes of this machine, or the workers of a Dask cluster."""
    if scheduler is None:
        from concurrent.futures import ProcessPoolExecutor
        from multiprocessing import get_context

        with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
            yield pool
        return
    from .errors import InputError

    try:
        from distributed import Client
    except ImportError:
        raise InputError("--scheduler needs Dask: pip install lostmotion[study]") from None
    try:
        client: Any = Client(scheduler, timeout="10s")  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise InputError(f"--scheduler {scheduler}: cannot be reached ({error})") from None
    with client:
        yield client.get_executor(pure=False)

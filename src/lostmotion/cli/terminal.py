"""What the commands share: errors as one line, progress bars, directories that are written to, workers."""

from __future__ import annotations

import sys
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, Protocol

import typer

from ..errors import InputError, need

if TYPE_CHECKING:
    from concurrent.futures import Executor


def fail(text: str, code: int = 1) -> NoReturn:
    """One line on stderr, and the end."""
    print(f"lostmotion: {text}", file=sys.stderr)
    sys.exit(code)


def number(unit: str = "") -> Callable[[str], float]:
    """Reads the value of an option: a bare number in `unit`, or one with a unit, as in a scenario."""

    def read(text: str) -> float:
        from ..inputs.validation import shown
        from ..units.conversion import si_value

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
    if not sys.stderr.isatty():
        yield _unseen
        return
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

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), Rate(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
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


@contextmanager
def busy(what: str) -> Iterator[None]:
    """What is being done and since when, on stderr where that is a terminal, for work whose length is not known."""
    if not sys.stderr.isatty():
        yield
        return

    def show() -> None:
        from rich.console import Console
        from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

        columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
        with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
            bar.add_task(what, total=None)
            done.wait()

    def wait() -> None:
        if not done.wait(SILENCE):
            show()

    done = threading.Event()
    shown = threading.Thread(target=wait, daemon=True)
    shown.start()
    try:
        yield
    finally:
        done.set()
        shown.join()


def try_file(path: Path) -> None:
    """See, before the work, that a file can be written; nothing is left behind.

    Raises
    ------
    InputError
    """
    if path.is_dir():
        raise InputError(f"{path}: is a directory; name a file")
    if path.exists() and not path.is_file():  # a device
        return
    try:
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except FileNotFoundError:
        raise InputError(f"{path}: its directory does not exist; make it first") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None


def try_directory(path: Path) -> None:
    """See, before the work, that files can be written into a directory, made if missing; nothing is left behind.

    Raises
    ------
    InputError
    """
    if path.exists() and not path.is_dir():
        raise InputError(f"{path}: is a file; -o names a directory")
    made: list[Path] = []
    try:
        for directory in reversed([p for p in (path, *path.parents) if not p.exists()]):
            directory.mkdir()
            made.append(directory)
        with tempfile.TemporaryFile(dir=path):
            pass
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None
    finally:
        for directory in reversed(made):
            directory.rmdir()


@contextmanager
def writing(directory: Path, then: str = "") -> Iterator[None]:
    """What goes wrong with a directory that is written to, as one line."""
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
    need("distributed", f"--scheduler {scheduler}", "cluster")
    from distributed import Client

    try:
        client: Any = Client(scheduler, timeout="10s")  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise InputError(f"--scheduler {scheduler}: cannot be reached ({error})") from None
    with client:
        yield client.get_executor(pure=False)

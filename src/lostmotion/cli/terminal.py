"""Output of commands while they work: errors as one line, progress bars."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, Protocol, TextIO

import typer

from ..errors import InputError, visible
from ..verdict import Verdict

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
    """Console for tables and bars of our own; the command sets the terminal."""
    from rich.console import Console

    return Console(file=getattr(stream, "stream", stream), width=width)


def fail(text: str, code: int = 1) -> NoReturn:
    """One line on stderr, and the end. Of a text that is too long for it, which only long names make, the middle is left out."""
    if len(text) > MAX_LINE:
        text = f"{text[: MAX_LINE // 2]} ... {text[-MAX_LINE // 2 + 5 :]}"
    print(f"lostmotion: {text}", file=sys.stderr)
    sys.exit(code)


def conclude(verdict: Verdict | None) -> None:
    """End a command with the exit code of its verdict; the last call of the command. Raises typer.Exit."""
    if verdict is not None:
        raise typer.Exit(verdict.exit_code)


@contextmanager
def about(source: str) -> Iterator[None]:
    """Name the source in the faults of a scenario that was read without one."""
    try:
        yield
    except (InputError, RuntimeError) as error:
        from ..inputs.toml_files import in_short

        raise InputError(f"{in_short(Path(source))}: {error}") from None


class ProgressStep(Protocol):
    """Notifies a progress bar of one more piece of work, or of how many are done."""

    def __call__(self, done: int | None = None) -> None: ...


@contextmanager
def progress(total: int, what: str) -> Iterator[ProgressStep]:
    """A progress bar with rate and remaining time on stderr; where that is no terminal, a line now and then."""
    if not sys.stderr.isatty():
        yield _lines(total, what)
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


def _lines(total: int, what: str) -> ProgressStep:
    """Prints a line now and then, once the work takes long."""
    begin = last = time.monotonic()
    count = 0

    def step(done: int | None = None) -> None:
        nonlocal last, count
        count = count + 1 if done is None else done
        now = time.monotonic()
        if now - begin > LONG and now - last > EVERY:
            last = now
            left = (now - begin) * (total - count) / max(1, count)
            print(f"{what}: {count} of {total}, {_span(left)} left by estimate", file=sys.stderr, flush=True)

    return step


def _now_and_then(what: str) -> Callable[[str], None]:
    """Prints how far the work has got, once it takes long."""
    begin = last = time.monotonic()

    def tell(how_far: str) -> None:
        nonlocal last
        now = time.monotonic()
        if now - begin > LONG and now - last > EVERY:
            last = now
            print(f"{what}: {how_far}, {_span(now - begin)} so far", file=sys.stderr, flush=True)

    return tell


MAX_LINE = 300  # characters of an error
SILENCE = 0.5  # [s] after which something must be seen
LONG = 60.0  # [s] from which on work is said to take long
MANY_SHAFTS = 12  # with dry friction or play among which a response takes up to minutes a point
EVERY = 30.0  # [s] between lines where there is no terminal
REFRESH = 0.2  # [s]


@contextmanager
def _beside(watch: Callable[[], None], done: threading.Event) -> Iterator[None]:
    """Run a function in another thread, which ends when it is done."""
    beside = threading.Thread(target=watch, daemon=True)
    beside.start()
    try:
        yield
    finally:
        done.set()
        beside.join()


@contextmanager
def busy(what: str) -> Iterator[Callable[[str], None]]:
    """Show the present activity and its start on stderr, for work of unknown length; without a terminal, print a line now and then.

    Gives a function that takes how far it has got.
    """
    if not sys.stderr.isatty():
        yield _now_and_then(what)
        return
    words = [what]

    def tell(how_far: str) -> None:
        words[0] = f"{what}: {how_far}"

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
    with _beside(wait, done):
        yield tell


@contextmanager
def simulating(what: str, scenario: Any, tolerance: float = 0.0) -> Iterator[Callable[[str], None]]:
    """Show a run of a scenario as `busy` does; for more than a minute also an estimate and the progress, on stderr.

    tolerance: relative tolerance of the adaptive solver; 0: the default tolerance of the run.
    """
    from ..simulation.runs.run_time_forecast import forecast
    from ..units.practical import counted

    with busy(what) as tell:
        expected = forecast(scenario, tolerance)
        begin = time.monotonic()
        done = threading.Event()
        terminal = sys.stderr.isatty()
        say = tell if terminal else lambda text: print(f"{what}: {text}", file=sys.stderr, flush=True)

        def watch() -> None:
            if long := expected.seconds > LONG:
                say(
                    f"takes {_span(expected.seconds)} by estimate; its first {expected.part:.3g} s have {counted(expected.switchings, 'switching')}"
                )
            while not done.wait(REFRESH if terminal else EVERY):
                passed = time.monotonic() - begin
                if long or passed > LONG:
                    say(_progress(passed, expected.seconds))

        with _beside(watch, done):
            yield tell


def announce_response(train: Any, points: int) -> None:
    """Say on stderr before it starts that the response of a large train with dry contacts or play takes long."""
    from ..model import TorsionCurve

    sticking = sum(shaft.friction_torque > 0.0 or shaft.friction_curve is not None for shaft in train.shafts.values())
    bent = sum(isinstance(gear.stiffness, TorsionCurve) for gear in train.gears.values())
    if len(train.shafts) > MANY_SHAFTS and sticking + bent > 0:
        print(
            f"Response: {len(train.shafts)} shafts, {sticking} of them with dry friction, and {bent} torsion curves; "
            f"each of the {points} points takes up to minutes",
            file=sys.stderr,
        )


def _progress(passed: float, expected: float) -> str:
    """Progress of a run by an estimate of its length, both in seconds."""
    if passed < expected:
        return f"about {100.0 * passed / expected:.0f} %, {_span(expected - passed)} left by estimate"
    return f"{_span(passed)} so far, longer than estimated; Ctrl-C ends it"


def _span(seconds: float) -> str:
    """A time in words."""
    if seconds < 100.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 6000.0 else f"{seconds / 3600.0:.3g} h"

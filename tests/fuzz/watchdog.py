"""Processes that run cases, with limits of time and memory."""

from __future__ import annotations

import gc
import os
import resource
import signal
import sys
import time
import traceback
from collections.abc import Iterator
from importlib import import_module
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from random import Random
from shutil import rmtree
from tempfile import TemporaryDirectory
from typing import NamedTuple

PROCESSOR = 30.0  # [s] of processor time of a case
DEAF = 2.0 * PROCESSOR  # [s] of processor time after which a case that does not obey is ended
WALL = 1800.0  # [s] after which a case is ended that waits for ever, also on a busy machine
MEMORY = 4 * 2**30  # [bytes] of addresses of a process


class Case(NamedTuple):
    """A case is made again from these alone."""

    kind: str
    seed: int
    number: int

    def __str__(self) -> str:
        return f"{self.kind}:{self.seed}:{self.number}"


class Overtime(BaseException):
    """Raised in a case that takes too long."""


def _ring(*_: object) -> None:
    raise Overtime


def failure_of(case: Case, folder: Path) -> str:
    """What is wrong with a case, run in this process; empty where nothing is.

    Parameters
    ----------
    folder
        For its files, empty.
    """

    home, unseen = Path.cwd(), list[str]()
    hook, sys.unraisablehook = sys.unraisablehook, lambda error: unseen.append(f"{error.object}: {error.exc_value}")
    before = signal.signal(signal.SIGPROF, _ring)
    signal.setitimer(signal.ITIMER_PROF, PROCESSOR)
    try:
        os.chdir(folder)
        import_module(f"fuzz.{case.kind}").case(Random(str(case)), folder)
    except Overtime:
        return f"endless run: more than {PROCESSOR:g} s of processor time\n{traceback.format_exc()}"
    except BaseException as error:
        return f"{type(error).__name__}: {error}\n{traceback.format_exc()}"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)
        os.chdir(home)
        gc.collect()
        sys.unraisablehook = hook
    return f"an exception is printed, not raised: {unseen[0]}" if unseen else ""


def _serve(pipe: Connection) -> None:
    """Run the cases that come through the pipe."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    while True:
        case, folder = pipe.recv()
        pipe.send(failure_of(case, folder))


def processor_time(process: int | None) -> float:
    """Processor time [s] that another process has used; where the system does not say, that of the clock."""
    try:
        words = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return time.monotonic()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


class Process:
    """A process that runs one case after another, and is replaced when one ends it."""

    def __init__(self) -> None:
        self.case: Case | None = None
        self._start()

    def _start(self) -> None:
        context = get_context("spawn")
        self.pipe, other = context.Pipe()
        self.process = context.Process(target=_serve, args=(other,), daemon=True)
        self.process.start()
        other.close()

    def begin(self, case: Case) -> None:
        self.case, self.since = case, time.monotonic()
        self.before = processor_time(self.process.pid)
        self.folder = TemporaryDirectory(prefix="fuzz-", ignore_cleanup_errors=True)
        self.pipe.send((case, Path(self.folder.name)))

    def failure(self) -> str | None:
        """What is wrong with its case, or None while it runs."""
        try:
            if self.pipe.poll():
                return str(self.pipe.recv())
            taken = processor_time(self.process.pid) - self.before
            passed = time.monotonic() - self.since
            if taken < DEAF and passed < WALL:
                return None
            text = f"endless run: ended after {taken:.0f} s of processor time and {passed:.0f} s without an answer"
        except (EOFError, OSError):
            self.process.join()
            text = f"crash: the process ended with {self.process.exitcode}"
        self.process.kill()
        self.process.join()
        self._start()
        return text

    def keep(self, directory: Path) -> None:
        """Copies the files of its case."""
        rmtree(directory, ignore_errors=True)
        try:
            os.makedirs(directory.parent, exist_ok=True)
            os.replace(self.folder.name, directory)
        except OSError:  # on another file system
            import shutil

            shutil.copytree(self.folder.name, directory, symlinks=True)

    def end(self) -> None:
        self.process.kill()
        self.process.join()


def run(cases: Iterator[Case], processes: int) -> Iterator[tuple[Case, str, Process]]:
    """Each case with what is wrong with it, as they end; the files of one are there until the next is asked for."""
    pool = [Process() for _ in range(processes)]
    try:
        waiting = True
        while waiting or any(p.case for p in pool):
            for process in pool:
                if process.case and (text := process.failure()) is not None:
                    yield process.case, text, process
                    process.folder.cleanup()
                    process.case = None
                if process.case is None and waiting:
                    case = next(cases, None)
                    if waiting := case is not None:
                        process.begin(case)
            time.sleep(0.002)
    finally:
        for process in pool:
            process.end()

"""Threads whose runs end with the block that started them, as by Ctrl-C."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

from . import _core


class Pool(ThreadPoolExecutor):
    """A pool in which few tasks wait: a signal that interrupts a submission can leave a lock of the pool closed for ever."""

    def map(self, fn: Callable[..., Any], *iterables: Iterable[Any], **_: Any) -> Iterator[Any]:
        """Results in the order of the arguments."""
        waiting: deque[Future[Any]] = deque()
        for arguments in zip(*iterables, strict=False):
            waiting.append(self.submit(fn, *arguments))
            if len(waiting) > 2 * self._max_workers:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()


@contextmanager
def thread_pool(threads: int | None) -> Iterator[Pool]:
    """Pool of threads; an exception in the block, such as Ctrl-C, ends the runs in the threads within milliseconds."""
    stop = _core.Stop()
    with Pool(threads, initializer=stop.watch) as pool:
        try:
            yield pool
        except BaseException:
            stop.request()
            pool.shutdown(wait=False, cancel_futures=True)
            raise

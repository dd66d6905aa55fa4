"""Threads whose runs end with the block that started them."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

from . import _core


@contextmanager
def thread_pool(threads: int | None) -> Iterator[ThreadPoolExecutor]:
    """Pool of threads; an exception in the block, such as Ctrl-C, ends the runs in the threads within milliseconds."""
    stop = _core.Stop()
    with ThreadPoolExecutor(threads, initializer=stop.watch) as pool:
        try:
            yield pool
        except BaseException:
            stop.request()
            pool.shutdown(wait=False, cancel_futures=True)
            raise

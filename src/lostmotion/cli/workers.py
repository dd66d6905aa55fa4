"""Workers that compute the runs of a study beside the core's own threads."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from ..errors import InputError, need

if TYPE_CHECKING:
    from concurrent.futures import Executor


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

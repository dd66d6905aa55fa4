"""Running studies: chunk by chunk, on all cores or any executor, safe against interruption at any instant."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ThreadPoolExecutor,
    wait,
)
from pathlib import Path
from typing import Any

from ...atomic_writer import write_bytes
from ...errors import InputError, need
from ...inputs.argument_checks import checked
from ...inputs.quantities import Count
from ..study.study_definition import Study
from ..study.study_files import from_json, to_json
from .chunk import as_parquet, as_table, compute_chunk, parsed, pieces, run_piece
from .stored_parts import (
    FOREIGN,
    NO_REPAIR,
    carried,
    checksum_of,
    checksums,
    damages,
    forget_missing,
    parts,
    write_part,
)

NOTE = "_study.json"  # a leading underscore: readers of Parquet directories pass it over


@checked
def study(
    what: Study,
    directory: str | Path,
    *,
    threads: Count | None = None,
    executor: Executor | None = None,
    progress: Callable[[int], None] | None = None,
    repair: bool = False,
) -> Path:
    """Run a study, or resume it, into a directory of Parquet files.

    Runs are computed and written in chunks; each written chunk is whole. A study that was interrupted at any instant computes the
    missing chunks when it is called again, so that no run is lost or repeated. Rows depend on the study alone, not on threads,
    workers or interruptions.

    Parameters
    ----------
    what : Study
        Result of `load_study`, or made in Python.
    directory : str or Path
        Directory, made if missing. ``pandas.read_parquet(directory)``, DuckDB and polars open it directly.
    threads : int, optional
        Number of threads in the core, without an executor. Default: all cores.
    executor : concurrent.futures.Executor, optional
        A process pool, the executor of a Dask client, or any other.
    progress : callable, optional
        Called with the number of finished runs. Slow studies without executor call it within a chunk, too, before it is written.
    repair : bool
        Whether to make damaged parts again; otherwise they are refused.

    Returns
    -------
    Path
        The directory.

    Raises
    ------
    InputError
        The directory contains another study or damaged parts, or cannot be written, or the executor lost its workers. Existing files
        stay.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import lostmotion as lm
    >>> study = lm.studies.load_study("examples/tolerance.toml")
    >>> with TemporaryDirectory() as folder:
    ...     directory = lm.study(study, Path(folder, "tolerance"))
    ...     print([path.name for path in directory.glob("*.parquet")])
    ['part-000000.parquet']
    """
    need("pyarrow", "A study", "study")
    need("scipy", "A study", "study")
    directory = Path(directory)
    text = to_json(what)
    _prepare(directory, text)
    damaged = damages_of(directory, what)
    refuse_damaged(directory, {path: why for path, why in damaged.items() if not repair or why in NO_REPAIR})
    for path in damaged:
        path.unlink()
    forget_missing(directory)
    files = parts(directory, what)
    missing = [runs for runs, part in files.items() if not part.exists()]
    done = what.total - sum(last - first for first, last in missing)
    furthest = 0

    def report(done: int) -> None:
        """Notify of the furthest alone: a chunk is simulated while the one before it is being written."""
        nonlocal furthest
        furthest = max(furthest, done)
        if progress is not None:
            progress(furthest)

    report(done)
    for first, last, content in _compute(text, missing, threads or os.cpu_count() or 1, executor, report, done):
        write_part(files[first, last], content)
        done += last - first
        report(done)
    return directory


def damages_of(directory: Path, what: Study) -> dict[Path, str]:
    """Damaged parts of the directory of a study, each with the reason."""
    text = to_json(what)
    damaged = damages(directory, what, text)
    foreign = [path for path, reason in damaged.items() if reason == FOREIGN]
    if foreign and text not in _studies_carried(directory).values():
        raise InputError(
            f"{directory / NOTE}: is of another study than {foreign[0].name}; "
            f"`lostmotion study resume {directory} --repair` restores it from there"
        )
    return damaged


def refuse_damaged(directory: Path, damaged: Mapping[Path, str]) -> None:
    """Refuse a directory with damaged parts. Raises InputError: it names the first of them."""
    for path, reason in damaged.items():
        if reason in NO_REPAIR:
            raise InputError(f"{path}: {reason}; remove it")
        more = f" ({len(damaged) - 1} more parts are damaged)" if len(damaged) > 1 else ""
        raise InputError(f"{path}: {reason}{more}; `lostmotion study resume {directory} --repair` makes it again")


def _prepare(directory: Path, text: str) -> None:
    """Makes the directory, or sees that it holds this study; what a killed run left half-written is removed."""
    note = directory / NOTE
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{directory}: cannot be made: {error.strerror}") from None
    for leftover in directory.glob(".part-*"):
        leftover.unlink(missing_ok=True)
    if note.exists():
        study_of(directory)
        if note.read_text(encoding="utf-8") != text:
            raise InputError(f"{directory}: holds another study; name another directory, or remove it")
        return
    if any(directory.glob("*.parquet")):
        raise InputError(f"{directory}: holds Parquet files that are of no study; name another directory")
    write_bytes(note, text.encode())


def _compute(
    text: str,
    missing: list[tuple[int, int]],
    threads: int,
    executor: Executor | None,
    report: Callable[[int], None],
    done: int,
) -> Iterator[tuple[int, int, bytes]]:
    if executor is None:
        yield from _compute_here(text, missing, threads, report, done)
        return
    # A few chunks more than there are workers, so that memory does not grow with the study.
    waiting: dict[Future[bytes], tuple[int, int]] = {}
    ahead = 2 * (getattr(executor, "_max_workers", None) or os.cpu_count() or 1) + 2
    rest = iter(missing)
    try:
        while True:
            for chunk in rest:
                waiting[executor.submit(compute_chunk, text, *chunk)] = chunk
                if len(waiting) >= ahead:
                    break
            if not waiting:
                return
            for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                first, last = waiting.pop(future)
                yield first, last, _result(future)
    finally:
        for future in waiting:
            future.cancel()


def _result(future: Future[bytes]) -> bytes:
    try:
        return future.result()
    except Exception as error:
        if isinstance(error, CancelledError | BrokenExecutor) or type(error).__module__.startswith("distributed."):
            why = " ".join(str(error).split())
            raise InputError(
                f"workers or their scheduler were lost ({type(error).__name__}{': ' if why else ''}{why[:80]}); "
                "what is written stays, and the same command resumes it"
            ) from None
        raise


def _compute_here(
    text: str, missing: list[tuple[int, int]], threads: int, report: Callable[[int], None], done: int
) -> Iterator[tuple[int, int, bytes]]:
    """While a piece is simulated, the one before it is made into a table beside it."""
    study = parsed(text)
    written: list[tuple[int, int, Future[bytes]]] = []  # the chunk before, if it is not yet given

    def given() -> Iterator[tuple[int, int, bytes]]:
        while written:
            first, last, content = written.pop()
            yield first, last, content.result()

    with ThreadPoolExecutor(max_workers=1) as beside:
        for first, last in missing:
            tables: list[Future[Any]] = []
            try:
                for a, b in pieces(study, first, last):
                    runs = run_piece(study, a, b, threads)
                    if tables:
                        tables[-1].result()
                    tables.append(beside.submit(as_table, text, a, b, runs, threads))
                    done += b - a
                    if b < last:
                        report(done)
            except BaseException:  # interrupted; what is simulated is not lost
                yield from given()
                raise
            yield from given()
            written.append((first, last, beside.submit(_together, text, tables)))
        yield from given()


def _together(text: str, tables: list[Future[Any]]) -> bytes:
    return as_parquet(text, [table.result() for table in tables])


def study_of(directory: str | Path) -> Study:
    """The study that a directory holds. Raises InputError: it holds none."""
    note = Path(directory) / NOTE
    if not note.is_file():
        raise InputError(f"{directory}: holds no study; run `lostmotion study STUDY.toml -o {directory}` first")
    try:
        return from_json(note.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{note}: cannot be read: {error.strerror}") from None
    except (ValueError, KeyError, TypeError, RecursionError):
        raise InputError(
            f"{note}: is damaged; `lostmotion study resume {directory} --repair` restores it from a part"
        ) from None


def restore_note(directory: Path) -> None:
    """Write the study that a part carries into the directory, if its own note is missing, damaged or of another study."""
    need("pyarrow", "A study", "study")
    try:
        damages_of(directory, study_of(directory))
        return
    except InputError as error:
        problem = error
    found = _studies_carried(directory)
    if not found:
        raise problem
    if (directory / NOTE).is_symlink():  # which may lead to a device
        (directory / NOTE).unlink()
    known, count = checksums(directory), Counter(found.values())
    source = max(found, key=lambda part: (count[found[part]], checksum_of(part) == known.get(part.name)))
    write_bytes(directory / NOTE, found[source].encode())


def _studies_carried(directory: Path) -> dict[Path, str]:
    """The studies as JSON that the parts carry; parts that cannot be read are left out."""
    import pyarrow.parquet as pq

    found = {}
    for part in sorted(directory.glob("part-*.parquet")):
        try:
            text = carried(pq.read_schema(part).metadata)
            from_json(text)
        except Exception:  # damaged in whatever way
            continue
        found[part] = text
    return found

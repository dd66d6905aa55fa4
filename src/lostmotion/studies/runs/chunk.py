"""One chunk of a study: its runs simulated, and what is kept of them as a table."""

from __future__ import annotations

import io
from functools import lru_cache
from typing import TYPE_CHECKING

from ...simulation.runs.results import installed_version
from ...simulation.scenario.scenario import Scenario
from ..study.study_definition import Study
from ..study.study_files import from_json
from ..study.wanted_values import channels, needed, reductions
from .candidate_rows import run_axes
from .chunk_results import Runs
from .runs_in_core import core_can, run_in_core, together
from .runs_one_by_one import run_each
from .tabulated_runs import tabulate, units_of

if TYPE_CHECKING:
    import pyarrow as pa

SLOW_RUNS = 20  # in a piece of runs that are made one by one
MAX_NUMBERS = 2**23  # of samples that are held at once: 64 megabytes


def compute_chunk(text: str, first: int, last: int, threads: int = 1) -> bytes:
    """The runs first .. last - 1 of a study (as JSON), as the bytes of a Parquet file. What executors are given."""
    study = parsed(text)
    return as_parquet(
        text, [as_table(text, a, b, run_piece(study, a, b, threads), threads) for a, b in pieces(study, first, last)]
    )


def pieces(study: Study, first: int, last: int) -> list[tuple[int, int]]:
    """The parts of a chunk, so that the samples of each can be held at once, and that slow ones show progress.

    Most chunks that the core can make are one piece.
    """
    size = last - first if core_can(study) or study.axis is not None else SLOW_RUNS
    if held := _arrays(study):
        size = min(size, max(1, MAX_NUMBERS // (held * study.scenario.simulation.samples)))
    return [(a, min(a + size, last)) for a in range(first, last, size)]


def _arrays(study: Study) -> int:
    """Number of variables of each run that are held at once."""
    if together(study):
        return 0 if reductions(study) else len(channels(study))
    return len(needed(study))


@lru_cache(maxsize=8)
def parsed(text: str) -> Study:
    """The study of a text; each is read once."""
    return from_json(text)


@lru_cache(maxsize=8)
def _units(text: str) -> dict[str, str]:
    return units_of(parsed(text))


def run_piece(study: Study, first: int, last: int, threads: int) -> Runs:
    """Simulates the runs; nearly all the time is spent here, mostly with the GIL released."""
    parameters = study.parameters(first, last)
    if study.axis is not None:
        return run_axes(study, parameters, threads)
    return (run_in_core if together(study) else run_each)(study, parameters, threads)


def as_table(text: str, first: int, last: int, runs: Runs, threads: int) -> pa.Table:
    """The rows of a piece."""
    return tabulate(parsed(text), _units(text), first, last, runs, threads)


def as_parquet(text: str, tables: list[pa.Table]) -> bytes:
    """The tables of a chunk as one file, with the study in its metadata."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    about = {"lostmotion_study": text, "lostmotion_version": installed_version()}
    out = io.BytesIO()
    pq.write_table(pa.concat_tables(tables).replace_schema_metadata(about), out)
    return out.getvalue()


def scenario_of_run(study: Study, run: int) -> Scenario:
    """The scenario of one run, by its number."""
    return study.scenario_at(study.parameters(run, run + 1)[0])

"""Pictures of reports on request, drawn by matplotlib: each once, several at a time where there are many."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..atomic_writer import write_whole
from ..errors import InputError
from .panels import Group

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ENDINGS = ("png", "svg", "pdf")
MANY = 6  # pictures from which on other processes help, which take a second to begin


def endings(text: str | None) -> tuple[str, ...]:
    """Endings of pictures from the text of ``--figures``. Raises InputError: one of them is not known."""
    found = tuple(dict.fromkeys(word.strip().lower() for word in (text or "").split(",") if word.strip()))
    if unknown := [word for word in found if word not in ENDINGS]:
        raise InputError(
            f"--figures {text}: {unknown[0]} is not known; write png, svg or pdf, with commas between them"
        )
    return found


def draw_all(directory: Path, groups: Sequence[Group], kinds: Sequence[str]) -> None:
    """Write each group as files NAME.png, NAME.svg, ... into a directory."""
    side_by_side(_draw, [(directory, group, kinds) for group in groups if group.charts])


def side_by_side(draw: Callable[..., None], calls: Sequence[tuple[Any, ...]]) -> None:
    """Calls a function that draws with each of these arguments, in several processes where there are many."""
    count = min(os.cpu_count() or 1, len(calls) // 3)
    if len(calls) < MANY or count < 2:
        for call in calls:
            draw(*call)
        return
    with ProcessPoolExecutor(count, multiprocessing.get_context("spawn")) as pool:
        for done in [pool.submit(draw, *call) for call in calls]:
            done.result()


def _draw(directory: Path, group: Group, kinds: Sequence[str]) -> None:
    from .plots import draw_group

    save(draw_group(group), directory, group.name, kinds)


def save(figure: Figure, directory: Path, name: str, kinds: Sequence[str]) -> None:
    """Write a picture as NAME.png, NAME.svg, ...: its layout is computed for the first, and kept for the others."""
    nothing = {"png": {"Software": None}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}
    for kind in kinds:
        write_whole(
            directory / f"{name}.{kind}",
            lambda path, kind=kind: figure.savefig(path, format=kind, metadata=nothing[kind]),  # type: ignore[misc]
        )
        figure.set_layout_engine("none")

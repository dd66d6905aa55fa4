"""Libraries that a checkout compiles when they are first needed."""

from __future__ import annotations

import shutil
import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

from ..errors import InputError

CHECKOUT = Path(__file__).parents[3]


def made_here(target: str, made: Iterable[Path], what: str) -> None:
    """Compile in a checkout what is missing there, or older than the sources of the core. An installed package has it already.

    target: of the Makefile.
    made: the files, as far as they exist.
    what: what they are, for the line that announces it.

    Raises InputError: the compilation failed.
    """
    if not (CHECKOUT / "Makefile").is_file() or not (CHECKOUT / "core" / "kernels").is_dir():
        return
    sources = [
        p
        for directory in ("core/lostmotion", "core/kernels", "bindings")
        for p in (CHECKOUT / directory).rglob("*.?pp")
    ]
    newest = max(path.stat().st_mtime for path in sources)
    if any(path.stat().st_mtime >= newest for path in made):
        return
    if shutil.which("make") is None:
        return
    print(f"Compiling {what}; this takes a minute or two, once.", file=sys.stderr)
    done = subprocess.run(["make", "-C", str(CHECKOUT), target], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise InputError(
            f"make {target}: failed in {CHECKOUT}; its last line: {done.stderr.strip().rpartition(chr(10))[2]}"
        )

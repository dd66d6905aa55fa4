"""Libraries that a checkout compiles when they are first needed."""

import shutil
import subprocess
import sys
import threading
import time
from collections.abc import Iterable
from pathlib import Path

from ..errors import InputError

CHECKOUT = Path(__file__).parents[3]
EVERY = 10.0  # s, after which a compilation that goes on says so


def made_here(target: str, made: Iterable[Path], what: str) -> None:
    """Compile in a checkout what is missing there, or older than the sources of the core. An installed package has it already.

    target: of the Makefile.
    made: the files, as far as they exist.
    what: what they are, for the line that announces it.
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
    begin, lines = time.monotonic(), ["it starts"]
    with subprocess.Popen(
        ["make", "-C", str(CHECKOUT), target], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as work:
        assert work.stdout is not None
        reader = threading.Thread(target=lines.extend, args=(map(str.strip, work.stdout),), daemon=True)
        reader.start()
        while True:
            try:
                work.wait(EVERY)
                break
            except subprocess.TimeoutExpired:
                print(f"  {time.monotonic() - begin:.0f} s: make {target}: {_last(lines)}", file=sys.stderr)
        reader.join()
    if work.returncode != 0:
        raise InputError(f"make {target}: failed in {CHECKOUT}; its last line: {_last(lines)}")


def _last(lines: list[str]) -> str:
    """The last line that a program under make printed, or make itself if none did."""
    found = [line for line in lines if line] or [""]
    return next((line for line in reversed(found) if not line.startswith("make")), found[-1])

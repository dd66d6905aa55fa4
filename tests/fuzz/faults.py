"""Cases that fail on purpose, with which the watchdog itself is tried: in the way that ``FUZZ_FAULT`` names."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from random import Random

from fuzz.verdict import check_message
from fuzz.watchdog import MEMORY

FAULTS = ("", "crash", "endless run", "ValueError", "the message is not one line", "MemoryError")


def case(random: Random, folder: Path) -> None:
    """Ends well where no fault is named."""
    (folder / "input.txt").write_text("what the case was made of")
    match os.environ.get("FUZZ_FAULT", ""):
        case "crash":
            os.abort()
        case "endless run":
            signal.setitimer(signal.ITIMER_PROF, 0.2)
            while True:
                pass
        case "ValueError":
            raise ValueError("raw")
        case "the message is not one line":
            check_message("two\nlines")
        case "MemoryError":
            bytearray(2 * MEMORY)

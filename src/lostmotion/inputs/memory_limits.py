"""Limits of the memory that input files may need, checked before the memory is taken."""

import math
import os
import re
from pathlib import Path

from ..errors import InputError

VARIABLE = "LOSTMOTION_MEMORY"
LOG = 2**29  # [bytes] that an input file may need; 10 channels at 1 kHz for an hour need 0.3 GB
RESULT = 2**32  # [bytes] that a saved result may need
PER_BYTE = 32  # bytes of memory for each byte of a table that is read into lists of Python's numbers, measured

ALWAYS_FREE = 4_000_000  # bytes, for which the system is not asked
PREFIXES = {"": 1.0, "k": 1e3, "M": 1e6, "G": 1e9, "T": 1e12}


def size_of(text: str) -> int:
    """Bytes of a size such as ``2 GB`` or ``800 MiB``. Raises ValueError: the text is no size."""
    match = re.fullmatch(r"\s*([0-9]+(?:\.[0-9]*)?)\s*([kKMGT]?)(i?)B?\s*", text)
    if match is None:
        raise ValueError("is no size of memory, such as 2 GB")
    prefix = match[2].replace("K", "k")
    factor = math.ldexp(1.0, 10 * list(PREFIXES).index(prefix)) if match[3] else PREFIXES[prefix]
    return int(float(match[1]) * factor)


def shown_size(size: float) -> str:
    """A number of bytes as text, such as ``1.6 GB``."""
    prefix = next((p for p in reversed(PREFIXES) if size >= PREFIXES[p]), "")
    return f"{size / PREFIXES[prefix]:.3g} {prefix}B"


def memory_limit(default: int = LOG) -> int:
    """Bytes that one input file may need: ``LOSTMOTION_MEMORY``, else the default."""
    text = os.environ.get(VARIABLE, "")
    try:
        return size_of(text) if text else default
    except ValueError as error:
        raise InputError(f"{VARIABLE}: {text!r} {error}") from None


def check_memory(needed: float, what: str = "", default: int = LOG) -> None:
    """Refuse an input that needs more memory than the limit.

    needed: bytes.
    what: the input, as the beginning of the message.
    default: limit where the user gives none [bytes].
    """
    if needed > (limit := memory_limit(default)):
        raise InputError(
            f"needs {shown_size(needed)} of memory or more, and the limit is {shown_size(limit)}; "
            f"shorten it, or raise the limit with `lostmotion --memory SIZE ...` or {VARIABLE}=SIZE",
            where=what,
        )


def check_free(needed: float, what: str, remedy: str) -> None:
    """Refuse results that do not fit into the memory that is free.

    needed: bytes.
    what: the results in the plural, as the beginning of the message.
    remedy: its end.
    """
    free = None if needed < ALWAYS_FREE else free_memory()
    if free is not None and needed > free:
        raise InputError(f"{what} need {needed / 1e9:.3g} GB of memory, and {free / 1e9:.3g} GB are free; {remedy}")


def free_memory() -> int | None:
    """Bytes of memory that programs can still have, or None where the system does not say."""
    try:
        with open("/proc/meminfo", encoding="ascii") as table:
            kilobytes = next(line.split()[1] for line in table if line.startswith("MemAvailable:"))
        return 1024 * int(kilobytes)
    except (OSError, StopIteration):
        pass
    try:
        return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, OSError, ValueError):
        return None


def read_text(path: Path, *, per_byte: float = PER_BYTE, default: int = LOG) -> str:
    """Text of a file in UTF-8; devices and files that need more memory than the limit are refused while they are read.

    path: may be a pipe.
    per_byte: memory that each byte of the text will need in the end.
    default: limit where the user gives none [bytes].
    """
    room = int(memory_limit(default) / per_byte)
    with path.open("rb") as file:
        content = file.read(room + 1)
        if len(content) > room:
            length = path.stat().st_size
            if length > room:
                check_memory(per_byte * length, str(path), default)
            raise InputError(f"does not end after {shown_size(room)}; name a file that ends", where=path)
    return content.decode("utf-8-sig")

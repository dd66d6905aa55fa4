"""Lists of values on the command line."""

from __future__ import annotations

import numpy as np

from ..errors import InputError


def parse_grid(text: str, option: str) -> list[float]:
    """Values from ``0.1,1,10`` or, with equal ratios, ``0.1..100:60`` (first, last, how many).

    Raises
    ------
    InputError
        The text is neither, or not positive.
    """
    problem = f"--{option} {text}: must be numbers such as 0.1,1,10 or a range such as 0.1..100:60"
    try:
        if ".." not in text:
            values = [float(x) for x in text.split(",")]
        else:
            bounds, _, count = text.partition(":")
            low, high = (float(x) for x in bounds.split(".."))
            values = np.geomspace(low, high, int(count)).tolist() if int(count) > 1 else [low]
    except ValueError:
        raise InputError(problem) from None
    if not all(np.isfinite(values)) or min(values) <= 0.0:
        raise InputError(f"{problem}, all of them above 0")
    return values

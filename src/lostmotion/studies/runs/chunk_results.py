"""Results of the runs of a chunk of a study."""

from types import SimpleNamespace

import numpy as np


class Runs(SimpleNamespace):
    """Results of a chunk: parameters (runs x parameters), samples (variable -> runs x samples) or their reductions by
    the core (column -> runs), energy (entry -> runs). Further columns are columns of the drive check, switchings and
    errors."""

    parameters: np.ndarray
    samples: dict[str, np.ndarray]
    kept: dict[str, np.ndarray]
    energy: dict[str, np.ndarray]
    checks: dict[str, list[float | str]]
    switchings: np.ndarray
    errors: list[str]


def spread(values: np.ndarray, where: np.ndarray, runs: int) -> np.ndarray:
    """Values of some of the runs in a row of all of them; NaN elsewhere."""
    if len(where) == runs:
        return values
    out = np.full((runs, *values.shape[1:]), np.nan)
    out[where] = values
    return out

"""Means over the samples of a run. The last sample may lie closer to the one before than the others."""

import numpy as np

WHOLE = 1e-6  # of an interval: rounding of the instants


def last_share(time: np.ndarray) -> float:
    """Share of an interval that the last sample is behind the one before: its weight in a mean over samples."""
    if len(time) < 3:
        return 1.0
    share = float((time[-1] - time[-2]) / (time[1] - time[0]))
    return share if share < 1.0 - WHOLE else 1.0


def weights(time: np.ndarray) -> np.ndarray | None:
    """Weights of samples in a mean; None where all are alike.

    Examples
    --------
    >>> weights(np.array([0.0, 0.1, 0.2, 0.25])).round(9).tolist()
    [1.0, 1.0, 1.0, 0.5]
    """
    share = last_share(time)
    return None if share == 1.0 else np.append(np.ones(len(time) - 1), share)

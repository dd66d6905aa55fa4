"""Fewer points that look the same."""

from typing import Any

import numpy as np

MAX_POINTS = 10_000  # of a curve that is drawn; more than twice the pixels across any figure


def thinned(x: Any, y: Any, max_points: int = MAX_POINTS) -> tuple[Any, Any]:
    """Points of a curve that look the same: of each run of neighbours the first and the extremes of both coordinates."""
    n = len(y)
    if n <= max_points:
        return x, y
    x, y = np.asarray(x), np.asarray(y)
    width = -(-n * 5 // max_points)
    whole = n // width * width
    firsts = np.arange(0, whole, width)
    kept: list[Any] = [firsts, np.arange(whole, n), [n - 1]]
    for values in (y,) if np.all(x[1:] >= x[:-1]) else (x, y):
        rows = values[:whole].reshape(-1, width)
        gaps = bool(np.isnan(rows.min()))
        for extreme, fill in ((np.argmin, np.inf), (np.argmax, -np.inf)):
            kept.append(firsts + extreme(np.where(np.isnan(rows), fill, rows) if gaps else rows, axis=1))
    index: Any = np.unique(np.concatenate(kept))
    return x[index], y[index]


def simplified(points: np.ndarray, within: float) -> np.ndarray:
    """Indices of the points of a line without which it would move by more (Ramer, Douglas and Peucker)."""
    kept = {0, len(points) - 1}
    waiting = [(0, len(points) - 1)]
    while waiting:
        begin, end = waiting.pop()
        if end - begin < 2:
            continue
        (a, b), (c, d) = points[begin], points[end]
        x, y = points[begin + 1 : end].T
        length = float(np.hypot(c - a, d - b))
        away = np.abs((c - a) * (b - y) - (a - x) * (d - b)) / length if length else np.hypot(x - a, y - b)
        k = int(np.argmax(away))
        if away[k] > within:
            kept.add(begin + 1 + k)
            waiting += [(begin, begin + 1 + k), (begin + 1 + k, end)]
    return np.array(sorted(kept))

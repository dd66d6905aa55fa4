"""The data of charts as a page carries them: binary arrays behind a header, compressed, as page/src/packed.ts reads them."""

import base64
import gzip
import json
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from .figure_style import INK, PALETTE, STEPS
from .panels import Chart, Contacts, Curve, Flows, Mark, Panel
from .thinning import thinned

NAMES = {colour: name for name, colour in PALETTE.items()} | {c: f"step{k}" for k, c in enumerate(STEPS[:-1])}
NAMES |= {INK: "text"}
DASHES: Mapping[str, list[float]] = {"-": [], "--": [7, 3], "-.": [7, 3, 2, 3], ":": [2, 3]}


def dashes(line: Any) -> list[float]:
    """Lengths of strokes and gaps of a line style."""
    return [2.0 * length for length in line[1]] if isinstance(line, tuple) else list(DASHES.get(line, []))


def colour_name(style: Mapping[str, Any]) -> str:
    """The name of a colour in the style sheet; others are muted."""
    return NAMES.get(str(style["color"]), "muted")


class Packed:
    """Collects arrays, each distinct one once."""

    def __init__(self) -> None:
        self.arrays: list[np.ndarray] = []
        self.places: dict[bytes, int] = {}

    def add(self, values: Any) -> int:
        """Index of an array."""
        array = np.ascontiguousarray(values, dtype="<f8")
        key = array.tobytes()
        if key not in self.places:
            self.places[key] = len(self.arrays)
            self.arrays.append(array)
        return self.places[key]

    def text(self, charts: Iterable[dict[str, Any]]) -> str:
        """Header and arrays, gzip in base64.

        The bytes of an array stand by their places in a number, all first ones first: neighbours then resemble each other, and
        what is smooth takes a third less.
        """
        header = {"charts": list(charts), "lengths": [len(array) for array in self.arrays]}
        told = json.dumps(header, ensure_ascii=False, allow_nan=False).encode()
        shuffled = [array.view(np.uint8).reshape(-1, 8).T.tobytes() for array in self.arrays]
        whole = b"".join([len(told).to_bytes(4, "little"), told, *shuffled])
        return base64.b64encode(gzip.compress(whole, 6, mtime=0)).decode()


def packed(charts: Iterable[Chart]) -> str:
    """The data of charts, in their order."""
    pack = Packed()
    return pack.text([_described(chart, pack) for chart in charts])


def _described(chart: Chart, pack: Packed) -> dict[str, Any]:
    if isinstance(chart, Panel):
        return _panel(chart, pack)
    if isinstance(chart, Contacts):
        rows = [{"label": label, "modes": pack.add(modes)} for label, modes in chart.modes.items()]
        return {"kind": "contacts", "rows": rows, "duration": float(chart.time[-1] - chart.time[0])}
    if isinstance(chart, Flows):
        return {"kind": "flows", "energies": dict(chart.energies)}
    return {"kind": "still"}  # the document contains the whole file


def _panel(panel: Panel, pack: Packed) -> dict[str, Any]:
    def axis(label: str, logarithmic: bool, limits: tuple[float, float] | None) -> dict[str, Any]:
        found: dict[str, Any] = {"label": label, "unit": "", "logarithmic": logarithmic}
        return found if limits is None else found | {"range": [float(limit) for limit in limits]}

    positive = any(np.any(np.asarray(curve.y) > 0.0) for curve in panel.curves) or panel.ground is not None
    out: dict[str, Any] = {
        "kind": "lines",
        "x": axis(panel.x_label, panel.log_x, panel.x_range)
        | ({"names": panel.x_names} if panel.x_names else {})
        | ({"whole": True} if panel.whole_x else {}),
        "y": axis(panel.y_label, panel.log_y and positive, panel.y_range),
        "lines": [_curve(curve, pack, panel.max_points) for curve in panel.curves],
        "spans": [[float(low), float(high)] for low, high in panel.shaded],
        "marks": [_mark(mark) for mark in panel.marks if np.isfinite(mark.x) and np.isfinite(mark.y)],
    }
    if panel.level is not None:
        out["level"] = panel.level
    if (ground := panel.ground) is not None:
        values = np.asarray(ground.values, float)
        grid = {
            "x": pack.add(ground.x),
            "y": pack.add(ground.y),
            "values": pack.add(values.ravel()),
            "label": ground.label,
        }
        out["ground"] = grid
        out["contours"] = [
            {"text": c.text, "x": pack.add(c.x), "y": pack.add(c.y), "label": list(c.label)} for c in panel.contours()
        ]
    return out


def _curve(curve: Curve, pack: Packed, max_points: int) -> dict[str, Any]:
    x, y = (curve.x, curve.y) if curve.names else thinned(curve.x, curve.y, max_points)
    style = curve.style
    line = style.get("linestyle", "-")
    out = {
        "label": curve.label,
        "x": pack.add(x),
        "y": pack.add(y),
        "colour": colour_name(style),
        "width": style.get("linewidth", 1.5) if line not in ("none", "") else 0,
        "dash": dashes(line),
        "faint": style.get("alpha", 1.0) < 1.0,
    }
    if style.get("marker"):
        out["points"] = 0.5 * style.get("markersize", 5.0)
    return out | ({"names": curve.names} if curve.names else {}) | ({"numbered": True} if curve.numbered else {})


def _mark(mark: Mark) -> dict[str, Any]:
    found: dict[str, Any] = {
        "x": float(mark.x),
        "y": float(mark.y),
        "text": mark.text,
        "colour": colour_name(mark.style),
    }
    return found | ({} if mark.to is None else {"to": float(mark.to)})

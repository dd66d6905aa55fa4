"""The catalogue as text: a list, one record with sources and gaps, a template for one's own."""

from __future__ import annotations

import difflib
from importlib.resources import files
from pathlib import Path

import numpy as np

from .data_sheet import GearboxSheet, MotorSheet
from .errors import InputError
from .records import catalogue, find, read_sheets
from .rig_sheet import rows_of


def _range(text: str | None, option: str) -> tuple[float, float]:
    """Bounds from ``MIN..MAX``; each may be left out."""
    if text is None:
        return -np.inf, np.inf
    low, dots, high = text.partition("..")
    try:
        if not dots:
            return float(low), float(low)
        return float(low or "-inf"), float(high or "inf")
    except ValueError:
        raise InputError(f"--{option} {text}: must be MIN..MAX, such as --{option} 50..120") from None


def list_records(kind: str | None = None, ratio: str | None = None, torque: str | None = None) -> str:
    """The records that fit, a line each; a dash marks those that lack what a run needs.

    Raises
    ------
    InputError
        Unknown kind, or a range that is none.
    """
    kinds = sorted({"motor", *(r.kind for r in catalogue() if isinstance(r, GearboxSheet))})
    if kind is not None and kind not in kinds:
        raise InputError(f"--kind {kind}: must be one of {', '.join(kinds)}")
    ratios, torques = _range(ratio, "ratio"), _range(torque, "torque")
    lines = [f"{'name':<34} {'kind':<12} {'ratio':>8} {'rated N·m':>9} {'rpm':>6}  runs"]
    for r in catalogue():
        what = r.kind if isinstance(r, GearboxSheet) else "motor"
        if kind is not None and what != kind:
            continue
        own_ratio = r.ratio if isinstance(r, GearboxSheet) else None
        own_torque = r.rated_output_torque if isinstance(r, GearboxSheet) else r.rated_torque
        speed = r.rated_input_speed if isinstance(r, GearboxSheet) else r.rated_speed
        if ratio is not None and (own_ratio is None or not ratios[0] <= own_ratio <= ratios[1]):
            continue
        if torque is not None and (own_torque is None or not torques[0] <= own_torque <= torques[1]):
            continue
        cells = [
            f"{own_ratio:8.4g}" if own_ratio else " " * 8,
            f"{own_torque:9.4g}" if own_torque else "        ?",
            f"{speed * 30.0 / np.pi:6.0f}" if speed else "     ?",
        ]
        missing = ", ".join(r.missing())
        lines.append(f"{r.name:<34} {what:<12} {' '.join(cells)}  {'yes' if not missing else 'lacks ' + missing}")
    if len(lines) == 1:
        return "No record fits."
    return "\n".join([*lines, f"{len(lines) - 1} records; `lostmotion catalogue NAME` shows one"])


def record_text(name: str) -> str:
    """One record: figures with the status of their source, sources, gaps.

    Raises
    ------
    InputError
        There is no such record.
    """
    kinds = {r.name: "gearbox" if isinstance(r, GearboxSheet) else "motor" for r in catalogue()}
    if not name.endswith(".toml") and name not in kinds:
        near = difflib.get_close_matches(name, kinds, n=3, cutoff=0.5)
        hint = f"did you mean {' or '.join(near)}?" if near else "`lostmotion catalogue` lists them"
        raise InputError(f"{name!r} is not in the catalogue; {hint}")
    table = kinds.get(name) or ("gearbox" if isinstance(read_sheets(Path(name))[0], GearboxSheet) else "motor")
    record = find(name, table)
    rows = rows_of(record)
    lines = [f"{record.name}: {record.maker} {record.title}".strip(), ""]
    lines += [f"  {what:<52} {value:<26} {status}" for what, value, status in rows]
    if isinstance(record, MotorSheet) and not record.missing() and record.no_load_speed is not None:
        rpm = 30.0 / np.pi
        lines += [
            "",
            f"  The model keeps rated point and stall torque; its no-load speed is {rpm * record.no_load_speed_of_model():.0f} rpm, "
            f"the sheet's {rpm * record.no_load_speed:.0f} rpm.",
        ]
    lines += ["", "Sources"]
    lines += [f"  {s.status}: {s.text} [{', '.join(s.figures)}]" for s in record.sources]
    if record.gaps:
        lines += ["", "Gaps"]
        lines += [f"  {g.figure}: {g.where}" for g in record.gaps]
    missing = record.missing()
    lines += ["", "Complete enough to run." if not missing else f"A run also needs: {', '.join(missing)}."]
    lines += [f"Note: {record.note}"] if record.note else []
    return "\n".join(lines)


def template() -> str:
    """A commented sheet file for a gearbox and a motor."""
    return files("lostmotion").joinpath("sheet-template.toml").read_text(encoding="utf-8")

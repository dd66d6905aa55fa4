"""The catalogue as text: a list, one record with sources and gaps, a template for your own."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import get_args

import numpy as np

from ..data_sheets.gearbox_sheet import GearboxSheet
from ..data_sheets.motor_sheet import MotorSheet
from ..data_sheets.records import catalogue, find, read_sheets
from ..errors import InputError
from ..inputs.validation import names_like
from ..units.conversion import si_value
from ..units.practical import RPM
from .sheet_rows import rows_of


def _range(text: str | None, option: str, unit: str = "") -> tuple[float, float]:
    """Bounds from ``MIN..MAX``; each may be left out."""
    if text is None:
        return -np.inf, np.inf
    low, dots, high = text.partition("..")
    problem = f"--{option} {text}: must be MIN..MAX, such as --{option} 50..120"
    try:
        ends = (si_value(low, unit) if low else -np.inf, si_value(high, unit) if high else np.inf)
    except ValueError as error:
        raise InputError(f"{problem}; it {error}") from None
    if not dots:
        if not low:
            raise InputError(problem)
        return ends[0], ends[0]
    if ends[0] > ends[1]:
        raise InputError(f"--{option} {text}: is reversed; write {high.strip()}..{low.strip()}")
    return ends


def list_records(
    kind: str | None = None, ratio: str | None = None, torque: str | None = None, complete: bool = False
) -> str:
    """The records that fit, a line each, with what they lack for a simulation.

    Parameters
    ----------
    kind
        ``"gearbox"``, ``"motor"``, or a kind of either, such as ``"worm"``.
    ratio, torque
        ``MIN..MAX``; torque is the rated one [N·m].
    complete
        Only records that lack nothing.

    Raises
    ------
    InputError
        Unknown kind, or a range that is none.
    """
    records = catalogue()
    kinds = sorted({_table(r) for r in records}) + sorted({r.kind for r in records})
    if kind is not None and kind not in kinds:
        raise InputError(f"--kind {kind}: must be one of {', '.join(kinds)}")
    ratios, torques = _range(ratio, "ratio"), _range(torque, "torque", "N*m")
    found: list[GearboxSheet | MotorSheet] = []
    for r in records:
        own_ratio = r.ratio if isinstance(r, GearboxSheet) else None
        own_torque = _rated_torque(r)
        fits = kind in (None, _table(r), r.kind) and not (complete and r.missing())
        fits = fits and (ratio is None or (own_ratio is not None and ratios[0] <= own_ratio <= ratios[1]))
        if fits and (torque is None or (own_torque is not None and torques[0] <= own_torque <= torques[1])):
            found.append(r)
    if not found:
        return "No record fits."
    head = f"{'name':<34} {'type':<8} {'kind':<12} {'ratio':>8} {'rated N·m':>9} {'rpm':>6}  complete"
    return "\n".join([head, *map(_line, found), _counts(found), "`lostmotion catalogue NAME` shows one."])


def _table(record: GearboxSheet | MotorSheet) -> str:
    return "gearbox" if isinstance(record, GearboxSheet) else "motor"


def _rated_torque(record: GearboxSheet | MotorSheet) -> float | None:
    return record.rated_output_torque if isinstance(record, GearboxSheet) else record.rated_torque


def _line(record: GearboxSheet | MotorSheet) -> str:
    ratio = f"{record.ratio:8.4g}" if isinstance(record, GearboxSheet) else " " * 8
    torque = _rated_torque(record)
    speed = record.rated_input_speed if isinstance(record, GearboxSheet) else record.rated_speed
    rated = f"{torque:9.4g}" if torque else "        ?"
    rpm = f"{RPM * speed:6.0f}" if speed else "     ?"
    missing = ", ".join(record.missing())
    state = "yes" if not missing else f"no, lacks {missing}"
    return f"{record.name:<34} {_table(record):<8} {record.kind:<12} {ratio} {rated} {rpm}  {state}"


def _counts(records: list[GearboxSheet | MotorSheet]) -> str:
    parts = []
    for table, plural in (("gearbox", "gearboxes"), ("motor", "motors")):
        of_it = [r for r in records if _table(r) == table]
        if of_it:
            whole = sum(not r.missing() for r in of_it)
            parts.append(f"{len(of_it)} {plural if len(of_it) > 1 else table}, {whole} of them complete")
    return f"{len(records)} record{'s' if len(records) > 1 else ''}: {'; '.join(parts)}."


def record_text(name: str) -> str:
    """One record: data with the status of their source, sources, gaps.

    Raises
    ------
    InputError
        There is no such record.
    """
    kinds = {r.name: _table(r) for r in catalogue()}
    if not name.endswith(".toml") and name not in kinds:
        hint = names_like(name, kinds, "`lostmotion catalogue` lists them")
        raise InputError(f"{name!r} is not in the catalogue; {hint}")
    table = kinds.get(name) or _table(read_sheets(Path(name))[0])
    record = find(name, table)
    rows = rows_of(record)
    lines = [f"{record.name}: {table}, {record.manufacturer} {record.title}".strip(), ""]
    lines += [f"  {what:<52} {value:<26} {status}" for what, value, status in rows]
    if isinstance(record, MotorSheet) and not record.missing() and record.no_load_speed is not None:
        lines += [
            "",
            f"  The model keeps rated point and stall torque; its no-load speed is {RPM * record.no_load_speed_of_model():.0f} rpm, "
            f"the sheet's {RPM * record.no_load_speed:.0f} rpm.",
        ]
    lines += ["", "Sources"]
    lines += [f"  {s.status}: {s.text} [{', '.join(s.data)}]" for s in record.sources]
    if record.gaps:
        lines += ["", "Gaps"]
        lines += [f"  {g.datum}: {g.where}" for g in record.gaps]
    missing = record.missing()
    lines += [
        "",
        "Complete: it can be simulated."
        if not missing
        else f"Not complete: a simulation also needs {', '.join(missing)}.",
    ]
    lines += [f"Note: {record.note}"] if record.note else []
    return "\n".join(lines)


def template(kind: str | None = None) -> str:
    """A commented sheet file for a gearbox, or with the kind ``"motor"`` for a motor.

    Raises
    ------
    InputError
        Unknown kind.
    """
    gearboxes, motors = (_kinds(sheet) for sheet in (GearboxSheet, MotorSheet))
    if kind is not None and kind not in ("gearbox", "motor", *gearboxes, *motors):
        raise InputError(f"--kind {kind}: must be one of gearbox, motor, {', '.join((*gearboxes, *motors))}")
    table = "motor" if kind == "motor" or kind in motors else "gearbox"
    name = "synchronous-motor" if kind == "synchronous" else table
    text = files("lostmotion").joinpath(f"data_sheets/{name}-template.toml").read_text(encoding="utf-8")
    if kind in (None, "gearbox", "motor", "synchronous"):
        return text
    default = "planetary" if table == "gearbox" else "brushless"
    return text.replace(f'kind = "{default}"', f'kind = "{kind}"')


def _kinds(sheet: type[GearboxSheet] | type[MotorSheet]) -> tuple[str, ...]:
    return get_args(sheet.model_fields["kind"].annotation)

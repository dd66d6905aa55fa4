"""The catalogue as text: a list, one record with sources and gaps, a template for your own."""

from __future__ import annotations

import re
from collections import Counter
from importlib.resources import files
from pathlib import Path
from typing import Any, get_args

import numpy as np

from ..data_sheets.accessory_sheets import AmplifierSheet, BrakeSheet
from ..data_sheets.actuator_sheet import ActuatorSheet
from ..data_sheets.gearbox_sheet import GearboxSheet
from ..data_sheets.linear_sheets import BeltSheet, LinearMotorSheet, LinearSheet, RackSheet, ScrewSheet
from ..data_sheets.motor_sheet import MotorSheet
from ..data_sheets.records import KINDS, Sheet, catalogue, find, read_sheets, table_of
from ..errors import InputError
from ..inputs.refusal_messages import did_you_mean, names_like
from ..inputs.toml_files import is_in_file
from ..units.conversion import si_value
from ..units.practical import RPM
from .data_sheet_rows import rows_of

SCREEN = 34  # records that fit on a screen with the lines around them
QUANTITIES: dict[str, tuple[str, str, float, tuple[tuple[Any, tuple[str, ...]], ...]]] = {
    "ratio": ("", "", 1.0, ((GearboxSheet | ActuatorSheet, ("ratio",)),)),
    "lead": ("m", " mm", 1e3, ((ScrewSheet, ("lead",)),)),
    "torque": (
        "N*m",
        " N·m",
        1.0,
        (
            (GearboxSheet | ActuatorSheet, ("rated_output_torque",)),
            (BrakeSheet, ("holding_torque",)),
            (MotorSheet, ("rated_torque", "holding_torque")),
        ),
    ),
    "force": (
        "N",
        " N",
        1.0,
        ((ScrewSheet, ("dynamic_capacity",)), (RackSheet | BeltSheet | LinearMotorSheet, ("rated_force",))),
    ),
    "current": ("A", " A", 1.0, ((AmplifierSheet, ("continuous_current",)),)),
}
"""unit, unit that is shown and factor to it, keys of the records that have it; of an amplifier [A rms]"""


def _range(text: str | None, option: str, unit: str = "") -> tuple[float, float]:
    """Bounds from ``MIN..MAX``, where either may be left out, or from ``MIN-MAX``."""
    if text is None:
        return -np.inf, np.inf
    if (dash := re.fullmatch(r"(.*[^eE\s])\s*[-–]\s*([\d.].*)", text)) and ".." not in text:
        text = "..".join(dash.groups())
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
    kind: str | None = None,
    ratio: str | None = None,
    torque: str | None = None,
    complete: bool = False,
    force: str | None = None,
    lead: str | None = None,
    every: bool = True,
    current: str | None = None,
) -> str:
    """The records that fit, a line each, with what they lack for a simulation.

    kind: a table of records, such as ``"gearbox"`` or ``"screw"``, or a kind within one, such as ``"worm"``.
    ratio, torque, force, lead, current: ``MIN..MAX``; torque and force are the rated ones [N·m, N], of a screw the
        dynamic capacity, of a brake the holding torque. The current is the continuous one of an amplifier [A].
    complete: only records that lack nothing.
    every: all of them, or as many as a screen shows.

    Raises InputError: unknown kind, or a range that is none.
    """
    records = catalogue()
    kinds = [*KINDS, *sorted({r.kind for r in records})]
    if kind is not None and kind not in kinds:
        raise InputError(f"--kind {kind}: is not known; {did_you_mean(kind, kinds, 'take one of ' + ', '.join(kinds))}")
    given = {"ratio": ratio, "torque": torque, "force": force, "lead": lead, "current": current}
    bounds = {what: _range(text, what, QUANTITIES[what][0]) for what, text in given.items() if text is not None}
    found = [
        r
        for r in records
        if kind in (None, table_of(r), r.kind)
        and not (complete and r.missing())
        and all((x := _datum(r, what)) is not None and low <= x <= high for what, (low, high) in bounds.items())
    ]
    if not found:
        return "No record fits."
    head = f"{'name':<34} {'type':<12} {'kind':<12} {'ratio, lead':>11} {'rated':>10} {'rpm':>6}  runs as"
    shown = found if every or len(found) <= SCREEN else found[:SCREEN]
    more = [f"{len(found) - len(shown)} more: add --all, or narrow the list"] if len(shown) < len(found) else []
    return "\n".join([head, *map(_line, shown), *more, _counts(found), f"Next: lostmotion catalogue {shown[0].name}"])


def summary() -> str:
    """Number of records of each kind, their levels, and the range of their ratings."""
    rows = []
    of_kind: dict[tuple[str, str], list[Sheet]] = {}
    for record in catalogue():
        of_kind.setdefault((table_of(record), record.kind), []).append(record)
    for (table, kind), records in of_kind.items():
        levels = Counter(level for r in records if (level := r.level()) is not None)
        runs = ", ".join(f"{number} {level}" for level, number in levels.items()) or "none"
        spans = [_span(records, quantity) for quantity in QUANTITIES]
        rows.append(f"{table:<13} {kind:<12} {len(records):>7}  {'; '.join(filter(None, spans)):<40} {runs}")
    head = f"{'type':<13} {'kind':<12} {'records':>7}  {'ratio or lead; rated':<40} run as"
    return "\n".join([head, *rows, _counts(list(catalogue())), "Next: lostmotion catalogue --kind planetary"])


def _span(records: list[Sheet], quantity: str) -> str:
    _, unit, factor, _ = QUANTITIES[quantity]
    found = [factor * x for r in records if (x := _datum(r, quantity))]
    return f"{min(found):.4g} to {max(found):.4g}{unit}" if found else ""


def _datum(record: Sheet, quantity: str) -> float | None:
    """A quantity of a record [SI]; None of a record that has no such quantity, or lacks it."""
    if quantity == "lead" and isinstance(record, ScrewSheet) and record.lead is None:
        return (record.pitch or 0.0) * (record.starts or 0) or None
    keys = next((keys for kind, keys in QUANTITIES[quantity][3] if isinstance(record, kind)), ())
    return next((x for key in keys if (x := getattr(record, key)) is not None), None)


def _line(record: Sheet) -> str:
    ratio, lead, torque, force, current = (_datum(record, quantity) for quantity in QUANTITIES)
    speed = None
    if isinstance(record, GearboxSheet):
        speed = record.rated_input_speed
    elif isinstance(record, MotorSheet):
        speed = record.rated_speed
    first = f"{ratio:.4g}" if ratio else f"{1e3 * lead:.4g} mm" if lead else ""
    rated = f"{torque:.4g} N·m" if torque else f"{force:.4g} N" if force else f"{current:.4g} A rms" if current else "?"
    turns = isinstance(record, GearboxSheet | MotorSheet) and record.kind != "stepper"
    rpm = f"{RPM * speed:.0f}" if speed else "?" if turns else ""
    missing = ", ".join(record.missing())
    state = record.level() or f"lacks {missing}"
    return f"{record.name:<34} {table_of(record):<12} {record.kind:<12} {first:>11} {rated:>10} {rpm:>6}  {state}"


def _counts(records: list[Sheet]) -> str:
    parts = []
    for table in KINDS:
        of_it = [r for r in records if table_of(r) == table]
        if of_it:
            whole = sum(not r.missing() for r in of_it)
            one = table.replace("_", " ")
            many = "gearboxes" if table == "gearbox" else f"{one}s"
            named = f"{len(of_it)} {many if len(of_it) > 1 else one}"
            parts.append(named if table in ("brake", "amplifier") else f"{named}, {whole} of them run")
    return f"{len(records)} record{'s' if len(records) > 1 else ''}: {'; '.join(parts)}."


def _table_in_file(reference: str) -> str:
    """The table of the record that a reference to a file means, or of its first one."""
    file, _, name = reference.partition("#")
    records = read_sheets(Path(file))
    return next((table_of(r) for r in records if r.name == name.lower()), table_of(records[0]))


def record_text(name: str) -> str:
    """One record: data with the status of their source, sources, gaps. Raises InputError: there is no such record."""
    kinds = {r.name: table_of(r) for r in catalogue()}
    if not is_in_file(name) and name not in kinds:
        hint = names_like(name, kinds, "`lostmotion catalogue` lists them")
        raise InputError(f"{name!r} is not in the catalogue; {hint}")
    table = kinds.get(name) or _table_in_file(name)
    record = find(name, table)
    rows = rows_of(record)
    lines = [f"{record.name}: {table.replace('_', ' ')}, {record.manufacturer} {record.title}".strip(), ""]
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
        "The rules have all data that they need."
        if not missing and table in ("brake", "amplifier")
        else f"It can be simulated: {record.level()}."
        if not missing
        else f"Not complete: a simulation also needs {', '.join(missing)}.",
        *record.assumptions(),
    ]
    if isinstance(record, LinearSheet) and (choices := record.open_choices(record.values())):
        beside = " and ".join(f"{key} ({text})" for key, text in choices.items())
        lines.append(f"Beside `from` a scenario gives {beside}.")
    lines += [f"Note: {record.note!s}"] if record.note else []
    if table in ("gearbox", "screw") and not missing:
        lines.append(f"Measure it: lostmotion rig {name}")
    else:
        lines.append(f"Others of its kind: lostmotion catalogue --kind {record.kind}")
    return "\n".join(lines)


def template(kind: str | None = None) -> str:
    """A commented sheet file to fill in, for a gearbox if nothing else is said.

    kind: a table of records, such as ``"motor"`` or ``"screw"``, or a kind within one, such as ``"worm"``.

    Raises InputError: unknown kind.
    """
    of_kind = {inner: table for table, sheet in KINDS.items() for inner in _kinds(sheet)}
    if kind is not None and kind not in (*KINDS, *of_kind):
        known = (*KINDS, *of_kind)
        raise InputError(f"--kind {kind}: is not known; {did_you_mean(kind, known, 'take one of ' + ', '.join(known))}")
    table = "gearbox" if kind is None else of_kind.get(kind, kind)
    name = kind if kind in TEMPLATES else table
    text = files("lostmotion").joinpath(f"data_sheets/{TEMPLATES[name]}-template.toml").read_text(encoding="utf-8")
    if kind not in of_kind:
        return text
    return re.sub(r'^kind = "\w+"', f'kind = "{kind}"', text, count=1, flags=re.MULTILINE)


# The files with the templates, by tables of records and kinds with one of their own.
TEMPLATES = {table: table.replace("_", "-") for table in KINDS} | {
    kind: f"{kind}-motor" for kind in ("synchronous", "stepper")
}


def _kinds(sheet: type[Sheet]) -> tuple[str, ...]:
    return get_args(sheet.model_fields["kind"].annotation)

"""The answer as files that are loadable everywhere: the identified rig as a scenario, and its gear as a data sheet."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from ..data_sheets.gearbox_sheet import GearboxSheet
from ..data_sheets.sheet import Source
from ..model.gear import Gear
from ..model.losses import ConstantEfficiency, LossMap, MeshEfficiency, WormMesh, efficiency_map
from ..model.torsion import LinearStiffness, TorsionCurve
from ..simulation.train_scenario import TrainScenario

RIGID = "The logs were compared with a rig whose gear is rigid, so that they say nothing of its stiffness: this record makes a rigid gearbox."


def toml_text(tables: Mapping[str, Any], comment: str = "") -> str:
    """Nested tables as a TOML file; what is None is left out.

    Parameters
    ----------
    comment
        Lines above it.
    """
    lines = [f"# {line}".rstrip() for line in comment.splitlines()]
    plain = {k: v for k, v in tables.items() if not isinstance(v, Mapping) and v is not None}
    lines += [f"{_key(k)} = {_value(v)}" for k, v in plain.items()]
    _write(tables, (), lines)
    return "\n".join(lines).strip() + "\n"


def _write(tables: Mapping[str, Any], where: tuple[str, ...], lines: list[str]) -> None:
    for name, value in tables.items():
        if not isinstance(value, Mapping) or not value:
            continue
        path = (*where, name)
        plain = {k: v for k, v in value.items() if v is not None and not isinstance(v, Mapping)}
        if plain:
            lines += ["", f"[{'.'.join(map(_key, path))}]", *(f"{_key(k)} = {_value(v)}" for k, v in plain.items())]
        _write(value, path, lines)


def _key(name: str) -> str:
    return name if name.replace("_", "").replace("-", "").isalnum() and name.isascii() else json.dumps(name)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items() if v is not None) + " }"
    return "[" + ", ".join(map(_value, value)) + "]"


def scenario_text(scenario: TrainScenario, comment: str) -> str:
    """A scenario as a TOML file that `load` reads."""
    return toml_text(_without_empty(scenario.model_dump(exclude_none=True)), comment)


def _without_empty(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Without lists and tables that are empty."""
    found = {k: _without_empty(v) if isinstance(v, Mapping) else v for k, v in tables.items()}
    return {k: v for k, v in found.items() if not (isinstance(v, Mapping | list | tuple | str) and not v)}


def gear_sheet(gear: Gear, name: str, title: str, source: str) -> GearboxSheet:
    """A gear as a data sheet with the status "identified".

    Parameters
    ----------
    name
        Of the record: lower-case letters, digits, dots and dashes.
    source
        What it was identified from.
    """
    data: dict[str, Any] = {
        "ratio": gear.ratio,
        "rated_output_torque": gear.rated_output_torque,
        "rated_input_speed": gear.rated_input_speed,
    }
    data["inertia"] = gear.inertia
    if gear.viscous_friction > 0.0:
        data["viscous_friction"] = gear.viscous_friction
    if gear.hysteresis is not None:
        data["hysteresis_efficiency"] = gear.hysteresis.efficiency
    if isinstance(gear.stiffness, LinearStiffness):
        data["stiffness"] = {"slopes": [gear.stiffness.stiffness]}
    elif isinstance(gear.stiffness, TorsionCurve):
        data |= _of_curve(gear.stiffness)
    else:
        data["rigid"] = True
    losses = gear.losses
    if isinstance(losses, ConstantEfficiency) and losses.efficiency == 1.0:
        losses = efficiency_map(1.0, 1.0)
    if isinstance(losses, MeshEfficiency | WormMesh):
        losses = efficiency_map(*losses.efficiencies())
    if isinstance(losses, LossMap):
        data["losses"] = {"table": losses.model_dump()}
    given = {key: value for key, value in data.items() if value is not None}
    sources = (Source(data=tuple(sorted(given)), status="identified", text=source),)
    note = RIGID if "rigid" in given else ""
    return GearboxSheet(kind="other", name=name, title=title, note=note, sources=sources, **given)


def sheet_text(sheet: GearboxSheet) -> str:
    """A data sheet as a TOML file that `gearbox` reads."""
    data = _without_empty(sheet.model_dump(exclude_none=True))
    sources = data.pop("sources", ())
    return toml_text({"source": sources, "gearbox": [data]})


def _of_curve(curve: TorsionCurve) -> dict[str, Any]:
    """Backlash and stiffness pieces of a torsion curve."""
    breaks, slopes = map(list, curve.pieces())
    found: dict[str, Any] = {}
    if slopes and slopes[0] == 0.0 and breaks:
        found["backlash"] = 2.0 * breaks[0]
        breaks, slopes = [b - breaks[0] for b in breaks[1:]], slopes[1:]
    torques, torque, last = [], 0.0, 0.0
    for b, k in zip(breaks, slopes, strict=False):
        torque += k * (b - last)
        last = b
        torques.append(torque)
    return {**found, "stiffness": {"slopes": slopes, **({"torques": torques} if torques else {})}}

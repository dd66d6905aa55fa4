"""The answer as files that are loadable everywhere: the identified rig as a scenario, and its gear as a data sheet."""

from typing import Any

from ..data_sheets.gearbox_sheet import GearboxSheet
from ..data_sheets.sheet import Source
from ..inputs.toml_text import toml_text, without_empty
from ..model.gear import Gear
from ..model.losses import ConstantEfficiency, LossMap, MeshEfficiency, WormMesh, efficiency_map
from ..model.torsion import LinearStiffness, TorsionCurve

RIGID = "The logs were compared with a rig whose gear is rigid, so that they say nothing of its stiffness: this record makes a rigid gearbox."


def gear_sheet(gear: Gear, name: str, title: str, source: str) -> GearboxSheet:
    """A gear as a data sheet with the status "identified".

    name: of the record: lower-case letters, digits, dots and dashes.
    source: what it was identified from.
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
    note = {"stiffness": RIGID} if "rigid" in given else ""
    return GearboxSheet(kind="other", name=name, title=title, note=note, sources=sources, **given)


def sheet_text(sheet: GearboxSheet) -> str:
    """A data sheet as a TOML file that `gearbox` reads."""
    data = without_empty(sheet.model_dump(exclude_none=True))
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

"""The data of a data sheet as rows of text, in the units that data sheets use."""

from typing import Any

from ..data_sheets.accessory_sheets import AmplifierSheet
from ..data_sheets.actuator_sheet import ActuatorSheet
from ..data_sheets.gearbox_sheet import GearboxSheet, StiffnessData
from ..data_sheets.linear_sheets import LinearMotorSheet
from ..data_sheets.sheet import WORDS, Record
from ..inputs.part import Part
from ..inputs.schema import unit_in_schema
from ..model.gearbox import Gearbox
from ..units.practical import practical


def rows_of(record: Record) -> list[tuple[str, str, str]]:
    """(quantity, value, status of its source) of all data of a record."""
    fields = type(record).model_json_schema()["properties"]
    out: list[tuple[str, str, str]] = []
    effective = isinstance(record, AmplifierSheet | ActuatorSheet) or (
        isinstance(record, LinearMotorSheet) and record.kind != "voice_coil"
    )

    def add(key: str, label: str, text: str) -> None:
        source = record.source_of(key)
        out.append((label, text, source.status if source else "own value"))

    for name in type(record).model_fields:
        value = getattr(record, name)
        if name in WORDS or name == "kind" or value in (None, False) or name not in record.model_fields_set:
            continue
        label = name.replace("_", " ")
        if isinstance(value, StiffnessData):
            for k, slope in enumerate(value.slopes):
                upto = f" up to {value.torques[k]:g} N·m" if k < len(value.torques) else ""
                add(name, f"torsional stiffness K{k + 1}{upto}", f"{slope:.5g} N·m/rad")
            if value.scatter:
                add(name, "scatter of the stiffness", f"±{100 * value.scatter:.0f} %")
        elif name == "rigid":
            add(name, "torsional stiffness", "rigid: no twist")
        elif name == "losses" and isinstance(record, GearboxSheet):
            _add_losses(value, add)
        elif isinstance(value, tuple) and all(isinstance(x, str) for x in value):
            add(name, label, ", ".join(value))
        elif isinstance(value, Part):
            units = type(value).model_json_schema()["properties"]
            for key in type(value).model_fields:
                if (datum := getattr(value, key)) is not None and key in value.model_fields_set:
                    add(f"{name}.{key}", key.replace("_", " "), practical(datum, unit_in_schema(units[key]) or ""))
        else:
            unit = unit_in_schema(fields[name]) or ""
            add(name, label, practical(value, unit) + (" rms" if unit.endswith("A") and effective else ""))
    return out


def _add_losses(losses: Any, add: Any) -> None:
    for key in ("efficiency", "backdrive_efficiency"):
        for p in getattr(losses, key):
            where = f"{key.replace('_', ' ')} at {practical(p.input_speed, 'rad/s')}, load {p.load:g}"
            add(f"losses.{key}", where, f"{p.efficiency:g}")
    for q in losses.no_load_torque:
        at = f"no-load torque at {practical(q.input_speed, 'rad/s')}" + (
            f", {q.temperature:g} °C" if q.temperature is not None else ""
        )
        add("losses.no_load_torque", at, f"{q.torque:g} N·m")
    for load, factor in losses.load_correction:
        add("losses.load_correction", f"load correction at load {load:g}", f"{factor:g}")
    for key, unit in (("starting_torque", "N·m"), ("backdriving_torque", "N·m"), ("static_efficiency", "")):
        value = getattr(losses, key)
        if value is not None:
            add(
                f"losses.{key}",
                key.replace("_", " ").replace("backdriving", "back-driving"),
                f"{value:g} {unit}".strip(),
            )
    if losses.table is not None:
        t = losses.table
        add("losses.table", "loss map", f"{len(t.loads)} loads x {len(t.speeds)} speeds")


def rows_of_part(g: Gearbox) -> list[tuple[str, str, str]]:
    """The data of a gearbox that has no sheet."""
    names = (("rated_output_torque", "N*m"), ("rated_input_speed", "rad/s"), ("inertia", "kg*m^2"))
    plain = [(name.replace("_", " "), practical(getattr(g, name), unit), "own value") for name, unit in names]
    return [("ratio", f"{g.ratio:g}", "own value"), *plain]

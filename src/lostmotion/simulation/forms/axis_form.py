"""The short form of a linear axis: motor, gearbox if there is one, screw, rack or belt, and slide, in the table `axis`."""

import json
from collections.abc import Mapping
from copy import deepcopy
from typing import Any

from ...errors import InputError
from ...inputs.refusal_messages import did_you_mean, shown
from ...units.conversion import Unit
from .common_tables import RECORD_NAME
from .drive_tables import drive_schema
from .key_aliases import BRAKE, DRIVES, GEARBOX, MOTOR, SLIDE
from .train_tables import ShaftTable, train_schema

PAYLOAD = "payload"
BESIDE = ("title", "task", "command", "controller", "initial", "simulation")


def long_form(tables: Mapping[str, Any]) -> dict[str, Any]:
    """The same tables in the long form. Raises InputError: a table is missing, or is none of this form."""
    kind = _kind_of(tables)
    table: dict[str, dict[str, Any]] = {
        key: {"from": value} if isinstance(value, str) else dict(value) for key, value in tables["axis"].items()
    }
    shaft = MOTOR
    long: dict[str, Any] = {
        "shafts": {MOTOR: {}},
        "slides": {SLIDE: _carrying(table[SLIDE], table.get(PAYLOAD))},
        "motors": {MOTOR: {"shaft": MOTOR, **table[MOTOR]}},
    }
    if GEARBOX in table:
        shaft = kind
        long["shafts"][shaft] = {}
        gearbox = table[GEARBOX]
        if "from" in gearbox:
            gearbox = {"gearbox": gearbox.pop("from"), **gearbox}
        long["gears"] = {GEARBOX: {"input": MOTOR, "output": shaft, **gearbox}}
    long[DRIVES[kind]] = {kind: {"input": shaft, "output": SLIDE, **table[kind]}}
    for short, in_long in (("controller", "controllers"), ("command", "command")):
        if short in tables:
            long[in_long] = {MOTOR: tables[short]}
    on_slide(long)
    if BRAKE in table:
        if "command" in table[BRAKE]:
            long["command"] = {**long.get("command", {}), BRAKE: table[BRAKE].pop("command")}
        long["brakes"] = {BRAKE: {"shaft": MOTOR, **table[BRAKE]}}
    return {**{key: tables[key] for key in ("title", "task", "initial", "simulation") if key in tables}, **long}


def short_form(long: Mapping[str, Any]) -> dict[str, Any]:
    """The written-out tables of an axis in the long form as its files have them; as they are if they have more than an axis."""
    kind = next(kind for kind, table in DRIVES.items() if long[table])
    joined = {
        MOTOR: ("motors", "shaft"),
        GEARBOX: ("gears", "input", "output"),
        kind: (DRIVES[kind], "input", "output"),
        SLIDE: ("slides",),
        BRAKE: ("brakes", "shaft"),
    }
    axis: dict[str, dict[str, Any]] = {}
    for part, (table, *ends) in joined.items():
        if part in long[table]:
            axis[part] = {key: value for key, value in long[table][part].items() if key not in ends}
    made = {"axis": axis, **{key: long[key] for key in ("title", "task", "initial", "simulation")}}
    for table, key in (("controllers", "controller"), ("command", "command")):
        if MOTOR in long[table]:
            made[key] = long[table][MOTOR]
    if BRAKE in long["command"]:
        axis[BRAKE]["command"] = long["command"][BRAKE]
    known = {*made, "shafts", "controllers", "command", *(table for table, *_ in joined.values())}
    plain = all(shaft == ShaftTable().model_dump(exclude_none=True) for shaft in long["shafts"].values())
    return made if plain and not any(long[table] for table in long.keys() - known) else dict(long)


def _kind_of(tables: Mapping[str, Any]) -> str:
    """Kind of what moves the slide: screw, rack or belt.

    Raises InputError: a table is missing, or is none of this form.
    """
    for key in tables:
        if key not in ("axis", *BESIDE):
            meant = did_you_mean(key, ("axis", *BESIDE), f"beside [axis] there may be {', '.join(BESIDE)}")
            raise InputError(f"is not allowed beside [axis]; {meant}", key)
    axis = tables["axis"]
    parts = (MOTOR, BRAKE, GEARBOX, *DRIVES, SLIDE, PAYLOAD)
    all_parts = f"they are {', '.join(parts)}"
    if not isinstance(axis, Mapping):
        raise InputError(f"{shown(axis)} must be a table with {', '.join(parts)}", "axis")
    for key, value in axis.items():
        if key not in parts:
            raise InputError(f"is no part of an axis; {did_you_mean(key, parts, all_parts)}", f"axis.{key}")
        if not isinstance(value, Mapping | str) or (isinstance(value, str) and key in (BRAKE, SLIDE, PAYLOAD)):
            raise InputError(f"{shown(value)} must be a table", f"axis.{key}")
    given = [kind for kind in DRIVES if kind in axis]
    if len(given) != 1:
        what = (
            f"has {' and '.join(given)}; keep one"
            if given
            else f"lacks what moves the slide; add one of {', '.join(DRIVES)}"
        )
        raise InputError(what, "axis")
    for key in (MOTOR, SLIDE):
        if key not in axis:
            raise InputError("is missing; add it", f"axis.{key}")
    if "controller" in tables and "command" in tables:
        raise InputError("both turn the motor; leave one of them out", "command", "controller")
    return given[0]


def _carrying(slide: dict[str, Any], payload: dict[str, Any] | None) -> dict[str, Any]:
    """The slide with the mass of its payload. Raises InputError: the payload has no mass, or something else."""
    if payload is None:
        return slide
    for key in payload:
        if key != "mass":
            raise InputError("is not known; a payload has its mass", f"axis.{PAYLOAD}.{key}")
    if "mass" not in payload:
        raise InputError("is missing; add it", f"axis.{PAYLOAD}.mass")
    masses = []
    for part, mass in ((SLIDE, slide.get("mass", 0.0)), (PAYLOAD, payload["mass"])):
        try:
            masses.append(Unit("kg").read(mass))
        except ValueError as problem:
            raise InputError(f"{shown(mass)} {problem}", f"axis.{part}.mass") from None
        if not masses[-1] >= 0.0:
            raise InputError(f"{shown(mass)} must be at least 0", f"axis.{part}.mass")
    return {**slide, "mass": sum(masses)}


def on_slide(tables: dict[str, Any]) -> None:
    """Put the position encoder of the axis on the slide, unless the encoder says where it is; the tables are of the long form."""
    given = tables.get("controllers")
    controller = given.get(MOTOR) if isinstance(given, Mapping) else None
    encoder = controller.get("position_encoder") if isinstance(controller, Mapping) else None
    if isinstance(controller, Mapping) and isinstance(encoder, Mapping) and encoder.get("shaft") is None:
        tables["controllers"] = {MOTOR: {**controller, "position_encoder": {**encoder, "shaft": SLIDE}}}


def axis_schema() -> dict[str, Any]:
    """JSON Schema of scenario files in this form, made from the schema of the long form."""
    whole = train_schema()
    definitions = whole["$defs"]

    def part(name: str, *without: str) -> dict[str, Any]:
        own = deepcopy(definitions[name])
        for key in without:
            own["properties"].pop(key, None)
        own["required"] = [key for key in own.get("required", []) if key not in without]
        record = {"properties": {"from": RECORD_NAME}, "required": ["from"], "type": "object"}
        return {"anyOf": [own, record, RECORD_NAME]}

    mass = definitions["SlideTable"]["properties"]["mass"]
    brake = deepcopy(definitions["Brake"])
    del brake["properties"]["shaft"]
    brake["required"].remove("shaft")
    brake["properties"]["command"] = whole["properties"]["command"]["additionalProperties"]
    properties = {
        MOTOR: part("ShaftMotor", "shaft"),
        GEARBOX: part("Gear", "input", "output", "housing"),
        "screw": part("Screw", "input", "output"),
        "rack": part("Rack", "input", "output"),
        "belt": part("Belt", "input", "output"),
        SLIDE: {"$ref": "#/$defs/SlideTable"},
        PAYLOAD: {"type": "object", "properties": {"mass": mass}, "required": ["mass"], "additionalProperties": False},
        BRAKE: brake,
    }
    long = whole["properties"]
    axis = {
        "type": "object",
        "properties": properties,
        "required": [MOTOR, SLIDE],
        "additionalProperties": False,
        "description": "A motor with its brake, a gearbox if there is one, one of screw, rack and belt, and the slide that it moves with its payload.",
    }
    beside = {key: long[key] for key in ("title", "task", "initial", "simulation", "base")}
    beside["command"] = long["command"]["additionalProperties"]
    beside["controller"] = long["controllers"]["additionalProperties"]
    return {
        "title": "Linear axis",
        "type": "object",
        "properties": {"title": beside["title"], "axis": axis, **beside},
        "additionalProperties": False,
        "$defs": definitions,
    }


def file_schema() -> dict[str, Any]:
    """JSON Schema of scenario files in all their forms."""

    def of_train(schema: dict[str, Any]) -> dict[str, Any]:
        renamed: dict[str, Any] = json.loads(json.dumps(schema).replace('"#/$defs/', '"#/$defs/train_'))
        return renamed

    of_drive, long, axis = drive_schema(), of_train(train_schema()), of_train(axis_schema())
    of_drive["properties"]["controller"]["anyOf"].append({"$ref": "#/$defs/train_ContinuousController"})
    axis.pop("$defs")
    definitions = of_drive.pop("$defs") | {f"train_{name}": node for name, node in long.pop("$defs").items()}
    motion = definitions["train_ShaftTable"]["properties"]
    definitions["LoadTable"]["properties"] |= {key: motion[key] for key in ("speed", "motion")}
    return {"title": "Scenario file", "anyOf": [of_drive, long, axis], "$defs": definitions}

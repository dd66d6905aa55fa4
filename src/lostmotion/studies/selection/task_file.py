"""Task files: what an axis has to do, and which motors and gearboxes may do it, read as a study of them."""

from __future__ import annotations

from math import sqrt
from pathlib import Path
from typing import Any

from ...control.controller import AnyCurrent
from ...data_sheets.components import accessories_in, record_in, use_accessories
from ...data_sheets.records import find
from ...errors import InputError, inside
from ...inputs.argument_checks import checked
from ...inputs.quantities import argument
from ...inputs.refusal_messages import shown, unknown_key
from ...inputs.schema import follow, unit_in_schema
from ...inputs.toml_files import read_toml
from ...model.angle_torques import STANDARD_GRAVITY
from ...model.gears_in_series import DIRECT
from ...model.signals import ForceSignal, TorqueSignal
from ...model.slide import Slide
from ...model.task import Task
from ...reproducible import sin
from ...simulation.forms.slide_units import in_si, of_slides
from ...simulation.forms.train_tables import train_schema
from ...simulation.scenario.scenario import Scenario
from ...simulation.scenario.scenario_files import read_series_files, units_of_series
from ...sizing.axis_task.axis_task import AxisTask, InnerLoop, reference_of
from ...sizing.linear_stage_demands import STAGES, stage_of
from ...sizing.whole_drives import BESIDE, LINEAR, WHOLE
from ..study.records_that_vary import kind_of_record, names_that_fit
from ..study.select_table import Selection
from ..study.stepper_candidates import is_stepper
from ..study.study_definition import Study
from ..study.study_files import find_sheets
from ..study.task_keys import with_first

PLAIN = tuple(key for key in Task.model_fields if key not in ("supply", "amplifier", "brake"))
TABLES = (
    "title",
    "task",
    "load",
    "slide",
    *STAGES,
    *WHOLE,
    "controller",
    "motor",
    "gearbox",
    "candidates",
    "vary",
    "select",
)
CANDIDATES = ("gearbox", "motor", *STAGES, *WHOLE)
OBJECTIVES = {"energy": "least", "tracking_error_peak": "least"}
OF_TORQUE_SOURCES = {"mechanical_energy": "least", "tracking_error_peak": "least"}  # whose windings are not known
SLIDE_KEYS = ("mass", "viscous_friction", "friction_force", "friction_coefficient", "inclination", "force")
NO_PAIR = {
    "kind": "torque_source",
    "rotor_inertia": 1.0,
    "rated_torque": 1.0,
}  # in the base of a task without pairs; never run
GAINS = {"position": {"gain": 1.0}, "speed": {"gain": 1.0}}  # which the rule replaces
CONTROLLER = {"sample_time": 125e-6, "encoder": {"lines": 2048}, "current": {"kind": "pi"}}
POSITION = {"sample_time": 1e-3, "feedforward": 1.0}


@checked
def load_task(path: str | Path) -> Study:
    """Read a task file.

    It has the tables of a scenario: `[load]`, `[controller]` with its reference but without gains, `[motor]` and
    `[gearbox]` with keys beside a record. Further tables are `[task]` (`AxisTask`), and `[candidates]` or `[[vary]]`
    and `[select]` of a study. Without the former, motors and gearboxes are taken from the whole catalogue.

    Parameters
    ----------
    path : str or Path
        The task file (TOML).

    Returns
    -------
    Study
        The task, for `select`.

    Raises
    ------
    InputError
        The file cannot be used. The message names the file, the key, the value and the remedy.

    Examples
    --------
    >>> import lostmotion as lm
    >>> type(lm.studies.load_task("examples/select-axis.toml")).__name__
    'Study'
    """
    path = Path(path)
    try:
        tables = read_toml(path, "a task")
        read_series_files(tables, path, _units_on_a_slide if "slide" in tables else units_of_series)
        study = task_of(tables, path.parent)
        assert study.axis is not None
        study.axis.doubt_window(
            reference_of(study.scenario), study.kept_units["rest_error"], f"{path}: key task.settling_window"
        )
        return study
    except InputError as error:
        text = str(error)
        raise error if text.startswith(f"{path}:") else InputError(f"{path}: {text}") from None


def _units_on_a_slide(place: tuple[str, ...]) -> list[str]:
    """SI units of the values of a series at keys of a task with a slide."""
    if place == ("slide", "force", "samples"):
        return ["N"]
    return [of_slides(unit, positions=True, forces=True) for unit in units_of_series(place)]


def task_of(tables: dict[str, Any], directory: Path = Path()) -> Study:
    """The study of the tables of a task file."""
    for key in tables:
        if key not in TABLES:
            raise InputError(unknown_key(key, TABLES), key)
    given = _relative(_with_candidates(tables), directory)
    tables = with_first(given)
    linear = linear_axis(tables)
    for key in ("task", "load" if linear is None else "slide", "controller"):
        if not isinstance(tables.get(key), dict):
            raise InputError(f"must be a table [{key}]; add it", key)
    tables = {**tables, "task": use_accessories(tables["task"])}
    wanted = tables["task"]
    if linear is not None:
        tables = {**tables, **in_translation(tables)}
        wanted = tables["task"] | {"linear": linear}
    with inside("task"):
        task = AxisTask(**wanted)
    controller = _controller(tables["controller"])
    current, controller = _apart(controller)
    vary = _vary(tables, directory)
    pairs = _has_pairs(tables, vary)
    task = task.model_copy(update={"current": current, "pairs": pairs, "whole": _beside_whole(tables)})
    _need_scale(controller, vary)
    time = argument("controller.sample_time", controller["sample_time"], "s")
    written = {
        "title": tables.get("title", ""),
        "load": _on_its_guide(tables["load"], task),
        "controller": controller,
        "motor": _table(tables, "motor"),
        "gearbox": _table(tables, "gearbox"),
        "task": {key: value for key, value in tables["task"].items() if key in PLAIN},
        "simulation": {"duration": task.cycle, "sample_interval": time},
    }
    if pairs:
        own = dict(written["motor"])
        _with_parts(written, vary, linear=linear is not None)
        if _any_stepper(written, vary):
            task = task.model_copy(update={"steppers": own or {"kind": "stepper"}})
        if is_stepper(written["motor"]):
            written["motor"] = NO_PAIR
    else:
        written |= {"motor": NO_PAIR, "gearbox": DIRECT.model_dump()}
    if "microsteps" in task.model_fields_set and not task.steppers:
        raise InputError("are of the driver of a stepper, and no candidate is one; leave it out", "task.microsteps")
    return Study(
        title=written["title"],
        scenario=Scenario(**written),
        written=written,
        vary=tuple(vary),
        axis=task,
        select=_selection(tables, task, usual=OF_TORQUE_SOURCES if _torque_sources(written, vary) else OBJECTIVES),
        task_tables={**given, "vary": vary} if any("unit_of_values" in entry for entry in vary) else {},
    )


Study.of_tables = staticmethod(task_of)


def _selection(tables: dict[str, Any], task: AxisTask, *, usual: dict[str, str]) -> Selection:
    """The table `[select]` with the limits of the task, or the usual objectives."""
    select = tables.get("select", {})
    if not isinstance(select, dict):
        raise InputError(f"{shown(select)} must be a table, such as [select]", "select")
    limits = {name: bound.model_dump(exclude_none=True) for name, bound in task.limits().items()}
    with inside("select"):
        return Selection(**{"objectives": usual} | select | {"limits": limits | select.get("limits", {})})


def _with_parts(written: dict[str, Any], vary: list[Any], *, linear: bool) -> None:
    """Puts parts into the base that the file leaves to the candidates: the first of them, or no gearbox for a linear axis."""
    if linear and not written["gearbox"] and not _varied({"vary": vary}, "gearbox"):
        written["gearbox"] = DIRECT.model_dump()
    for entry in vary:
        if (
            isinstance(entry, dict)
            and kind_of_record(str(entry.get("key"))) in ("gearbox", "motor")
            and "from" not in written[entry["key"].split(".")[0]]
        ):
            _first(written, entry)


def _with_candidates(tables: dict[str, Any]) -> dict[str, Any]:
    """The tables with `[candidates]` written as `[[vary]]`."""
    if "candidates" not in tables:
        return tables
    given, vary = tables["candidates"], tables.get("vary", [])
    if not isinstance(given, dict):
        raise InputError(f"{shown(given)} must be a table, such as [candidates]", "candidates")
    entries = list(vary) if isinstance(vary, list) else vary
    for key, values in given.items():
        if key not in CANDIDATES:
            raise InputError(unknown_key(key, CANDIDATES), f"candidates.{key}")
        if _varied(tables, key):
            raise InputError("is in [[vary]] too; keep one of them", f"candidates.{key}")
        if isinstance(entries, list):
            entries.append({"key": key, "values": list(values) if isinstance(values, list) else [values]})
    return {key: value for key, value in tables.items() if key != "candidates"} | {"vary": entries}


def _relative(tables: dict[str, Any], directory: Path) -> dict[str, Any]:
    """The tables with files of records, which are relative to the task file, by their whole names."""
    home = directory.resolve()
    out = tables | {kind: record_in(home, tables[kind]) for kind in CANDIDATES if kind in tables}
    return out | ({"task": accessories_in(home, out["task"])} if "task" in out else {})


def _torque_sources(written: dict[str, Any], vary: list[Any]) -> bool:
    """Whether only the mechanical energy of a candidate of the motor is known: it runs as a torque source, or is a stepper without data of its phases."""
    from ...data_sheets.linear_sheets import FORCE_SOURCE
    from ...data_sheets.motor_sheet import TORQUE_SOURCE, MotorSheet

    whole = [entry for entry in vary if isinstance(entry, dict) and entry.get("key") in WHOLE]
    of_force = (FORCE_SOURCE, TORQUE_SOURCE)
    if any(find(name, entry["key"]).level() in of_force for entry in whole for name in _names(entry)):
        return True
    names, given = _motors(vary), written["motor"]
    if names is None:
        if "from" not in given:
            phases = given.get("resistance_phase") is not None and given.get("rated_current") is not None
            return given.get("kind") == "torque_source" or (given.get("kind") == "stepper" and not phases)
        names = [given["from"]]
    sheets = (find(name, "motor") for name in names)
    return any(isinstance(s, MotorSheet) and (s.level() == TORQUE_SOURCE or s.lacks_phases()) for s in sheets)


def _any_stepper(written: dict[str, Any], vary: list[Any]) -> bool:
    """Whether a candidate of the motor is a stepper."""
    return is_stepper(written["motor"]) or any(is_stepper({"from": name}) for name in _motors(vary) or ())


def _motors(vary: list[Any]) -> list[str] | None:
    """The names of records of motors among the candidates; None where no motor varies by its record."""
    records = [entry for entry in vary if isinstance(entry, dict) and kind_of_record(str(entry.get("key"))) == "motor"]
    return [name for entry in records for name in _names(entry)] if records else None


def _names(entry: dict[str, Any]) -> list[str]:
    """The names of records of an entry of `[[vary]]`."""
    kind = kind_of_record(str(entry["key"]))
    assert kind is not None
    try:
        if "values" in entry:
            return list(entry["values"])
        return names_that_fit(kind, entry.get("catalogue", {}))
    except ValueError as error:
        raise InputError(f"vary: {error}") from None


def linear_axis(tables: dict[str, Any]) -> dict[str, Any] | None:
    """Last stage and slope of a linear task, or None for a rotary one."""
    given, direct = ([kind for kind in kinds if kind in tables or _varied(tables, kind)] for kinds in (STAGES, LINEAR))
    if "slide" not in tables and not given and not direct:
        return None
    if "load" in tables:
        raise InputError("the load turns or slides; leave one of them out", "load", "slide")
    slope = argument("slide.inclination", tables.get("slide", {}).get("inclination", 0.0), "rad")
    own: dict[str, Any] = {"rise": sin(slope)}
    if (friction := tables.get("slide", {}).get("friction_coefficient")) is not None:
        own["guide_friction"] = argument("slide.friction_coefficient", friction, "1")
        if own["guide_friction"] < 0.0:
            raise InputError(f"{shown(friction)} must be at least 0", "slide.friction_coefficient")
    if direct and not given:
        return own
    if len(given) != 1:
        what = (
            f"has {' and '.join(given)}; keep one" if given else f"lacks one of {', '.join((*STAGES, *LINEAR))}; add it"
        )
        raise InputError(f"what moves it {what}", "slide")
    (kind,) = given
    stage = tables.get(kind, {})
    stage = {"from": stage} if isinstance(stage, str) else stage
    if not isinstance(stage, dict):
        raise InputError(f"{shown(stage)} must be a table [{kind}], or the name of a record", kind)
    if not _varied(tables, kind):
        with inside(kind):
            stage_of(kind, stage)
    return {"kind": kind, "stage": dict(stage), **own}


def _varied(tables: dict[str, Any], kind: str) -> bool:
    entries = tables.get("vary")
    return isinstance(entries, list) and any(isinstance(v, dict) and v.get("key") == kind for v in entries)


def in_translation(tables: dict[str, Any]) -> dict[str, Any]:
    """The tables of a linear task as the tables of a rotary one with the same numbers: kg for kg m², m for rad, N for N m.

    The equations of a slide behind a screw equal the equations of a load behind a gear of the ratio 2 pi/lead.
    """
    slide = tables["slide"]
    for key in slide:
        if key not in SLIDE_KEYS:
            raise InputError(unknown_key(key, SLIDE_KEYS), f"slide.{key}")
    own = Slide(**{key: value for key, value in slide.items() if key not in ("force", "friction_coefficient")})
    given = slide.get("force", 0.0)
    force = ForceSignal(**given) if isinstance(given, dict) else ForceSignal(mean=given)
    torque = TorqueSignal(**force.model_dump())
    load = {
        "inertia": own.mass,
        "viscous_friction": own.viscous_friction,
        "friction_torque": own.friction_force,
        "torque": torque.model_copy(update={"mean": torque.mean + own.weight()}).model_dump(),
    }
    train = {"slides": {"slide": {}}, "controllers": {"motor": {**tables["controller"], "shaft": "slide"}}}
    controller = in_si(train, train_schema)["controllers"]["motor"]
    encoder = controller.get("position_encoder")
    if isinstance(encoder, dict) and "grating_period" in encoder:  # a scale, as an encoder of the same steps
        period = argument("controller.position_encoder.grating_period", encoder["grating_period"], "m")
        step = period / 2.0 ** encoder["bits"] if "bits" in encoder else 0.25 * period
        rest = {key: value for key, value in encoder.items() if key not in ("grating_period", "bits")}
        controller["position_encoder"] = {"shaft": "load", **rest, "resolution": step}
    controller["shaft"] = "load"
    return {"load": load, "controller": controller, "task": _task_in_translation(tables["task"])}


def _on_its_guide(load: dict[str, Any], task: AxisTask) -> dict[str, Any]:
    """Load with the dry friction of its guide under the weight of the slide and its largest payload across it."""
    linear = task.linear
    if linear is None or not linear.guide_friction:
        return load
    carried = [sum(p.mass for p in task.payload if p.begin <= one.begin < p.end) for one in task.payload]
    weight = (load["inertia"] + max(carried, default=0.0)) * STANDARD_GRAVITY * sqrt(1.0 - linear.rise * linear.rise)
    return load | {"friction_torque": load["friction_torque"] + linear.guide_friction * weight}


def _task_in_translation(task: Any) -> Any:
    """A task with its angles read as lengths."""
    if not isinstance(task, dict):
        return task
    schema = AxisTask.model_json_schema()

    def read(value: Any, path: tuple[int | str, ...]) -> Any:
        if isinstance(value, dict):
            return {key: read(inner, (*path, key)) for key, inner in value.items()}
        if isinstance(value, list):
            return [read(inner, (*path, k)) for k, inner in enumerate(value)]
        units = {unit for node in follow(schema, path)[1] if (unit := unit_in_schema(node)) is not None}
        if not isinstance(value, str) or len(units) != 1 or "rad" not in (unit := units.pop()):
            return value
        return argument(".".join(("task", *map(str, path))), value, of_slides(unit, positions=True, forces=False))

    return read(task, ())


def _table(tables: dict[str, Any], key: str) -> dict[str, Any]:
    """Values of a motor or gearbox, beside its record or in full."""
    given = tables.get(key, {})
    if isinstance(given, str):
        return {"from": given}
    if not isinstance(given, dict):
        raise InputError(f"{shown(given)} must be a table [{key}], or the name of a record", key)
    return dict(given)


def _controller(given: dict[str, Any]) -> dict[str, Any]:
    """A controller whose gains the rule gives."""
    for loop, gains in (("position", ("gain",)), ("speed", ("gain", "integral_gain", "integral_time"))):
        for key in gains:
            if isinstance(given.get(loop), dict) and key in given[loop]:
                raise InputError("follows from the rule for each pair; leave it out", f"controller.{loop}.{key}")
    out = CONTROLLER | given
    out["position"] = POSITION | given.get("position", {}) | GAINS["position"]
    out["speed"] = given.get("speed", {}) | GAINS["speed"]
    return out


def _apart(controller: dict[str, Any]) -> tuple[AnyCurrent | None, dict[str, Any]]:
    """The current loop of a controller, and the controller with an ideal one, which every motor of the task can have."""
    if not isinstance(controller["current"], dict):
        return None, controller  # which the scenario refuses
    loop: Any = controller["current"]
    with inside("controller"):
        current = InnerLoop(current=loop).current
    return current, controller | {"current": {"kind": "ideal"}}


def _vary(tables: dict[str, Any], directory: Path) -> list[Any]:
    """Varied values: the records of the file, else all records of parts that the file does not name or write out."""
    entries = tables.get("vary")
    if entries is None:
        kinds = ("motor",) if "slide" in tables and "gearbox" not in tables else ("gearbox", "motor")
        alone = any(kind in tables for kind in WHOLE) and not any(kind in tables for kind in (*kinds, *STAGES))
        entries = [{"key": kind, "catalogue": {}} for kind in kinds if not alone and not _whole(tables, kind)]
    if isinstance(entries, list):
        entries = [
            *entries,
            *(_entry_of(tables, kind) for kind in WHOLE if kind in tables and not _varied(tables, kind)),
        ]
    if not isinstance(entries, list):
        raise InputError(f"{shown(entries)} must be tables; write [[vary]] with double brackets", "vary")
    for entry in entries:
        find_sheets(entry, directory)
    return entries


def _entry_of(tables: dict[str, Any], kind: str) -> dict[str, Any]:
    """The entry of `[[vary]]` of a table of whole drives: the record that it names, or all."""
    name = _table(tables, kind).get("from")
    return {"key": kind, "catalogue": {}} if name is None else {"key": kind, "values": [name]}


def _beside_whole(tables: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Values beside the records of whole drives. Raises InputError: one is none of such a drive."""
    given = {kind: _table(tables, kind) for kind in WHOLE if kind in tables}
    for kind, table in given.items():
        for key in table:
            if key not in ("from", *BESIDE[kind]):
                raise InputError(unknown_key(key, BESIDE[kind]), f"{kind}.{key}")
    return {kind: {key: value for key, value in table.items() if key != "from"} for kind, table in given.items()}


def _has_pairs(tables: dict[str, Any], vary: list[Any]) -> bool:
    """Whether a task has pairs of motor and gearbox among its candidates, and not whole drives alone."""
    keys = [str(entry.get("key")).split(".")[0] for entry in vary if isinstance(entry, dict)]
    if not set(keys) & set(WHOLE) or {*keys, *tables} & {"motor", "gearbox"}:
        return True
    stage = next((kind for kind in STAGES if kind in {*keys, *tables}), None)
    if stage is not None and "actuator" not in keys:
        raise InputError("linear motors need none; add candidates of motor, or leave it out", stage)
    return False


def _need_scale(controller: dict[str, Any], vary: list[Any]) -> None:
    """Sees that a task with linear motors has the scale by which they are controlled."""
    if controller.get("position_encoder") is None and _varied({"vary": vary}, "linear_motor"):
        raise InputError(
            'a linear motor needs a scale; add it, such as { grating_period = "20 um", bits = 10 }',
            "controller.position_encoder",
        )


def _whole(tables: dict[str, Any], kind: str) -> bool:
    """Whether the file names a record, or writes a part out."""
    table = _table(tables, kind)
    return "from" in table or {"motor": "rotor_inertia", "gearbox": "stiffness"}[kind] in table


def _first(written: dict[str, Any], entry: dict[str, Any]) -> None:
    """Puts the first record that can be run into the base, so that there is one."""
    kind = entry["key"].split(".")[0]
    names = _names(entry)
    problem: InputError | None = None
    for name in names:
        try:
            _part_of(kind, name, written[kind])
        except InputError as error:
            problem = problem or error
            continue
        written[kind] = {"from": name} | written[kind]
        return
    raise problem or InputError(f"vary: has no {kind}; name at least one")


def _part_of(kind: str, name: Any, beside: dict[str, Any]) -> None:
    """Sees that a record can be run."""
    from ...data_sheets.components import gearbox_table, motor_table

    (gearbox_table if kind == "gearbox" else motor_table)(name, beside)

"""Own sheets beside the catalogue as candidates of a task, and the choice by price, mass, length and lead time."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from lostmotion.model.losses import efficiency_map
from lostmotion.reports.study_selection import SelectionReport
from lostmotion.studies.runs.candidate_rows import HOLDS, Axes, run_axes
from lostmotion.studies.runs.read_table import read_table
from lostmotion.studies.runs.run_study import study
from lostmotion.studies.selection.nearest_misses import misses, not_judged
from lostmotion.studies.selection.ranking import candidates, pareto_front
from lostmotion.studies.selection.task_file import task_of
from lostmotion.studies.study.drive_check_columns import ESTIMATED
from lostmotion.studies.study.records_that_vary import names_of, names_that_fit
from lostmotion.studies.study.study_definition import Study
from refusals import refused
from test_select import ACCELERATION, FRICTION, TABLES, J

GEARBOX = """
[[gearbox]]
name = "{name}"
kind = "planetary"
ratio = {ratio}
rated_output_torque = "60 N*m"
peak_output_torque = "90 N*m"
rated_input_speed = "3000 rpm"
max_input_speed = "6000 rpm"
inertia = "0.2 kg*cm^2"
stiffness = "6 N*m/arcmin"
efficiency = 0.95
{more}
"""
MOTOR = """
[[motor]]
name = "{name}"
kind = "synchronous"
rotor_inertia = "{inertia} kg*cm^2"
rated_torque = "1.2 N*m"
peak_torque = "3.6 N*m"
rated_speed = "3000 rpm"
max_speed = "6000 rpm"
{more}
"""
MASS, LENGTH, PRICE, DAYS = (
    {"g-one": 2.5, "m-one": 1.5, "m-two": 3.5},
    {"g-one": 0.12, "m-one": 0.1, "m-two": 0.15},
    {"g-one": 480.0, "m-one": 300.0, "m-two": 240.0},
    {"g-one": 40.0, "m-one": 10.0, "m-two": 60.0},
)


def choice(name: str) -> str:
    values = f'total_mass = "{MASS[name]} kg"\noverall_length = "{LENGTH[name]} m"'
    return f'{values}\nprice = {PRICE[name]}\nlead_time = "{DAYS[name]} day"'


@pytest.fixture(scope="module")
def sheets(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory of sheets: motors and gearboxes in one file, one gearbox without a price in another."""
    directory = tmp_path_factory.mktemp("sheets")
    one = [GEARBOX.format(name="g-one", ratio=30, more=choice("g-one"))]
    one += [MOTOR.format(name=n, inertia=j, more=choice(n)) for n, j in (("m-one", 1.0), ("m-two", 1.1))]
    (directory / "both.toml").write_text("".join(one))
    (directory / "cheap.toml").write_text(GEARBOX.format(name="g-two", ratio=35, more='total_mass = "1 kg"'))
    return directory


def task_with(sheets: Path, task: dict[str, Any], select: dict[str, Any] | None = None, **candidates_of: Any) -> Study:
    kept = {key: value for key, value in TABLES.items() if key not in ("vary", "motor")}
    tables = kept | {"task": {**TABLES["task"], **task}, "candidates": candidates_of or {"gearbox": "sheets/", "motor": "sheets/"}}
    if select is not None:
        tables["select"] = select
    return task_of(tables, sheets.parent)


@pytest.fixture(autouse=True)
def _called_sheets(sheets: Path) -> None:
    """The directory by a name that task files may have."""
    link = sheets.parent / "sheets"
    if not link.exists():
        link.symlink_to(sheets)


def ranked_of(task: Study, directory: Path) -> Any:
    return candidates(read_table(study(task, directory / "rows")), task)


def test_one_list_takes_names_files_directories_and_filters(sheets: Path):
    wanted = {"manufacturer": "Wittenstein"}
    file = str((sheets / "both.toml").resolve())
    given = ["schaeffler-rt1-h-20-100", "both.toml", wanted, "both.toml#g-one"]
    wittenstein = names_that_fit("gearbox", wanted)
    assert names_of("gearbox", given, sheets.resolve()) == [given[0], file, *wittenstein, f"{file}#g-one"]
    assert names_of("motor", ["both.toml"], sheets.resolve()) == [f"{file}#m-one", f"{file}#m-two"]
    everything = names_of("gearbox", [sheets.name], sheets.parent.resolve())
    assert everything == [file, str((sheets / "cheap.toml").resolve())]
    short = task_with(sheets, {}, gearbox="sheets/both.toml", motor=["maxon-ec-i-52-606793", "sheets/both.toml"])
    assert {v.key: len(v.names) for v in short.vary} == {"gearbox": 1, "motor": 3}


def test_a_scenario_names_one_of_several_records(sheets: Path):
    assert lm.motor(f"{sheets / 'both.toml'}#m-two").rotor_inertia == pytest.approx(1.1e-4)
    refused(lambda: lm.motor(str(sheets / "both.toml")), reason="both.toml#m-one")
    refused(lambda: lm.motor(f"{sheets / 'both.toml'}#m-three"), reason="m-three")


@pytest.mark.parametrize(("given", "says"), [
    ({"gearbox": "nowhere/"}, "no directory"),
    ({"gearbox": "sheets/none.toml"}, "there is no such file"),
    ({"motor": "sheets/cheap.toml"}, "a motor is wanted here"),
    ({"motors": "sheets/"}, "did you mean motor"),
    ({"gearbox": 3}, "no name of a gearbox"),
    ({"gearbox": {"ratio": [1e6, 1e7]}}, "ratio = .*, which no gearbox of the catalogue has; they go from 3 to 1000"),
    ({"gearbox": {"kind": "planetry"}}, "kind = .*; did you mean planetary"),
    ({"gearbox": {"kind": "worm", "ratio": [3, 4]}}, r"no gearbox fits: \d+ without kind, \d+ without ratio"),
])  # fmt: skip
def test_what_is_no_candidate_is_refused(sheets: Path, given: dict[str, Any], says: str):
    assert len(refused(lambda: task_with(sheets, {}, **({"gearbox": "sheets/", "motor": "sheets/"} | given)), match=says)) < 400


def test_sums_over_the_parts(sheets: Path, tmp_path: Path):
    task = task_with(sheets, {}, {"objectives": {"mass": "least", "price": "least"}}, gearbox="sheets/both.toml", motor="sheets/")
    rows = read_table(study(task, tmp_path / "rows"))
    table = next(part for part in SelectionReport(rows, task).parts() if part.title == "Candidates that fit")
    shown = dict(zip(table.header, table.rows[0], strict=True))
    assert [float(shown[key]) for key in ("length [mm]", "lead time [days]")] == pytest.approx([220.0, 40.0])
    ranked = candidates(rows, task)
    found = {c.name.rpartition(", ")[2]: c.choice for c in ranked}
    for motor in ("m-one", "m-two"):
        assert found[motor] == pytest.approx(
            {
                "mass": MASS["g-one"] + MASS[motor],
                "length": LENGTH["g-one"] + LENGTH[motor],
                "price": PRICE["g-one"] + PRICE[motor],
                "lead_time": 86400.0 * max(DAYS["g-one"], DAYS[motor]),
            }
        )
    # The lighter motor costs more: both are on the front.
    assert {c.name.rpartition(", ")[2] for c in pareto_front(ranked, task.select)} == {"m-one", "m-two"}
    assert ranked[0].name.endswith("m-one")


def test_limits_of_space_mass_price_and_time_have_nearest_misses(sheets: Path, tmp_path: Path):
    limits = {"max_mass": "3.2 kg", "max_length": "200 mm", "max_price": 600, "max_lead_time": "20 day"}
    task = task_with(sheets, limits, gearbox="sheets/both.toml", motor="sheets/")
    near = misses(task, ranked_of(task, tmp_path), 5)
    over = {"mass": (4.0, 3.2), "length": (0.22, 0.2), "price": (780.0, 600.0), "lead_time": (40.0, 20.0)}
    assert near[0].candidate.name.endswith("m-one")
    assert near[0].lacks == pytest.approx({name: value / limit - 1.0 for name, (value, limit) in over.items()})
    assert "40 of 20 days" in near[0].candidate.why
    assert near[0].then == "a slower cycle does not change its parts"


def test_a_record_without_the_datum_is_listed_apart(sheets: Path, tmp_path: Path):
    task = task_with(sheets, {"max_price": 1000})
    ranked = ranked_of(task, tmp_path)
    (group,) = not_judged(ranked)
    assert len(group.candidates) == 2
    assert "sheet of the gearbox lacks price, which task.max_price needs" in group.datum
    assert sum("data" not in c.violated for c in ranked) == 2
    kept = ranked_of(task_with(sheets, {}), tmp_path / "free")
    assert not not_judged(kept)
    assert set(next(c for c in kept if "cheap" in c.name).choice) == {"mass"}


# --- torque sources, and gearboxes whose losses are estimated ---
def test_torque_sources_are_ranked_by_mechanical_energy(sheets: Path, tmp_path: Path):
    smooth = {"controller": SMOOTH, "candidates": {"gearbox": "sheets/both.toml", "motor": "sheets/both.toml#m-one"}}
    kept = {key: value for key, value in TABLES.items() if key not in ("vary", "motor")}
    task = task_of(kept | smooth, sheets.parent)
    assert next(iter(task.select.objectives)) == "mechanical_energy"
    winding = task_with(sheets, {}, gearbox="sheets/both.toml", motor="maxon-ec-i-52-606793")
    assert next(iter(winding.select.objectives)) == "energy"
    ranked = ranked_of(task, tmp_path)
    assert ranked[0].fits
    # Rigid, without the current loop's lag: what the motor gives while the load speeds up and against friction and losses.
    demand = Axes(task).gearbox(task.parameters(0, 1)[0])[0]
    motion, motor = demand.motion, task.part("motor", task.parameters(0, 1)[0])
    power = demand.motor_torque(motor) * demand.speed
    steps = np.diff(motion.time)
    by_hand = float((np.maximum(0.5 * (power[1:] + power[:-1]), 0.0) * steps).sum())
    assert ranked[0].values["mechanical_energy"] == pytest.approx(by_hand, rel=0.03)


def test_a_torque_source_has_the_lag_of_a_current_loop_and_no_electrical_energy(sheets: Path, tmp_path: Path):
    task = task_with(sheets, {}, gearbox="sheets/both.toml", motor="sheets/both.toml#m-one")
    loop = task.axis_at(task.parameters(0, 1)[0], 2).controller.current
    # g/(z (z - 1)) with g = 1/3 lags by 3 T, of which one is the delay of the output.
    assert loop.kind == "first_order"
    assert loop.time_constant == pytest.approx(2 * 125e-6)
    electrical = task_with(sheets, {}, {"objectives": {"energy": "least"}}, gearbox="sheets/both.toml", motor="sheets/both.toml#m-one")
    (group,) = not_judged(ranked_of(electrical, tmp_path))
    assert "lacks its winding, which select for energy needs; take mechanical_energy" in group.datum
    wrong = {"controller": TABLES["controller"] | {"current": {"kind": "field_oriented"}}, "candidates": {"motor": "maxon-ec-i-52-606793"}}
    both = {key: value for key, value in TABLES.items() if key not in ("vary", "motor")} | wrong
    task = task_of({**both, "gearbox": "schaeffler-rt1-h-20-100"})
    refused(lambda: Axes(task).judged(task.parameters(0, 1)[0]), "controller.current.kind", reason="field_oriented")


EFFICIENCY = 0.6
# An encoder of fine steps and limited jerk, so that the run has the torques of the rigid motion within some per cent.
SMOOTH = {"encoder": {"bits": 20}, "reference": {**TABLES["controller"]["reference"], "jerk": 2000.0}}
OWN = 1e-4


def estimated(limit: float) -> Study:
    """A gearbox with an estimated efficiency, a fifth to three times the losses, and a motor with this largest torque [N·m]."""
    laws = {"stiffness": {"kind": "rigid"}, "losses": efficiency_map(EFFICIENCY, EFFICIENCY).model_dump(), "loss_range": (0.2, 3.0)}
    gearbox = {"ratio": 30.0, "inertia": 0.0, "rated_output_torque": 60.0, "rated_input_speed": 314.0, **laws}
    limits = {"peak_torque": limit, "continuous_torque": 100.0, "max_speed": 600.0}
    motor = {"kind": "torque_source", "rotor_inertia": OWN, "rated_torque": 1.2, "limits": limits}
    tables = {key: value for key, value in TABLES.items() if key not in ("vary", "motor")}
    tables |= {"task": {"cycle": "1 s", "max_inertia_ratio": 1e12}, "gearbox": gearbox, "motor": motor, "controller": SMOOTH}
    return task_of({**tables, "vary": [{"key": "gearbox.inertia", "values": [0.0]}]})


def peak(losses: float) -> float:
    """Largest torque of the motor by hand: (J a + friction)/i + J_M i a with so many times the loss 1/efficiency - 1 of the torque of the load."""
    load = (J * ACCELERATION + FRICTION) / 30.0
    return load * (1.0 + losses * (1.0 / EFFICIENCY - 1.0)) + OWN * 30.0 * ACCELERATION


@pytest.mark.parametrize(("limit", "nominal", "says"), [
    (1.2 * peak(3.0), "", HOLDS),
    (0.5 * (peak(1.0) + peak(3.0)), "", "fits with the least losses of its kind, violates motor_peak_torque with the largest"),
    (0.98 * peak(1.0), "motor_peak_torque", "fits with the least losses"),
    (0.9 * peak(0.2), "motor_peak_torque", HOLDS),
])  # fmt: skip
def test_a_verdict_is_marked_with_the_range_that_it_survives(limit: float, nominal: str, says: str):
    task = estimated(limit)
    rows = run_axes(task, task.parameters(0, 1), 1)
    assert rows.checks["violated"] == [nominal]
    assert says in rows.checks[ESTIMATED][0]

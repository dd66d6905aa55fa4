"""Records of screws, racks, belts and linear motors: their data, scenarios that name them, bad use."""

import itertools
import math
import statistics
from collections import defaultdict
from pathlib import Path

import pytest

import lostmotion as lm
from lostmotion.data_sheets.linear_components import linear_table
from lostmotion.data_sheets.records import KINDS, catalogue, find, parse_sheets, table_of
from lostmotion.data_sheets.train_components import RECORD_KINDS, RECORDS
from lostmotion.model.train import DriveTrain
from lostmotion.reports.catalogue_text import list_records, record_text, template
from lostmotion.simulation.forms.train_tables import TrainTables
from refusals import refusals_of, refused

LINEAR = {kind: [r for r in catalogue() if table_of(r) == kind] for kind in ("screw", "rack", "belt", "linear_motor")}
# What the axis decides.
BESIDE = {"screw": {}, "rack": {"teeth": 20}, "belt": {"teeth": 20, "free_lengths": ["0.5 m", "1 m"]}, "linear_motor": {}}
PLACES = dict.fromkeys(("screws", "racks", "belts"), 'input = "motor"\noutput = "table"') | {"linear_motors": 'slide = "table"'}


def axis(tmp_path: Path, table: str, text: str) -> Path:
    """A scenario with one part that joins a motor's shaft and a slide, or that moves the slide."""
    shaft = "" if table == "linear_motors" else 'shafts.motor.inertia = "1e-4 kg*m^2"\n'
    rest = 'slides.table.mass = "20 kg"\nsimulation = { duration = 0.01, sample_interval = 0.001 }\n'
    path = tmp_path / "axis.toml"
    path.write_text(f"{shaft}{rest}[{table}.part]\n{PLACES[table]}\n{text}\n")
    return path


def test_keys_of_records_are_those_of_the_tables() -> None:
    """Each datum that a record shares with its table has the same unit and meaning, as the sheet takes it from there."""
    complete = {kind: [r for r in records if not r.missing()] for kind, records in LINEAR.items()}
    assert len(complete["screw"]) >= 60 and len(complete["rack"]) >= 10
    assert len(complete["linear_motor"]) >= 15 and len(LINEAR["belt"]) >= 30 and len(complete["belt"]) >= 20
    for kind in LINEAR:
        for record in complete[kind]:
            KINDS[kind].PART(**linear_table(kind, record.name, BESIDE[kind], "x"))
        sheet = KINDS[kind]
        assert set(sheet.PART.model_fields) <= set(sheet.model_fields)
        assert set(sheet.CHOICES) <= set(sheet.PART.model_fields)
        for ways in sheet.ALTERNATIVES:
            assert {key for way in ways for key in way} <= set(sheet.PART.model_fields)
    for table, kind in RECORD_KINDS.items():
        places = set(RECORDS[table][1])
        if kind in LINEAR:
            element = TrainTables.model_fields[table].annotation
            assert set(element.__args__[1].model_fields) == places | set(KINDS[kind].PART.model_fields)


@pytest.mark.parametrize("table", PLACES)
def test_a_record_by_name_runs(tmp_path: Path, table: str) -> None:
    kind = RECORD_KINDS[table]
    record = next(r for r in LINEAR[kind] if not r.missing())
    beside = "\n".join(f"{key} = {value}" for key, value in BESIDE[kind].items()).replace("'", '"')
    scenario = lm.load(axis(tmp_path, table, f'from = "{record.name}"\n{beside}'))
    part = getattr(scenario, table)["part"]
    for key, value in record.values().items():
        if key in part.model_fields_set:
            assert getattr(part, key) == value
    result = lm.simulate(scenario)
    assert "table_position" in result


def test_a_screw_of_a_record_is_the_gear_of_its_lead(tmp_path: Path) -> None:
    """The record's data by hand: ratio 2 pi/lead, nut and screw in series, E A/L with the core diameter."""
    text = 'from = "rexroth-25x10rx3-i4"\nsupported_length = "600 mm"\nlength = "800 mm"'
    train = lm.load(axis(tmp_path, "screws", text)).train()
    assert isinstance(train, DriveTrain)
    gear = train.gears["part"]
    assert gear.ratio == pytest.approx(2 * math.pi / 0.01, rel=1e-15)
    screw = 206e9 * math.pi / 4 * 0.02306**2 / 0.6
    assert gear.stiffness.stiffness == pytest.approx(1 / (1 / 320e6 + 1 / screw), rel=1e-14)
    assert gear.inertia == pytest.approx(math.pi / 32 * 7850 * 0.8 * 0.025**4, rel=1e-14)
    assert gear.losses.drive_efficiency == 0.9 and gear.losses.backdrive_efficiency == 0.8
    assert train.shafts["motor"].friction_torque == 0.08


def test_another_preload_scales_stiffness_and_drag() -> None:
    twice = linear_table("screw", "rexroth-25x10rx3-i4", {"nut_preload": "628 N"}, "x")
    assert twice["nut_stiffness"] == pytest.approx(320e6 * 2 ** (1 / 3), rel=1e-14)
    assert twice["drag_torque"] == pytest.approx(0.16, rel=1e-14)
    # HIWIN prints none: T = K_p F_pr P/(2 pi) with K_p = 1/eta_1 - eta_2, and eta_2 = 2 - 1/eta_1.
    made = linear_table("screw", "hiwin-r25-10k4-fsc", {"nut_preload": "500 N"}, "x")
    assert made["drag_torque"] == pytest.approx((2 / 0.9 - 2) * 500 * 0.01 / (2 * math.pi), rel=1e-13)
    assert "drag_torque" not in linear_table("screw", "hiwin-r25-10k4-fsc", {}, "x")


def test_what_is_given_takes_the_place_of_what_says_the_same() -> None:
    screw = linear_table("screw", "thk-bnfn2505-5", {"friction_coefficient": 0.003, "stiffness": "100 N/um"}, "x")
    assert not {"efficiency", "nut_stiffness", "core_diameter"} & screw.keys()
    assert screw["mean_diameter"] == 0.02575
    belt = linear_table("belt", "elatech-at5-25", {"travel_per_turn": "0.1 m", "stiffness": "1e6 N/m"}, "x")
    assert not {"pitch", "specific_stiffness"} & belt.keys()
    assert belt["rated_force"] == 1750.0  # a rating remains
    motor = linear_table("linear_motor", "inoprec-lmc88-130", {"rated_current": "3 A", "cogging_force": "3 N"}, "x")
    assert "rated_force" not in motor and motor["pole_pitch"] == 0.014


test_bad_use_names_file_key_and_remedy = refusals_of(
    lambda table, text, *, tmp_path: lm.load(axis(tmp_path, table, text)),
    ("screws", 'from = "rexroth-25x10rx3-i5"', "screws.part.from: did you mean rexroth"),
    ("screws", 'from = "elatech-at5-25"', "screws.part.from: is a belt; a screw is wanted here"),
    ("screws", "from = 3", "screws.part.from: 3 must be the name of a record"),
    ("screws", 'from = "hiwin-r25-10t3-deb"', "screws.part.from: lacks nut_stiffness, see HIWIN"),
    ("screws", 'from = "thk-bnf2505-5"\nnut_preload = 3', "screws.part.nut_preload: has none"),
    ("screws", 'from = "thk-bnfn2505-5"\nnut_preload = "-3 N"', 'screws.part.nut_preload: "-3 N" must be greater'),
    ("screws", 'from = "thk-bnfn2505-5"\nstifness = 3', "screws.part.stifness: is not known; did you mean stiffness"),
    ("screws", 'lead = "5 mm"\nnut_preload = "3 N"', "screws.part.nut_preload: acts on a record; give screws.part.from"),
    ("screws", 'from = "thk-bnfn2505-5"\nsupported_length = "-1 m"', "screws.part.supported_length"),
    ("racks", 'from = "sati-cr28100"', "racks.part.from: give racks.part.teeth (of the pinion) beside"),
    ("belts", 'from = "elatech-at5-25"', "belts.part.from: belts.part.teeth (of the pulley) and belts.part.free_lengths"),
    ("belts", 'from = "synchroflex-at-10-25"\nteeth = 20', "belts.part.from: lacks specific_stiffness"),
    ("linear_motors", 'from = "none.toml"', "linear_motors.part.from: no such file"),
)  # fmt: skip


def test_own_sheets_from_templates_can_be_used_as_they_are(tmp_path: Path) -> None:
    for table, kind in ((t, k) for t, k in RECORD_KINDS.items() if k in LINEAR):
        (tmp_path / "own.toml").write_text(template(kind))
        beside = "\n".join(f"{key} = {value}" for key, value in BESIDE[kind].items()).replace("'", '"')
        lm.load(axis(tmp_path, table, f'from = "own.toml"\n{beside}'))
        for datum in KINDS[kind].__annotations__:
            assert datum.isupper() or f"{datum} = " in template(kind), (kind, datum)
        assert "It can be simulated: all data." in record_text(str(tmp_path / "own.toml"))


test_a_bad_sheet_is_refused = refusals_of(
    lambda kind, changes: parse_sheets({kind: [{"name": "x", **changes}]}, "my.toml"),
    ("screw", {"lead": "5 kg"}, 'lead: "5 kg" has the unit of something else'),
    ("screw", {"lead": "-5 mm"}, "lead: greater than 0"),
    ("screw", {"dynamic_capacty": 3}, "dynamic_capacty: did you mean dynamic_capacity"),
    ("rack", {"kind": "bent"}, "kind"),
    ("belt", {"width": 0}, "width"),
    ("linear_motor", {"peak_force": "3 N*m"}, "peak_force"),
)


def test_the_list_filters_by_lead_and_force() -> None:
    lines = list_records("screw", lead="10 mm", force="20000..30000").splitlines()[1:-2]
    assert lines
    for line in lines:
        record = find(line.split()[0], "screw")
        assert record.lead == 0.01 and 2e4 <= record.dynamic_capacity <= 3e4
    assert len(list_records("ironless").splitlines()) == 3 + sum(r.kind == "ironless" for r in LINEAR["linear_motor"])
    assert "--lead 10 kg" in refused(lambda: list_records(lead="10 kg"))


# --- the data against each other ---
def test_capacities_and_stiffness_of_screws_grow_with_their_turns() -> None:
    """ISO 3408: C goes with the turns to the power 0.86; the stiffness at a preload in proportion to C so with 2/3 + 0.86/3.

    The number of turns is in the type code. THK prints two digits of small stiffnesses, so 10 %.
    """
    families = defaultdict(list)
    for r in LINEAR["screw"]:
        if r.name.startswith("thk-bnf"):
            series, _, turns = r.name.removeprefix("thk-").rpartition("-")
            families[series].append((float(turns), r))
    compared = 0
    for members in families.values():
        for (n, a), (m, b) in itertools.combinations(members, 2):
            compared += 1
            assert b.dynamic_capacity / a.dynamic_capacity == pytest.approx((m / n) ** 0.86, rel=0.06), (a.name, b.name)
            assert b.nut_stiffness / a.nut_stiffness == pytest.approx((m / n) ** 0.953, rel=0.1), (a.name, b.name)
    assert compared > 100


def test_the_drag_of_a_preloaded_screw_goes_with_preload_and_diameter_and_bars_of_racks_have_their_teeth() -> None:
    """Rexroth: 0.01 x preload x diameter, printed with two decimals."""
    for r in LINEAR["screw"]:
        if r.name.startswith("rexroth"):
            assert r.drag_torque == pytest.approx(0.01 * r.nut_preload * r.diameter, abs=0.0051, rel=0.05)
    for r in LINEAR["rack"]:
        assert r.bar_length == pytest.approx(r.bar_teeth * math.pi * r.module, abs=1e-5)
        assert r.height - r.pitch_line_height == pytest.approx(r.module, rel=1e-12)


def test_belts_stretch_by_the_same_share_at_their_rated_force() -> None:
    """Elatech: rated force at a strain of 0.4 %; mass in proportion to the width, printed with two decimals."""
    by_profile = defaultdict(list)
    for r in LINEAR["belt"]:
        if r.specific_stiffness is not None:
            assert r.rated_force / r.specific_stiffness == pytest.approx(0.004, rel=1e-9)
        by_profile[r.profile].append(r)
    for members in by_profile.values():
        density = statistics.median(r.mass_per_length / r.width for r in members)
        for r in members:
            assert r.mass_per_length == pytest.approx(density * r.width, abs=0.0061, rel=0.12)


def test_forces_of_linear_motors_are_those_of_their_currents() -> None:
    """Rated force = constant x current as printed; the peak is below that by saturation. Volts and newtons are one constant."""
    for r in LINEAR["linear_motor"]:
        assert r.rated_force == pytest.approx(r.force_constant * r.rated_current, rel=0.05)
        assert r.peak_force <= 1.02 * r.force_constant * r.peak_current
        if r.voltage_constant is not None:
            assert r.force_constant == pytest.approx(math.sqrt(1.5) * r.voltage_constant, rel=0.05)
        if r.resistance is not None:  # copper losses: of the warm winding up to 1.4 times those at 25 degC
            assert 0.7 < 1.5 * r.resistance * r.rated_current**2 / r.max_dissipation < 1.05

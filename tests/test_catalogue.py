"""Records of the catalogue: what they hold, scenarios that name them, bad sheets."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import lostmotion as lm
from conftest import ROOT
from lostmotion.cli import app
from lostmotion.data_sheets import records
from lostmotion.data_sheets.components import motor_table
from lostmotion.data_sheets.loss_map_builder import build_loss_map
from lostmotion.data_sheets.records import KINDS, catalogue, find, parse_sheets
from lostmotion.errors import InputError
from lostmotion.paper import paper_scenario
from lostmotion.test_rig.comparison import Comparison
from refusals import refused, refuses
from sheets import ARCMIN, COMPLETE, GEARBOXES, MOTORS, RPM, scenario_with, sheet


def test_every_figure_of_every_record_has_a_source():
    for record in catalogue():
        for figure in record.given():
            assert record.source_of(figure) is not None, (record.name, figure)


def test_names_are_unique_and_enough_records_can_run():
    names = [r.name for r in catalogue()]
    assert len(set(names)) == len(names)
    assert {r.kind for r in COMPLETE} >= {"strain_wave", "planetary"}
    assert len(COMPLETE) >= 400
    assert len([r for r in MOTORS if not r.missing()]) >= 150
    assert {r.kind for r in GEARBOXES} >= {"strain_wave", "planetary", "worm"}


def test_a_record_found_by_name_is_that_of_the_catalogue_and_other_files_are_not_parsed(monkeypatch):
    for table, kind in KINDS.items():
        assert all(find(r.name, table) == r for r in catalogue() if isinstance(r, kind))
    parsed = []
    monkeypatch.setattr(records, "_entries_of", lambda file: parsed.append(file) or ())
    assert records._named.__wrapped__("schaeffler-rt1-h-20-100") is None
    assert parsed == ["strain-wave-schaeffler-rt1-h.toml"]


def test_what_is_missing_is_named_with_the_place_to_read_it():
    for record in catalogue():
        for key, text in record.missing().items():
            assert "see" in text, (record.name, key)
    refused(lambda: lm.gearbox("nord-sk1si50-60"), match=r"nord-sk1si50-60.*lacks inertia.*NORD.*give gearbox.inertia")


def test_the_papers_records_are_the_papers_drive():
    scenario = paper_scenario("2-DOF-NL", "large")
    gearbox, motor = lm.gearbox("paper-gearbox"), lm.motor("paper-motor")
    assert "stand-in" in str(gearbox.note)
    for name in ("ratio", "inertia", "viscous_friction", "rated_input_speed", "rated_output_torque", "hysteresis"):
        assert getattr(gearbox, name) == getattr(scenario.gearbox, name)
    assert gearbox.stiffness.breaks == pytest.approx(scenario.gearbox.stiffness.breaks, rel=1e-15)
    assert motor.model_copy(update={"limits": None}) == scenario.motor
    a = lm.simulate(scenario)
    b = lm.simulate(scenario.replace(gearbox=gearbox.model_dump(), motor=motor.model_dump()))
    assert float(b["load_speed"][-1]) == pytest.approx(float(a["load_speed"][-1]), rel=1e-9)


def test_a_motor_record_keeps_rated_point_and_stall_torque():
    record = find("maxon-re-50-578296", "motor")
    m = record.motor()
    friction = 0.0385 * 0.236
    assert m.friction_torque == pytest.approx(friction)
    # At rated speed and voltage (2) gives the printed torque at the shaft, at standstill the printed stall torque.
    assert m.rated_torque - friction == pytest.approx(0.405)
    assert m.armature_voltage_constant * m.rated_torque == pytest.approx(8.92)
    assert m.electrical_time_constant == pytest.approx(72e-6 / 0.103)
    assert record.no_load_speed_of_model() / RPM == pytest.approx(5950, rel=0.01)


BAD = [
    ({"rated_output_torque": "-5 N*m"}, "rated_output_torque"),
    ({"rated_output_torque": "52 rpm"}, "unit of something else"),
    ({"ratio": 0}, "ratio"),
    ({"inertia": "-1 kg*m^2"}, "inertia"),
    ({"stiffness": {"slopes": [1e4, 2e4], "torques": []}}, "one torque fewer"),
    ({"stiffness": {"slopes": [1e4, 2e4, 3e4], "torques": [9, 5]}}, "do not rise"),
    ({"stiffness": {"slopes": []}}, "stiffness"),
    ({"losses": {"efficiency": [{"input_speed": "2000 rpm", "efficiency": 1.2}]}}, "efficiency"),
    ({"losses": {"efficiency": [{"input_speed": "2000 rpm", "efficiency": 0.0}]}}, "efficiency"),
    ({"losses": {"load_correction": [[0.5, 0.9]]}}, "exactly one efficiency at load 1"),
    ({"losses": {"efficiency": [{"input_speed": 200.0, "efficiency": 0.9}], "load_correction": [[1.5, 1.2]]}}, "above 1"),
    ({"losses": {"efficiency": [{"input_speed": 200.0, "efficiency": 0.9}] * 2}}, "twice"),
    ({"losses": {"starting_torqe": 0.1}}, "is not known"),
    ({"losses": {"lubricant": {"viscosity_40": 1e-5, "viscosity_100": 2e-5}}}, "thins"),
    ({"hysteresis_loss": 1e-3, "hysteresis_efficiency": 0.9}, "give one"),
    ({"name": "My Gearbox"}, "name"),
    ({"kind": "magic"}, "kind"),
]


@pytest.mark.parametrize(("changes", "match"), BAD)
def test_a_bad_sheet_ends_in_one_clear_line(changes: dict, match: str):
    entry = sheet().model_dump(exclude_none=True, exclude={"sources", "gaps"}) | changes
    assert refused(lambda: parse_sheets({"gearbox": [entry]}, "my.toml"), match=match).startswith("my.toml: gearbox ")


def test_files_that_are_no_sheets(tmp_path: Path):
    for text, match in (
        ("gearbox = 3", "double brackets"),
        ("gearbox = [3]", "double brackets"),
        ("source = 3\n[[gearbox]]\nname = 'x'", "key source: 3 must be tables"),
        ("[[gearbox]]\nname = 'x'\ngap = 'y'", 'gearbox x: key gap: "y" must be tables'),
        ("", "no record"),
        ("gearboks = []", "did you mean gearbox"),
        ("[", "TOML"),
    ):
        path = tmp_path / "s.toml"
        path.write_text(text)
        with pytest.raises(InputError, match=match):
            find(str(path), "gearbox")
    assert "no such file" in refused(lambda: find(str(tmp_path / "none.toml"), "gearbox"))
    assert "did you mean schaeffler-rt1-h-20-100" in refused(lambda: find("schaeffler-rt1-h-20-10", "gearbox"))


def test_a_sheet_without_efficiency_of_a_kind_without_estimate_is_refused_with_the_place_to_read_it():
    gap = {"datum": "losses.efficiency", "where": "the catalogue, page 7"}
    refused(lambda: build_loss_map(sheet(kind="cycloidal", losses={}, gaps=[gap])), match=r"lacks an efficiency.*the catalogue, page 7")


def test_losses_that_are_not_printed_are_those_of_the_kind_and_say_so():
    record = find("harmonic-drive-csf-17-100-2uh", "gearbox")
    assert record.losses.empty and record.level() == "estimated losses"
    gearbox = lm.gearbox(record.name)
    # At rated load and speed an efficiency eta loses 1/eta - 1 of what the load takes: 0.75, within 0.6 to 0.85.
    losses, speed = gearbox.losses, gearbox.losses.speeds.index(1.0)
    lost = losses.values[losses.loads.index(1.0)][speed]
    assert lost == pytest.approx(1.0 / 0.75 - 1.0)
    assert [lost * factor for factor in gearbox.loss_range] == pytest.approx([1.0 / 0.85 - 1.0, 1.0 / 0.6 - 1.0])
    assert "estimated as 75%" in str(gearbox.note) and "60% to 85%" in str(gearbox.note)
    assert "only those of a" in refused(lambda: gearbox.model_copy(update={"losses": {"kind": "constant_efficiency", "efficiency": 0.9}}))


def test_a_motor_without_winding_runs_as_a_torque_source_within_its_printed_torques():
    record = find("yaskawa-sgm7j-01a", "motor")
    assert record.level() == "torque source"
    motor = lm.motor(record.name)
    assert (motor.kind, motor.friction_torque, motor.limits.peak_torque) == ("torque_source", 0.0, 1.11)
    assert motor.note.keys() == {"kind", "friction_torque"}
    siemens = lm.Motor(**motor_table("siemens-1ft7044-ak7", {"dc_voltage": "600 V", "friction_torque": 0.1}))
    assert siemens.kind == "synchronous" and "taken as 0" not in str(siemens.note)
    with refuses(match=r"lacks dc_voltage.*give motor.dc_voltage beside `from`"):
        motor_table("siemens-1ft7044-ak7", {"kind": "synchronous"})


def test_data_are_read_as_they_are_printed():
    printed = sheet(name="My-Gearbox", stiffness="6 Nm/arcmin", losses={}, efficiency=0.96)
    assert printed.name == "my-gearbox"
    assert printed.stiffness.slopes == pytest.approx((6.0 * 60.0 * 180.0 / np.pi,))
    (point,) = printed.losses.efficiency
    assert (point.efficiency, point.load, point.input_speed) == (0.96, 1.0, printed.rated_input_speed)
    assert "say the same; give one" in refused(lambda: sheet(efficiency=0.9, losses={"efficiency": 0.8}))
    assert find("Schaeffler-RT1-H-20-100", "gearbox") == find("schaeffler-rt1-h-20-100", "gearbox")


def test_a_loop_wider_than_the_torque_is_refused():
    record = sheet(hysteresis_loss="10 arcmin")
    assert "half of the rated torque" in refused(lambda: record.hysteresis(record.torsion_curve()))


def test_a_record_by_name_with_overrides_and_by_file(tmp_path: Path):
    by_name = lm.load(scenario_with(tmp_path, 'gearbox = "schaeffler-rt1-h-20-100"'))
    assert by_name.gearbox == lm.gearbox("schaeffler-rt1-h-20-100")
    changed = lm.load(scenario_with(tmp_path, '[gearbox]\nfrom = "schaeffler-rt1-h-20-100"\ninertia = "1 kg*cm^2"\nloss_factor = 2'))
    assert changed.gearbox.inertia == pytest.approx(1e-4)
    assert changed.gearbox.losses.values[3][1] == pytest.approx(2 * by_name.gearbox.losses.values[3][1])
    (tmp_path / "own.toml").write_text(CliRunner().invoke(app, ["catalogue", "new"]).output)
    own = lm.load(scenario_with(tmp_path, '[gearbox]\nfrom = "own.toml"'))
    assert own.gearbox.stiffness.backlash == pytest.approx(3 * ARCMIN)
    # A record takes the place of a base's gearbox, it is not mixed with it.
    child = tmp_path / "child.toml"
    child.write_text(f'base = "{(ROOT / "scenarios" / "paper-2dof-nl-large.toml")}"\n[gearbox]\nfrom = "wittenstein-tp010-mf-10"\n')
    assert lm.load(child).gearbox == lm.gearbox("wittenstein-tp010-mf-10")
    assert lm.load(child, ["gearbox.from=paper-gearbox"]).gearbox == lm.gearbox("paper-gearbox")


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ('gearbox = "no-such"', "not in the catalogue"),
        ("[gearbox]\nfrom = 3", "must be the name of a record"),
        ('[gearbox]\nfrom = "paper-gearbox"\ntemperatur = 3', "temperatur"),
        ('[gearbox]\nfrom = "paper-gearbox"\nloss_factor = -1', "loss_factor"),
        ('[gearbox]\nfrom = "paper-gearbox"\ntemperature = "60 degC"', "leave temperature out"),
        ('[gearbox]\nfrom = "nord-sk1si50-60"', "lacks inertia"),
        ('[gearbox]\nfrom = "none.toml"', "no such file"),
    ],
)
def test_bad_use_of_a_record_names_file_and_remedy(tmp_path: Path, text: str, match: str):
    path = scenario_with(tmp_path, text)
    assert refused(lambda: lm.load(path), match=match).startswith(str(path))


def test_command_line(tmp_path: Path):
    run = CliRunner().invoke
    listed = run(app, ["catalogue", "--kind", "strain_wave", "--ratio", "50..120", "--torque", "20..100"])
    assert listed.exit_code == 0
    assert "schaeffler-rt1-h-20-100" in listed.output
    assert "schaeffler-rt1-h-14-100" not in listed.output
    shown = run(app, ["catalogue", "nord-sk1si50-60"])
    assert "static efficiency" in shown.output
    assert "Not complete: a simulation also needs inertia, stiffness." in shown.output
    template = tmp_path / "own.toml"
    assert run(app, ["catalogue", "new", "-o", str(template)]).exit_code == 0
    out = tmp_path / "sheet"
    done = run(app, ["rig", str(template), "-o", str(out)])
    assert done.exit_code == 0, done.output
    assert {p.name for p in out.iterdir()} == {"rig.html", "rig.csv", "comparison.csv", "efficiency.csv"}
    page = (out / "rig.html").read_text()
    assert "back-driving torque" in page
    assert "ask the manufacturer" in page
    checked = run(app, ["check", str(ROOT / "scenarios" / "catalogue-robot-joint.toml")])
    assert checked.exit_code == 0
    assert "Verdict: fits, with a reservation: 3 of 16 points not judged" in checked.output  # it gives no limits for them


def test_a_name_that_is_none_is_answered_with_near_ones():
    done = CliRunner().invoke(app, ["catalogue", "maxon-re-65-35329"])
    assert isinstance(done.exception, InputError)
    assert "did you mean maxon-re-65-35329" in str(done.exception)


def test_difference_is_relative():
    assert Comparison("x", "1", 2.0, 2.1).difference == pytest.approx(0.05)

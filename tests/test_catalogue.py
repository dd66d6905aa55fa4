"""Records of the catalogue: what they hold, scenarios that name them, bad sheets."""

import json
import math
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import lostmotion as lm
from conftest import ROOT
from lostmotion.cli import app
from lostmotion.data_sheets import records
from lostmotion.data_sheets.components import motor_table
from lostmotion.data_sheets.loss_data import Lubricant
from lostmotion.data_sheets.loss_map_from_data_sheet import build_loss_map
from lostmotion.data_sheets.records import KINDS, catalogue, find, parse_sheets
from lostmotion.errors import InputError
from lostmotion.inputs.toml_text import toml_text
from lostmotion.paper import paper_scenario
from lostmotion.reports.rig import summary_rows
from lostmotion.simulation.scenario.scenario_files import gearbox_from_record
from lostmotion.test_rig.comparison import Comparison
from lostmotion.test_rig.virtual_rig import TestRig
from refusals import refusals_of, refused
from sheets import ARCMIN, COMPLETE, GEARBOXES, MOTORS, RPM, gearbox_of, scenario_with, sheet


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
    refused(lambda: lm.gearbox("nord-sk1si50-60"), reason="give gearbox.inertia")


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


AT = {"efficiency": [{"input_speed": 200.0, "efficiency": 0.9}]}
test_a_bad_sheet_is_refused = refusals_of(
    lambda changes: parse_sheets({"gearbox": [sheet().model_dump(exclude_none=True, exclude={"sources", "gaps"}) | changes]}, "my.toml"),
    ({"rated_output_torque": "-5 N*m"}, "rated_output_torque"),
    ({"rated_output_torque": "52 rpm"}, "rated_output_torque: unit of something else"),
    ({"ratio": 0}, "ratio"),
    ({"inertia": "-1 kg*m^2"}, "inertia"),
    ({"stiffness": {"slopes": [1e4, 2e4], "torques": []}}, ": one torque fewer"),
    ({"stiffness": {"slopes": [1e4, 2e4, 3e4], "torques": [9, 5]}}, ": do not rise"),
    ({"stiffness": {"slopes": []}}, "stiffness.slopes"),
    ({"losses": {"efficiency": [{"input_speed": "2000 rpm", "efficiency": 1.2}]}}, "losses.efficiency[0].efficiency"),
    ({"losses": {"efficiency": [{"input_speed": "2000 rpm", "efficiency": 0.0}]}}, "losses.efficiency[0].efficiency"),
    ({"losses": {"load_correction": [[0.5, 0.9]]}}, ": exactly one efficiency at load 1"),
    ({"losses": AT | {"load_correction": [[1.5, 1.2]]}}, ": above 1"),
    ({"losses": {"efficiency": AT["efficiency"] * 2}}, ": twice"),
    ({"losses": {"starting_torqe": 0.1}}, "losses.starting_torqe: is not known"),
    ({"losses": {"lubricant": {"viscosity_40": 1e-5, "viscosity_100": 2e-5}}}, ": thins"),
    ({"hysteresis_loss": 1e-3, "hysteresis_efficiency": 0.9}, ": give one"),
    ({"name": "My Gearbox"}, "name"),
    ({"kind": "magic"}, "kind"),
)


def test_files_that_are_no_sheets(tmp_path: Path):
    path = tmp_path / "s.toml"
    for text, match in (
        ("gearbox = 3", "double brackets"),
        ("gearbox = [3]", "double brackets"),
        ("source = 3\n[[gearbox]]\nname = 'x'", "key source: 3 must be tables"),
        ("[[gearbox]]\nname = 'x'\ngap = 'y'", 'gearbox x: key gap: "y" must be tables'),
        ("", "no record"),
        ("gearboks = []", "did you mean gearbox"),
        ("[", "TOML"),
    ):
        path.write_text(text)
        refused(lambda: find(str(path), "gearbox"), match=match)
    refused(lambda: find(str(tmp_path / "none.toml"), "gearbox"), reason="no such file")
    refused(lambda: find("schaeffler-rt1-h-20-10", "gearbox"), reason="did you mean schaeffler-rt1-h-20-100")
    wide = sheet(hysteresis_loss="10 arcmin")
    refused(lambda: wide.hysteresis(wide.torsion_curve()), reason="half of the rated torque")
    bare = sheet(kind="cycloidal", losses={}, gaps=[{"datum": "losses.efficiency", "where": "the catalogue, page 7"}])
    refused(lambda: build_loss_map(bare), reason="the catalogue, page 7")
    assert Comparison("x", "1", 2.0, 2.1).difference == pytest.approx(0.05)


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
    refused(lambda: motor_table("siemens-1ft7044-ak7", {"kind": "synchronous"}), reason="give motor.dc_voltage beside `from`")


def test_data_are_read_as_they_are_printed():
    printed = sheet(name="My-Gearbox", stiffness="6 Nm/arcmin", losses={}, efficiency=0.96)
    assert printed.name == "my-gearbox"
    assert printed.stiffness.slopes == pytest.approx((6.0 * 60.0 * 180.0 / np.pi,))
    (point,) = printed.losses.efficiency
    assert (point.efficiency, point.load, point.input_speed) == (0.96, 1.0, printed.rated_input_speed)
    assert "say the same; give one" in refused(lambda: sheet(efficiency=0.9, losses={"efficiency": 0.8}))
    assert find("Schaeffler-RT1-H-20-100", "gearbox") == find("schaeffler-rt1-h-20-100", "gearbox")


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


test_bad_use_of_a_record_names_the_remedy = refusals_of(
    lambda text, *, tmp_path: lm.load(scenario_with(tmp_path, text)),
    ('gearbox = "no-such"', ": not in the catalogue"),
    ("[gearbox]\nfrom = 3", ": must be the name of a record"),
    ('[gearbox]\nfrom = "paper-gearbox"\ntemperatur = 3', "gearbox.temperatur"),
    ('[gearbox]\nfrom = "paper-gearbox"\nloss_factor = -1', ": loss_factor: -1.0 must be greater than 0"),
    ('[gearbox]\nfrom = "paper-gearbox"\ntemperature = "60 degC"', ": leave temperature out"),
    ('[gearbox]\nfrom = "nord-sk1si50-60"', ": lacks inertia"),
    ('[gearbox]\nfrom = "none.toml"', ": no such file"),
)


def test_command_line(tmp_path: Path):
    run = CliRunner().invoke
    listed = run(app, ["catalogue", "--kind", "strain_wave", "--ratio", "50..120", "--torque", "20..100"])
    assert listed.exit_code == 0
    assert "schaeffler-rt1-h-20-100" in listed.output
    assert "schaeffler-rt1-h-14-100" not in listed.output
    shown = run(app, ["catalogue", "nord-sk1si50-60"])
    assert "static efficiency" in shown.output
    assert "Not complete: a simulation also needs inertia, stiffness." in shown.output
    assert "did you mean maxon-re-65-35329" in str(run(app, ["catalogue", "maxon-re-65-35329"]).exception)
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


# --- changes to what the catalogue has ---
def own_sheet(tmp_path: Path, **changes) -> str:
    """A sheet file of one's own, with a printed width of the torsion loop."""
    record = sheet(name="own", backlash="1 arcmin", hysteresis_loss="2 arcmin", **changes)
    given = {name: getattr(record, name) for name in record.model_fields_set}
    lines = ["[[gearbox]]"]
    for key in ("name", "kind", "ratio", "rated_output_torque", "rated_input_speed", "inertia", "backlash", "hysteresis_loss"):
        lines.append(f"{key} = {given[key]!r}")
    lines += [f"stiffness = {{ slopes = {list(record.stiffness.slopes)}, torques = {list(record.stiffness.torques)} }}"]
    lines += ["losses = { efficiency = [{ input_speed = 200.0, efficiency = 0.77 }] }"]
    path = tmp_path / "own.toml"
    path.write_text("\n".join(lines))
    return str(path)


def test_wear_that_adds_backlash_leaves_the_hysteresis_as_it_was(tmp_path: Path):
    name = own_sheet(tmp_path)
    new = lm.gearbox(name)
    # At half the printed width, 1 arcmin, the new gearbox carries h; (16) makes of it eta_H = 1 - 2 h/(T_R - h).
    h = 1.6e4 * 0.5 * ARCMIN
    assert new.hysteresis.efficiency == pytest.approx(1.0 - 2.0 * h / (52.0 - h), rel=1e-12)
    for added in (1e-4, "1 arcmin", "6 arcmin"):
        worn = lm.gearbox(name, added_backlash=added)
        assert worn.hysteresis == new.hysteresis
        assert worn.stiffness.backlash > new.stiffness.backlash
        assert worn.stiffness.slopes == new.stiffness.slopes
        assert worn.losses == new.losses
    # On the rig, the loop of the worn one is wider by the added gap and by nothing else.
    worn = lm.gearbox(name, added_backlash="6 arcmin")
    wider = TestRig(worn).loop(52.0).width - TestRig(new).loop(52.0).width
    assert wider / ARCMIN == pytest.approx(6.0, rel=1e-3)


def test_a_change_takes_the_place_of_what_it_names_and_of_nothing_else(tmp_path: Path):
    path = scenario_with(tmp_path, f'[gearbox]\nfrom = "{own_sheet(tmp_path)}"')
    plain = lm.load(path).gearbox
    data = plain.model_dump()
    cases = {
        "gearbox.stiffness.slopes=[1e4, '5 N*m/arcmin', 3e4]": {"slopes": (1e4, 5 / ARCMIN, 3e4)},
        "gearbox.stiffness.backlash=3 arcmin": {"backlash": 3 * ARCMIN},
    }
    for override, change in cases.items():
        changed = lm.load(path, [override]).gearbox.model_dump()
        wanted = data["stiffness"] | change
        assert changed["stiffness"].keys() == wanted.keys()
        for key in ("slopes", "breaks", "backlash", "preload"):
            assert changed["stiffness"][key] == pytest.approx(wanted[key], rel=1e-14)
        assert {k: v for k, v in changed.items() if k != "stiffness"} == {k: v for k, v in data.items() if k != "stiffness"}
    values = [[2 * x for x in row] for row in plain.losses.values]
    changed = lm.load(path, [f"gearbox.losses.values={values}"]).gearbox
    assert changed.losses.values == tuple(map(tuple, values))
    assert changed.losses.speeds == plain.losses.speeds
    assert changed.stiffness == plain.stiffness
    limited = lm.load(path, ["gearbox.limits.peak_output_torque=99 Nm"]).gearbox.limits
    assert limited == plain.limits.model_copy(update={"peak_output_torque": 99.0})


def test_a_table_that_says_its_kind_takes_the_place_of_the_whole_one(tmp_path: Path):
    path = scenario_with(tmp_path, f'[gearbox]\nfrom = "{own_sheet(tmp_path)}"')
    plain = lm.load(path).gearbox
    curve = lm.load(path, ['gearbox.stiffness={kind = "curve", slopes = [2e4]}']).gearbox
    assert curve.stiffness == lm.model.TorsionCurve(slopes=(2e4,))  # without the record's backlash
    linear = lm.load(path, ['gearbox.stiffness={kind = "linear", stiffness = "6 Nm/arcmin"}']).gearbox
    assert linear.stiffness == lm.model.LinearStiffness(stiffness="6 Nm/arcmin")
    assert curve.hysteresis == linear.hysteresis == plain.hysteresis
    assert lm.load(path, ['gearbox.stiffness={kind = "rigid"}']).gearbox.hysteresis is None


def test_the_order_of_changes_does_not_count(tmp_path: Path):
    path = scenario_with(tmp_path, 'gearbox = "schaeffler-rt1-h-20-100"')
    changes = ["gearbox.inertia=3 kgcm2", "gearbox.from=paper-gearbox", "gearbox.added_backlash=1 arcmin"]
    one, other = lm.load(path, changes), lm.load(path, changes[::-1])
    assert one == other
    assert one.gearbox.inertia == pytest.approx(3e-4)
    assert one.gearbox.ratio == 90
    replaced = lm.load(path).replace(**dict(c.split("=") for c in changes), title=one.title)
    assert replaced == one  # which keeps its title by itself


def test_added_backlash_adds_to_a_changed_curve_too(tmp_path: Path):
    path = scenario_with(tmp_path, f'[gearbox]\nfrom = "{own_sheet(tmp_path)}"')
    both = lm.load(path, ["gearbox.stiffness.backlash=3 arcmin", "gearbox.added_backlash=1 arcmin"])
    assert both.gearbox.stiffness.backlash == pytest.approx(4 * ARCMIN)


test_a_change_without_effect_or_sense_is_refused = refusals_of(
    lambda *overrides, tmp_path: lm.load(scenario_with(tmp_path, f'[gearbox]\nfrom = "{own_sheet(tmp_path)}"'), list(overrides)),
    ("gearbox.losses.efficiency=0.9", "gearbox.loss_factor=2", "gearbox.loss_factor: acts on the record's own losses"),
    ('gearbox.losses={kind="constant_efficiency",efficiency=0.9}', "gearbox.temperature=40", "gearbox.temperature: acts"),
    ('gearbox.stiffness={kind="linear",stiffness=1e4}', "gearbox.added_backlash=1e-3", ": needs a torsion curve"),
    ("gearbox.stiffness.slopes=[1e4]", "gearbox.stiffness: has 1 slopes and 2 breaks"),
    ("gearbox.stiffness.slops=[1e4]", "gearbox.stiffness.slops: is not known; did you mean slopes"),
    ("gearbox.stiffness=5", "gearbox.stiffness: 5 must be a table"),
    ("gearbox.losfactor=2", "gearbox.losfactor: is not known; did you mean loss_factor"),
    ("gearbox.inertia=1,2 kgcm2", ': has a decimal comma; write "1.2 kgcm2"'),
    ("gearbox=maxon-ec-i-52-606793", ": is a motor; a gearbox is wanted here"),
    ("motor=schaeffler-rt1-h-20-100", ": is a gearbox; a motor is wanted here"),
)


def test_a_change_closes_the_gap_of_a_motor(tmp_path: Path):
    (tmp_path / "motor.toml").write_text(
        '[[motor]]\nname = "m"\nrated_voltage = "24 V"\nrated_torque = "1 Nm"\nrated_speed = "3000 1/min"\nno_load_current = "0.1 A"\n'
        'torque_constant = "0.05 Nm/A"\nresistance = "0.2 ohm"\ninductance = "0.2 mH"\n'
    )
    name = str(tmp_path / "motor.toml")
    path = scenario_with(tmp_path, 'gearbox = "paper-gearbox"')
    refused(lambda: lm.load(path, [f"motor.from={name}"]), reason="give motor.rotor_inertia beside")
    filled = lm.load(path, [f"motor.from={name}", "motor.rotor_inertia=2 kgcm2", "motor.friction_torque=0.03"]).motor
    assert filled.rotor_inertia == pytest.approx(2e-4)
    assert filled.friction_torque == 0.03
    assert filled.rated_torque == pytest.approx(1.0 + 0.05 * 0.1)  # of the record, with the friction of the record


def test_the_rig_answers_in_its_own_words():
    for arguments, words in (
        (["maxon-ec-i-52-606793"], "maxon-ec-i-52-606793 is a motor; a gearbox or screw is wanted here"),
        (["paper-gearbox", "--set", "losfactor=2"], "losfactor: is not known; did you mean loss_factor?"),
        (["paper-gearbox", "--set", "stiffness.slops=[2]"], "stiffness.slops: is not known; did you mean slopes?"),
        (["paper-gearbox", "--set", "inertia=1 kg*m"], "inertia"),
    ):
        done = CliRunner().invoke(app, ["rig", *arguments])
        assert isinstance(done.exception, InputError)
        assert words in str(done.exception)
        assert "simulation" not in str(done.exception)  # a key of scenarios


def test_changed_parts_are_those_that_the_rig_measures(tmp_path: Path):
    part, _ = gearbox_from_record("paper-gearbox", ["gearbox.ratio=80", "stiffness.slopes=[3e3, 2e4, 3e4]"])
    assert part.ratio == 80
    assert part.stiffness.slopes == (3e3, 2e4, 3e4)


def test_the_rig_gives_no_figure_where_there_is_no_cause():
    """A curve without hysteresis and backlash has no loop; what the rig measures of one is rounding."""
    plain = lm.gearbox("paper-gearbox").model_copy(update={"hysteresis": None})
    assert plain.stiffness.backlash == 0.0
    slack = plain.model_copy(update={"stiffness": plain.stiffness.model_copy(update={"backlash": 1e-3})})
    rows = {name: dict(summary_rows(lm.test_rig.measure(g))) for name, g in (("plain", plain), ("slack", slack))}
    width, energy = "width of the loop at zero torque, rated torque in both directions", "energy lost in that loop"
    assert rows["plain"][width] == "none: neither hysteresis nor backlash is given"
    assert rows["slack"][width].startswith(f"{np.degrees(1e-3) * 60.0:.4g}"[:4])  # the backlash, in arcmin
    assert rows["plain"][energy] == rows["slack"][energy] == "none: no hysteresis is given"
    assert dict(summary_rows(lm.test_rig.measure(lm.gearbox("paper-gearbox"))))[energy].endswith(" J")


def test_a_reversed_range_is_told_as_such():
    for words, sentence in (
        (["--ratio", "120..50"], "--ratio 120..50: is reversed; write 50..120"),
        (["--torque", "1,5..3"], 'has a decimal comma; write "1.5 N*m"'),
        (["--torque", ".."], ""),
        (["--torque", "nan..3"], "is not a finite number"),
    ):
        done = CliRunner().invoke(app, ["catalogue", *words])
        assert (done.exit_code == 0) is (sentence == "")
        assert sentence in str(done.exception or "").replace("'", '"')
    bare, united = (CliRunner().invoke(app, ["catalogue", "--torque", t]) for t in ("20..30", "20 Nm..3 kgf*m"))
    assert bare.exit_code == united.exit_code == 0


# --- notes of parts after an override ---
MAP = {"kind": "map", "speeds": [0.0, 1.0], "loads": [0.0, 1.0], "values": [[0.01, 0.02], [0.03, 0.05]], "mirrored": True}


def train(tmp_path: Path, **changes: Any) -> lm.Scenario:
    gear = {"gearbox": "paper-gearbox", "input": "a", "output": "b"} | changes
    shafts = {"a": {"inertia": 1e-3}, "b": {"inertia": 1.0}}
    time = {"duration": 0.1, "sample_interval": 0.01}
    (tmp_path / "train.toml").write_text(toml_text({"shafts": shafts, "gears": {"stage": gear}, "simulation": time}))
    return lm.load(tmp_path / "train.toml")


def with_base(tmp_path: Path) -> lm.Scenario:
    shutil.copy(ROOT / "scenarios" / "paper-2dof-nl-small.toml", tmp_path / "old.toml")
    shutil.copy(ROOT / "scenarios" / "paper-2dof-nl-large.toml", tmp_path)
    losses = "\n".join(f"{key} = {json.dumps(value)}" for key, value in MAP.items())
    (tmp_path / "own.toml").write_text(f'base = "old.toml"\n[gearbox.losses]\n{losses}\n')
    return lm.load(tmp_path / "own.toml")


WAYS: dict[str, Callable[[Path], lm.Scenario]] = {
    "overrides": lambda _: lm.load("paper-2dof-nl-small", {"gearbox.losses": MAP}),
    "one key": lambda _: lm.load("paper-2dof-nl-small", {"gearbox.losses.values.0.0": 0.03}),
    "replace": lambda _: lm.load("paper-2dof-nl-small").replace(**{"gearbox.losses": MAP}),
    "base": with_base,
    "beside its record": lambda _: lm.load("paper-2dof-nl-small", {"gearbox": {"from": "paper-gearbox", "losses": MAP}}),
    "train": lambda path: train(path, losses=MAP),
    "train, override": lambda path: lm.load(train(path) and path / "train.toml", {"gears.stage.losses": MAP}),
    "train, replace": lambda path: train(path).replace(**{"gears.stage.losses": MAP}),
}


@pytest.mark.parametrize("way", WAYS)
def test_a_loss_table_that_was_replaced_is_no_stand_in(way: str, tmp_path: Path) -> None:
    assert "stand-in" in lm.load("paper-2dof-nl-small").note()
    assert "stand-in" in train(tmp_path).note()
    scenario = WAYS[way](tmp_path)
    assert scenario.note() == ""
    assert "note" not in lm.simulate(scenario).attrs


def test_losses_that_replace_those_of_a_record_are_no_estimate_and_no_stand_in() -> None:
    estimated = next(r.name for r in lm.catalogue() if r.kind in ("planetary", "strain_wave") and r.level() == "estimated losses")
    scenario = lm.load("catalogue-robot-joint", {"gearbox": {"from": estimated}})
    assert scenario.gearbox.loss_range is not None
    assert "estimated" in scenario.gearbox.note["losses"]
    changed = scenario.replace(**{"gearbox.losses": MAP})
    assert changed.gearbox.loss_range is None
    assert "losses" not in changed.gearbox.note
    for own, said in (([], True), (["--set", "losses={kind='constant_efficiency', efficiency=0.9}"], False)):
        assert ("stand-in" in CliRunner().invoke(app, ["rig", "paper-gearbox", *own]).output) == said


def test_a_note_that_is_still_true_stays() -> None:
    same = {"gearbox.losses.values": lm.load("paper-2dof-nl-small").gearbox.losses.model_dump()["values"]}
    for changes in (same, {"load.inertia": 2.0}, {"gearbox.ratio": 80.0}, {"gearbox.hysteresis.efficiency": 0.9}):
        for scenario in (lm.load("paper-2dof-nl-small", changes), lm.load("paper-2dof-nl-small").replace(**changes)):
            assert "stand-in" in scenario.note()
    own = {"gearbox.note": {"losses": "The table of our rig."}}
    for both in (own | {"gearbox.losses": MAP}, {"gearbox.losses": MAP} | own):
        assert lm.load("paper-2dof-nl-small", both).note() == "The table of our rig."
    text = {"gearbox.note": "The losses of our rig."}
    assert lm.load("paper-2dof-nl-small", text).replace(**{"gearbox.losses": MAP}).note() == "The losses of our rig."


def test_a_note_is_about_the_value_that_it_names_whatever_its_words_are(tmp_path: Path) -> None:
    """The note of an own record speaks of losses and is about the backlash; another is about one limit of several."""
    shutil.copy(ROOT / "src" / "lostmotion" / "catalogue" / "paper.toml", tmp_path / "own.toml")
    text = (tmp_path / "own.toml").read_text()
    note = 'note = {stiffness = "No loss of the gap is known.", "limits.max_input_speed" = "Of a torn page."}'
    (tmp_path / "own.toml").write_text(re.sub("note.losses = .*", note, text))
    table = {"from": str(tmp_path / "own.toml")}
    joint = lm.load("paper-2dof-nl-small", {"gearbox": table})
    for changes, left in (
        ({"gearbox.losses": MAP}, {"stiffness", "limits.max_input_speed"}),
        ({"gearbox.stiffness.backlash": "1 arcmin"}, {"limits.max_input_speed"}),
        ({"gearbox.limits.max_input_speed": "5000 rpm"}, {"stiffness"}),
        ({"gearbox.limits.average_input_speed": "3000 rpm"}, {"stiffness", "limits.max_input_speed"}),
    ):
        assert joint.replace(**changes).gearbox.note.keys() == left
        assert lm.load("paper-2dof-nl-small", {"gearbox": table, **changes}).gearbox.note.keys() == left
    worn = lm.load("paper-2dof-nl-small", {"gearbox": {**table, "added_backlash": "1 arcmin"}})
    assert worn.gearbox.note.keys() == {"limits.max_input_speed"}
    refused(lambda: lm.load("paper-2dof-nl-small", {"gearbox.note": {"lossez": "A misprint."}}), "gearbox.note")


def test_what_is_said_of_a_friction_that_is_not_printed_goes_when_it_is_given() -> None:
    joint = "catalogue-robot-joint"
    changes = {"motor": {"from": "siemens-1ft7044-ak7"}}
    assert lm.load(joint, changes).motor.note.keys() == {"winding", "kind", "friction_torque"}
    for scenario in (
        lm.load(joint, {"motor": {"from": "siemens-1ft7044-ak7", "friction_torque": 0.05}}),
        lm.load(joint, changes | {"motor.friction_torque": 0.05}),
        lm.load(joint, changes).replace(**{"motor.friction_torque": 0.05}),
    ):
        assert scenario.motor.note.keys() == {"winding", "kind"}  # still a torque source


# --- titles ---
def test_a_title_names_the_values_that_were_changed_below_it(tmp_path: Path) -> None:
    """The joint of the title swings at 1 Hz, the changed one at 2 Hz."""
    plain = lm.load("catalogue-robot-joint").title
    changes = {"command.frequency": "2 Hz", "simulation.duration": 1.0}
    assert lm.load("catalogue-robot-joint", changes).title == f"{plain}; changed: command.frequency"
    assert lm.load("catalogue-robot-joint", {"simulation.duration": 1.0}).title == plain
    assert lm.load("catalogue-robot-joint", {"title": "Mine", "command.frequency": 2.0}).title == "Mine"
    file = tmp_path / "run.csv"
    lm.save(lm.simulate(lm.load("catalogue-robot-joint", changes)), file)
    again = lm.load(file, {"load.inertia": 2.0, "command.frequency": 3.0})
    assert again.title == f"{plain}; changed: command.frequency, load.inertia"
    many = {f"load.{key}": 1.0 for key in ("inertia", "friction_torque", "viscous_friction")}
    assert lm.load("catalogue-robot-joint", {**changes, **many}).title.endswith(", load.inertia, ...")


# --- loss maps from data sheets ---
def test_measured_nodes_carry_their_figure_and_their_origin():
    built = build_loss_map(sheet())
    speeds, loads, values = built.losses.whole()
    at = {(round(mu, 4), round(v, 4)): (values[j][k], built.origin[j][k]) for j, mu in enumerate(loads) for k, v in enumerate(speeds)}
    assert at[1.0, 1.0] == (pytest.approx(1 / 0.77 - 1), "efficiency (area 1)")
    assert at[0.0, 1.0] == (pytest.approx(100 * 0.105 / 52), "no-load torque (area 2)")
    assert at[0.0, 0.0] == (pytest.approx(100 * 0.037 / 52), "starting torque (area 3)")
    mu = round(-3.89 / 52, 4)
    assert at[mu, 0.0] == (pytest.approx(3.89 / 52), "back-driving torque (area 4)")
    assert all(o.startswith("filled in") or "(area" in o for row in built.origin for o in row)
    assert built.notes == ()


def test_the_efficiency_is_not_used_towards_zero_load():
    built = build_loss_map(sheet())
    core = built.losses.core()
    # Along mu (1/eta - 1) the loss would vanish with mu; here what turns the unloaded gearbox remains.
    assert core(1e-6, 1.0) == pytest.approx(100 * 0.105 / 52, rel=1e-4)


def test_a_contradiction_is_reported_with_both_figures():
    record = find("wittenstein-tp010-mf-10", "gearbox")
    built = build_loss_map(record)
    assert len(built.notes) == 1
    assert "0.64 N·m, 0.079 of rated torque" in built.notes[0]
    assert "efficiency 0.97 at load 1 leaves no more than 0.0309" in built.notes[0]
    gearbox = lm.gearbox(record.name)
    assert built.notes[0] in gearbox.note["losses"]  # and so in every result
    # The documented choice: no-load torque kept, the efficiency for what the load adds.
    eta = TestRig(gearbox).efficiency(record.rated_input_speed, 1.0)
    # The flywheel slows down by parts in a billion while the load settles.
    assert eta == pytest.approx(1 / (1 + 0.64 * 10 / 81 + 1 / 0.97 - 1), rel=1e-7)


def test_load_correction_gives_more_efficiencies():
    losses = sheet().losses.model_dump(exclude_none=True) | {"load_correction": [(0.25, 0.6), (0.5, 0.85), (1.0, 1.0)]}
    rig = TestRig(gearbox_of(sheet(losses=losses)))
    for load, factor in ((0.25, 0.6), (0.5, 0.85), (1.0, 1.0)):
        assert rig.efficiency(2000 * RPM, load) == pytest.approx(0.77 * factor, rel=1e-8)


def test_drive_and_backdrive_efficiency_hold_each_on_its_side():
    losses = {
        "efficiency": [{"input_speed": "1400 rpm", "efficiency": 0.8}],
        "backdrive_efficiency": [{"input_speed": "1400 rpm", "efficiency": 0.7}],
        "no_load_torque": [{"input_speed": "1400 rpm", "torque": 0.02}],
    }
    rig = TestRig(gearbox_of(sheet(losses=losses)))
    assert rig.efficiency(1400 * RPM, 1.0) == pytest.approx(0.8, rel=1e-8)
    assert rig.efficiency(1400 * RPM, -1.0) == pytest.approx(0.7, rel=1e-8)


def test_viscosity_follows_walther_and_scales_the_no_load_part():
    oil = Lubricant(viscosity_40="220 mm^2/s", viscosity_100="18.7 mm^2/s")
    assert oil.viscosity(40.0) == pytest.approx(220e-6, rel=1e-12)
    assert oil.viscosity(100.0) == pytest.approx(18.7e-6, rel=1e-12)
    # In the chart of ASTM D341, log log (nu + 0.7) over log T, an oil is a straight line.
    middle = math.sqrt(313.15 * 373.15) - 273.15
    chart = [math.log10(math.log10(oil.viscosity(t) * 1e6 + 0.7)) for t in (40.0, middle, 100.0)]
    assert chart[1] == pytest.approx(0.5 * (chart[0] + chart[2]), rel=1e-12)
    losses = sheet().losses.model_dump(exclude_none=True) | {"lubricant": oil.model_dump()}
    record = sheet(losses=losses)
    cold, warm = build_loss_map(record, temperature=0.0), build_loss_map(record, temperature=60.0)
    factor = (oil.viscosity(60.0) / oil.viscosity(0.0)) ** (2 / 3)
    ratio = warm.losses.core()(0.0, 1.0) / cold.losses.core()(0.0, 1.0)
    assert ratio == pytest.approx(factor, rel=1e-12)
    assert "60 °C" in warm.notes[0]


def test_no_load_torque_at_two_temperatures_is_used_between_and_refused_outside():
    points = [
        {"input_speed": "2000 rpm", "torque": 0.105, "temperature": "20 degC"},
        {"input_speed": "2000 rpm", "torque": 0.065, "temperature": "60 degC"},
    ]
    losses = sheet().losses.model_dump(exclude_none=True) | {"no_load_torque": points}
    record = sheet(losses=losses)
    at_40 = build_loss_map(record, temperature=40.0).losses.core()(0.0, 1.0)
    assert at_40 == pytest.approx(100 * 0.085 / 52)
    assert "from 20 to 60 °C, not at 80 °C" in refused(lambda: build_loss_map(record, temperature=80.0))


def test_figures_of_different_temperatures_are_each_taken_at_their_own():
    # No-load torque at 20 and 60 °C; starting torque measured cold, efficiency warm. At each figure's temperature the map
    # gives that figure back.
    losses = {
        "no_load_torque": [
            {"input_speed": "2000 rpm", "torque": 0.105, "temperature": "20 degC"},
            {"input_speed": "2000 rpm", "torque": 0.065, "temperature": "60 degC"},
        ],
        "efficiency": [{"input_speed": "2000 rpm", "efficiency": 0.8, "temperature": "60 degC"}],
        "starting_torque": 0.037,
        "starting_temperature": "20 degC",
        "backdriving_torque": 3.0,
        "backdriving_temperature": "60 degC",
    }
    record = sheet(losses=losses)
    cold, warm = (build_loss_map(record, temperature=t).losses.core() for t in (20.0, 60.0))
    assert cold(0.0, 0.0) == pytest.approx(100 * 0.037 / 52)
    assert warm(0.0, 0.0) == pytest.approx(100 * 0.037 / 52 * 65 / 105)
    assert warm(1.0, 1.0) == pytest.approx(1 / 0.8 - 1)
    assert cold(1.0, 1.0) == pytest.approx(1 / 0.8 - 1 + 100 * (0.105 - 0.065) / 52)
    assert warm(-3.0 / 52, 0.0) == pytest.approx(3.0 / 52)


def test_wear_adds_backlash_and_multiplies_losses():
    new, worn = (lm.gearbox("bonfiglioli-tr080-3-90"), lm.gearbox("bonfiglioli-tr080-3-90", added_backlash=2e-3, loss_factor=1.5))
    assert worn.stiffness.backlash - new.stiffness.backlash == pytest.approx(2e-3)
    assert worn.losses.core()(1.0, 1.0) == pytest.approx(1.5 * new.losses.core()(1.0, 1.0))


def test_a_title_of_a_base_names_the_values_that_a_file_over_it_changes(tmp_path: Path) -> None:
    """The joint of the base swings at 1 Hz, the joint of the file at 2 Hz. A file with a title keeps that title."""
    plain = lm.load("catalogue-robot-joint").title
    file = tmp_path / "mine.toml"
    file.write_text('base = "catalogue-robot-joint"\n[command]\nfrequency = "2 Hz"\n[simulation]\nduration = 1.0\n')
    assert lm.load(file).title == f"{plain}; changed: command.frequency"
    assert lm.load(file, {"load.inertia": 2.0}).title == f"{plain}; changed: command.frequency, load.inertia"
    file.write_text('title = "Mine"\n' + file.read_text())
    assert lm.load(file).title == "Mine"

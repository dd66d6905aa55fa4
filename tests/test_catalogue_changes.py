"""Changes to what the catalogue has."""

from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import lostmotion as lm
from lostmotion.cli import app
from lostmotion.errors import InputError
from lostmotion.reports.rig import summary_rows
from lostmotion.simulation.scenario.scenario_files import gearbox_from_record
from lostmotion.test_rig.virtual_rig import TestRig
from refusals import refused
from sheets import ARCMIN, scenario_with, sheet


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


@pytest.mark.parametrize(
    ("overrides", "match"),
    [
        (["gearbox.losses.efficiency=0.9", "gearbox.loss_factor=2"], "gearbox.loss_factor: acts on the record's own losses"),
        (['gearbox.losses={kind="constant_efficiency",efficiency=0.9}', "gearbox.temperature=40"], "gearbox.temperature: acts"),
        (['gearbox.stiffness={kind="linear",stiffness=1e4}', "gearbox.added_backlash=1e-3"], "needs a torsion curve"),
        (["gearbox.stiffness.slopes=[1e4]"], "gearbox.stiffness: has 1 slopes and 2 breaks"),
        (["gearbox.stiffness.slops=[1e4]"], "gearbox.stiffness.slops: is not known; did you mean slopes"),
        (["gearbox.stiffness=5"], "gearbox.stiffness: 5 must be a table"),
        (["gearbox.losfactor=2"], "gearbox.losfactor: is not known; did you mean loss_factor"),
        (["gearbox.inertia=1,2 kgcm2"], 'has a decimal comma; write "1.2 kgcm2"'),
        (["gearbox=maxon-ec-i-52-606793"], "is a motor; a gearbox is wanted here"),
        (["motor=schaeffler-rt1-h-20-100"], "is a gearbox; a motor is wanted here"),
    ],
)
def test_a_change_without_effect_or_sense_is_refused(tmp_path: Path, overrides: list[str], match: str):
    path = scenario_with(tmp_path, f'[gearbox]\nfrom = "{own_sheet(tmp_path)}"')
    assert refused(lambda: lm.load(path, overrides), match=match).startswith(str(path))


def test_a_change_closes_the_gap_of_a_motor(tmp_path: Path):
    (tmp_path / "motor.toml").write_text(
        '[[motor]]\nname = "m"\nrated_voltage = "24 V"\nrated_torque = "1 Nm"\nrated_speed = "3000 1/min"\nno_load_current = "0.1 A"\n'
        'torque_constant = "0.05 Nm/A"\nresistance = "0.2 ohm"\ninductance = "0.2 mH"\n'
    )
    name = str(tmp_path / "motor.toml")
    path = scenario_with(tmp_path, 'gearbox = "paper-gearbox"')
    refused(lambda: lm.load(path, [f"motor.from={name}"]), match=r"lacks rotor_inertia.*give motor\.rotor_inertia beside")
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

"""Component catalogue, loss maps from data sheets, virtual test rig, drive check."""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

import lostmotion as lm
from conftest import ROOT
from lostmotion.cli import app
from lostmotion.data_sheets.components import gearbox_table
from lostmotion.data_sheets.gearbox_sheet import GearboxSheet
from lostmotion.data_sheets.loss_data import Lubricant
from lostmotion.data_sheets.loss_map_builder import build_loss_map
from lostmotion.data_sheets.motor_sheet import MotorSheet
from lostmotion.data_sheets.records import catalogue, find, parse_sheets
from lostmotion.errors import InputError
from lostmotion.paper import paper_scenario
from lostmotion.reports.rig import summary_rows
from lostmotion.simulation.scenario_files import gearbox_from_record
from lostmotion.sizing.drive_check import check_drive
from lostmotion.test_rig.comparison import Comparison, compare
from lostmotion.test_rig.rig import TestRig

RPM = math.pi / 30.0
ARCMIN = math.pi / 10800.0
GEARBOXES = [r for r in catalogue() if isinstance(r, GearboxSheet)]
COMPLETE = [r for r in GEARBOXES if not r.missing()]
MOTORS = [r for r in catalogue() if isinstance(r, MotorSheet)]


def sheet(**changes) -> GearboxSheet:
    values = {
        "name": "sheet",
        "kind": "strain_wave",
        "ratio": 100,
        "rated_output_torque": "52 N*m",
        "rated_input_speed": "2000 rpm",
        "inertia": "0.193 kg*cm^2",
        "stiffness": {"slopes": [1.6e4, 2.5e4, 2.9e4], "torques": [7, 25]},
        "losses": {
            "efficiency": [{"input_speed": "2000 rpm", "efficiency": 0.77}],
            "no_load_torque": [{"input_speed": "2000 rpm", "torque": 0.105}],
            "starting_torque": 0.037,
            "backdriving_torque": 3.89,
        },
    }
    return GearboxSheet(**(values | changes))


def gearbox_of(record: GearboxSheet) -> lm.Gearbox:
    built = build_loss_map(record)
    curve = record.torsion_curve()
    return lm.Gearbox(**record.scalars(), stiffness=curve, hysteresis=record.hysteresis(curve), losses=built.losses)


# --- the records ---


def test_every_figure_of_every_record_has_a_source():
    for record in catalogue():
        for figure in record.given():
            assert record.source_of(figure) is not None, (record.name, figure)


def test_names_are_unique_and_enough_records_can_run():
    names = [r.name for r in catalogue()]
    assert len(set(names)) == len(names)
    assert {r.kind for r in COMPLETE} >= {"strain_wave", "planetary"}
    assert len(COMPLETE) >= 8
    assert len([r for r in MOTORS if not r.missing()]) >= 4
    assert {r.kind for r in GEARBOXES} >= {"strain_wave", "planetary", "worm"}


def test_what_is_missing_is_named_with_the_place_to_read_it():
    for record in catalogue():
        for key, text in record.missing().items():
            assert "see" in text, (record.name, key)
    with pytest.raises(InputError, match=r"nord-sk1si50-60.*lacks inertia.*NORD.*give gearbox.inertia"):
        lm.gearbox("nord-sk1si50-60")


def test_the_papers_records_are_the_papers_drive():
    scenario = paper_scenario("2-DOF-NL", "large")
    gearbox, motor = lm.gearbox("paper-gearbox"), lm.motor("paper-motor")
    assert "stand-in" in gearbox.note
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


# --- the loss map ---


def test_measured_nodes_carry_their_figure_and_their_origin():
    built = build_loss_map(sheet())
    speeds, loads, values = built.losses.whole()
    at = {
        (round(mu, 4), round(v, 4)): (values[j][k], built.origin[j][k])
        for j, mu in enumerate(loads)
        for k, v in enumerate(speeds)
    }
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
    assert built.notes[0] in gearbox.note  # and so in every result
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
    with pytest.raises(ValueError, match=r"from 20 to 60 °C, not at 80 °C"):
        build_loss_map(record, temperature=80.0)


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
    new, worn = (
        lm.gearbox("bonfiglioli-tr080-3-90"),
        lm.gearbox("bonfiglioli-tr080-3-90", added_backlash=2e-3, loss_factor=1.5),
    )
    assert worn.stiffness.backlash - new.stiffness.backlash == pytest.approx(2e-3)
    assert worn.losses.core()(1.0, 1.0) == pytest.approx(1.5 * new.losses.core()(1.0, 1.0))


# --- the rig ---


@pytest.mark.parametrize("family", ["schaeffler", "wittenstein", "bonfiglioli-tr", "bonfiglioli-tq", "paper"])
def test_the_rig_returns_the_figures_of_every_complete_record(family: str):
    records = [r for r in COMPLETE if r.name.startswith(family)]
    assert records
    for record in records:
        table, built = gearbox_table(record.name, {})
        for c in compare(TestRig(lm.Gearbox(**table)), record, built.notes):
            # Printed with two to four digits; a thousandth is finer than half a unit of any of their last ones.
            if c.remark:
                assert c.quantity.startswith("efficiency")
                assert any("Contradiction" in n for n in built.notes)
            else:
                assert abs(c.difference) < 1e-3, (record.name, c)


def test_stiffness_from_a_data_book():
    # A strain-wave gear of size 32, ratio 100: 60 N·m give 7.15e-4 rad (2.46 arcmin).
    record = sheet(stiffness={"slopes": [6.7e4, 1.1e5], "torques": [29]})
    twist, torque = TestRig(gearbox_of(record)).initial_loading_curve(60.0)
    assert float(np.interp(60.0, torque, twist)) == pytest.approx(7.15e-4, abs=0.5e-6)
    assert float(np.interp(60.0, torque, twist)) / ARCMIN == pytest.approx(2.46, abs=5e-3)


def test_hysteresis_loss_comes_back_as_the_width_of_the_loop_and_the_loop_has_the_energy_of_16():
    record = sheet(hysteresis_loss="0.6 arcmin")
    rig = TestRig(gearbox_of(record))
    loop = rig.loop(52.0)
    # A slow ramp is not infinitely slow: the load lags by parts in ten thousand.
    assert loop.width / ARCMIN == pytest.approx(0.6, rel=1e-4)
    # Both branches run between the same turning points, 2h apart: area 2h x twist, less the two corners where the
    # twist stands, which have no width.
    h = record.torsion_curve().torque(0.3 * ARCMIN)
    assert loop.area == pytest.approx(2.0 * h * np.ptp(loop.twist), rel=1e-3)


def test_inner_loops_remember_their_own_turning_point():
    rig = TestRig(gearbox_of(sheet(hysteresis_efficiency=0.9)))
    outer, inner = rig.loop(50.0), rig.loop(20.0)
    assert inner.width < 0.6 * outer.width
    assert outer.twist[0] == pytest.approx(outer.twist[-1], rel=1e-4)  # closed


def test_backlash_is_measured_as_printed_with_hysteresis_present():
    rig = TestRig(gearbox_of(sheet(backlash="4 arcmin", hysteresis_efficiency=0.95)))
    assert rig.backlash(7.0) / ARCMIN == pytest.approx(4.0, rel=1e-6)


def worm(name: str) -> lm.Gearbox:
    """A worm record with the figures it lacks."""
    changes = {"inertia": 1e-4, "stiffness": {"kind": "linear", "stiffness": 2e4}, "rated_output_torque": 70.0}
    table, _ = gearbox_table(name, changes)
    return lm.Gearbox(**(table | changes))


@pytest.mark.parametrize(
    ("name", "holds"),
    [("nord-sk1si50-60", True), ("motovario-sw050-60", True), ("motovario-sw050-10", False), ("nord-sk1si50-5", False)],
)
def test_a_worm_holds_its_load_without_power_if_its_static_efficiency_is_below_one_half(name: str, holds: bool):
    gearbox = worm(name)
    assert (find(name, "gearbox").losses.static_efficiency < 0.5) is holds
    drive = lm.Drive(
        motor=lm.Motor(kind="torque_source", rotor_inertia=1e-4),
        gearbox=gearbox,
        load=lm.Load(inertia=0.5, viscous_friction=20.0),
    )
    result = lm.simulate(drive, load_torque=-70.0, duration=2.0, sample_interval=0.01)
    turned = abs(float(result["motor_speed"][-1]))
    assert (turned == 0.0) is holds
    assert (TestRig(gearbox).backdriving_torque() is None) is holds


def test_static_efficiency_is_what_starting_under_load_shows():
    rig = TestRig(worm("motovario-sw050-60"))
    eta = 70.0 / (60 * rig.starting_torque(1.0))
    assert eta == pytest.approx(0.32, rel=1e-9)


plausible = st.fixed_dictionaries(
    {
        "eta": st.floats(0.2, 0.99),
        "no_load": st.none() | st.floats(1e-3, 0.5),
        "start": st.none() | st.floats(1e-3, 0.5),
        "back": st.none() | st.floats(1e-3, 1.2),
        "static": st.none() | st.floats(0.1, 0.95),
        "backdrive": st.none() | st.floats(0.05, 1.0),
        "low": st.none() | st.tuples(st.floats(0.1, 0.9), st.floats(0.1, 0.98)),
        "ratio": st.floats(3.0, 200.0),
    }
)


@settings(max_examples=60, deadline=None)
@given(figures=plausible, mu=st.floats(-1.4, 1.4), v=st.floats(0.05, 1.1))
def test_any_plausible_sheet_gives_a_passive_map(figures: dict, mu: float, v: float):
    ratio = figures["ratio"]
    at_input = 52.0 / ratio
    losses: dict = {"efficiency": [{"input_speed": "2000 rpm", "efficiency": figures["eta"]}]}
    if figures["low"]:
        load, eta = figures["low"]
        losses["efficiency"].append({"input_speed": "2000 rpm", "load": load, "efficiency": eta})
    if figures["no_load"]:
        losses["no_load_torque"] = [{"input_speed": "2000 rpm", "torque": figures["no_load"] * at_input}]
    if figures["start"]:
        losses["starting_torque"] = figures["start"] * at_input
    if figures["back"]:
        losses["backdriving_torque"] = figures["back"] * 52.0
    if figures["static"]:
        losses["static_efficiency"] = figures["static"]
    if figures["backdrive"]:
        losses["backdrive_efficiency"] = [{"input_speed": "2000 rpm", "efficiency": figures["backdrive"]}]
    record = sheet(ratio=ratio, losses=losses)
    built = build_loss_map(record)
    values = np.array(built.losses.values)
    assert np.all(np.isfinite(values))
    assert np.all(values >= 0.0)
    core = built.losses.core()
    # Continuous: across every grid line and diagonal the value changes by no more than a step is long.
    step = 1e-9
    slope = np.max(np.abs(values)) / min(np.min(np.diff(built.losses.speeds)), np.min(np.diff(built.losses.loads)))
    for x in built.losses.loads[1:-1]:
        assert abs(core(x - step, v) - core(x + step, v)) <= 4.0 * slope * step + 1e-12
    # Passive: the rig, with the motor driving, never finds an efficiency above 1, nor a loss that gives power.
    gearbox = gearbox_of(record)
    T_1, T_2 = TestRig(gearbox).steady(v * 2000 * RPM, mu)
    assert (T_1 - T_2 / ratio) >= -1e-9 * at_input
    contradictory = (figures["no_load"] or 0) > 1 / figures["eta"] - 1
    assert not contradictory or any("Contradiction" in n for n in built.notes)


# --- bad sheets ---

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
    (
        {"losses": {"efficiency": [{"input_speed": 200.0, "efficiency": 0.9}], "load_correction": [[1.5, 1.2]]}},
        "above 1",
    ),
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
    with pytest.raises(InputError, match=match) as caught:
        parse_sheets({"gearbox": [entry]}, "my.toml")
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("my.toml: gearbox ")


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
    with pytest.raises(InputError, match="no such file"):
        find(str(tmp_path / "none.toml"), "gearbox")
    with pytest.raises(InputError, match="did you mean schaeffler-rt1-h-20-100"):
        find("schaeffler-rt1-h-20-10", "gearbox")


def test_a_sheet_without_efficiency_is_refused_with_the_place_to_read_it():
    with pytest.raises(ValueError, match=r"lacks an efficiency.*Harmonic Drive, CSF-2UH"):
        build_loss_map(find("harmonic-drive-csf-17-100-2uh", "gearbox"))


def test_a_loop_wider_than_the_torque_is_refused():
    record = sheet(hysteresis_loss="10 arcmin")
    with pytest.raises(ValueError, match="half of the rated torque"):
        record.hysteresis(record.torsion_curve())


# --- scenarios and the command line ---


def scenario_with(tmp_path: Path, gearbox: str) -> Path:
    """The shipped scenario with another gearbox: a line of the top level, or a table."""
    text = (ROOT / "scenarios" / "catalogue-robot-joint.toml").read_text()
    start, end = text.index("[gearbox]"), text.index("[command]")
    path = tmp_path / "s.toml"
    if gearbox.startswith("["):
        path.write_text(text[:start] + gearbox + "\n" + text[end:])
    else:
        path.write_text(gearbox + "\n" + text[:start] + text[end:])
    return path


def test_a_record_by_name_with_overrides_and_by_file(tmp_path: Path):
    by_name = lm.load(scenario_with(tmp_path, 'gearbox = "schaeffler-rt1-h-20-100"'))
    assert by_name.gearbox == lm.gearbox("schaeffler-rt1-h-20-100")
    changed = lm.load(
        scenario_with(tmp_path, '[gearbox]\nfrom = "schaeffler-rt1-h-20-100"\ninertia = "1 kg*cm^2"\nloss_factor = 2')
    )
    assert changed.gearbox.inertia == pytest.approx(1e-4)
    assert changed.gearbox.losses.values[3][1] == pytest.approx(2 * by_name.gearbox.losses.values[3][1])
    (tmp_path / "own.toml").write_text(CliRunner().invoke(app, ["catalogue", "new"]).output)
    own = lm.load(scenario_with(tmp_path, '[gearbox]\nfrom = "own.toml"'))
    assert own.gearbox.stiffness.backlash == pytest.approx(3 * ARCMIN)
    # A record takes the place of a base's gearbox, it is not mixed with it.
    child = tmp_path / "child.toml"
    child.write_text(
        f'base = "{(ROOT / "scenarios" / "paper-2dof-nl-large.toml")}"\n[gearbox]\nfrom = "wittenstein-tp010-mf-10"\n'
    )
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
    with pytest.raises(InputError, match=match) as caught:
        lm.load(path)
    assert str(caught.value).startswith(str(path))


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
    assert {p.name for p in out.iterdir()} == {
        "rig.html",
        "rig.png",
        "rig.svg",
        "rig.csv",
        "comparison.csv",
        "efficiency.csv",
    }
    page = (out / "rig.html").read_text()
    assert "back-driving torque" in page
    assert "ask the manufacturer" in page
    checked = run(app, ["drive", "check", str(ROOT / "scenarios" / "catalogue-robot-joint.toml")])
    assert checked.exit_code == 0
    assert "No warnings." in checked.output


def test_the_drive_check_finds_what_is_wrong():
    scenario = lm.load(ROOT / "scenarios" / "catalogue-robot-joint.toml")
    heavy = scenario.replace(**{"load.inertia": 60.0, "command.frequency": 3.0})
    wrong = {f.what for f in check_drive(heavy) if f.verdict == "warning"}
    assert {"inertia of the load / of the motor side", "resonance on the softest segment"} <= wrong
    weak = scenario.replace(**{"command.amplitude": 0.004})
    (zone,) = [f for f in check_drive(weak) if f.what == "dead zone"]
    assert zone.verdict == "warning"
    assert "does not move" in zone.remark
    # That it does not move is a fact of the run, not of the check alone.
    assert float(abs(lm.simulate(weak)["motor_speed"]).max()) == 0.0
    plain = [f for f in check_drive(paper_scenario("2-DOF-NL", "large")) if f.verdict == "unknown"]
    assert {"output torque, largest"} <= {f.what for f in plain}


def test_a_load_that_drives_is_no_dead_zone():
    findings = {f.what: f for f in check_drive(lm.load(ROOT / "scenarios" / "backlash-reversing-load.toml"))}
    assert findings["dead zone"].verdict == "ok"  # the command is 0 throughout


def test_a_name_that_is_none_is_answered_with_near_ones():
    done = CliRunner().invoke(app, ["catalogue", "maxon-re-65-35329"])
    assert isinstance(done.exception, InputError)
    assert "did you mean maxon-re-65-35329" in str(done.exception)


def test_difference_is_relative():
    assert Comparison("x", "1", 2.0, 2.1).difference == pytest.approx(0.05)


# --- changes to what the catalogue has ---


def own_sheet(tmp_path: Path, **changes) -> str:
    """A sheet file of one's own, with a printed width of the torsion loop."""
    record = sheet(name="own", backlash="1 arcmin", hysteresis_loss="2 arcmin", **changes)
    given = {name: getattr(record, name) for name in record.model_fields_set}
    lines = ["[[gearbox]]"]
    for key in (
        "name",
        "kind",
        "ratio",
        "rated_output_torque",
        "rated_input_speed",
        "inertia",
        "backlash",
        "hysteresis_loss",
    ):
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
        assert {k: v for k, v in changed.items() if k != "stiffness"} == {
            k: v for k, v in data.items() if k != "stiffness"
        }
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
    assert curve.stiffness == lm.TorsionCurve(slopes=(2e4,))  # without the record's backlash
    linear = lm.load(path, ['gearbox.stiffness={kind = "linear", stiffness = "6 Nm/arcmin"}']).gearbox
    assert linear.stiffness == lm.LinearStiffness(stiffness="6 Nm/arcmin")
    assert curve.hysteresis == linear.hysteresis == plain.hysteresis
    assert lm.load(path, ['gearbox.stiffness={kind = "rigid"}']).gearbox.hysteresis is None


def test_the_order_of_changes_does_not_count(tmp_path: Path):
    path = scenario_with(tmp_path, 'gearbox = "schaeffler-rt1-h-20-100"')
    changes = ["gearbox.inertia=3 kgcm2", "gearbox.from=paper-gearbox", "gearbox.added_backlash=1 arcmin"]
    one, other = lm.load(path, changes), lm.load(path, changes[::-1])
    assert one == other
    assert one.gearbox.inertia == pytest.approx(3e-4)
    assert one.gearbox.ratio == 90
    assert lm.load(path).replace(**dict(c.split("=") for c in changes)) == one


def test_added_backlash_adds_to_a_changed_curve_too(tmp_path: Path):
    path = scenario_with(tmp_path, f'[gearbox]\nfrom = "{own_sheet(tmp_path)}"')
    both = lm.load(path, ["gearbox.stiffness.backlash=3 arcmin", "gearbox.added_backlash=1 arcmin"])
    assert both.gearbox.stiffness.backlash == pytest.approx(4 * ARCMIN)


@pytest.mark.parametrize(
    ("overrides", "match"),
    [
        (
            ["gearbox.losses.efficiency=0.9", "gearbox.loss_factor=2"],
            "gearbox.loss_factor: acts on the record's own losses",
        ),
        (
            ['gearbox.losses={kind="constant_efficiency",efficiency=0.9}', "gearbox.temperature=40"],
            "gearbox.temperature: acts",
        ),
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
    with pytest.raises(InputError, match=match) as caught:
        lm.load(path, overrides)
    assert str(caught.value).startswith(str(path))


def test_a_change_closes_the_gap_of_a_motor(tmp_path: Path):
    (tmp_path / "motor.toml").write_text(
        '[[motor]]\nname = "m"\nrated_voltage = "24 V"\nrated_torque = "1 Nm"\nrated_speed = "3000 1/min"\nno_load_current = "0.1 A"\n'
        'torque_constant = "0.05 Nm/A"\nresistance = "0.2 ohm"\ninductance = "0.2 mH"\n'
    )
    name = str(tmp_path / "motor.toml")
    path = scenario_with(tmp_path, 'gearbox = "paper-gearbox"')
    with pytest.raises(InputError, match=r"lacks rotor_inertia.*give motor\.rotor_inertia beside"):
        lm.load(path, [f"motor.from={name}"])
    filled = lm.load(path, [f"motor.from={name}", "motor.rotor_inertia=2 kgcm2", "motor.friction_torque=0.03"]).motor
    assert filled.rotor_inertia == pytest.approx(2e-4)
    assert filled.friction_torque == 0.03
    assert filled.rated_torque == pytest.approx(1.0 + 0.05 * 0.1)  # of the record, with the friction of the record


def test_the_rig_answers_in_its_own_words():
    for arguments, words in (
        (["maxon-ec-i-52-606793"], "maxon-ec-i-52-606793 is a motor; a gearbox is wanted here"),
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


def test_a_sheet_that_says_maker_for_the_manufacturer_is_read_as_before(tmp_path: Path):
    text = (ROOT / "src" / "lostmotion" / "catalogue" / "worm-nord-si50.toml").read_text()
    former = text.replace("manufacturer =", "maker =").replace('"manufacturer"', '"maker"')
    assert former.count('maker = "NORD"') == former.count('status = "maker"') == 1
    records = parse_sheets(tomllib.loads(former), "former.toml")
    assert records == parse_sheets(tomllib.loads(text), "now.toml")
    assert {(r.manufacturer, r.sources[-1].status) for r in records} == {("NORD", "manufacturer")}
    with pytest.raises(lm.InputError, match="key maker: is not known"):
        parse_sheets(
            tomllib.loads('maker = "A"\nmanufacturer = "B"\n' + former.replace('maker = "NORD"', "")), "both.toml"
        )


def test_the_rig_gives_no_figure_where_there_is_no_cause():
    """A curve without hysteresis and backlash has no loop; what the rig measures of one is rounding."""
    plain = lm.gearbox("paper-gearbox").model_copy(update={"hysteresis": None})
    assert plain.stiffness.backlash == 0.0
    slack = plain.model_copy(update={"stiffness": plain.stiffness.model_copy(update={"backlash": 1e-3})})
    rows = {name: dict(summary_rows(lm.measure(g))) for name, g in (("plain", plain), ("slack", slack))}
    width, energy = "width of the loop at zero torque, rated torque in both directions", "energy lost in that loop"
    assert rows["plain"][width] == "none: neither hysteresis nor backlash is given"
    assert rows["slack"][width].startswith(f"{np.degrees(1e-3) * 60.0:.4g}"[:4])  # the backlash, in arcmin
    assert rows["plain"][energy] == rows["slack"][energy] == "none: no hysteresis is given"
    assert dict(summary_rows(lm.measure(lm.gearbox("paper-gearbox"))))[energy].endswith(" J")


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


def test_sheets_with_former_words_are_read() -> None:
    """`maker`, `figures` and `figure` stood for `manufacturer`, `data` and `datum`."""
    former = {
        "name": "old",
        "rated_voltage": 24.0,
        "sources": [{"figures": ["rated_voltage"], "status": "maker", "text": "page 7"}],
        "gaps": [{"figure": "inductance", "where": "page 8"}],
    }
    sheet = MotorSheet(**former)
    assert sheet.sources[0].data == ("rated_voltage",)
    assert sheet.sources[0].status == "manufacturer"
    assert sheet.where("inductance") == "page 8"

"""The virtual test rig."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

import lostmotion as lm
from lostmotion.cli import app
from lostmotion.data_sheets.components import gearbox_table
from lostmotion.data_sheets.loss_map_from_data_sheet import build_loss_map
from lostmotion.data_sheets.records import catalogue, find
from lostmotion.model.losses import efficiency_map
from lostmotion.simulation.scenario.scenario_files import screw_from_record
from lostmotion.test_rig.comparison import compare
from lostmotion.test_rig.screw_measurement import WORK, rig_load
from lostmotion.test_rig.screw_rig import ScrewRig
from lostmotion.test_rig.virtual_rig import TestRig
from refusals import refused
from sheets import ARCMIN, COMPLETE, RPM, gearbox_of, sheet


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


def test_a_rigid_gearbox_is_measured_but_for_its_torsion():
    """In a steady state it loses what the same gearbox with a torsion does, and breaks loose at the torques of its sheet."""
    compliant = TestRig(gearbox_of(sheet()))
    rig = TestRig(gearbox_of(sheet(stiffness=None, rigid=True)))
    for load in (1.0, 0.3, -1.0):
        assert rig.efficiency(200.0, load) == pytest.approx(compliant.efficiency(200.0, load), rel=1e-6)
    assert rig.no_load_torque(2000 * RPM) == pytest.approx(0.105, rel=1e-6)
    assert rig.starting_torque() == pytest.approx(0.037, rel=1e-6)
    assert rig.backdriving_torque() == pytest.approx(3.89, rel=1e-6)
    assert rig.lost_motion() == 0.0
    assert "a rigid gearbox has no torsion to measure" in refused(lambda: rig.loop(52.0))


def test_a_rigid_sheet_has_no_twist():
    assert "is rigid and has backlash" in refused(lambda: sheet(stiffness=None, rigid=True, backlash="1 arcmin"))


@pytest.mark.parametrize("stiffness", [{"kind": "rigid"}, {"kind": "linear", "stiffness": 100.0}])
def test_what_nothing_holds_starts_at_once(stiffness: dict):
    """Losses in proportion to the load alone: no torque is needed to start; driven backwards it holds only if it is self-locking."""
    for eta_b, torque in ((0.7, 0.0), (-0.2, None)):
        losses = efficiency_map(0.8, eta_b)
        rig = TestRig(lm.Gearbox(ratio=2, rated_input_speed=1, rated_output_torque=1, stiffness=stiffness, losses=losses))
        assert rig.starting_torque() == 0.0 and rig.backdriving_torque() == torque


@pytest.mark.parametrize("name", ["paper-1dof-l-large", "paper-2dof-l-large", "hunting-with-static-friction"])
def test_a_gear_without_friction_at_rest_starts_at_once(name: str):
    (gear,) = lm.load(name).train().gears.values()
    rig = TestRig(gear)
    assert rig.starting_torque() == 0.0 and rig.backdriving_torque() == 0.0


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
    ("name", "holds"), [("nord-sk1si50-60", True), ("motovario-sw050-60", True), ("motovario-sw050-10", False), ("nord-sk1si50-5", False)]
)
def test_a_worm_holds_its_load_without_power_if_its_static_efficiency_is_below_one_half(name: str, holds: bool):
    gearbox = worm(name)
    assert (find(name, "gearbox").losses.static_efficiency < 0.5) is holds
    drive = lm.Drive(
        motor=lm.Motor(kind="torque_source", rotor_inertia=1e-4), gearbox=gearbox, load=lm.Load(inertia=0.5, viscous_friction=20.0)
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


# --- the virtual test rig for screws ---
LEAD = 0.01
TRAVEL = LEAD / (2 * math.pi)

SCRIPT = (Path(lm.__file__).parent / "reports" / "report.js").read_text()


class Steps:
    """Counts how often progress is reported."""

    count = 0

    def __call__(self) -> None:
        self.count += 1


def screw(**values) -> lm.model.Screw:
    return lm.model.Screw(**({"input": "m", "output": "t", "lead": LEAD} | values))


def test_stiffness_drag_and_efficiency_come_back() -> None:
    rig = ScrewRig(screw(stiffness=2e8, efficiency=0.9, backdriving_efficiency=0.7, drag_torque=0.1), load=1000.0)
    # A slow ramp is not infinitely slow; of the drag the slide's own inertia takes 1e-8.
    assert rig.stiffness([], 1000.0) == pytest.approx([2e8], rel=1e-9)
    assert rig.drag_torque(100.0) == pytest.approx(0.1, rel=1e-6)
    for share in (1.0, 0.1):
        assert rig.efficiency(10.0, share) == pytest.approx(0.9, rel=1e-8)
        assert rig.efficiency(10.0, -share) == pytest.approx(0.7, rel=1e-8)
    # T = F p/(2 pi eta) + T_0; F = T_0 2 pi/(p eta_b). The force leads the deflection by its damping: 0.02 N in 90 N.
    assert rig.starting_torque(1.0) == pytest.approx(1000.0 * TRAVEL / 0.9 + 0.1, rel=1e-6)
    assert rig.backdriving_torque() == pytest.approx(0.1 / (TRAVEL * 0.7), rel=1e-3)


def test_lost_motion_is_the_play_and_the_deflection_both_ways() -> None:
    rig = ScrewRig(screw(stiffness=2e8, backlash=20e-6), load=1000.0)
    assert rig.lost_motion() == pytest.approx(20e-6 + 2 * 30.0 / 2e8, rel=1e-6)
    assert rig.backlash(1000.0) == pytest.approx(20e-6, rel=1e-5)
    assert rig.loop(1000.0).width == pytest.approx(20e-6, rel=1e-4)


def test_nut_bearing_and_screw_are_in_series() -> None:
    part = screw(nut_stiffness=4e8, bearing_stiffness=2e8, supported_length=0.5, core_diameter=0.02, support="both ends")
    bar = 4 * 206e9 * math.pi / 4 * 0.02**2 / 0.5
    series = 1 / (1 / 4e8 + 1 / 2e8 + 1 / bar)
    assert ScrewRig(part, load=1000.0).stiffness([], 1000.0) == pytest.approx([series], rel=1e-9)


def test_each_segment_of_a_stiffness_curve_is_measured() -> None:
    report = lm.test_rig.measure_screw(screw(stiffness_curve={"slopes": [1.2e8, 2e8], "breaks": [2e-6]}))
    assert report.stiffness == pytest.approx((1.2e8, 2e8), rel=1e-8)


def test_hysteresis_opens_the_loop_and_a_pitch_error_is_seen_over_a_turn() -> None:
    assert ScrewRig(screw(stiffness=1e8, hysteresis={"efficiency": 0.9}), load=1000.0).loop(1000.0).area > 0.0
    error = {"kind": "sine", "order": 1, "amplitude": 2e-6}
    rig = ScrewRig(screw(stiffness=1e8, pitch_error=error), load=1000.0)
    # By straight lines that depart from the sine by 0.1 % at most.
    assert rig.pitch_error() == pytest.approx(4e-6, rel=2e-3)
    assert rig.efficiency(10.0, 1.0) == pytest.approx(1.0, rel=1e-8)


def test_a_self_locking_screw_is_not_driven_back_and_a_rigid_one_has_no_deflection() -> None:
    assert ScrewRig(screw(stiffness=1e8, efficiency=0.3), load=1000.0).backdriving_torque() is None
    rigid = lm.test_rig.measure_screw(screw(efficiency=0.9, drag_torque=0.1, viscous_friction=1e-3))
    assert rigid.first_loading is None and rigid.loops == () and rigid.stiffness == () and rigid.lost_motion == 0.0
    # The flywheel loses 2e-6 of its speed.
    assert rigid.drag_at(100.0) == pytest.approx(0.1 + 1e-3 * 100.0, rel=1e-5)
    assert "a rigid screw has no deflection to measure" in refused(lambda: ScrewRig(screw(), load=1000.0).loop(100.0))
    assert "load: -1 N must be greater than 0" in refused(lambda: ScrewRig(screw(), load=-1.0))


def test_the_rig_returns_the_data_of_the_records() -> None:
    """One of each family; printed with two or three digits, so a thousandth is finer than half a unit of the last."""
    for name in ("rexroth-40x10rx6-i4", "hiwin-r25-10k4-fsc", "hiwin-r32-10k5-fdc-ball-6.35", "thk-bnf2505-5", "thk-sbn3210-7"):
        sheet = next(r for r in catalogue() if r.name == name)
        steps = Steps()
        report = lm.test_rig.measure_screw(screw_from_record(name), sheet, progress=steps)
        assert 0 < steps.count <= WORK
        assert report.load == rig_load(sheet) == pytest.approx(0.1 * sheet.dynamic_capacity)
        assert len(report.comparisons) >= 2
        for c in report.comparisons:
            assert not c.remark and abs(c.difference) < 1e-3, (name, c)


def test_command_line(tmp_path: Path) -> None:
    run = CliRunner().invoke
    out = tmp_path / "sheet"
    done = run(app, ["rig", "rexroth-25x10rx3-i4", "-o", str(out), "--set", "supported_length=600 mm"])
    assert done.exit_code == 0, done.output
    assert "axial stiffness [N/µm]" in done.output and "lost motion at ±3 % of 1570 N" in done.output
    assert "of the nut in series with screw and bearings" in done.output
    assert {p.name for p in out.iterdir()} == {"rig.html", "comparison.csv", "efficiency.csv", "deflection.csv", "rig.csv"}
    page = (out / "rig.html").read_text()
    assert "back-driving force" in page and "R310RU3301" in page and "µm" in page
    for word in ("arcmin", "mrad", "N·m/rad"):
        assert word not in page.replace(SCRIPT, "")
    (tmp_path / "own.toml").write_text(run(app, ["catalogue", "new", "--kind", "screw"]).output)
    assert run(app, ["rig", str(tmp_path / "own.toml"), "-o", str(tmp_path / "own")]).exit_code == 0


@pytest.mark.parametrize(("arguments", "match"), [
    (["elatech-at5-25"], "elatech-at5-25 is a belt; a gearbox or screw is wanted here"),
    (["rexroth-25x10rx3"], 'gearbox or screw "rexroth-25x10rx3" is not in the catalogue; did you mean rexroth-25x10'),
    (["rexroth-25x10rx3-i4", "--logs", "logs"], "--logs: rexroth-25x10rx3-i4 is a screw"),
    (["rexroth-25x10rx3-i4", "--set", "nut_prelod=3"], "key screw.nut_prelod: is not known; did you mean nut_preload"),
    (["hiwin-r25-10t3-deb"], "lacks nut_stiffness"),
])  # fmt: skip
def test_what_cannot_be_measured_is_refused(tmp_path: Path, arguments: list[str], match: str) -> None:
    done = CliRunner().invoke(app, ["rig", *arguments, "-o", str(tmp_path / "sheet")])
    assert isinstance(done.exception, lm.InputError)
    assert match in str(done.exception)

"""The virtual test rig for screws: what it measures against closed forms, and the records of the catalogue."""

import math
from pathlib import Path

import pytest
from typer.testing import CliRunner

import lostmotion as lm
from lostmotion.cli import app
from lostmotion.data_sheets.records import catalogue
from lostmotion.simulation.scenario.scenario_files import screw_from_record
from lostmotion.test_rig.screw_measurement import WORK, rig_load
from lostmotion.test_rig.screw_rig import ScrewRig
from refusals import refused

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


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        (["elatech-at5-25"], "elatech-at5-25 is a belt; a gearbox or screw is wanted here"),
        (["rexroth-25x10rx3"], 'gearbox or screw "rexroth-25x10rx3" is not in the catalogue; did you mean rexroth-25x10'),
        (["rexroth-25x10rx3-i4", "--logs", "logs"], "--logs: rexroth-25x10rx3-i4 is a screw"),
        (["rexroth-25x10rx3-i4", "--set", "nut_prelod=3"], "key screw.nut_prelod: is not known; did you mean nut_preload"),
        (["hiwin-r25-10t3-deb"], "lacks nut_stiffness"),
    ],
)
def test_what_cannot_be_measured_is_refused(tmp_path: Path, arguments: list[str], match: str) -> None:
    done = CliRunner().invoke(app, ["rig", *arguments, "-o", str(tmp_path / "sheet")])
    assert isinstance(done.exception, lm.InputError)
    assert match in str(done.exception)

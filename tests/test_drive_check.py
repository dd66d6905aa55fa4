"""The drive check: duty cycle and means, heat, holding, and that no verdict is the same for every drive."""

import math
import re
from html import escape
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import lostmotion as lm
from conftest import ROOT
from html_pages import Page
from lostmotion.cli import app
from lostmotion.data_sheets.records import find
from lostmotion.paper import paper_scenario
from lostmotion.reports.drive_check import check_report
from lostmotion.reports.page import render
from lostmotion.simulation.forms.key_aliases import DRIVE
from lostmotion.sizing.drive_check import check_drive
from lostmotion.sizing.duty_cycle import DutyCycle, duty_cycle
from lostmotion.sizing.finding import RULES, Finding
from lostmotion.sizing.holding import holding
from refusals import refusals_of, refused
from tables import rated_gearbox, run_of, torque_source

RPM = math.pi / 30.0


def by_rule(scenario: lm.Scenario) -> dict[str, Finding]:
    return {f.rule: f for f in check_drive(scenario)}


def move(duration: float = 0.25, **changes) -> lm.Scenario:
    """A torque source that accelerates a load for 0.1 s and brakes it for 0.1 s with 0.5 N·m; then all is at rest."""
    torque = {"steps": [{"height": 0.5}, {"height": -1.0, "time": 0.1}, {"height": 0.5, "time": 0.2}]}
    scenario = lm.Scenario(
        command=torque,
        motor=torque_source(
            1e-4,
            rated_torque=1.0,
            limits={
                "continuous_torque": 0.6,
                "torque_constant": 0.05,
                "resistance": 0.2,
                "thermal_resistance": 5.0,
                "max_winding_temperature": 155.0,
                "max_speed": 1000.0,
                "max_voltage": 48.0,
                "max_current": 12.0,
            },
        ),
        gearbox=rated_gearbox(50.0, 300.0, 20.0, {"kind": "rigid"}, 1.0, limits={"peak_output_torque": 40.0, "max_input_speed": 600.0}),
        load={"inertia": 0.25},
        task={"max_lost_motion": 1e-3},
        simulation=run_of(duration, 1e-3),
    )
    return scenario.replace(**changes)


# --- duty cycle ---
def test_means_are_those_of_the_maker_s_worked_example():
    """Harmonic Drive, CSF & CSG catalogue, selection example: 319 N·m and 12 rpm (at the output)."""
    pattern = [(0.3, 7.0, 400.0), (3.0, 14.0, 320.0), (0.4, 7.0, -200.0)]  # s, rpm, N·m; then a pause of 0.2 s
    ends = np.cumsum([0.0] + [t for t, _, _ in pattern])
    time = np.repeat(ends, 2)[1:-1]
    speed, torque = (np.repeat([p[k] for p in pattern], 2) for k in (1, 2))
    cycle = DutyCycle(time, speed * RPM, torque, torque, 0.0, 3.9)
    assert cycle.mean_output_torque == pytest.approx(319.0, abs=1.0)
    assert cycle.mean_input_speed / RPM == pytest.approx(12.0, abs=0.05)


def test_heat_and_loads_do_not_depend_on_how_long_the_run_rests_afterwards():
    short, long, longest = (by_rule(move(duration)) for duration in (0.25, 20.0, 50_000.0))
    assert longest["motor_torque"].use == pytest.approx(short["motor_torque"].use, rel=0.02)
    assert longest["peak_output_torque"].use == pytest.approx(short["peak_output_torque"].use, rel=1e-3)
    for rule in ("motor_torque", "winding_temperature", "average_output_torque", "average_input_speed"):
        assert long[rule].use == pytest.approx(short[rule].use, rel=0.02), rule
        assert long[rule].verdict == short[rule].verdict
        assert "of 0.2" in short[rule].value
        assert "repeated without a pause" in short[rule].value
    # 0.5 N·m throughout: 10 A, 20 W at 25 °C, times 5 K/W; R rises with 0.393 %/K.
    assert short["motor_torque"].use == pytest.approx(0.5 / 0.6, rel=0.01)
    rise = 100.0 / (1.0 - 0.00393 * 100.0)
    assert short["winding_temperature"].use == pytest.approx(rise / 130.0, rel=0.02)
    assert short["winding_temperature"].verdict == "warning"


def test_the_cycle_of_the_task_brings_the_pause():
    for duration in (0.25, 5.0):
        found = by_rule(move(duration, **{"task.cycle": 0.8}))
        assert found["motor_torque"].use == pytest.approx(0.5 * math.sqrt(0.2 / 0.8) / 0.6, rel=0.01)
        rise = 25.0 / (1.0 - 0.00393 * 25.0)
        assert found["winding_temperature"].use == pytest.approx(rise / 130.0, rel=0.02)
        assert found["winding_temperature"].verdict == "ok"
        assert "every 0.8 s" in found["winding_temperature"].value
        # Speed is a triangle of 0.2 s; the mean torque of the gearbox does not know of pauses.
        top = 0.5 * 0.1 / (1e-4 + 0.25 / 50.0**2)
        assert found["average_input_speed"].use == pytest.approx(0.5 * top * 0.2 / 0.8 / 300.0, rel=0.01)
        assert found["average_output_torque"].use == pytest.approx(0.25 * top / 50.0 / 0.1 / 20.0, rel=0.01)


def test_holding_a_load_heats_even_at_rest():
    """A vertical axis: 0.3 N·m hold it before and after the move; no pause cools the motor below that."""
    scenario = move(1.0, **{"command.mean": 0.3, "load.torque": 15.0, "task.hold_without_power": False, "motor.friction_torque": 1e-3})
    cycle = duty_cycle(lm.simulate(scenario), 100.0)
    assert cycle.rms_motor_torque == pytest.approx(0.3, rel=0.01)
    at_rest = duty_cycle(lm.simulate(move(1.0, command=0.0)), None)
    assert not at_rest.moves
    assert at_rest.rms_motor_torque == at_rest.mean_output_torque == 0.0
    assert "at rest" in str(at_rest)


def test_the_reversal_of_a_sine_is_no_rest():
    """Where the speed passes zero the torque is largest; a run that ends there must not be taken to hold it for good."""
    sine = {"sines": [{"amplitude": 0.5, "frequency": 2.0, "phase": math.pi / 2.0}]}
    cycle = duty_cycle(lm.simulate(move(1.0, command=sine)), None)  # ends at zero speed, at the largest torque
    assert cycle.holding_torque is None
    assert cycle.duration == pytest.approx(1.0)
    assert cycle.rms_motor_torque == pytest.approx(0.5 / math.sqrt(2.0), rel=1e-3)
    # Nor is a shaft that sticks at each reversal, while the torque on it rises.
    small = duty_cycle(lm.simulate(lm.load(ROOT / "scenarios" / "paper-2dof-nl-small.toml")), None)
    assert small.duration == 2.0


def test_waiting_before_the_move_is_no_part_of_the_cycle():
    later = {"steps": [{"height": h, "time": t + 3.0} for h, t in ((0.5, 0.0), (-1.0, 0.1), (0.5, 0.2))]}
    now, then = by_rule(move(0.25)), by_rule(move(3.25, command=later))
    for rule in ("motor_torque", "winding_temperature", "average_input_speed"):
        assert then[rule].use == pytest.approx(now[rule].use, rel=0.02)


def test_a_cycle_that_does_not_fit_the_run_is_refused():
    refused(lambda: check_drive(move(**{"task.cycle": 0.1})), "task.cycle", match=r"task.cycle: 0.1 s is shorter than the motion of 0\.2")
    refused(lambda: check_drive(move(0.15, **{"task.cycle": 1.0})), "task.cycle", match="still turns at its end; lengthen simulation")


# --- holding ---
def vertical(**changes) -> lm.Scenario:
    path = ROOT / "scenarios" / "overrunning-load.toml"
    return lm.load(path, {"command": 0.0, "simulation.duration": 4.0}).replace(**changes)


def test_a_falling_axis_is_called_so():
    scenario = vertical()
    truth = float(lm.simulate(scenario)["load_speed"][-1])
    assert truth < -0.3
    finding = by_rule(scenario)["holding"]
    assert finding.verdict == "warning"
    assert f"drives the load at {truth:.3g} rad/s" in finding.value
    assert by_rule(vertical(**{"task.hold_without_power": False}))["holding"].verdict == "ok"
    assert by_rule(vertical(**{"load.torque": 1.0}))["holding"].verdict == "ok"


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_torque_that_is_held_at_rest_is_that_of_all_friction(sign: float):
    """Rigid gear without losses: bearings of motor and load hold T_10 i + T_L, at rest as in motion."""
    changes = {"motor.friction_torque": 0.02, "load.friction_torque": 0.5, "task.hold_without_power": True}
    limit = 0.02 * 50.0 + 0.5
    for share, holds in ((0.98, True), (1.02, False)):
        found = holding(move(**changes, command=0.0), sign * share * limit, 0.0)
        assert found.holds is holds
        assert (found.from_rest == 0.0) is holds
        assert holds or math.copysign(1.0, found.from_rest) == -sign  # the load follows its torque


@pytest.mark.parametrize(
    ("name", "speed", "verdict"), [("nord-sk1si50-30", 0.0, "ok"), ("nord-sk1si50-30", 3.6, "warning"), ("motovario-sw050-100", 3.6, "ok")]
)
def test_a_worm_gear_that_locks_at_rest_may_not_stop_a_moving_load(name: str, speed: float, verdict: str):
    """Static efficiencies 0.36 and 0.23: both lock at rest. Efficiency e in motion makes 2 - 1/e in reverse: 0.46 and below 0."""
    ratio = float(name.rsplit("-", 1)[1])
    stiffness = {"kind": "linear", "stiffness": 5e3}
    tables = move().model_dump(exclude_none=True) | {
        "command": 0.0,
        "gearbox": {"from": name, "rated_output_torque": 60.0, "inertia": 1e-4, "stiffness": stiffness},
        "load": {"inertia": 5.0, "torque": 30.0},
        "initial": {"motor_speed": -speed * ratio, "load_speed": -speed},
    }
    finding = by_rule(lm.Scenario.model_validate(tables))["holding"]
    assert finding.verdict == verdict
    assert finding.value.startswith("at rest only" if verdict == "warning" else "the load stays at rest")
    assert ("ever faster" in finding.value) is (verdict == "warning")


def test_a_load_that_slows_down_for_long_is_not_said_to_go_on():
    # 0.1 N·m too much friction against 250 kg m2 on the shaft: it takes minutes to stop.
    changes = {"command": 0.0, "load.inertia": 250.0, "load.friction_torque": 10.1, "load.torque": 10.0}
    found = holding(move(**changes), 10.0, 0.2)
    assert found.holds
    assert not holding(move(**changes), 10.3, 0.2).holds


# --- all rules ---
OF_THUMB = ("inertia_ratio", "resonance", "dead_zone", "end_stop")
OTHERWISE = {
    "average_output_torque": {"gearbox.rated_output_torque": 1.0},
    "peak_output_torque": {"gearbox.limits.peak_output_torque": 1.0},
    "average_input_speed": {"gearbox.rated_input_speed": 50.0},
    "max_input_speed": {"gearbox.limits.max_input_speed": 50.0},
    "max_motor_speed": {"motor.limits.max_speed": 50.0},
    "motor_torque": {"motor.limits.continuous_torque": 0.4},
    "winding_temperature": {"motor.limits.max_winding_temperature": 200.0},
    "voltage": {"motor.limits.max_voltage": 5.0},
    "current": {"motor.limits.max_current": 9.0},
    "inertia_ratio": {"load.inertia": 5.0},
    "resonance": {"command.sines": [{"amplitude": 0.01, "frequency": 60.0}]},
    "dead_zone": {"motor.friction_torque": 0.3},
    "lost_motion": {"gearbox.stiffness": {"kind": "curve", "slopes": [2e4], "backlash": 2e-3}},
    "holding": {"load.torque": 0.1},
    "end_stop": {"load.end_stops": {"lower": -0.1, "upper": 0.02, "stiffness": 1e4}},
}


@pytest.mark.parametrize("rule", OTHERWISE)
def test_no_verdict_is_the_same_for_every_drive(rule: str):
    of_twist = rule in ("resonance", "lost_motion")
    base = {"gearbox.stiffness": {"kind": "linear", "stiffness": 2e4}} if of_twist else {}
    base |= {"load.end_stops": {"lower": -9.0, "upper": 9.0, "stiffness": 1e4}} if rule == "end_stop" else {}
    first, second = (by_rule(s)[rule] for s in (move(**base), move(**base | OTHERWISE[rule])))
    beyond = "caution" if rule in OF_THUMB else "warning"
    assert {first.verdict, second.verdict} == {"ok", beyond}
    if first.use is not None and second.use is not None:
        assert (first.use > 1.0) == (first.verdict == beyond)
        assert (second.use > 1.0) == (second.verdict == beyond)


def test_the_lost_motion_of_what_is_taken_as_rigid_is_not_known():
    """A record without stiffness is rigid, and so are actuators of the catalogue: 0 arcmin would be the model's, not the drive's."""
    found = by_rule(move(**{"gearbox.stiffness": {"kind": "rigid"}}))["lost_motion"]
    assert (found.verdict, found.use, found.value) == ("unknown", None, "not known")


def test_the_peak_torque_of_the_motor_is_judged_where_it_is_known():
    assert "motor_peak_torque" not in by_rule(move())
    largest = float(abs(lm.simulate(move())["motor_torque"]).max())
    for limit, verdict in ((1.01 * largest, "ok"), (0.98 * largest, "warning")):
        assert by_rule(move(**{"motor.limits.peak_torque": limit}))["motor_peak_torque"].verdict == verdict


def test_verdicts_that_depend_on_estimated_losses_are_not_decided():
    losses = {"kind": "map", "speeds": [0, 1], "loads": [0, 1], "values": [[0, 0], [0.3, 0.3]], "mirrored": True}
    most = losses | {"values": [[0, 0], [0.39, 0.39]]}
    torque, largest = (float(abs(lm.simulate(move(**{"gearbox.losses": some}))["output_torque"]).max()) for some in (losses, most))
    assert largest > 1.01 * torque  # the same torque of the motor brakes the load harder the more the gearbox loses
    for limit, verdict in ((1.1 * largest, "ok"), (0.5 * (torque + largest), "unknown")):
        changes = {"gearbox.loss_range": [0.5, 1.3], "gearbox.limits.peak_output_torque": limit}
        found = by_rule(move(**{"gearbox.losses": losses, **changes}))["estimated_losses"]
        assert found.verdict == verdict
        assert ("output torque, largest (ok to warning)" in found.value) is (verdict == "unknown")


def test_leaving_the_data_of_the_loss_map_is_found():
    path = ROOT / "scenarios" / "paper-2dof-nl-large.toml"
    assert by_rule(lm.load(path))["loss_map"].verdict == "ok"
    assert by_rule(lm.load(path, {"load.torque": 100.0}))["loss_map"].verdict == "caution"


def test_a_worm_gear_that_locks_lowers_smoothly_or_chatters():
    losses = {"kind": "map", "speeds": [0, 1], "loads": [0, 1], "values": [[0, 0], [1.3, 1.3]], "mirrored": True}
    stiffness = {"kind": "linear", "stiffness": 2e4}
    worm = {"gearbox.losses": losses, "gearbox.stiffness": stiffness, "load.torque": 4.0, "command": {"mean": -1.0}}
    # eta_b = -0.3: the critical ratio is 1/0.3; mine are 1e-4 kg m2 at 50:1.
    for ratio, verdict in ((3.3, "ok"), (3.4, "warning")):
        found = by_rule(move(**worm, **{"load.inertia": ratio * 1e-4 * 50.0**2}))["self_locking"]
        assert found.verdict == verdict
        assert "takes more than 0.024 N·m" in found.value  # 0.3 times 4 N m/50


def test_every_rule_is_tried_and_names_its_source():
    page = (ROOT / "docs" / "drive-check.md").read_text()
    assert [rule for rule in RULES if f"`{rule}`" not in page] == []
    of_steppers = {"lost_steps", "stepper_torque", "step_resonance"}  # tests/test_stepper.py
    assert set(OTHERWISE) | of_steppers | {"loss_map", "self_locking", "motor_peak_torque", "estimated_losses"} == set(RULES)
    for finding in check_drive(move()):
        assert finding.source
        assert f"[{finding.source}]" in str(finding)


def test_voltage_and_current_are_those_of_the_motor_equation():
    found = by_rule(move())
    top = 0.5 * 0.1 / (1e-4 + 0.25 / 50.0**2)
    assert found["voltage"].use == pytest.approx((0.2 * 10.0 + 0.05 * top) / 48.0, rel=0.01)
    assert found["current"].use == pytest.approx(10.0 / 12.0)
    dc = lm.load(ROOT / "scenarios" / "voltage-limited-start.toml")
    assert by_rule(dc)["voltage"].verdict == "warning"  # its amplifier ends before its command does


def test_the_command_line_says_what_is_wrong():
    path = ROOT / "scenarios" / "overrunning-load.toml"
    done = CliRunner().invoke(app, ["check", str(path)])
    assert done.exit_code == 1
    assert "WARNING  holding 20 N·m with command 0: the load torque drives the load" in done.output
    assert re.search(r"^Verdict: does not fit: \S", done.output, re.MULTILINE)


def test_nothing_judged_is_not_decided_and_what_is_not_judged_is_a_reservation():
    whole = lm.check_drive(lm.load("catalogue-robot-joint"))
    kept = lm.sizing.Findings(f for f in whole if f.verdict == "ok")
    unknown = lm.sizing.Findings(f for f in whole if f.verdict == "unknown")
    assert (len(kept), len(unknown)) == (13, 3)
    assert [f.verdict.state for f in (kept, whole, unknown)] == ["fits", "fits with a reservation", "not decided"]
    assert all(f.what in whole.verdict.lines[0] for f in unknown)
    turned = lm.sizing.Finding("estimated_losses", "estimated losses", "not decided by them: x (ok to warning)", "unknown")
    assert lm.sizing.Findings([*whole, turned]).verdict.state == "not decided"
    done = CliRunner().invoke(app, ["check", "two-motors-one-ring"])
    assert done.exit_code == 3
    assert re.search(r"^Verdict: not decided: none of \d+ points is judged", done.output, re.MULTILINE)


def test_a_limit_that_is_missed_by_far_leaves_the_other_bars_to_be_seen(tmp_path: Path):
    """An inertia ratio of 72, beside limits that are used by less than 100 %."""
    scenario = lm.load("catalogue-robot-joint", {"task.max_lost_motion": "0.0908 arcmin"})
    findings = lm.check_drive(scenario)
    uses = {f.what: 100.0 * f.use for f in findings if f.use is not None}
    assert max(uses.values()) == pytest.approx(720.0, rel=0.01)
    bars = re.findall(r'width="([\d.]+)" height="15\.0".*?<title>([^<:]*): ', render(check_report("joint", findings)))
    widths = {name: float(width) for width, name in bars}
    assert len(widths) == len(uses)
    first, *others = sorted(uses, key=lambda name: -uses[name])
    for name in others:
        assert widths[name] / widths[first] == pytest.approx(uses[name] / 200.0, abs=0.01)
    assert f"{uses[first]:.4g} →" in render(check_report("joint", findings))


MEANS = ("average_output_torque", "average_input_speed", "motor_torque", "winding_temperature")


def lifted(begin: float, end: float, duration: float, again: bool = False, changes: dict | None = None) -> lm.Scenario:
    """A load of 20 N·m that the command lifts except from `begin` to `end`, in which it sinks."""
    steps = [{"height": 0.5}, {"height": -0.5, "time": begin}]
    steps += [{"height": 0.5, "time": end}] if again else []
    own = {"command": {"steps": steps}, "load.torque": 20.0, "task.hold_without_power": False}
    return lm.load("catalogue-robot-joint", own | {"simulation.duration": duration} | (changes or {}))


def test_no_mean_is_judged_ok_by_waiting_while_the_load_sinks():
    for duration in (0.5, 20.0, 200.0):
        verdicts = {by_rule(lifted(0.5, duration, duration))[rule].verdict for rule in MEANS}
        assert ("unknown" if duration == 0.5 else "ok") not in verdicts


@pytest.mark.parametrize("share", [0.05, 0.3, 0.45])
def test_a_load_that_sinks_for_a_part_of_the_run_is_not_passed_over(share: float):
    duration = 0.5 / (1.0 - share)
    scenario = lifted(0.5, duration, duration)
    run = lm.simulate(scenario)
    assert float(run["load_speed"][-1]) < 0.0  # it does sink
    found = by_rule(scenario)
    for rule in MEANS:
        assert found[rule].verdict != "ok", rule
        assert "also at its end, so that this mean depends on the duration" in found[rule].remark
        told = float(found[rule].remark.split("drives the motor for ")[1].split(" s of")[0])
        falling = float((run["motor_speed"] < 0.0).mean()) * duration
        assert told == pytest.approx(falling, abs=0.02 * duration)
    whole = by_rule(lifted(0.5, 0.5, 0.5))
    for rule in MEANS:
        assert whole[rule].verdict != "unknown"
        assert "with command 0" not in whole[rule].remark


@pytest.mark.parametrize(
    ("run", "told"),
    [
        ((0.4, 0.7, 1.0, True), "with command 0 the load drives the motor for 0."),  # its time is fixed by the command
        ((0.5, 0.7, 0.7, False, {"task.cycle": 0.7}), "with command 0 the load drives the motor"),
        ((0.5, 0.52, 0.52, False, {"load.torque": 0.0}), None),  # it is slowed down by friction alone
    ],
)
def test_a_load_that_sinks_within_the_cycle_is_told_and_judged(run, told):
    found = by_rule(lifted(*run))
    for rule in MEANS:
        assert found[rule].verdict != "unknown" or not told
        assert told in found[rule].remark if told else "with command 0" not in found[rule].remark
        assert "depends" not in found[rule].remark or len(run) > 4


def test_the_drive_check_finds_what_is_wrong():
    scenario = lm.load(ROOT / "scenarios" / "catalogue-robot-joint.toml")
    heavy = scenario.replace(**{"load.inertia": 60.0, "command.frequency": 3.0})
    doubtful = {f.what for f in check_drive(heavy) if f.verdict == "caution"}
    assert {"inertia ratio", "resonance on the softest segment"} <= doubtful
    weak = scenario.replace(**{"command.amplitude": 0.004})
    (zone,) = [f for f in check_drive(weak) if f.what == "dead zone"]
    assert zone.verdict == "warning"
    assert "does not move" in zone.remark
    # That it does not move is a fact of the run, not of the check alone.
    assert float(abs(lm.simulate(weak)["motor_speed"]).max()) == 0.0
    plain = [f for f in check_drive(paper_scenario("2-DOF-NL", "large")) if f.verdict == "unknown"]
    assert {"output torque, largest"} <= {f.what for f in plain}


def test_an_inertia_ratio_is_a_reservation_by_the_rule_of_thumb_and_a_failure_by_the_limit_of_the_maker() -> None:
    """The shipped axis has 31.7. Its record states no limit; with one of 20 it does not fit, with one of 40 nothing is said."""
    states = {}
    for limit in (None, 20.0, 40.0):
        limits = {} if limit is None else {"motor.limits.max_inertia_ratio": limit}
        findings = lm.check_drive(lm.load("position-axis", limits))
        ratio = next(f for f in findings if f.rule == "inertia_ratio")
        assert ratio.use == pytest.approx(31.7 / (limit or 10.0), rel=2e-3)
        states[limit] = (ratio.verdict, findings.verdict.exit_code, "inertia" in findings.verdict.lines[0])
    assert states == {None: ("caution", 0, True), 20.0: ("warning", 1, True), 40.0: ("ok", 0, False)}


ROTOR = {"kind": "torque_source", "rotor_inertia": 2e-4, "rated_torque": 2.0}
TRAVEL = 0.2 / (2.0 * math.pi)  # of a slide for a radian


@pytest.mark.parametrize(("parts", "inertia"), [
    ({"rack": {"travel_per_turn": 0.2, "inertia": 1e-3}, "slide": {"mass": 50.0}, "gearbox": {"ratio": 5.0, "inertia": 1e-5}}, 1e-5 + (1e-3 + 50.0 * TRAVEL**2) / 25.0),
    ({"belt": {"travel_per_turn": 0.2, "inertia": 2e-4}, "slide": {"mass": 10.0}, "payload": {"mass": 5.0}}, 2e-4 + 15.0 * TRAVEL**2),
    ({"screw": {"lead": 0.2, "inertia": 5e-4, "efficiency": 0.9}, "slide": {"mass": 4.0}, "gearbox": {"ratio": 3.0, "inertia": 1e-5}}, 1e-5 + (5e-4 + 4.0 * TRAVEL**2) / 9.0),
])  # fmt: skip
def test_the_inertia_of_an_axis_is_all_that_its_rotor_moves(parts: dict, inertia: float) -> None:
    axis = lm.Scenario(axis={"motor": ROTOR, **parts}, command={"mean": 0.2}, simulation={"duration": 0.1, "sample_interval": 0.01})
    ratio = next(f for f in lm.check_drive(axis) if f.rule == "inertia_ratio")
    assert ratio.use == pytest.approx(inertia / 2e-4 / 10.0, rel=1e-9)
    assert ratio.verdict == "ok" or "axis.motor.limits.max_inertia_ratio states" in ratio.remark


def test_the_inertia_of_two_stages_is_referred_through_both() -> None:
    train = lm.Scenario(
        shafts={"a": {}, "b": {"inertia": 2e-4}, "c": {"inertia": 1.5}},
        motors={"m": {"shaft": "a", **ROTOR}},
        gears={"g": {"input": "a", "output": "b", "ratio": 4.0, "inertia": 3e-5}, "h": {"input": "b", "output": "c", "ratio": 10.0, "inertia": 1e-4}},
        command={"m": 0.2},
        simulation={"duration": 0.1, "sample_interval": 0.01},
    )  # fmt: skip
    ratio = next(f for f in lm.check_drive(train) if f.rule == "inertia_ratio")
    assert ratio.use == pytest.approx((3e-5 + (2e-4 + 1e-4 + 1.5 / 100.0) / 16.0) / 2e-4 / 10.0, rel=1e-9)


def test_lost_motion_and_resonance_of_two_stages_are_those_of_springs_and_gaps_in_series() -> None:
    """The first gear twists under a tenth of the torque, and the load sees a tenth of that; the rotor's inertia counts 1600 times."""
    k1, k2, gap1, gap2 = 500.0, 2e4, 2e-3, 1e-3
    first = {"ratio": 4.0, "stiffness": {"kind": "curve", "backlash": gap1, "slopes": [k1]}}
    second = {"ratio": 10.0, "stiffness": {"kind": "curve", "backlash": gap2, "slopes": [k2]}}
    train = lm.Scenario(
        shafts={"a": {}, "b": {"inertia": 1e-9}, "c": {"inertia": 1.5}},
        motors={"m": {"shaft": "a", **ROTOR}},
        gears={"g": {"input": "a", "output": "b", **first}, "h": {"input": "b", "output": "c", **second, "rated_output_torque": 100.0, "rated_input_speed": 100.0}},
        command={"m": 0.2},
        task={"max_lost_motion": 0.01},
        simulation={"duration": 0.1, "sample_interval": 0.01},
    )  # fmt: skip
    found = {f.rule: f for f in lm.check_drive(train)}
    softness = 1.0 / k2 + 1.0 / (100.0 * k1)
    lost = gap2 + gap1 / 10.0 + 2.0 * 3.0 * softness
    assert found["lost_motion"].use == pytest.approx(lost / 0.01, rel=1e-4)  # measured by a ramp
    swing, hold = (math.sqrt(x / softness) / (2.0 * math.pi) for x in (1.0 / (2e-4 * 1600.0) + 1.0 / 1.5, 1.0 / 1.5))
    assert found["resonance"].value == f"{swing:.4g} Hz, anti-resonance {hold:.4g} Hz"


def test_the_force_of_a_linear_motor_is_judged_by_its_peak_and_its_rated_force() -> None:
    """A force of 80 N + 90 N sin: 170 N at most, and sqrt(80^2 + 90^2/2) N in the mean."""
    scenario = lm.Scenario(
        slides={"table": {"mass": 8.0, "viscous_friction": 100.0}},
        linear_motors={"m": {"slide": "table", "rated_force": 100.0, "mass": 2.0, "peak_force": 250.0}},
        command={"m": {"mean": 0.8, "amplitude": 0.9, "frequency": 5.0}},
        simulation={"duration": 1.0, "sample_interval": 1e-3},
    )
    found = by_rule(scenario)
    mean, peak = found["motor_torque"], found["motor_peak_torque"]
    assert (mean.use, mean.verdict) == (pytest.approx(math.sqrt(80.0**2 + 90.0**2 / 2.0) / 100.0, rel=1e-6), "warning")
    assert (peak.use, peak.verdict) == (pytest.approx(170.0 / 250.0, rel=1e-9), "ok")


def test_a_limit_that_is_given_takes_no_other_judgement_away() -> None:
    before, after = (
        {f.what: f.verdict for f in lm.check_drive(lm.load("position-axis", changes))}
        for changes in ({}, {"motor.limits.max_speed": "4000 rpm"})
    )
    assert {what for what in before if after[what] != before[what]} == {"input speed, largest, for the motor"}


def test_the_page_of_a_check_has_the_uses_and_verdicts_of_its_findings(tmp_path: Path) -> None:
    findings, page = lm.check_drive(lm.load("catalogue-robot-joint")), tmp_path / "check.html"
    done = CliRunner().invoke(app, ["check", "catalogue-robot-joint", "--report", str(page)])
    assert done.exit_code == 0, done.output
    text = page.read_text()
    assert not Page(text).faults
    shown = dict(re.findall(r"<title>([^<:]*): ([\d.e−]+)</title>", text))
    wanted = {f.what: 100.0 * f.use for f in findings if f.use is not None and f.verdict != "caution"}
    assert len(wanted) > 2
    assert {name: float(value.replace("−", "-")) for name, value in shown.items()} == pytest.approx(wanted, rel=1e-5)
    rows = re.findall(r"<tr><td(?: class=\"words\")?>(.*?)</td><td[^>]*>.*?</td><td>(.*?)</td>", text)
    words = {"ok": "ok", "caution": "caution", "warning": "WARNING", "unknown": "not judged"}
    assert rows == [(escape(f.what), words[f.verdict]) for f in findings]
    assert findings._repr_html_().startswith("<iframe")  # type: ignore[attr-defined]


def screw_at(turns: float, **data: object) -> lm.Scenario:
    """A slide with 500 N of friction on a screw of 40 mm lead that turns at a constant speed [1/s], deflected by that force."""
    stiffness = lm.model.RatedScrew(lead=40e-3, **data).gear("motor", "table").stiffness
    deflections = {} if stiffness.kind == "rigid" else {"screw": 500.0 / stiffness.stiffness}
    return lm.Scenario(
        shafts={"motor": {"inertia": 1e-4, "speed": 2.0 * math.pi * turns}},
        slides={"table": {"mass": 60.0, "friction_force": 500.0}},
        screws={"screw": {"input": "motor", "output": "table", "lead": 40e-3} | data},
        initial={"slide_speeds": {"table": 40e-3 * turns}, "deflections": deflections},
        simulation={"duration": 1.0, "sample_interval": 0.01},
    )


THK = {"core_diameter": 17.5e-3, "supported_length": 1.1, "nut_stiffness": 3e8, "ball_circle_diameter": 20.75e-3}
THK |= {"dynamic_capacity": 5400.0, "static_capacity": 12600.0, "load_factor": 1.5}


def test_a_screw_of_a_train_is_judged_by_its_ratings():
    """THK A-731 and A-734: 2180 rpm, 7750 N (fixed and supported), 3373 rpm of the balls; 1e6 (C/(f_w F))^3 turns at 10 1/s."""
    found = {f.rule: f for f in check_drive(screw_at(10.0, **THK))}
    assert found["critical_speed"].use == pytest.approx(600.0 / 2180.0, rel=5e-3)
    assert found["buckling"].use == pytest.approx(500.0 / 7750.0, rel=5e-3)
    assert found["screw_speed"].use == pytest.approx(600.0 / 3373.0, rel=5e-3)
    assert found["screw_static"].use == pytest.approx(500.0 / 12600.0, rel=1e-6)
    life = 1e6 * (5400.0 / (1.5 * 500.0)) ** 3 / 10.0 / 3600.0
    assert found["screw_life"].value == f"{life:.4g} h"
    assert found["screw_life"].verdict == "unknown"
    assert "no wanted life" in found["screw_life"].remark
    assert {found[rule].verdict for rule in ("critical_speed", "buckling", "screw_speed", "screw_static")} == {"ok"}


def test_what_moves_a_slide_is_asked_for_no_rating_of_a_gearbox():
    """A screw is judged by its axial load; of a rack the largest force of the run is named."""
    screw = check_drive(screw_at(10.0, **THK))
    assert not [f for f in screw if "gearbox" in str(f.remark) or "rated_output_torque" in str(f.remark)]
    rack = lm.load("rack-axis-with-play")
    force = float(abs(lm.simulate(rack)["rack_output_force"]).max())
    (found,) = [f for f in check_drive(rack) if f.rule == "rack_force"]
    assert found.verdict == "unknown"
    assert found.value.endswith(" N")
    assert float(found.value.removesuffix(" N")) == pytest.approx(force, rel=0.01)  # of denser samples
    assert found.remark.endswith("rack.rated_force is missing")


def test_the_verdict_of_a_screw_turns_with_its_speed_and_its_mounting():
    def verdict(turns: float, rule: str, **changes: object) -> str:
        findings = check_drive(screw_at(turns, **THK | changes))
        return next(f.verdict for f in findings if f.rule == rule)

    assert (verdict(36.0, "critical_speed"), verdict(37.0, "critical_speed")) == ("ok", "warning")
    assert (verdict(56.0, "screw_speed"), verdict(57.0, "screw_speed")) == ("ok", "warning")
    assert verdict(20.0, "critical_speed", mounting="fixed-free") == "warning"
    assert verdict(1.0, "buckling", supported_length=4.5, mounting="fixed-free") == "warning"


def test_a_screw_of_the_catalogue_has_its_ratings_in_the_check(tmp_path: Path):
    (tmp_path / "axis.toml").write_text(
        """
shafts.motor = { inertia = 1e-4, speed = "60 rpm" }
slides.table = { mass = 60, friction_force = 500 }
screws.screw = { input = "motor", output = "table", from = "hiwin-r20-10k3-fsc", mounting = "fixed-fixed" }
initial.slide_speeds.table = 0.01
simulation = { duration = 1, sample_interval = 0.01 }
"""
    )
    record = find("hiwin-r20-10k3-fsc", "screw")
    found = by_rule(lm.load(tmp_path / "axis.toml"))
    assert record.static_capacity is not None
    # From a start without deflection the slide overshoots, up to twice the force of its friction.
    assert 500.0 < found["screw_static"].use * record.static_capacity < 1001.0
    bare = {f.rule: f for f in check_drive(screw_at(1.0))}
    assert bare["screw_static"].remark == "screws.screw.static_capacity is missing"
    assert bare["screw_life"].remark == "screws.screw.dynamic_capacity is missing"


BRAKING = 0.3125  # energy [J] that one axis of AXES returns: 0.5 N·m · w - 0.5 Ω · (5 A)² from 50 to 25 rad/s, at 500 rad/s²
AXIS = {"steps": [{"height": 0.5}, {"height": -1.0, "time": 0.1}, {"height": 0.5, "time": 0.2}]}
MOTOR = {"kind": "torque_source", "rotor_inertia": 5e-4, "rated_torque": 1.0, "limits": {"torque_constant": 0.1, "resistance": 0.5}}


def axes(later: float = 0.0, cycle: float = 0.5, **supply) -> lm.Scenario:
    """Two axes of 1e-3 kg·m² on one bus, the second one with its motion later."""
    second = {"steps": [{**step, "time": step.get("time", 0.0) + later} for step in AXIS["steps"]]}
    return lm.Scenario.model_validate(
        {
            "shafts": {"x": {"inertia": 5e-4}, "y": {"inertia": 5e-4}},
            "motors": {name: {**MOTOR, "shaft": name} for name in ("x", "y")},
            "command": {"x": AXIS, "y": second},
            "task": {"cycle": cycle, "supply": {"max_voltage": 48.0, "voltage_limit": 60.0, "capacitance": 1e-3} | supply},
            "simulation": {"duration": 0.5, "sample_interval": 1e-3},
        }
    )


@pytest.mark.parametrize(
    ("later", "energy"),
    [(0.0, 2.0 * BRAKING), (0.25, BRAKING), (0.1, BRAKING)],
    ids=["both brake at once", "one after the other", "one brakes while the other accelerates"],
)
def test_a_bus_takes_what_all_axes_together_return(later, energy):
    """With the motion 0.1 s later, the first axis feeds the second: 500 t W are taken in all, and the second returns its own energy."""
    found = by_rule(axes(later))["bus_voltage"]
    assert found.use == pytest.approx(math.sqrt(48.0**2 + 2.0 * energy / 1e-3) / 60.0, rel=1e-4)
    assert found.verdict == "ok"


def test_brake_resistor_of_a_bus_is_judged_over_the_cycle_and_a_motor_without_data_not():
    """Up to 50 V the capacitors take (50² - 48²)/2 · 1 mF = 0.098 J. The resistor takes the rest of what returns at once."""
    supply = {"voltage_limit": 50.0, "brake_resistance": 50.0, "brake_power": 2.0}
    mean = [f for f in check_drive(axes(cycle=0.5, **supply)) if f.rule == "brake_resistor"][-1]
    assert mean.use == pytest.approx((2.0 * BRAKING - 0.098) / 0.5 / 2.0, rel=1e-3)
    found = by_rule(axes().replace(**{"motors.y.limits.resistance": None}))["bus_voltage"]
    assert found.verdict == "unknown" and "motors.y.limits.resistance" in found.remark


def test_a_drive_on_its_bus_is_the_train_of_one_axis():
    changes = {"motor": MOTOR, "gearbox.ratio": 1.0, "load.inertia": 5e-4, "command": AXIS, "simulation.duration": 0.45}
    task = {"cycle": 0.5, "supply": {"max_voltage": 48.0, "voltage_limit": 60.0, "capacitance": 1e-3}}
    found = by_rule(move(**changes, task=task))["bus_voltage"]
    assert found.use == pytest.approx(math.sqrt(48.0**2 + 2.0 * BRAKING / 1e-3) / 60.0, rel=1e-4)


@pytest.mark.parametrize(
    "scenario",
    [*map(lm.load, ("position-axis", "catalogue-robot-joint", "paper-1dof-l-small", "lossy-rigid-gear")),
     move(), move(**{"load.torque": 2.0, "task.max_lost_motion": 1e-3, "motor.rotor_inertia": 1e-5})],
)  # fmt: skip
def test_a_drive_has_the_same_findings_in_both_forms(scenario: lm.Scenario):
    """Keys in remarks are those of each form; all else is the same."""
    assert scenario.form == DRIVE
    short, long = ([(f.rule, f.value, f.verdict, f.use) for f in check_drive(s)] for s in (scenario, scenario.long()))
    assert short == long and len(short) > 5


@pytest.mark.parametrize(("efficiency", "verdict"), [(0.9, "warning"), (0.45, "ok")])
def test_a_vertical_screw_holds_by_itself_only_if_it_locks(efficiency, verdict):
    """eta_b = 2 - 1/eta: 0.89 of the weight reaches the motor of one screw, the other one locks."""
    axis = {"motor": {"kind": "torque_source", "rotor_inertia": 3e-4, "rated_torque": 2.0}}
    axis["screw"] = {"lead": 0.02, "efficiency": efficiency, "stiffness": 1e8, "damping": 2e4}
    axis["slide"] = {"mass": 30.0, "inclination": math.pi / 2}
    times = {"duration": 0.01, "sample_interval": 0.001}
    scenario = lm.Scenario(axis=axis, command={"mean": 0.0}, simulation=times)
    assert by_rule(scenario)["holding"].verdict == verdict
    off = scenario.replace(**{"task.hold_without_power": False})
    assert by_rule(off)["holding"].verdict == "ok"


def test_a_brake_and_a_payload_of_an_axis_are_those_of_the_long_form():
    """Weight of 32 kg at a lead of 20 mm: 32 g 0.02/(2 pi) = 0.9989 N m at the motor, beyond the 0.8 N m of the brake."""
    axis = {"motor": {"kind": "torque_source", "rotor_inertia": 3e-4, "rated_torque": 2.0}}
    axis["screw"] = {"lead": 0.02, "efficiency": 0.9, "stiffness": 1e8, "damping": 2e4}
    axis["slide"] = {"mass": "30 kg", "inclination": math.pi / 2}
    times = {"duration": 0.1, "sample_interval": 0.01}
    short = lm.Scenario(axis=axis | {"payload": {"mass": 2.0}, "brake": {"torque": 0.8, "command": 1.0}}, simulation=times)
    long = lm.Scenario(axis=axis | {"slide": axis["slide"] | {"mass": 32.0}}, simulation=times).written
    assert short.slides == long.slides
    assert short.brakes["brake"] == lm.Brake(shaft="motor", torque=0.8)
    found = by_rule(short)
    assert found["holding_brake"].use == pytest.approx(32.0 * 9.80665 * 0.02 / (2.0 * math.pi) / 0.8, rel=1e-9)
    assert found["holding_brake"].verdict == found["holding"].verdict == "warning"
    assert by_rule(short.replace(**{"axis.brake.torque": 1.0}))["holding"].verdict == "ok"
    # Closed, it holds what it can: the brake slips under 0.9989 N m, and not under the weight of 20 kg.
    assert lm.simulate(short)["slide_position"][-1] < 0.0
    held = lm.simulate(short.replace(**{"slides.slide.mass": 20.0}))
    assert not held["motor_speed"].any()


test_what_is_wrong_with_them_is_said_with_the_key_of_the_file = refusals_of(
    lambda axis: lm.Scenario(axis={"motor": ROTOR, "slide": {"mass": 1.0}, "screw": {"lead": 0.02}} | axis, simulation=run_of(1, 0.1)),
    ({"brake": {"torque": 1.0}}, "axis.brake.command"),
    ({"brake": {"torque": -1.0, "command": 0.0}}, "axis.brake.torque"),
    ({"payload": {"mass": "2 m"}}, "axis.payload.mass"),
    ({"payload": {"inertia": 2.0}}, "axis.payload.inertia"),
)  # fmt: skip

"""Motors and gearboxes for a task: the rules against closed forms, the rows against single runs, and what is refused."""

import math
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from conftest import ROOT, lostmotion
from lostmotion.control.gain_rules import TwoInertias, suited
from lostmotion.simulation.forms.drive_tables import LoadTable
from lostmotion.simulation.runs.run import run
from lostmotion.sizing.axis_task.axis_task import repeated
from lostmotion.sizing.axis_task.candidate_scenario import last_cycle
from lostmotion.sizing.axis_task.cycle_demands import COLUMNS
from lostmotion.sizing.axis_task.motor_per_sample_time import Electrical
from lostmotion.sizing.duty_cycle import DutyCycle
from lostmotion.sizing.required_motion import check_motor, input_demand, required_motion
from lostmotion.studies.selection.task_file import task_of
from lostmotion.studies.study.study_definition import Study
from refusals import refused

J, FRICTION, RATIO, CYCLE = 0.1, 0.5, 50.0, 1.0
FINE = 40  # samples in a sample time of the controller
SPEED, ACCELERATION, DISTANCE = 4.0, 40.0, 1.2
INERTIA_1, EFFICIENCY = 2e-6, 0.8

RATED = {"rated_torque": 0.4, "rated_speed": 400.0, "rated_voltage": 48.0, "voltage_limit": 48.0}
RATED |= {"electrical_time_constant": 5e-4, "armature_voltage_constant": 10.0}
LIMITS = {"continuous_torque": 0.4, "resistance": 1.0, "torque_constant": 0.1, "max_current": 20.0}
MOTOR = lm.Motor(rotor_inertia=1e-5, friction_torque=0.01, **RATED, limits=LIMITS)
GEARBOX = lm.Gearbox(
    ratio=RATIO,
    inertia=INERTIA_1,
    rated_input_speed=300.0,
    rated_output_torque=20.0,
    stiffness={"kind": "rigid"},
    losses={"kind": "constant_efficiency", "efficiency": EFFICIENCY},
)
LIMITED = {"kind": "position", "speed": SPEED, "acceleration": ACCELERATION}
TABLES: dict[str, Any] = {
    "title": "there and back",
    "task": {"cycle": "1 s", "settling_window": "5 arcmin"},
    "load": {"inertia": J, "friction_torque": FRICTION},
    "controller": {"reference": LIMITED | {"moves": [{"to": DISTANCE, "dwell": 0.1}, {"to": 0.0}]}},
    "motor": {"voltage_limit": "48 V", "limits": {"max_current": "20 A"}},
    "vary": [
        {"key": "gearbox", "values": ["schaeffler-rt1-h-20-100", "bonfiglioli-tr060-2-36"]},
        {"key": "motor", "values": ["maxon-ec-i-52-606793", "faulhaber-3242g024bx4"]},
    ],
}


ONE_WAY = {"reference": LIMITED | {"moves": [{"to": DISTANCE}]}}


def changed(**tables: Any) -> dict[str, Any]:
    return TABLES | tables


@pytest.fixture(scope="module")
def task() -> Study:
    return task_of(changed())


@pytest.fixture(scope="module")
def result(task: Study) -> Any:
    return lm.select(task)


def test_an_interrupted_selection_keeps_its_finished_pairs(tmp_path: Path):
    """402 pairs that the rules refuse, in parts of 40: those that were written are not computed again."""
    file = tmp_path / "task.toml"
    ratios = ", ".join(f"{3.0 + 0.02 * k:.2f}" for k in range(402))
    moves = "[{ to = 1.2, dwell = 0.1 }, { to = 0.0 }]"
    file.write_text(
        f"""
task = {{ cycle = "1 s", max_inertia_ratio = 1e-9 }}
load.inertia = {J}
controller.reference = {{ kind = "position", speed = {SPEED}, acceleration = {ACCELERATION}, moves = {moves} }}
motor.from = "maxon-ec-i-52-606793"
gearbox.from = "bonfiglioli-tr060-2-36"
vary = [{{ key = "gearbox.ratio", values = [{ratios}] }}]
"""
    )
    directory = tmp_path / "rows"
    process = subprocess.Popen([sys.executable, "-m", "lostmotion", "select", str(file), "-o", str(directory)], stdout=subprocess.DEVNULL)
    while not list(directory.glob("part-*.parquet")) and process.poll() is None:
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    process.wait()
    kept = {p.name: p.stat().st_mtime_ns for p in directory.glob("part-*.parquet")}
    assert 1 <= len(kept) < 11
    again = lm.select(file, directory)
    assert again.sizes["pair"] == 402
    assert {p.name: p.stat().st_mtime_ns for p in directory.glob("part-*.parquet")}.items() >= kept.items()
    assert again.equals(lm.select(file))


# --- rules against closed forms ---
@pytest.fixture(scope="module")
def demand() -> Any:
    reference = task_of(changed()).scenario.controller.reference
    motion = required_motion(reference, LoadTable(inertia=J, friction_torque=FRICTION), CYCLE)
    return input_demand(motion, GEARBOX)


def phases() -> list[tuple[float, float, float]]:
    """Of a move there: duration [s], mean speed of the load over it, and torque at the gearbox output [N*m]."""
    t_a = SPEED / ACCELERATION
    t_c = DISTANCE / SPEED - t_a
    return [(t_a, SPEED / 2, J * ACCELERATION + FRICTION), (t_c, SPEED, FRICTION), (t_a, SPEED / 2, -J * ACCELERATION + FRICTION)]


def motor_torques() -> list[float]:
    own = (MOTOR.rotor_inertia + INERTIA_1) * RATIO * ACCELERATION
    return [MOTOR.friction_torque + T / (RATIO * EFFICIENCY) + sign * own for (_, _, T), sign in zip(phases(), (1, 0, -1), strict=True)]


def test_rms_torque_and_cubic_mean_of_trapezoidal_moves(demand: Any):
    rms = math.sqrt(2 * sum(t * T**2 for (t, _, _), T in zip(phases(), motor_torques(), strict=True)) / CYCLE)
    turned = sum(t * w for t, w, _ in phases())
    mean = (sum(t * w * abs(T) ** 3 for t, w, T in phases()) / turned) ** (1 / 3)
    cycle: DutyCycle = demand.cycle(demand.motor_torque(MOTOR))
    found = (cycle.rms_motor_torque, cycle.mean_output_torque, cycle.mean_input_speed)
    assert found == pytest.approx((rms, mean, 2 * RATIO * DISTANCE / CYCLE), rel=1e-7)


def test_peak_current_voltage_and_inertia_ratio(demand: Any):
    findings = {f.rule: f for f in check_motor(demand, MOTOR, J, 25.0, 10.0)}
    peak = max(map(abs, motor_torques()))
    assert findings["current"].use == pytest.approx(peak / 0.1 / 20.0, rel=1e-7)
    assert findings["inertia_ratio"].use == pytest.approx((J / RATIO**2 + INERTIA_1) / 1e-5 / 10.0, rel=1e-12)
    # (2) at the end of acceleration, without the inductance: k_N E = M/M_R + (k_N - 1) w/w_R
    volts = 48.0 * (motor_torques()[0] / 0.4 + 9.0 * RATIO * SPEED / 400.0) / 10.0
    assert findings["voltage"].use == pytest.approx(volts / 48.0, rel=1e-6)
    assert findings["max_motor_speed"].value.startswith(f"{RATIO * SPEED * 30 / math.pi:.4g} rpm")


def test_a_required_motion_has_the_losses_of_the_run():
    """At constant speed, where inertia and compliance have no part, the torque that is required is that of the run."""
    scenario = lm.load("paper-2dof-nl-large").replace(**{"load.torque": 20.0})
    result = lm.simulate(scenario.replace(command={"mean": 1.0}), duration=10.0).isel(time=-1)
    speed = float(result["load_speed"])
    reference = lm.PositionReference(samples={"times": [0.0, 1.0], "values": [0.0, speed]})
    found = input_demand(required_motion(reference, scenario.load, 1.0), scenario.gearbox)
    friction = scenario.gearbox.viscous_friction * found.speed
    assert (found.torque - friction) == pytest.approx(float(result["input_torque"]), rel=1e-3)


# --- gains ---
def test_identical_damping_damps_both_pole_pairs_alike():
    J_M, J_L, k = 2.5e-4, 4.2e-3, 36.0
    gains = suited(TwoInertias(J_M, J_L, k), 1.5e-5, 1e-4)
    w2, R = k / J_L, J_L / J_M
    s4 = [1.0, gains.speed.gain / J_M, (1 + R) * w2 + gains.speed.integral_gain / J_M, gains.speed.gain / J_M * w2]
    poles = np.roots([*s4, gains.speed.integral_gain / J_M * w2])
    assert gains.rule == "identical damping"
    assert -poles.real / np.abs(poles) == pytest.approx(np.full(4, 0.7), rel=1e-9)


@pytest.mark.parametrize(("stiffness", "load"), [(math.inf, 1e-3), (36.0, 1e-4), (1e9, 1e-3)])
def test_a_rigid_or_a_light_load_gets_the_symmetrical_optimum(stiffness: float, load: float):
    gains = suited(TwoInertias(2e-4, load, stiffness), 3.5e-4, 1e-3)
    assert gains.rule == "symmetrical optimum"
    assert gains.speed.gain == pytest.approx((2e-4 + load) / (2 * 3.5e-4))
    assert gains.speed.gain / gains.speed.integral_gain == pytest.approx(4 * 3.5e-4)


def test_a_pair_has_the_gains_of_the_rule_of_tune(task: Study):
    scenario = task.axis_at(task.parameters(0, 1)[0], 2)
    tuned, controller = lm.tune(scenario, rule="suited"), scenario.controller
    assert tuned.gain == pytest.approx(controller.speed.gain, rel=1e-12)
    assert tuned.integral_gain == pytest.approx(controller.speed.k_i, rel=1e-12)
    assert tuned.position_gain == pytest.approx(controller.position.gain, rel=1e-12)
    assert tuned.filter_time == 0.0


# --- the cycle ---
def test_a_cycle_repeats_exactly():
    reference = task_of(changed()).scenario.controller.reference
    three = repeated(reference, CYCLE, 3)
    time = np.linspace(0.0, CYCLE, 501)[:-1] + 1e-4
    for derivative in range(3):
        once = reference.at(time)[derivative]
        for k in range(3):
            assert three.at(time + k * CYCLE)[derivative] == pytest.approx(once, abs=1e-9)
    indexing = lm.PositionReference(speed=4.0, acceleration=40.0, moves=[{"to": 1.5}])  # goes on
    assert repeated(indexing, CYCLE, 4).at(3.99)[0] == pytest.approx(6.0)
    samples = lm.PositionReference(samples={"times": [0.0, 0.5, 1.0], "values": [0.0, 1.0, 0.0]})
    assert repeated(samples, 1.0, 2).at([0.25, 1.25, 1.75])[0] == pytest.approx([0.5, 0.5, 0.5])
    instants = np.linspace(0.0, 3.0, 31)  # the last cycle has both of its ends
    assert list(instants[last_cycle(len(instants), 3)][[0, -1]]) == pytest.approx([2.0, 3.0])


# --- rows ---
def test_a_row_is_the_run_of_its_scenario(task: Study, result: Any):
    runs = [k for k in range(task.total) if not math.isnan(float(result["cycles"].values[result["run"].values == k][0]))]
    assert runs
    for k in runs:
        row = result.isel(pair=int(np.flatnonzero(result["run"].values == k)[0]))
        count = int(row["cycles"])
        scenario = task.axis_at(task.parameters(k, k + 1)[0], count)
        data = lm.simulate(scenario, energy=False)
        each = (data.sizes["time"] - 1) // count
        last = data.isel(time=slice((count - 1) * each, count * each + 1))
        constant = scenario.motor.limits.torque_constant
        assert float(row["current_peak"]) == abs(last["motor_torque"].values).max() / constant
        assert float(row["voltage_peak"]) == abs(last["command"].values).max() * scenario.motor.rated_voltage
        error = last["load_angle"].values - scenario.controller.reference.at(last["time"].values)[0]
        assert float(row["tracking_error_peak"]) == abs(error).max()
        ends = [int(np.searchsorted(last["time"].values - last["time"].values[0], t - 1e-9)) for t in (0.5, CYCLE)]
        assert float(row["reversal_error"]) == pytest.approx(abs(error[ends[0]] - error[ends[1]]), abs=2e-5)
        fine = lm.simulate(scenario, energy=False, sample_interval=scenario.simulation.sample_interval / FINE)
        torque, command = (fine[name].values[-each * FINE - 1 :] for name in ("motor_torque", "command"))
        held = np.repeat(command[:-1:FINE], FINE)  # the command of a tick
        square = (torque[:-1] ** 2 + torque[:-1] * torque[1:] + torque[1:] ** 2) / 3.0
        power = held * scenario.motor.rated_voltage * 0.5 * (torque[:-1] + torque[1:]) / constant
        energy = power.reshape(-1, FINE).mean(axis=1) * scenario.simulation.sample_interval
        # Straight lines between the fine samples: (T/(40 tau))^2/12 = 1e-6 of the ripple, for rms and energy alike.
        assert float(row["motor_torque_rms"]) == pytest.approx(math.sqrt(square.mean()), rel=1e-5)
        assert float(row["current_rms"]) == pytest.approx(math.sqrt(square.mean()) / constant, rel=1e-5)
        assert float(row["energy"]) == pytest.approx(energy[energy > 0.0].sum(), rel=1e-5)
        assert float(row["energy_returned"]) == pytest.approx(-energy[energy < 0.0].sum(), rel=1e-4)


@pytest.mark.parametrize("current", [{"kind": "ideal"}, {"kind": "first_order", "time_constant": "0.3 ms"}])
def test_without_a_sampled_current_loop_torque_and_energy_are_those_of_fine_samples(current: dict[str, str]):
    scenario = lm.load("position-axis", {"simulation.duration": 0.3, "simulation.sample_interval": 125e-6})
    scenario = scenario.replace(**{"controller.current": current, "motor": MOTOR})
    samples = slice(800, 2401)
    found = Electrical.of(scenario, run(scenario, energy=False), samples)
    fine = lm.simulate(scenario, energy=False, sample_interval=125e-6 / FINE)
    torque, speed = (fine[name].values[800 * FINE :] for name in ("motor_torque", "motor_speed"))
    if current["kind"] == "ideal":  # held over a tick
        torque = np.append(np.repeat(torque[FINE // 2 :: FINE], FINE), torque[-1])
    ends = torque[:-1], (torque[:-1] if current["kind"] == "ideal" else torque[1:])
    square = (ends[0] ** 2 + ends[0] * ends[1] + ends[1] ** 2) / 3.0
    assert found.torque_square == pytest.approx(square.reshape(-1, FINE).mean(axis=1), rel=1e-4, abs=1e-9)
    mean = 0.5 * (ends[0] + ends[1])
    back_emf = (MOTOR.armature_voltage_constant - 1.0) * 0.5 * (speed[:-1] + speed[1:]) / MOTOR.rated_speed
    volts = MOTOR.rated_voltage / MOTOR.armature_voltage_constant
    power = volts * (square / MOTOR.rated_torque + mean * back_emf) / MOTOR.limits.torque_constant
    # What the inductance stores, and the heat of the ripple within a tick.
    assert found.energy.sum() == pytest.approx(power.mean() * 0.2, rel=2e-3)


def test_under_field_oriented_control_they_are_those_of_the_winding():
    """Energy less heat less what the windings store is the work of the torque."""
    train = lm.load("field-weakening")
    base = lm.load("position-axis")
    motor = train.motors["m"].model_dump(exclude_none=True)
    scenario = lm.Scenario(**{**base.model_dump(exclude_none=True), "motor": {k: v for k, v in motor.items() if k != "shaft"}})
    scenario = scenario.replace(**{"controller.current": {"kind": "field_oriented"}, "controller.speed.torque_limit": 2.0,
                                   "simulation.duration": 0.3, "simulation.sample_interval": 125e-6})  # fmt: skip
    result = run(scenario, energy=False)
    found = Electrical.of(scenario, result, slice(0, 2401))
    phase, torque, speed = scenario.motor.winding.phase_values(), result["motor_torque"], result["motor_speed"]
    assert found.torque_square.mean() == pytest.approx(np.mean(torque[:-1] ** 2), rel=0.02)
    assert found.heating_square == pytest.approx(found.torque_square, rel=1e-2, abs=1e-4 * found.torque_square.max())
    heat = 1.5 * phase.resistance * found.current_rms**2 * 0.3
    stored = 0.75 * (phase.inductance_d * result["direct_current"][-1] ** 2 + phase.inductance_q * result["quadrature_current"][-1] ** 2)
    work = np.sum(0.5 * (torque[1:] * speed[1:] + torque[:-1] * speed[:-1])) * 125e-6
    assert found.energy.sum() == pytest.approx(heat + stored + work, rel=1e-3)


def test_the_run_takes_about_what_the_rules_require(task: Study, result: Any):
    """The same cycle, once of rigid parts on the reference, once in the loop."""
    fits = result.isel(pair=~np.isnan(result["cycles"].values))
    assert fits.sizes["pair"] > 0
    for k in range(fits.sizes["pair"]):
        row = fits.isel(pair=k)
        parameters = task.parameters(int(row["run"]), int(row["run"]) + 1)[0]
        motion = required_motion(repeated(task.scenario.controller.reference, CYCLE, 1), task.scenario.load, CYCLE)
        found = input_demand(motion, task.part("gearbox", parameters))
        rms = found.cycle(found.motor_torque(task.part("motor", parameters))).rms_motor_torque
        assert float(row["motor_torque_rms"]) == pytest.approx(rms, rel=0.1)
        assert float(row["required_torque_rms"]) == rms


def test_refused_pairs_say_why(result: Any):
    refused = result.isel(pair=np.isnan(result["cycles"].values))
    assert refused.sizes["pair"] > 0
    for k in range(refused.sizes["pair"]):
        assert not bool(refused["fits"][k])
        assert str(refused["violated"].values[k])
        assert float(refused["required_torque_peak"][k]) == float(refused["motor_torque_peak"][k])
        assert "exceeds" in str(refused["why"].values[k]) or "above" in str(refused["why"].values[k])


def test_a_record_that_lacks_data_is_refused_in_words():
    lacking = next(r.name for r in lm.catalogue() if isinstance(r, lm.data_sheets.GearboxSheet) and r.missing())
    vary = [{"key": "gearbox", "values": ["schaeffler-rt1-h-20-100", lacking]}, TABLES["vary"][1]]
    found = lm.select(task_of(changed(vary=vary)))
    rows = found.isel(pair=found["gearbox"].values == lacking)
    assert set(rows["violated"].values.tolist()) == {"data"}
    assert "lacks" in str(rows["why"].values[0])


def test_limits_of_the_task_are_kept(task: Study, result: Any):
    value = float(result["tracking_error_peak"].min())
    tight = task_of(changed(task=TABLES["task"] | {"max_tracking_error": 0.5 * value}))
    found = lm.select(tight)
    ran = found.isel(pair=~np.isnan(found["cycles"].values))
    assert not ran["fits"].any()
    assert all("tracking_error_peak" in text for text in ran["violated"].values)
    assert task.select is not None
    assert not task.select.limits


def test_ratios_of_one_s_own():
    gearbox = GEARBOX.model_dump() | {"stiffness": {"kind": "linear", "stiffness": 5e3}}
    tables = changed(gearbox=gearbox, vary=[{"key": "gearbox.ratio", "values": [30.0, 50.0]}, TABLES["vary"][1]])
    found = lm.select(task_of(tables))
    assert sorted(set(found["gearbox.ratio"].values.tolist())) == [30.0, 50.0]
    ran = found.isel(pair=~np.isnan(found["cycles"].values))
    for k in range(ran.sizes["pair"]):
        motor = lm.motor(str(ran["motor"].values[k]))
        i = float(ran["gearbox.ratio"][k])
        by_hand = (J / i**2 + INERTIA_1) / motor.rotor_inertia
        assert float(ran["inertia_ratio"][k]) == pytest.approx(by_hand, rel=1e-12)


def test_rows_are_kept_and_the_best_come_first(task: Study, result: Any, tmp_path: Path):
    seen: list[int] = []
    first = lm.select(task, tmp_path / "rows", progress=seen.append)
    again = lm.select(task, tmp_path / "rows")
    assert seen[-1] == task.total == result.sizes["pair"]
    for found in (first, again):
        assert found.identical(result)
    energy = result["energy"].values[result["fits"].values]
    assert list(energy) == sorted(energy)
    assert result["settling_time"].attrs["units"] == "s"
    assert set(COLUMNS) <= set(result.data_vars)


# --- what is refused ---
@pytest.mark.parametrize(("change", "says"), [
    ({"tsk": {}}, "key tsk"),
    ({"task": {}}, "cycle"),
    ({"task": {"cycle": "0.1 s"}}, "after the cycle of 0.1 s; lengthen task.cycle"),
    ({"task": {"cycle": "1 s", "max_settling_time": "1 s"}}, "settling_window"),
    ({"task": {"cycle": "1 s", "max_reversal_error": "1 s"}}, "max_reversal_error"),
    ({"load": 3}, r"key load: must be a table \[load\]"),
    ({"controller": {"reference": {"kind": "speed", "mean": 1.0}}}, "position"),
    ({"controller": TABLES["controller"] | {"speed": {"gain": 1.0}}}, "controller.speed.gain: follows from the rule"),
    ({"controller": {"reference": {"kind": "position", "amplitude": 1.0, "frequency": 1.3}}}, "1.3 periods in the cycle"),
    ({"load": {"inertia": J, "torque": {"steps": [{"height": 1.0}]}}}, r"load.torque.steps: acts once"),
    ({"vary": [{"key": "load.inertia", "values": [1.0]}]}, "of a task motor and gearbox vary|lacks|motor"),
    ({"vary": [{"key": "gearbox", "values": ["schaefler-rt1-h-20-100"]}]}, "did you mean schaeffler"),
    ({"select": {"objectives": {"beauty": "least"}}}, "'beauty' is no column of numbers"),
    ({"select": {"objectives": {"reversal_error": "least"}}, "controller": ONE_WAY}, "moves .* go one way"),
    ({"task": {"cycle": "1 s", "max_reversal_error": "1 deg"}, "controller": ONE_WAY}, "moves .* go one way"),
    ({"task": {"cycle": "1 s"}, "select": {"objectives": {"settling_time": "least"}}}, "needs task.settling_window"),
    ({"select": 3}, "key select"),
])  # fmt: skip
def test_bad_tasks_are_refused_in_one_line(change: dict[str, Any], says: str, tmp_path: Path):
    refused(lambda: task_of(changed(**change)), match=says)
    (tmp_path / "task.toml").write_text('[task]\ncycle = "1 m"\n[load]\n[controller]\n')
    refused(lambda: lm.studies.load_task(tmp_path / "task.toml"), match=r"task.toml: .*cycle")


# --- command ---
def test_the_command_writes_table_and_front(tmp_path: Path):
    text = (ROOT / "examples" / "select-axis.toml").read_text()
    head, _, tail = text.partition("[[vary]]")
    vary = '[[vary]]\nkey = "gearbox"\nvalues = ["bonfiglioli-tr060-2-100", "bonfiglioli-tr060-2-36"]\n'
    vary += '[[vary]]\nkey = "motor"\nvalues = ["maxon-ec-40-393023"]\n'
    (tmp_path / "task.toml").write_text(head + vary + tail[tail.index("[select]") :])
    done = lostmotion("select", "task.toml", "-o", "rows", cwd=tmp_path)
    assert done.returncode == 0
    assert "of 2 fit" in done.stdout
    assert lostmotion("study", "show", "rows", "-o", "page", cwd=tmp_path).returncode == 0
    assert {p.name for p in (tmp_path / "page").iterdir()} >= {"study.html", "selection.csv", "limits.csv"}
    assert {p.name for p in tmp_path.iterdir()} == {"task.toml", "rows", "page"}
    missing = lostmotion("select", "none.toml", cwd=tmp_path)
    assert missing.returncode == 1
    assert missing.stderr.startswith("lostmotion: none.toml: there is no such file")

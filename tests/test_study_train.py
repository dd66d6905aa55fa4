"""Studies of drive trains: rows equal to single runs, what varies and what cannot, the bias of two motors on one ring."""

import json
import math
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

import lostmotion as lm
from conftest import ROOT, rows_by_any_threads_and_executor
from lostmotion.cli import app
from lostmotion.studies.expressions.expressions import FUNCTIONS
from lostmotion.studies.expressions.functions import REDUCTIONS
from lostmotion.studies.runs import chunk as study_chunk
from lostmotion.studies.runs.chunk import pieces, run_piece, scenario_of_run
from lostmotion.studies.runs.read_table import read_table, unit_of
from lostmotion.studies.study.drive_check_columns import check_columns
from lostmotion.studies.study.select_table import SHARES, USE
from lostmotion.studies.study.study_files import from_json, to_json
from refusals import refused

BELT = lm.load("belt-before-gearbox").replace(**{"simulation.duration": 0.3, "simulation.sample_interval": 2e-3})
RING = lm.load("two-motors-one-ring").replace(**{"simulation.duration": 0.3, "simulation.sample_interval": 2e-3})
VARY = [
    {"key": "gears.belt.ratio", "uniform": [1.0, 3.0]},
    {"name": "inertia", "key": "shafts.joint.inertia", "relative": True, "normal": {"mean": 1.0, "deviation": 0.1}},
    {"name": "stiffness", "key": "gears.strain_wave.stiffness.slopes", "relative": True, "uniform": [0.8, 1.2]},
    {"key": "command.servo.amplitude", "log_uniform": [0.1, 1.0]},
    {"key": "initial.twists.belt", "uniform": ["-1 mrad", "1 mrad"]},  # which the base leaves out
]
KEEP = {
    "peak_speed": "peak(joint_speed)",
    "end": "final(servo_torque)",
    "lost": "energy.strain_wave_mesh / energy.servo_motor",
    "unbalanced": "energy.residual / energy.turned_over",
    "late": "largest(strain_wave_twist.where(time > 0.1))",
    "turned": "final(motor_angle)",  # follows through the gears
    "stuck": "mean(joint_contact == 0)",
    "starts": "dead_time(joint_angle)",
}


def make(**changes) -> lm.studies.Study:
    return lm.studies.Study(**({"scenario": BELT, "design": "sobol", "runs": 48, "seed": 5, "vary": VARY, "keep": KEEP} | changes))


def rows_of(study: lm.studies.Study, directory: Path, **how) -> dict[str, list]:
    return read_table(lm.study(study, directory, **how)).to_pydict()


def test_a_row_equals_the_single_run_bit_for_bit(tmp_path: Path):
    study = make(trajectories={"variables": ["joint_speed", "motor_angle"], "every": 10})
    rows = rows_of(study, tmp_path / "s")
    assert rows["run"] == list(range(48))
    assert rows["error"] == [""] * 48
    for run in (0, 19, 20, 47):  # in three pieces
        result = lm.simulate(scenario_of_run(study, run))
        energy = lm.energy_of(result)
        own = {
            "peak_speed": FUNCTIONS["peak"].of_values(result["joint_speed"]),
            "end": result["servo_torque"][-1],
            "lost": energy["strain_wave: mesh"] / energy["servo: motor"],
            "unbalanced": energy["residual"] / energy["turned_over"],
            "late": result["strain_wave_twist"].where(result["time"] > 0.1).max(),
            "turned": result["motor_angle"][-1],
            "stuck": float((result["joint_contact"] == 0).mean()),
            "starts": FUNCTIONS["dead_time"].of_values(result["joint_angle"]),
        }
        for name, value in own.items():
            assert rows[name][run] == float(value), (run, name)
        assert rows["joint_speed over time"][run] == result["joint_speed"].values[::10].tolist()
        assert rows["motor_angle over time"][run] == result["motor_angle"].values[::10].tolist()
        assert rows["switchings"][run] == result.attrs["switching_count"]
    assert len(set(rows["peak_speed"])) == 48
    assert max(abs(x) for x in rows["unbalanced"]) < 1e-9


def test_what_the_core_reduces_equals_what_is_made_of_the_samples(tmp_path: Path):
    variables = ("joint_speed", "servo_torque", "belt_twist", "strain_wave_output_torque", "joint_angle", "motor_speed")
    keep = {how: f"{how}({variable})" for how, variable in zip(REDUCTIONS, variables, strict=True)}
    reduced, sampled = (make(keep=keep | more) for more in ({}, {"more": "peak(abs(belt_twist))"}))
    assert not run_piece(reduced, 0, 4, 1).samples
    assert run_piece(sampled, 0, 4, 1).samples
    rows, same = (rows_of(s, tmp_path / name) for s, name in ((reduced, "r"), (sampled, "s")))
    assert {name: rows[name] for name in keep} == {name: same[name] for name in keep}


def test_rows_do_not_depend_on_threads_executors_or_pieces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    study = make(design="random", runs=500 + 30, keep={"a": "rms(joint_speed)", "b": "final(motor_angle)"})
    one = rows_by_any_threads_and_executor(study, tmp_path)
    monkeypatch.setattr(study_chunk, "SLOW_RUNS", 7)
    assert pieces(study, 500, 530) == [(500, 507), (507, 514), (514, 521), (521, 528), (528, 530)]
    with ThreadPoolExecutor(1) as pool:
        assert one.equals(pq.ParquetDataset(lm.study(study, tmp_path / "t", executor=pool)).read())


def test_interrupted_and_started_again_it_has_the_same_rows(tmp_path: Path):
    study = make(design="random", runs=600, keep={"a": "rms(joint_speed)"})
    done = []

    def stop(count: int) -> None:
        done.append(count)
        if count > 520:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        lm.study(study, tmp_path / "s", progress=stop)
    assert done == sorted(done)
    assert len(done) > 20  # within a chunk, too
    assert [p.name for p in (tmp_path / "s").glob("part-*")] == ["part-000000.parquet"]
    whole = lm.study(study, tmp_path / "whole")
    assert read_table(lm.study(study, tmp_path / "s")).equals(read_table(whole))


def test_a_study_of_a_train_is_text_and_back(tmp_path: Path):
    study = make()
    again = from_json(to_json(study))
    assert again.scenario == study.scenario
    assert to_json(again) == to_json(study)
    table = read_table(lm.study(study, tmp_path / "s"))
    units = {name: unit_of(table, name) for name in table.column_names}
    assert (units["gears.belt.ratio"], units["initial.twists.belt"], units["inertia"]) == ("1", "rad", "1")
    assert (units["peak_speed"], units["end"], units["lost"], units["late"]) == ("rad/s", "N*m", "1", "rad")
    vary = [{"key": "axis.slide.mass", "grid": [10.0, 20.0, 2]}]  # keys of an axis are those of its file
    axis = lm.studies.Study(scenario=lm.load("ball-screw-axis"), vary=vary, keep={"peak": "peak(slide_speed)"})
    again = from_json(to_json(axis))
    assert to_json(again) == to_json(axis)
    refused(lambda: again.scenario_at(np.array([-1.0])), "axis.slide.mass")


def test_entries_of_lists_and_coupled_keys_vary(tmp_path: Path):
    steps = {"command.first_motor": {"steps": [{"height": 0.1, "time": 0.1}, {"height": 0.2, "time": 0.2}]}}
    vary = [
        {"key": "command.first_motor.steps.1.height", "values": [0.2, 0.4]},
        {"keys": [f"gears.{n}_gear.stiffness.backlash" for n in ("first", "second")], "values": ["2 arcmin", 0]},
    ]
    study = lm.studies.Study(scenario=RING.replace(**steps), vary=vary, keep={"x": "final(ring_angle)"})
    rows = rows_of(study, tmp_path / "s")
    assert len(set(rows["x"])) == 4
    last = scenario_of_run(study, 3)
    assert last.command["first_motor"].steps[1].height == 0.4
    assert [g.stiffness.backlash for g in last.gears.values()] == [0.0, 0.0]
    assert rows["x"][3] == float(lm.simulate(last)["ring_angle"][-1])


# --- records ---
STUDY = """
base = "belt-before-gearbox"
set = {{ "simulation.duration" = 0.1 }}
{text}
[keep]
peak = "peak(strain_wave_twist)"
"""


def read(tmp_path: Path, text: str) -> lm.studies.Study:
    path = tmp_path / "s.toml"
    path.write_text(STUDY.format(text=text))
    return lm.studies.load_study(path)


def test_a_gearbox_and_a_motor_of_the_catalogue_vary_at_their_place(tmp_path: Path):
    gearboxes = ["schaeffler-rt1-h-20-100", "schaeffler-rt1-h-25-100"]
    motors = ["maxon-ec-i-52-606793", "maxon-ec-60-flat-614949"]
    study = read(
        tmp_path,
        f'[[vary]]\nkey = "gears.strain_wave.gearbox"\nvalues = {gearboxes}\n[[vary]]\nkey = "motors.servo.from"\n'
        f'values = {motors}\n[[vary]]\nkey = "gears.strain_wave.loss_factor"\nvalues = [1, 2]',
    )
    rows = rows_of(study, tmp_path / "rows")
    assert rows["error"] == [""] * 8
    for run in range(8):
        own = scenario_of_run(study, run)
        gearbox = lm.gearbox(rows["gears.strain_wave.gearbox"][run], loss_factor=rows["gears.strain_wave.loss_factor"][run])
        assert own.gears["strain_wave"].losses == gearbox.losses
        assert own.gears["strain_wave"].stiffness == gearbox.stiffness
        assert own.gears["strain_wave"].input == "wave_generator"
        assert own.motors["servo"].rated_torque == lm.motor(rows["motors.servo.from"][run]).rated_torque
        assert rows["peak"][run] == float(abs(lm.simulate(own)["strain_wave_twist"]).max())
    assert len(set(rows["peak"])) == 8


def test_a_record_takes_the_place_of_a_gear_that_is_written_out(tmp_path: Path):
    vary = [{"key": "gears.belt.gearbox", "values": ["schaeffler-rt1-h-20-100", "nord-sk1si50-60"]}]
    study = make(design="grid", runs=None, vary=vary, keep={"peak": "peak(belt_twist)"})
    rows = rows_of(study, tmp_path / "s")
    assert scenario_of_run(study, 0).gears["belt"].stiffness == lm.gearbox("schaeffler-rt1-h-20-100").stiffness
    assert rows["error"][0] == ""
    assert "nord-sk1si50-60" in rows["error"][1]
    assert math.isnan(rows["peak"][1])


def test_each_run_of_a_selection_goes_through_the_drive_check(tmp_path: Path):
    vary = [{"key": "shafts.joint.inertia", "values": [0.5, 5.0, -1.0]}]
    study = make(design="list", runs=None, vary=vary, keep={"x": "peak(joint_speed)"}, select={"objectives": {"x": "least"}})
    rows = rows_of(study, tmp_path / "s")
    for run in range(2):
        for name, value in check_columns(scenario_of_run(study, run)).items():
            assert rows[name][run] == value or (math.isnan(value) and math.isnan(rows[name][run])), name
    assert any(math.isfinite(rows[f"{USE}{rule}"][0]) for rule in SHARES)
    assert rows["violated"][2] == ""
    assert rows["error"][2] != ""


# --- what is refused, before anything runs ---
@pytest.mark.parametrize(("text", "sentence"), [
    ('key = "gears.bellt.ratio"\nvalues = [1]', "did you mean gears.belt.ratio?"),
    ('key = "shafts.joint.inertai"\nvalues = [1]', "did you mean shafts.joint.inertia?"),
    ('key = "gearbox.ratio"\nvalues = [1]', "varies gearbox.ratio, which the base scenario does not know"),
    ('key = "gears.belt.ratio"\nvalues = ["1 N"]', 'of gears.belt.ratio: "1 N"'),
    ('key = "shafts.joint.inertia"\nvalues = ["1 kg"]', "has the unit of something else"),
    ('key = "gears.belt"\nvalues = [1]', "which is a table; vary one of its keys: gears.belt."),
    ('key = "gears"\nvalues = [1]', "which is a table; vary one of its keys: gears.belt, gears.strain_wave"),
    ('key = "motors.servo.shaft"\nvalues = [1]', 'which is "motor" and no number'),
    ('key = "command.sevo"\nvalues = [1]', "did you mean"),
    ('key = "initial.twists.bell"\nvalues = [1]', "is no gear with a stiffness of this train"),
    ('key = "initial.speeds.joint"\nrelative = true\nvalues = [1]', "has no value there to multiply"),
    ('key = "gears.belt.loss_factor"\nvalues = [1]', "belongs beside `gearbox`, but the gears.belt of the base"),
    ('key = "gears.bellt.gearbox"\nvalues = ["schaeffler-rt1-h-20-100"]', "did you mean gears.belt"),
    ('key = "gears.belt.gearbox"\nvalues = ["schaeffler-rt1-h-20-101"]', "schaeffler-rt1-h-20-10"),
    ('key = "simulation.duration"\nvalues = [1]', "all runs must have the same samples"),
    ('key = "gears.belt.ratio"\nvalues = [1]\n[select]\nobjectives = { pea = "least" }', "is no column of numbers"),
    ('key = "gears.belt.ratio"\nvalues = [1]\n[trajectories]\nvariables = ["joint_sped"]', "trajectories: has the"),
])  # fmt: skip
def test_what_cannot_vary_ends_in_one_clear_line(tmp_path: Path, text: str, sentence: str):
    message = refused(lambda: read(tmp_path, f"[[vary]]\n{text}"))
    assert sentence in message
    assert str(tmp_path / "s.toml") in message


def test_what_a_train_does_not_have_cannot_be_kept():
    for expression, sentence in (
        ("peak(load_speed)", r"keep.x: .*'load_speed' in 'peak\(load_speed\)' is neither a result variable nor one of"),
        ("peak(joint_sped)", r"keep.x: .*did you mean joint_speed\?"),
        ("energy.gear_losses", "keep.x: .*energy.gear_losses is none of servo_motor, "),
    ):
        refused(lambda e=expression: make(keep={"x": e}), match=sentence)
    for name in ("two-motors-one-ring", "two-link-arm-frozen"):
        scenario = lm.load(name)
        vary = [{"key": f"motors.{next(iter(scenario.motors))}.rotor_inertia", "relative": True, "values": [1.0]}]
        of = {"scenario": scenario, "vary": vary, "design": "grid", "runs": None, "seed": 0}
        for expression in ("bandwidth()", "peak(ideal_speed)"):
            only = r"keep\.x: .* is of one commanded motor that turns the last shaft"
            refused(lambda of=of, e=expression: make(**of, keep={"x": e}), match=only)
    data = json.loads(BELT.to_json())
    for table in ("motors", "command"):
        data[table]["frequency"] = data[table].pop("servo")
    frequency = {"vary": [{"key": "command.frequency", "values": [1.0]}], "keep": {"x": "peak(frequency_torque)"}}
    short = r"varies command\.frequency, which is a key of the short form, too; rename"
    refused(lambda: lm.studies.Study(scenario=data, **frequency), match=short)


def test_a_train_of_one_motor_has_an_ideal_speed_and_a_bandwidth(tmp_path: Path):
    """Of a belt of 1.5 before a gear of 100: the unloaded motor turns 150 times as fast as the load."""
    vary = [{"key": "shafts.joint.inertia", "values": [1.0, 2.0]}]
    keep = {"ideal": "peak(ideal_speed)", "band": "bandwidth(0.2)"}
    study = make(vary=vary, keep=keep, design="grid", runs=None, seed=0)
    rows = rows_of(study, tmp_path / "s")
    for run in (0, 1):
        scenario = scenario_of_run(study, run)
        command = float(np.abs(lm.simulate(scenario)["servo_command"]).max())
        unloaded = scenario.train().motors["servo"].unloaded_speed
        assert rows["ideal"][run] == pytest.approx(command * unloaded / 150.0, rel=1e-12)
        assert rows["band"][run] == pytest.approx(lm.response.bandwidth(scenario, 0.2), rel=1e-9)


def test_a_run_that_cannot_be_is_a_row_that_says_why(tmp_path: Path):
    vary = [{"key": "shafts.joint.inertia", "values": [1.0, -1.0, 2.0]}]
    keep = {"x": "peak(joint_speed)", "e": "energy.servo_motor"}
    rows = rows_of(make(design="list", runs=None, vary=vary, keep=keep), tmp_path / "s")
    assert [e == "" for e in rows["error"]] == [True, False, True]
    assert "key shafts.joint.inertia: -1.0" in rows["error"][1]
    assert math.isnan(rows["x"][1])
    assert math.isnan(rows["e"][1])
    assert rows["e"][2] == lm.energy_of(lm.simulate(BELT.replace(**{"shafts.joint.inertia": 2.0})))["servo: motor"]
    # A variable that another record takes away: this one has no hysteresis.
    vary = [{"key": "gears.strain_wave.gearbox", "values": ["bonfiglioli-tq060-2-16"]}]
    rows = rows_of(make(design="grid", runs=None, vary=vary, keep={"x": "mean(strain_wave_twist_contact)"}), tmp_path / "t")
    assert rows["error"] == ["this train has no result variable strain_wave_twist_contact"]
    assert math.isnan(rows["x"][0])


def test_the_example_finds_the_bias_of_the_ring(tmp_path: Path):
    done = CliRunner().invoke(app, ["study", str(ROOT / "examples" / "ring-bias.toml"), "-o", str(tmp_path / "ring")])
    assert done.exit_code == 0, done.output
    rows = read_table(tmp_path / "ring").to_pydict()
    closed = [min(a, b) > math.pi / 5400.0 for a, b in zip(rows["first_twist"], rows["second_twist"], strict=True)]
    first = closed.index(True)
    assert 0 < first < 25
    assert all(closed[first:])  # what closes the play keeps it closed with more bias
    shown = CliRunner().invoke(app, ["study", "show", str(tmp_path / "ring")])
    assert f"{26 - first} of 26 fit" in shown.output


# --- two motors on one ring, against closed forms ---
#
# Both gears have the ratio i, the stiffness k beyond half a gap, and motors of inertia J_1 that give T +- T_B. Without friction the
# mesh torques at the ring are +- i T_B in equilibrium, and with the sum s of the twists
# s'' + w^2 s = 2 T/(J_1 i), w^2 = k (1/(J_1 i^2) + 2/J): half of k s is what each gear passes on.

LONG = lm.load("two-motors-one-ring")
GEAR = LONG.gears["first_gear"]
RATIO, STIFFNESS, HALF_GAP = GEAR.ratio, GEAR.stiffness.slopes[0], 0.5 * GEAR.stiffness.backlash
ROTOR, RING_INERTIA = LONG.motors["first_motor"].rotor_inertia, LONG.shafts["ring"].inertia
FREQUENCY = math.sqrt(STIFFNESS * (1.0 / (ROTOR * RATIO**2) + 2.0 / RING_INERTIA))  # [rad/s]
NAMES = ("first", "second")
PERIODS = 160  # of the vibration, that a slow rise of the torque takes


def ring(friction: float = 0.0, losses: tuple[float, float] = (1.0, 1.0), **changes) -> lm.Scenario:
    """The ring without wind and viscous friction."""
    mesh = {"kind": "mesh_efficiency", "drive_efficiency": losses[0], "backdrive_efficiency": losses[1]}
    bare = {"shafts.ring.viscous_friction": 0.0, "shafts.ring.torque": 0.0}
    for name in NAMES:
        bare |= {f"motors.{name}_motor.friction_torque": friction, f"gears.{name}_gear.losses": mesh}
    return LONG.replace(**(bare | changes))


def loaded_twists(first: float, second: float) -> dict[str, float]:
    """[rad] of the gears with these torques at the ring [N·m]."""
    return {"first_gear": HALF_GAP + first / STIFFNESS, "second_gear": -HALF_GAP + second / STIFFNESS}


@pytest.mark.parametrize(("bias", "step"), [(0.1, 0.2), (0.15, 0.2), (0.05, 0.3)])
def test_too_small_a_bias_opens_the_gap_at_the_instant_of_the_closed_form(bias: float, step: float):
    # After a step T: s = 2 T/(J_1 i w^2) (1 - cos w t), and J alpha/2 = k T/(J_1 i w^2).
    begin = 0.01
    signals = {
        f"command.{name}_motor": {"mean": sign * bias, "steps": [{"height": step, "time": begin}]}
        for name, sign in zip(NAMES, (1.0, -1.0), strict=True)
    }
    start = {"initial.twists": loaded_twists(RATIO * bias, -RATIO * bias)}
    result = lm.simulate(ring(**signals, **start, **{"simulation.duration": 0.05, "simulation.sample_interval": 1e-4}))
    mean_acceleration = 2.0 * RATIO * step / (RING_INERTIA + 2.0 * ROTOR * RATIO**2)
    opens = begin + math.acos(1.0 - 2.0 * RATIO * bias / (RING_INERTIA * mean_acceleration)) / FREQUENCY
    switchings = lm.switchings_of(result)
    assert switchings["instant"].values[0] == begin
    assert switchings["instant"].values[1] == pytest.approx(opens, rel=1e-12)
    after = result["time"].values > opens + 1e-4
    before = result["time"].values < opens - 1e-4
    assert np.all(result["second_gear_output_torque"].values[before] < 0.0)
    assert result["second_gear_output_torque"].values[after][0] == 0.0


def smallest_bias(tmp_path: Path, torque: float, losses: tuple[float, float], way: float) -> tuple[float, float, float]:
    """(smallest bias that a study finds, its step, acceleration then) for a ring that turns and is then accelerated, or with
    way = -1 braked, by a slowly rising torque of each motor, `torque` without the friction of the rotor [N·m]."""
    friction, (forward, backward) = 0.01, losses
    biases = np.linspace(0.7, 0.9, 31) * torque
    # At constant speed: forward (T_B + T) = (T_B - T)/backward.
    balance = biases * (1.0 - forward * backward) / (1.0 + forward * backward)
    mesh = RATIO * forward * (biases + balance)
    rise, ramp = way * torque - balance, PERIODS * 2.0 * math.pi / FREQUENCY
    steady = {
        "initial.speeds": {"first": 100.0 * RATIO, "second": 100.0 * RATIO, "ring": 100.0},
        "initial.twists": loaded_twists(0.0, 0.0),
        "simulation.duration": 0.1 + 1.1 * ramp,
        "simulation.sample_interval": 4e-3,
    }
    signal = {"ramps": [{"rise": 0.1, "duration": ramp, "begin": 0.1}]}
    study = lm.studies.Study(
        scenario=ring(friction, losses, **steady, **{f"command.{name}_motor": signal for name in NAMES}),
        design="list",
        vary=[
            {"name": "bias", "key": "command.first_motor.mean", "values": (balance + friction + biases).tolist()},
            {"key": "command.second_motor.mean", "values": (balance + friction - biases).tolist()},
            {"keys": [f"command.{name}_motor.ramps.0.rise" for name in NAMES], "values": rise.tolist()},
            {"key": "initial.twists.first_gear", "values": (HALF_GAP + mesh / STIFFNESS).tolist()},
            {"key": "initial.twists.second_gear", "values": (-HALF_GAP - mesh / STIFFNESS).tolist()},
        ],
        keep={
            "first": "least(first_gear_twist)",
            "second": "largest(second_gear_twist)",
            "acceleration": "ring_speed.differentiate().isel(time=-20)",
        },
    )
    rows = rows_of(study, tmp_path / "s")
    assert rows["error"] == [""] * 31
    closed = [a > HALF_GAP and b < -HALF_GAP for a, b in zip(rows["first"], rows["second"], strict=True)]
    found = closed.index(True)
    assert 0 < found < 30
    assert all(closed[found:])
    return biases[found], biases[1] - biases[0], rows["acceleration"][found]


@pytest.mark.parametrize("way", [1.0, -1.0], ids=["accelerated", "braked"])
@pytest.mark.parametrize("losses", [(1.0, 1.0), (0.94, 0.93), (0.8, 0.7)], ids=str)
@pytest.mark.parametrize("torque", [0.1, 0.3])
def test_the_bias_that_a_study_finds_is_that_of_the_closed_form(tmp_path: Path, torque: float, losses: tuple[float, float], way: float):
    # One flank parts where the other gear carries all of J alpha: i T_B = J alpha/(2 eta_f) accelerated, eta_b J |alpha|/2 braked,
    # where both rotors still have the same speed.
    efficiency = losses[0] if way > 0.0 else 1.0 / losses[1]
    bias, step, acceleration = smallest_bias(tmp_path, torque, losses, way)
    needed = torque / (1.0 + 2.0 * efficiency * ROTOR * RATIO**2 / RING_INERTIA)
    vibration = 2.0 * needed / (math.pi * PERIODS)  # of two kinds, each at most 1/(pi n) after a ramp over n periods
    assert needed * (1.0 - 1e-6) < bias < needed + vibration + step
    by_acceleration = RING_INERTIA * abs(acceleration) / (2.0 * efficiency * RATIO)
    assert bias == pytest.approx(by_acceleration, abs=vibration + 2.0 * step)

"""Drives in MuJoCo: against closed systems of equations, the exact core and standing still."""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import lostmotion as lm
from conftest import ROOT
from refusals import refusals_of, refused

mujoco = pytest.importorskip("mujoco", reason='pip install "lostmotion[mujoco]"')

from robot_arm import ARM, HINGE, RATIO, ROTOR, arm_model, drive, energy, force_on_wall, inertia_and_bias, motor_torques, reference, robot  # noqa: E402  (it needs MuJoCo)


# --- accuracy ---
@pytest.mark.parametrize("gap", [0.0, 1e-3])
@pytest.mark.parametrize("step", [5e-3, 20e-3])
def test_a_joint_of_constant_inertia_moves_as_the_drive_alone(step: float, gap: float) -> None:
    given = drive(gap=gap, friction=0.01, bearing=0.3)
    arm = lm.mujoco.attach(mujoco.MjModel.from_xml_string(HINGE.format(step=step)), {"hinge": given}, substeps=1)
    alone = lm.Simulation(arm.drives["hinge"], step=step)
    for k in range(round(0.4 / step)):
        command = 0.2 * math.sin(9.0 * k * step)
        arm.step([command])
        alone.advance(step, command=command)
    assert abs(alone["load_angle"]) > 1.0
    assert arm.data.qpos[0] == pytest.approx(alone["load_angle"], abs=1e-12)
    assert arm["motor_speed"][0] == pytest.approx(alone["motor_speed"], rel=1e-10)
    assert arm.counts["unsettled"] == 0


def test_the_order_is_two() -> None:
    errors = []
    for step in (4e-3, 2e-3, 1e-3):
        arm = robot(step, drive(), substeps=16)
        for k in range(round(0.5 / step)):
            arm.step(motor_torques((k + 0.5) * step))
        errors.append(np.abs(arm.data.qpos - reference(step, 0.5, 2e4)).max())
    assert errors[0] < 5e-5
    assert errors[1] < 5e-6
    # 4 by the order; it is more where the terms of the next orders still count.
    assert errors[0] / errors[2] > 0.8 * 4.0**2


def test_substeps_are_chosen_so_that_the_error_of_the_arm_is_small() -> None:
    arm = robot(2e-3, drive())
    assert arm.substeps == 4
    for k in range(250):
        arm.step(motor_torques((k + 0.5) * 2e-3))
    assert np.abs(arm.data.qpos - reference(2e-3, 0.5, 2e4)).max() < 5e-6


def test_a_gap_opens_and_closes_as_in_the_equations() -> None:
    step, end = 1e-3, 0.1
    arm = robot(step, drive(gap=1e-3))
    for k in range(round(end / step)):
        arm.step(motor_torques((k + 0.5) * step))
    assert np.abs(arm.data.qpos - reference(step, end, 2e4, gap=1e-3)).max() < 1e-4


@pytest.mark.parametrize(("stiffness", "step"), [(1e5, 1e-3), (1e6, 5e-3)])
def test_energy_stays_without_damping(stiffness: float, step: float) -> None:
    arm = robot(step, drive(stiffness, 1e-3))
    first = energy(arm, stiffness, 1e-3)
    worst = 0.0
    for _ in range(round(0.5 / step)):
        arm.step()
        worst = max(worst, abs(energy(arm, stiffness, 1e-3) - first))
    assert worst < 1e-2  # of 20 J that the fall turns


# --- rest and contact ---
@pytest.mark.parametrize("given", [drive(friction=0.3, bearing=0.5), drive(friction=0.3, hysteresis=0.9)])
def test_an_arm_that_friction_holds_does_not_creep(given: lm.Drive) -> None:
    arm = robot(2e-3, given)
    arm.data.qpos[:] = 0.3, 0.4
    arm.follow(held=True)
    for _ in range(2000):
        arm.step()
    assert arm.data.qpos.tolist() == [0.3, 0.4]
    assert arm.data.qvel.tolist() == [0.0, 0.0]


@pytest.mark.parametrize(("stiffness", "gap"), [(2e4, 0.0), (1e5, 1e-3)])
def test_a_tip_presses_against_a_wall_as_with_short_steps(stiffness: float, gap: float) -> None:
    exact = force_on_wall(2e-4, stiffness, gap)
    assert exact.min() > 20.0
    assert force_on_wall(5e-3, stiffness, gap) == pytest.approx(exact, rel=0.01)


# --- states and wrong use ---
def test_states_and_snapshots_bring_robot_and_drives_back() -> None:
    arm = robot(2e-3, drive(gap=1e-3, friction=0.01))
    for _ in range(20):
        arm.step([0.2, 0.1])
    kept, copied = arm.state, arm.snapshot()
    runs = []
    for again in (None, kept, copied, kept):
        if again is copied:
            arm.restore(copied)
        elif again is not None:
            arm.state = kept
        for _ in range(30):
            arm.step([-0.1, 0.2])
        runs.append([*arm.data.qpos, *arm["motor_speed"], *arm["twist"]])
    assert runs[1:] == runs[:1] * 3
    other = robot(2e-3, drive())
    for wrong in (kept, other.snapshot()):
        with pytest.raises(lm.InputError, match="is none of this robot; between robots, use state"):
            arm.restore(wrong)
    arm.reset()
    assert arm.data.time == 0.0
    assert arm["motor_speed"].tolist() == [0.0, 0.0]


def test_after_reset_and_restore_the_bits_are_the_same() -> None:
    arm = robot(2e-3, drive(friction=0.02))

    def go() -> list[list[float]]:
        out = []
        for k in range(200):
            arm.step([0.2 * math.sin(0.05 * k), -0.05 * math.cos(0.03 * k)])
            out.append([*arm.data.qpos, *arm.data.qvel, *arm["twist"]])
        return out

    fresh = go()
    arm.reset()
    assert go() == fresh
    arm.reset()
    for _ in range(2):
        arm.step([0.1, 0.1])
    begin, state = arm.snapshot(), arm.state
    first = go()
    arm.restore(begin)
    assert go() == first
    arm.state = state
    assert go() == first


def test_torque_losses_and_states_are_read_by_name() -> None:
    arm = robot(2e-3, drive(friction=0.01))
    arm.step({"elbow": 0.5})
    assert arm.joints == ("shoulder", "elbow")
    assert arm["motor_torque"].tolist() == [0.0, 0.5]
    assert arm["load_angle"].tolist() == arm.data.qpos.tolist()
    assert arm.torque[1] > arm.torque[0]
    assert np.abs(arm.gear_loss).max() < 1e-9  # efficiency 1
    assert arm.simulation("elbow")["motor_speed"] > 0.0


def test_a_controller_moves_a_joint_to_its_reference() -> None:
    axis = lm.load("position-axis")
    arm = lm.mujoco.attach(mujoco.MjModel.from_xml_string(HINGE.format(step=1e-3)), {"hinge": axis.drive()}, {"hinge": axis.controller})
    for _ in range(1500):
        arm.step([0.05])
    assert arm.data.qpos[0] == pytest.approx(0.05, abs=2e-3)


def test_joints_without_a_drive_follow_the_inertia_matrix() -> None:
    step, end = 1e-3, 0.3
    arm = lm.mujoco.attach(arm_model(step), {"shoulder": drive(1e9)}, substeps=1)
    for _ in range(round(end / step)):
        arm.step()
    rotor = ROTOR * RATIO**2

    def rates(_t: float, y: np.ndarray) -> np.ndarray:
        mass, bias = inertia_and_bias(y[:2], y[2:])
        mass[0, 0] += rotor
        return np.concatenate([y[2:], np.linalg.solve(mass, -bias)])

    exact = solve_ivp(rates, (0.0, end), np.zeros(4), method="DOP853", rtol=1e-10, atol=1e-12).y[:2, -1]
    assert np.abs(arm.data.qpos - exact).max() < 1e-5


FLOATING = """
<mujoco><option timestep="{step}" gravity="0 0 0"/><worldbody><body name="base"><freejoint/>
  <inertial pos="0 0 0" mass="4" diaginertia="0.05 0.06 0.07"/>
  <body pos="0.2 0 0"><joint name="elbow" type="hinge" axis="0 -1 0.3"/>
    <inertial pos="0.3 0.1 0.05" mass="2" diaginertia="0.01 0.03 0.03"/></body>
</body></worldbody></mujoco>"""


def test_a_drive_turns_a_floating_body_without_momentum() -> None:
    def momentum(step: float) -> float:
        model = mujoco.MjModel.from_xml_string(FLOATING.format(step=step))
        arm = lm.mujoco.attach(model, {"elbow": drive(2e4)}, substeps=8)
        for k in range(round(0.3 / step)):
            arm.step([0.1 * np.sin(20.0 * (k + 0.5) * step)])
        mujoco.mj_forward(arm.model, arm.data)
        mujoco.mj_subtreeVel(arm.model, arm.data)
        assert abs(arm.data.qvel[6]) > 0.5
        assert abs(np.linalg.norm(arm.data.qpos[3:7]) - 1.0) < 1e-12
        return float(np.abs([6.0 * arm.data.subtree_linvel[1], arm.data.subtree_angmom[1]]).max())

    coarse, fine = momentum(2e-3), momentum(1e-3)
    assert coarse < 1e-4
    assert fine < coarse / 3.0  # of second order


test_wrong_use_is_one_line = refusals_of(
    lambda drives, options: lm.mujoco.attach(arm_model(1e-3), drives, **options),
    ({"elbo": drive()}, {}, ': joint "elbo": is not in the model; did you mean elbow'),
    ({"elbow": "no-such-gearbox"}, {}, ": neither a scenario nor a gearbox or an actuator of the catalogue"),
    ({"elbow": 5}, {}, ": is no drive"),
    ({}, {}, ": name at least one joint"),
    ({"elbow": drive()}, {"substeps": 0}, ": must lie between 1 and 1000"),
    ({"elbow": drive(1e12)}, {}, ": at most 1000 are made: shorten option.timestep"),
    ({"elbow": drive()}, {"controllers": {"shoulder": None}}, ": has no drive; name it in drives"),
)


def test_what_would_count_twice_is_refused_or_replaced() -> None:
    text = ARM.format(step=1e-3, world="", tip="").replace(
        "</worldbody>", '</worldbody><actuator><motor name="servo" joint="elbow"/></actuator>'
    )
    text = text.replace('name="elbow" type="hinge"', 'name="elbow" type="hinge" armature="0.1"')
    spec = mujoco.MjSpec.from_string(text)
    assert "has armature and the actuator 'servo', which would count twice" in refused(lambda: lm.mujoco.attach(spec, {"elbow": drive()}))
    arm = lm.mujoco.attach(spec, {"elbow": drive()}, replace=True)
    arm.data.ctrl[:] = 100.0
    arm.step()
    plain = lm.mujoco.attach(arm_model(1e-3), {"elbow": drive()})
    plain.step()
    assert arm.data.qpos.tolist() == plain.data.qpos.tolist()


def test_data_that_was_changed_is_noticed() -> None:
    arm = robot(1e-3, drive())
    arm.data.qpos[1] = 0.3
    refused(arm.step, reason="joint 'elbow': data has it at 0.3 rad, ")
    arm.follow()
    arm.step()
    assert "must be 2 finite numbers, for shoulder, elbow" in refused(lambda: arm.step([1.0]))
    assert 'joint "wrist" has no drive' in refused(lambda: arm.step({"wrist": 1.0}))
    for wrong in ({"elbow": math.nan}, "ab", 5, [None, 1.0]):
        with pytest.raises(lm.InputError, match="must be 2 finite numbers"):
            arm.step(wrong)


def test_a_gearbox_and_an_actuator_of_the_catalogue_are_attached_by_their_names() -> None:
    arm = lm.mujoco.attach(arm_model(1e-3), {"elbow": "schaeffler-rt1-h-20-100"})
    arm.step({"elbow": 0.2})
    assert arm["motor_torque"].tolist() == [0.2]
    drive = lm.mujoco.attach(arm_model(1e-3), {"elbow": "t-motor-ak80-6"}).drives["elbow"]
    assert (drive.motor, drive.gearbox) == lm.actuator("t-motor-ak80-6")
    assert lm.actuator("t-motor-ak80-6", rotor_inertia=1e-4)[0].rotor_inertia == 1e-4
    refused(
        lambda: lm.mujoco.attach(arm_model(1e-3), {"elbow": "unitree-n5020-16-g1-arm"}),
        match=r"actuator from .*: the record lacks rotor_inertia",
    )


# --- reduced models ---
def rigid(viscous: float, friction: float, efficiency: float = 1.0) -> lm.Drive:
    return lm.Drive(
        motor=lm.Motor(kind="torque_source", rotor_inertia=ROTOR),
        gearbox=lm.Gearbox(
            ratio=RATIO,
            rated_input_speed="3000 rpm",
            rated_output_torque=100.0,
            stiffness=lm.model.Rigid(),
            losses=lm.model.ConstantEfficiency(efficiency=efficiency),
        ),
        load=lm.Load(inertia=0.5, viscous_friction=viscous, friction_torque=friction),
    )


@pytest.mark.parametrize("load_torque", [0.0, 8.0])
def test_a_drive_without_what_a_reduction_lacks_is_described_whole(load_torque: float) -> None:
    found = lm.mujoco.reduce(rigid(0.7, 1.5), 0.5, 1.0, load_torque)
    # Speeds at the middle of a step of 1/2000 of a period stand for those within it.
    assert found.gear == pytest.approx(RATIO, rel=1e-3)
    assert found.armature == pytest.approx(ROTOR * RATIO**2, rel=1e-2)
    assert found.damping == pytest.approx(0.7, rel=1e-2)
    assert found.frictionloss == pytest.approx(1.5, rel=1e-2)
    assert found.error < 1e-2
    assert f'armature="{found.armature:.6g}"' in found.mjcf("elbow")
    assert f'friction="{found.frictionloss:.6g}"' in found.urdf("elbow")


def test_a_train_of_two_stages_is_described_by_what_all_its_parts_are_at_the_joint() -> None:
    """Armature: 400 times the rotor and 100 times the middle shaft; damping and friction of that shaft 100 and 10 times."""
    lossless = {"kind": "constant_efficiency", "efficiency": 1.0}
    train = lm.Scenario(
        shafts={"rotor": {}, "middle": {"inertia": 1e-3, "viscous_friction": 4e-3, "friction_torque": 0.05}, "arm": {"inertia": 0.5}},
        motors={"m": {"shaft": "rotor", "kind": "torque_source", "rated_torque": 1.0, "rotor_inertia": 2e-4}},
        gears={
            "first": {"input": "rotor", "output": "middle", "ratio": -2.0, "losses": lossless},
            "second": {"input": "middle", "output": "arm", "ratio": 10.0, "losses": lossless},
        },
        command={"m": 0.0},
        simulation={"duration": 0.1, "sample_interval": 0.01},
    )
    found = lm.mujoco.reduce(train, 0.5, 1.0)
    assert found.gear == pytest.approx(-20.0, rel=1e-3)
    assert found.armature == pytest.approx(400.0 * 2e-4 + 100.0 * 1e-3, rel=1e-2)
    assert found.damping == pytest.approx(100.0 * 4e-3, rel=1e-2)
    assert found.frictionloss == pytest.approx(10.0 * 0.05, rel=1e-2)


def test_a_screw_axis_is_described_by_mass_and_forces_at_its_slide() -> None:
    """Ratio 2 pi/lead; armature: its square times the rotor; friction: that of the motor times the ratio, and that of the guide."""
    ratio = 2.0 * np.pi / 0.01
    screw = {"s": {"input": "motor", "output": "table", "lead": 0.01}}
    found = lm.mujoco.reduce(lm.Scenario(**SCREW | {"screws": screw}), "100 mm", 1.0)
    assert found.gear == pytest.approx(ratio, rel=1e-3)
    assert found.armature == pytest.approx(2e-4 * ratio**2, rel=1e-2)
    assert found.frictionloss == pytest.approx(0.05 * ratio + 20.0, rel=1e-2)
    assert '<joint name="table" type="slide" armature' in found.mjcf("table")
    assert 'type="prismatic"' in found.urdf("table")
    refused(lambda: lm.mujoco.reduce(lm.Scenario(**SCREW), "10 deg", 1.0), reason="amplitude")


def test_what_a_reduction_costs_is_stated_and_no_load_torque_of_a_scenario_is_dropped_from_it() -> None:
    joint = lm.load("catalogue-robot-joint")
    found = lm.mujoco.reduce(joint, 0.5, 1.0, 10.0)
    assert found.gear < 100.0  # the losses that depend on the load
    assert 1e-3 < found.error < 0.2
    loaded = joint.replace(**{"load.torque": 10.0})
    refused(lambda: lm.mujoco.reduce(loaded, 0.5, 1.0), "load.torque")
    assert lm.mujoco.reduce(loaded, 0.5, 1.0, load_torque=0.0) == lm.mujoco.reduce(joint, 0.5, 1.0)
    # The motion ends near where it begins, so that the end alone does not show that the joint stood still.
    locked = joint.replace(**{"load.friction_torque": 1e5})
    refused(lambda: lm.mujoco.reduce(locked, 0.5, 1.0), reason="does not follow the motion")
    for ratio, words in ({}, "has no actuator that says the gear; give"), ({"ratio": 100.0}, "has no armature"):
        refused(lambda given=ratio: lm.mujoco.from_mjcf(arm_model(1e-3), "elbow", **given), match=f"joint 'elbow': {words}")


TURNING = (
    2.0 * 4.6 / 2000.0
)  # twice the share of the steps in which the friction turns: it acts there for a part of the step, with both signs


def test_a_motor_on_its_joint_is_reduced_to_its_own_numbers() -> None:
    """`lostmotion identify` writes an axis of one shaft like this: the rotor has all inertia, and the joint carries nothing else."""
    motor = {"kind": "torque_source", "shaft": "table", "rotor_inertia": 0.02, "rated_torque": 1.0}
    axis = lm.Scenario(
        shafts={"table": {"friction_torque": 0.1, "viscous_friction": 0.05}},
        motors={"drive": motor},
        simulation={"duration": 1.0, "sample_interval": 1e-3},
    )
    found = lm.mujoco.reduce(axis, amplitude=0.5, frequency=1.0)
    assert (found.armature, found.damping, found.frictionloss, found.gear) == pytest.approx((0.02, 0.05, 0.1, 1.0), rel=TURNING)
    assert found.error < TURNING**0.5


def test_the_drive_of_an_mjcf_joint_moves_as_that_joint() -> None:
    text = HINGE.replace('axis="0 0 1"', 'axis="0 1 0" armature="0.1" damping="0.3"').replace("0 0 0", "0 0 -9.81")
    text = text.replace("</worldbody>", '</worldbody><actuator><motor joint="hinge" gear="100"/></actuator>')
    fine = mujoco.MjModel.from_xml_string(text.format(step=1e-4))
    fine.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    data = mujoco.MjData(fine)
    for _ in range(5000):
        data.ctrl[0] = 0.01
        mujoco.mj_step(fine, data)
    coarse = mujoco.MjModel.from_xml_string(text.format(step=1e-3))
    arm = lm.mujoco.attach(coarse, {"hinge": lm.mujoco.from_mjcf(coarse, "hinge")}, replace=True)
    for _ in range(500):
        arm.step([0.01])
    assert abs(data.qpos[0]) > 0.1
    assert arm.data.qpos[0] == pytest.approx(data.qpos[0], abs=1e-5)


SCREW = {
    "motors": {"m": {"shaft": "motor", "kind": "torque_source", "rotor_inertia": 2e-4, "friction_torque": 0.05}},
    "shafts": {"motor": {}},
    "screws": {"s": {"input": "motor", "output": "table", "lead": 0.01, "stiffness": 8e7, "efficiency": 0.9}},
    "slides": {"table": {"mass": 30.0, "friction_force": 20.0}},
    "command": {"m": {}},
    "simulation": {"duration": 1.0, "sample_interval": 1e-3},
}


def test_a_slide_moves_as_its_axis_under_the_weight_of_the_robot() -> None:
    joint = '<joint name="table" type="slide" axis="0 0 1"/><geom size=".1" mass="80"/>'
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="0.001" gravity="0 0 -9.81"/><worldbody><body>{joint}</body></worldbody></mujoco>'
    )
    robot = lm.mujoco.attach(model, {"table": lm.Scenario(**SCREW)})
    alone = lm.Simulation(lm.Scenario(**SCREW | {"slides": {"table": {"mass": 80.0, "friction_force": 20.0, "force": {}}}}), step=1e-3)
    for k in range(300):
        command = 2.0 + 0.5 * np.sin(0.03 * k)
        robot.step({"table": command})
        alone.advance(1e-3, m_command=command, table_load_force=80.0 * 9.81)
    assert abs(alone["table_position"]) > 0.05
    assert robot.data.qpos[0] == pytest.approx(alone["table_position"], abs=1e-10)
    inclined = lm.Scenario(**SCREW).replace(**{"slides.table.inclination": 0.5 * np.pi})
    with pytest.raises(lm.InputError) as refusal:
        lm.mujoco.attach(model, {"table": inclined})
    assert "slides.table.inclination" in refusal.value.problems[0].keys
    assert lm.mujoco.attach(model, {"table": inclined}, replace=True).drives["table"].slides["table"].inclination == 0.0


def test_the_thousand_robots_of_the_page_move_as_robots_of_their_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    code = next(c for c in re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "robots.md").read_text(), re.S) if "ROBOTS" in c)
    (tmp_path / "arm.xml").write_text(ARM.format(step=1e-3, world="", tip=""))
    monkeypatch.chdir(tmp_path)
    page: dict[str, Any] = {"__name__": "page"}
    exec(code, page)
    page["STEPS"] = 30
    found = page["angles"](np.arange(3))
    for k, angles in enumerate(found):
        random, arm = np.random.default_rng(k), lm.mujoco.attach("arm.xml", page["DRIVES"])
        for _ in range(30):
            arm.step(dict(zip(page["DRIVES"], random.uniform(-0.2, 0.2, 2), strict=True)))
        assert angles.tolist() == arm.data.qpos.tolist()

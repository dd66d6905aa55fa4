"""Drives in MuJoCo on a floating base: contacts of the feet, standing, tendons, equalities, restored states."""

import math
import sys
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from refusals import refused
from test_examples import example

mujoco = pytest.importorskip("mujoco", reason='pip install "lostmotion[mujoco]"')

from robot_arm import ARM, HINGE, RATIO, ROTOR, drive  # noqa: E402  (it needs MuJoCo)


@pytest.fixture(scope="module")
def legged() -> Any:
    return example("mujoco_quadruped")


def stepped(robot: Any, steps: int, torque: float = 0.0) -> np.ndarray:
    """Positions and speeds after steps in which the knees alone are driven."""
    for _ in range(steps):
        robot.step({f"{leg}_knee": torque for leg in ("FL", "FR", "RL", "RR")})
    return np.concatenate([robot.data.qpos, robot.data.qvel])


@pytest.mark.parametrize("kind", ["quasi-direct", "strain wave"])
def test_a_standing_robot_does_not_creep(legged: Any, kind: str) -> None:
    joints, trunk = legged.rest(kind, 0.4)
    assert joints == 0.0
    assert trunk < 1e-4  # contacts of MuJoCo are soft; they settle


def test_a_landing_hardly_depends_on_the_timestep(legged: Any) -> None:
    heights = []
    for step in (4e-3, 2.5e-4):
        model = mujoco.MjModel.from_xml_string(legged.mjcf())
        model.opt.timestep = step
        robot = lm.mujoco.attach(model, dict.fromkeys(legged.JOINTS, legged.drive("quasi-direct", brake=1.5)))
        robot.data.qpos[7:] = legged.pose("squat", 0.0)
        robot.data.qpos[2] += 0.02
        robot.follow()
        for _ in range(round(0.1 / step)):
            robot.step()
        heights.append(robot.data.qpos[2])
    assert heights[0] < legged.HEIGHT + legged.FOOT
    # By the speed of 0.6 m/s at the landing, the two see the ground at instants that differ by less than 0.25 ms.
    assert heights[0] == pytest.approx(heights[1], abs=0.6 * 2.5e-4)


def test_mirrored_legs_move_alike(legged: Any) -> None:
    run = legged.move("strain wave", "squat", 0.3)
    left, right = run.poses[:, 7:10], run.poses[:, 10:13]
    assert run.forces[-1].sum() == pytest.approx(8.912 * 9.81, rel=0.2)
    assert np.abs(run.poses[:, 1]).max() < 1e-9
    assert np.abs(left[:, 1:] - right[:, 1:]).max() < 1e-9


def test_drives_trot_as_ideal_joints_do_and_lose_more(legged: Any) -> None:
    ideal, geared = (legged.move(kind, "trot", 0.3) for kind in ("ideal", "quasi-direct"))
    assert ideal.loss.max() == 0.0
    assert geared.loss.min() > -1e-9
    assert geared.power.sum() > ideal.power.sum()
    assert np.abs(geared.poses[-1] - ideal.poses[-1]).max() < 0.05
    assert geared.errors.std() < 0.02


@pytest.mark.parametrize("change", ["PGS", "noslip"])
def test_each_solver_of_contacts_stands_alike(legged: Any, change: str) -> None:
    heights = []
    for wanted in (False, True):
        model = mujoco.MjModel.from_xml_string(legged.mjcf())
        if wanted and change == "PGS":
            model.opt.solver, model.opt.iterations = mujoco.mjtSolver.mjSOL_PGS, 300
        elif wanted:
            model.opt.noslip_iterations = 5
        robot = lm.mujoco.attach(model, dict.fromkeys(legged.JOINTS, legged.drive("quasi-direct", brake=1.5)))
        robot.data.qpos[7:] = legged.pose("squat", 0.0)
        robot.follow(held=True)
        stepped(robot, 60)
        heights.append(robot.data.qpos[2])
    assert heights[1] == pytest.approx(heights[0], abs=1e-4)  # the penetration is 0.2 mm


def test_states_return_to_the_same_bits_in_contact(legged: Any) -> None:
    robot = legged.robot("quasi-direct")
    stepped(robot, 20, -0.1)
    kept, copied = robot.state, robot.snapshot()
    first = stepped(robot, 20, -0.3)
    robot.restore(copied)
    assert np.array_equal(stepped(robot, 20, -0.3), first)
    other = legged.robot("quasi-direct")
    other.state = kept
    assert np.array_equal(stepped(other, 20, -0.3), first)


def test_a_step_that_fails_leaves_robot_and_drives_where_they_were(legged: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = legged.robot("quasi-direct")
    stepped(robot, 5)
    before, twist = np.concatenate([robot.data.qpos, robot.data.qvel]), robot["twist"]
    advance, calls = type(robot._trains).advance, 0

    def fails(self: Any, *values: Any) -> None:
        nonlocal calls
        calls += 1
        if calls == 7:
            raise KeyboardInterrupt
        advance(self, *values)

    with monkeypatch.context() as patched, pytest.raises(KeyboardInterrupt):
        patched.setattr(type(robot._trains), "advance", fails)
        robot.step()
    assert np.array_equal(np.concatenate([robot.data.qpos, robot.data.qvel]), before)
    assert np.array_equal(robot["twist"], twist)
    robot.step()


def test_a_falling_robot_keeps_its_momentum(legged: Any) -> None:
    robot = legged.robot("quasi-direct")
    robot.data.qpos[2] = 2.0
    robot.follow()
    model, data, time = robot.model, robot.data, 0.1
    start = data.subtree_com[1].copy()
    stepped(robot, round(time / legged.STEP), 0.5)
    mujoco.mj_forward(model, data)
    mujoco.mj_subtreeVel(model, data)
    assert np.abs(data.qvel[6:]).max() > 1.0
    # The scheme is of second order: 1e-6 of the momentum of parts that turn at 10 rad/s.
    assert data.subtree_com[1] - start == pytest.approx([0.0, 0.0, -0.5 * 9.81 * time**2], abs=1e-5)
    assert data.subtree_linvel[1] == pytest.approx([0.0, 0.0, -9.81 * time], abs=1e-3)


def test_a_tendon_acts_beside_the_drive() -> None:
    """Its spring and the inertia of joint and rotor are an oscillator."""
    text = HINGE.format(step=1e-3).replace(
        "</worldbody>",
        "</worldbody><tendon><fixed name='cord' stiffness='40' springlength='0.1'><joint joint='hinge' coef='1'/></fixed></tendon>",
    )
    arm = lm.mujoco.attach(mujoco.MjModel.from_xml_string(text), {"hinge": drive(1e9)}, substeps=1)
    for _ in range(500):
        arm.step()
    omega = math.sqrt(40.0 / (0.03 + 0.01 + ROTOR * RATIO**2))
    assert arm.data.qpos[0] == pytest.approx(0.1 * (1.0 - math.cos(0.5 * omega)), abs=1e-4)


def test_an_equality_couples_two_joints() -> None:
    spec = mujoco.MjSpec.from_string(
        "<mujoco><option gravity='0 0 0' timestep='1e-3'/><worldbody>"
        "<body><joint name='a' axis='0 0 1'/><inertial pos='0 0 0' mass='1' diaginertia='.1 .1 .1'/></body>"
        "<body><joint name='b' axis='0 0 1'/><inertial pos='0 0 0' mass='1' diaginertia='.1 .1 .1'/></body></worldbody>"
        "<equality><joint joint1='a' joint2='b' solref='0.005 1' solimp='0.999 0.999 0.001'/></equality></mujoco>"
    )
    pair = lm.mujoco.attach(spec, {"a": drive(1e5), "b": drive(1e5)})
    for _ in range(200):
        pair.step({"a": 0.02})
    # 2 N·m turn both links and both rotors.
    reached = 0.5 * 0.02 * RATIO / (2.0 * (0.1 + ROTOR * RATIO**2)) * 0.2**2
    assert pair.data.qpos == pytest.approx([reached, reached], rel=5e-3)


def test_a_free_joint_and_a_missing_library_are_refused(legged: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    model = mujoco.MjModel.from_xml_string(legged.mjcf())
    assert "joint 'trunk': is neither a hinge nor a slide" in refused(lambda: lm.mujoco.attach(model, {"trunk": drive()}))
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(lm.MissingLibraryError, match="mujoco") as caught:
        lm.mujoco.attach("robot.xml", {"elbow": drive()})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("name", "place"), [("qpos", 2), ("qvel", 1), ("qfrc_applied", 4)])
def test_a_value_of_the_trunk_that_is_no_number_is_named(legged: Any, name: str, place: int) -> None:
    robot = legged.robot("quasi-direct")
    robot.step()
    getattr(robot.data, name)[place] = math.nan
    refused(robot.step, match=rf"data\.{name}: value {place} is nan; give finite numbers")
    robot.reset()
    robot.step()


def test_a_second_drive_of_a_joint_is_refused() -> None:
    """A dictionary has one drive a joint; the second would be an actuator of the model."""
    text = ARM.format(step=1e-3, world="", tip="").replace("</mujoco>", "<actuator><motor name='again' joint='elbow'/></actuator></mujoco>")
    model = mujoco.MjModel.from_xml_string(text)
    assert "joint 'elbow': has the actuator 'again', which would" in refused(lambda: lm.mujoco.attach(model, {"elbow": drive()}))


def test_an_encoder_on_the_joint_hunts_in_the_arm_as_alone() -> None:
    arm = example("mujoco_arm")
    amplitude, frequency = arm.swing(*arm.hunt(6.0))
    cycle = lm.servo.limit_cycle(arm.loop_of_the_load(), causes=False)
    # Alone, what the joint moves is rigid. In the arm, held gears give way, and hold no more than 4 % of that inertia.
    assert amplitude == pytest.approx(cycle.amplitudes["load_angle"], rel=0.02)
    assert frequency == pytest.approx(cycle.frequency, rel=0.02)

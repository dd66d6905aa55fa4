"""Joints of MuJoCo Warp that are turned by drives, on the CPU: against exact arms, closed forms and linear algebra."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

import lostmotion as lm
from refusals import refusals, refused

wp = pytest.importorskip("warp")
mjw = pytest.importorskip("mujoco_warp")
mujoco = pytest.importorskip("mujoco")
pytestmark = pytest.mark.usefixtures("fast_compiles")

PENDULUM = """<mujoco><option timestep="{step}" gravity="0 0 {gravity}"/><worldbody><body>
<joint name="j" axis="0 1 0"/><inertial pos=".2 0 0" mass="1" diaginertia=".001 .96 .96"/></body></worldbody></mujoco>"""
ARM = """<mujoco><option timestep="{step}"/><worldbody><body><joint name="shoulder" axis="0 1 0"/>
<geom type="capsule" fromto="0 0 0 .4 0 0" size=".03" mass="3" contype="0" conaffinity="0"/><body pos=".4 0 0">
<joint name="elbow" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .3 0 0" size=".03" mass="1.5" contype="0" conaffinity="0"/>
</body></body></worldbody></mujoco>"""
LEG = """<mujoco><option timestep="{step}"/><worldbody><geom type="plane" size="3 3 .1"/><body pos="0 0 .52">
<joint type="slide" axis="0 0 1" name="z"/><geom type="box" size=".1 .1 .05" mass="5" contype="0" conaffinity="0"/><body>
<joint name="hip" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 .15 0 -.2" size=".02" mass=".5" contype="0" conaffinity="0"/>
<body pos=".15 0 -.2"><joint name="knee" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 -.15 0 -.2" size=".02" mass=".3"/>
</body></body></body></worldbody></mujoco>"""
WORLDS = 4


def drive(ratio: float = 50.0, *, gap: float = 2e-3, friction: float = 0.02, **parts: Any) -> lm.Drive:
    load = {key: parts.pop(key) for key in ("friction_torque",) if key in parts}
    return lm.Drive(
        motor=lm.Motor(kind="torque_source", rotor_inertia=1e-4, friction_torque=friction),
        gearbox=lm.Gearbox(
            ratio=ratio,
            stiffness=lm.model.TorsionCurve(slopes=[1e4], backlash=gap),
            losses=lm.model.ConstantEfficiency(efficiency=parts.pop("efficiency", 0.8)),
            rated_input_speed=400.0,
            rated_output_torque=50.0,
            **parts,
        ),
        load=lm.Load(inertia=1.0, **load),
    )


class Robot:
    """A robot in MuJoCo Warp whose joints have drives."""

    def __init__(self, xml: str, drives: dict[str, Any], **options: Any) -> None:
        self.model = mujoco.MjModel.from_xml_string(xml)
        self.m, self.d = mjw.put_model(self.model), mjw.make_data(self.model, nworld=WORLDS)
        self.joints = lm.warp.attach(self.model, self.m, self.d, drives, **options)

    def run(self, commands: Callable[[float], dict[str, Any]], duration: float) -> None:
        step = self.model.opt.timestep
        for n in range(round(duration / step)):
            self.joints.before(commands(n * step))
            mjw.step(self.m, self.d)
        self.joints.before(commands(duration))


def held_for(period: float, t: float) -> float:
    return float(np.floor(t / period + 1e-9) * period)


def exact(xml: str, drives: dict[str, Any], commands: Callable[[float], dict[str, float]], duration: float) -> Any:
    arm = lm.mujoco.attach(mujoco.MjModel.from_xml_string(xml), drives)
    step = arm.model.opt.timestep
    for n in range(round(duration / step)):
        arm.step(commands(n * step))
    return arm.data


@pytest.mark.parametrize(("gravity", "angle", "speed"), [(0.0, 1e-6, 3e-6), (-9.81, 4e-5, 3e-4)])
@pytest.mark.parametrize("gap", [0.0, 2e-3])
def test_a_pendulum_moves_as_an_exact_one(gravity: float, angle: float, speed: float, gap: float) -> None:
    # MuJoCo takes gravity from where a step begins: half a step late, which is what is left.
    xml = PENDULUM.format(step=0.004, gravity=gravity)

    def command(t: float, phase: float = 0.0) -> float:
        return 0.15 * float(np.sin(4 * np.pi * held_for(0.004, t) + phase))

    robot = Robot(xml, {"j": drive(gap=gap)})
    robot.run(lambda t: {"j": [command(t, world) for world in range(WORLDS)]}, 0.4)
    for world in (0, 3):
        data = exact(xml, {"j": drive(gap=gap)}, lambda t, world=world: {"j": command(t, world)}, 0.4)
        assert robot.d.qpos.numpy()[world, 0] == pytest.approx(data.qpos[0], abs=angle)
        assert robot.d.qvel.numpy()[world, 0] == pytest.approx(data.qvel[0], abs=speed)
    assert robot.joints.counts["switchings"] > WORLDS
    assert robot.joints.counts["doubtful"] == 0


def test_an_arm_of_two_links_moves_as_an_exact_one() -> None:
    drives = {"shoulder": drive(mesh_damping=10.0), "elbow": drive(40.0, mesh_damping=10.0)}

    def commands(t: float) -> dict[str, float]:
        return {"shoulder": -0.3 + 0.1 * float(np.sin(9 * t)), "elbow": -0.05 + 0.1 * float(np.sin(7 * t + 1))}

    for step, error in ((0.001, 8e-4), (0.0005, 4e-4)):
        xml = ARM.format(step=step)
        robot = Robot(xml, drives)
        robot.run(lambda t: commands(held_for(0.004, t)), 0.4)
        data = exact(xml, drives, lambda t: commands(held_for(0.004, t)), 0.4)
        assert np.abs(data.qpos).max() > 0.8
        assert robot.d.qpos.numpy()[0] == pytest.approx(data.qpos, abs=error)


def test_a_foot_lands() -> None:
    # The fall of 0.12 m ends where the foot meets the ground; the trunk then sinks on yielding joints.
    drives = {"hip": drive(10.0, mesh_damping=10.0), "knee": drive(10.0, mesh_damping=10.0)}
    robot = Robot(LEG.format(step=0.001), drives)
    robot.run(lambda _: {"hip": 0.0, "knee": 0.0}, 0.14)
    data = exact(LEG.format(step=0.001), drives, lambda _: {"hip": 0.0, "knee": 0.0}, 0.14)
    assert robot.d.qpos.numpy()[0, 0] == pytest.approx(data.qpos[0], abs=2e-3)
    robot.run(lambda _: {"hip": 0.0, "knee": 0.0}, 0.3)
    assert np.isfinite(robot.d.qpos.numpy()).all()


def test_what_friction_holds_does_not_creep() -> None:
    # 0.2 m g = 1.96 N m: less than the load's friction of 2.5 N m.
    xml = PENDULUM.format(step=0.005, gravity=-9.81)
    robot = Robot(xml, {"j": drive(friction=0.0, friction_torque=2.5)})
    robot.run(lambda _: {"j": 0.0}, 2.0)
    assert robot.d.qpos.numpy().tolist() == [[0.0]] * WORLDS
    # Held by the motor through an elastic mesh: the load swings on its flank, and the motor stays.
    robot = Robot(xml, {"j": drive(gap=0.0, friction=0.1, mesh_damping=100.0)})
    robot.run(lambda _: {"j": 0.0}, 1.0)
    assert not robot.joints["motor_speed"]["j"].numpy().any()
    assert robot.d.qpos.numpy()[0, 0] == pytest.approx(0.2 * 9.81 / 1e4, rel=1e-3)


@pytest.mark.parametrize("samples", [1, 4])
def test_a_law_of_the_motor_acts_at_its_samples(samples: int) -> None:
    # The state has the angles and speeds of motor (over the ratio) and load. It is linear between samples, at which the torque is set anew.
    step, ratio, rotor, load, mesh = 0.004, 50.0, 50.0**2 * 1e-4, 1.0, 1e4
    stiffness, damping, goal = 300.0, 15.0, 0.2
    robot = Robot(
        PENDULUM.format(step=step, gravity=0.0),
        {"j": drive(ratio, gap=0.0, friction=0.0, efficiency=1.0)},
        stiffness=stiffness, damping={"j": damping}, samples=samples, dtype="float64",
    )  # fmt: skip
    robot.run(lambda _: {"j": goal}, 0.4)
    rates = np.zeros((5, 5))  # angle and speed of motor, of load, and the torque
    rates[0, 1] = rates[2, 3] = 1.0
    rates[1, [0, 2, 4]] = -mesh / rotor, mesh / rotor, 1.0 / rotor
    rates[3, [0, 2]] = mesh / load, -mesh / load
    between, x = expm(rates * step / samples), np.zeros(5)
    for _ in range(round(0.4 / step) * samples):
        x[4] = stiffness * (goal - x[0]) - damping * x[1]
        x = between @ x
    assert 0.02 < abs(x[2]) < 0.4
    assert robot.d.qpos.numpy()[0, 0] == pytest.approx(x[2], abs=2e-6)
    assert robot.joints["twist"]["j"].numpy()[0] == pytest.approx(x[0] - x[2], abs=2e-7)
    assert robot.joints["motor_speed"]["j"].numpy()[0] == pytest.approx(ratio * x[1], abs=2e-3)


def test_worlds_have_parameters_of_their_own_and_begin_anew() -> None:
    robot = Robot(PENDULUM.format(step=0.002, gravity=0.0), {"j": drive()})
    robot.joints.parameters["j"]["motor.friction_torque"].assign([0.02, 0.02, 0.05, 1.0])
    robot.run(lambda _: {"j": np.full(WORLDS, 0.2)}, 0.1)
    angles = robot.d.qpos.numpy()[:, 0]
    assert angles[0] == angles[1] > angles[2] > angles[3] == 0.0
    for array in (robot.d.qpos, robot.d.qvel):
        array.zero_()
    robot.joints.reset()
    robot.run(lambda _: {"j": wp.array([0.2] * WORLDS, dtype=wp.float32)}, 0.1)
    assert robot.d.qpos.numpy()[:, 0].tolist() == angles.tolist()


FREE = PENDULUM.format(step=0.002, gravity=0.0)


def test_a_load_torque_of_the_drive_gives_way_to_the_robot() -> None:
    """With replace=True the drive moves as one without it; what is on the device already cannot be taken off the model."""
    light = lm.load("paper-2dof-nl-small")
    heavy = light.replace(**{"load.torque": {"mean": 1.0}})
    found = [Robot(FREE, {"j": one}, replace=True) for one in (light, heavy)]
    for robot in found:
        robot.run(lambda _: {"j": 0.5}, 0.02)
    assert found[0].d.qpos.numpy().tolist() == found[1].d.qpos.numpy().tolist() != [[0.0]] * WORLDS
    assert "load.torque: would count twice" in refused(lambda: Robot(FREE, {"j": heavy}))
    armed = FREE.replace('name="j"', 'name="j" armature="0.1"')
    assert "before put_model" in refused(lambda: Robot(armed, {"j": light}, replace=True))


test_what_joints_do_not_take_is_refused = refusals(
    (lambda: Robot(FREE.replace('name="j"', 'name="j" armature="0.1"'), {"j": drive()}), ": armature"),
    (lambda: Robot(FREE.replace("timestep", 'integrator="RK4" timestep'), {"j": drive()}), ": integrator"),
    (lambda: Robot(FREE, {"k": drive()}), ': "k"'),
    (lambda: Robot(FREE, {}), ": drives"),
    (lambda: Robot(FREE, {"j": lm.load("paper-2dof-nl-small").drive()}, stiffness=1.0), ": stiffness: joint 'j'"),
    (lambda: Robot(FREE, {"j": drive()}, stiffness={"k": 1.0}), ': stiffness: joint "k"'),
    (lambda: Robot(FREE, {"j": drive()}, stiffness=1.0, damping=-1.0), ": damping.j"),
    (lambda: Robot(FREE, {"j": drive()}).joints.before({}), ": commands"),
    (lambda: Robot(FREE, {"j": drive()}).joints.before(np.zeros((3, 1))), ": commands"),
    (lambda: Robot(FREE, {"j": drive()}).joints.before(wp.zeros((1, 1))), ": array of Warp for each joint"),
    (lambda: Robot(FREE, {"j": drive()}).joints.before({"j": [0.1, 0.2, 0.3]}), ": one for each world"),
    (lambda: Robot(FREE, {"j": drive()}).joints.reset([True]), ": which"),
    (lambda: Robot(FREE, {"j": drive()}).joints["load_angle"], ": load_angle"),
)  # fmt: skip


@pytest.mark.parametrize("name", ["advance_kernel", "joint_kernel"])
def test_the_kernel_is_compiled_for_a_graphics_processor(name: str, tmp_path: object) -> None:
    from lostmotion.warp import kernel

    wp.compile_aot_module(getattr(kernel, name)("float32").module, device=None, arch=90, module_dir=tmp_path, use_ptx=True)


def test_a_slide_behind_a_screw_moves_as_in_attach() -> None:
    motor = {"shaft": "motor", "kind": "torque_source", "rotor_inertia": 2e-4, "friction_torque": 0.05}
    screw = {"input": "motor", "output": "table", "lead": 0.01, "efficiency": 0.9, "stiffness": 8e5}
    axis = lm.Scenario(
        shafts={"motor": {}},
        slides={"table": {"mass": 30.0, "friction_force": 20.0}},
        motors={"m": motor},
        screws={"s": screw},
        command={"m": {}},
        simulation={"duration": 1.0, "sample_interval": 1e-3},
    )
    body = '<joint name="table" type="slide" axis="0 0 1"/><inertial pos="0 0 0" mass="80" diaginertia="1 1 1"/>'
    text = f'<mujoco><option timestep="0.001" gravity="0 0 0"/><worldbody><body>{body}</body></worldbody></mujoco>'
    robot, exact = Robot(text, {"table": axis}, dtype="float64"), lm.mujoco.attach(mujoco.MjModel.from_xml_string(text), {"table": axis})
    robot.run(lambda t: {"table": 2.0 + 0.5 * np.sin(30.0 * t)}, 0.1)
    for k in range(100):
        exact.step([2.0 + 0.5 * np.sin(30.0 * k * 1e-3)])
    # MuJoCo Warp keeps speeds and positions in float32, and its scheme is of first order where the two are of second.
    assert robot.d.qpos.numpy()[0, 0] == pytest.approx(exact.data.qpos[0], rel=1e-3)
    assert exact.data.qpos[0] > 0.03

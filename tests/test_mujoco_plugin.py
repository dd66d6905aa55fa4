"""The actuator plugin of MuJoCo: against `lm.mujoco.attach`, with states of mjData, and wrong use."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from refusals import refused

mujoco = pytest.importorskip("mujoco", reason='pip install "lostmotion[mujoco]"')

from robot_arm import ARM, HINGE, RATIO, ROTOR, drive, motor_torques, robot  # noqa: E402  (it needs MuJoCo)

# Belt and worm between the motor and the joint, which a spring turns back; a flywheel beside them.
STAGES = {"belt": 5.0, "worm": 20.0}
TRAIN = {
    "shafts": {"rotor": {}, "worm": {"inertia": 2e-4}, "joint": {"inertia": 1.0}, "flywheel": {"inertia": 0.01}},
    "motors": {"m": {"shaft": "rotor", "kind": "torque_source", "rated_torque": 2.0, "rotor_inertia": 1e-4}},
    "gears": {
        "belt": {"input": "rotor", "output": "worm", "ratio": STAGES["belt"], "inertia": 3e-5},
        "worm": {"input": "worm", "output": "joint", "ratio": STAGES["worm"]},
        "bevel": {"input": "flywheel", "output": "worm", "ratio": -2.0},
    },
}
AT_JOINT = 100.0**2 * 1.3e-4 + 20.0**2 * (2e-4 + 4.0 * 0.01)
"""inertia of motor, worm and flywheel at the joint [kg m2]"""


@pytest.fixture(scope="session", autouse=True)
def plugin() -> Path:
    return lm.mujoco.load_plugin()


def arm(
    step: float,
    given: lm.Drive,
    where: Path,
    *,
    armature: float = ROTOR * RATIO**2,
    key: str = "",
    joint: str = "",
    actuator: str = "",
    before: str = "",
) -> Any:
    """The arm of the tests of `attach`, its drives as plugins."""
    file = where / "drive"
    lm.mujoco.write_drive(given, file)
    text = ARM.format(step=step, world="", tip="").replace('type="hinge"', f'type="hinge" armature="{armature!r}" {joint}')
    config = f'<config key="scenario" value="{key or file}"/>'
    actuators = "".join(
        f'<plugin name="{name}" joint="{name}" plugin="lostmotion.drive" {actuator}>{config}</plugin>' for name in ("shoulder", "elbow")
    )
    extension = '<extension><plugin plugin="lostmotion.drive"/></extension>'
    text = text.replace("<worldbody>", extension + "<worldbody>", 1)
    return mujoco.MjModel.from_xml_string(text.replace("</mujoco>", f"<actuator>{before}{actuators}</actuator></mujoco>"))


def swing(model: Any, duration: float) -> np.ndarray:
    data, step = mujoco.MjData(model), model.opt.timestep
    for k in range(round(duration / step)):
        data.ctrl[:] = motor_torques((k + 0.5) * step)
        mujoco.mj_step(model, data)
    return data.qpos.copy()


@pytest.mark.parametrize("given", [drive(), drive(gap=1e-3), drive(friction=0.02, hysteresis=0.9)])
def test_the_plugin_moves_an_arm_as_attach_does_to_first_order(given: lm.Drive, tmp_path: Path) -> None:
    exact = robot(2.5e-4, given)
    for k in range(1200):
        exact.step(motor_torques((k + 0.5) * 2.5e-4))
    errors = [np.abs(swing(arm(step, given, tmp_path), 0.3) - exact.data.qpos).max() for step in (2e-3, 1e-3, 5e-4)]
    assert np.abs(exact.data.qpos).max() > 0.05
    assert errors[1] < 5e-3
    assert errors[0] / errors[2] > 0.7 * 4.0


def test_a_copy_of_the_data_goes_on_with_the_same_bits(tmp_path: Path) -> None:
    model = arm(1e-3, drive(gap=1e-3, friction=0.01), tmp_path)
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.1, 0.05
    mujoco.mj_step(model, data, 50)
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    kept, copied = np.zeros(mujoco.mj_stateSize(model, kind)), mujoco.MjData(model)
    mujoco.mj_getState(model, data, kept, kind)
    mujoco.mj_copyData(copied, model, data)
    mujoco.mj_step(model, data, 50)
    end = [data.qpos.tolist(), data.plugin_state.tolist()]
    mujoco.mj_step(model, copied, 50)
    assert [copied.qpos.tolist(), copied.plugin_state.tolist()] == end
    mujoco.mj_setState(model, data, kept, kind)
    mujoco.mj_step(model, data, 50)
    assert [data.qpos.tolist(), data.plugin_state.tolist()] == end
    mujoco.mj_resetData(model, data)
    data.ctrl[:] = 0.1, 0.05
    mujoco.mj_step(model, data, 100)
    assert [data.qpos.tolist(), data.plugin_state.tolist()] == end


def test_an_arm_that_friction_holds_does_not_creep(tmp_path: Path) -> None:
    model = arm(2e-3, drive(friction=0.3, bearing=0.5), tmp_path)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 5000)  # the springs take up the weight, and the bearings damp their swing
    settled = data.qpos.copy()
    assert np.abs(settled).min() > 1e-4
    mujoco.mj_step(model, data, 1000)
    assert np.abs(data.qpos - settled).max() < 1e-12


@pytest.mark.parametrize(("options", "message"), [
    ({"armature": 0.0}, "lostmotion.drive .*: the joint has the armature 0; give it 0.1, the inertia of the drive"),
    ({"joint": 'damping="0.1"'}, "the joint has damping, which would act beside the drive"),
    ({"joint": 'frictionloss="0.1"'}, "the joint has a frictionloss, which would act beside the drive"),
    ({"joint": 'actuatorfrcrange="-1 1"'}, "the joint has an actuatorfrcrange, which would act beside the drive"),
    ({"actuator": 'forcerange="-1 1"'}, "the actuator has a forcerange, which would act beside the drive"),
    ({"key": "/no/such"}, "scenario /no/such: is no file of lostmotion.mujoco.write_drive"),
])  # fmt: skip
def test_a_wrong_configuration_ends_in_one_clear_line(options: dict[str, Any], message: str, tmp_path: Path) -> None:
    with pytest.raises((mujoco.FatalError, ValueError), match=message) as raised:
        mujoco.MjData(arm(1e-3, drive(), tmp_path, **options))
    assert "\n" not in str(raised.value).strip()


def test_loads_and_weights_of_a_scenario_are_taken_off_where_the_robot_has_them(tmp_path: Path) -> None:
    loaded = lm.load("lossy-rigid-gear")
    assert "load.torque: would count twice" in refused(lambda: lm.mujoco.write_drive(loaded, tmp_path / "one"))
    without = loaded.replace(**{"load.torque": {}})
    assert lm.mujoco.write_drive(loaded, tmp_path / "x", replace=True) == lm.mujoco.write_drive(without, tmp_path / "x")


def test_controls_are_limited_and_found_behind_an_actuator_of_two(tmp_path: Path) -> None:
    limited = arm(1e-3, drive(), tmp_path, actuator='ctrlrange="-0.1 0.1"')
    behind = arm(1e-3, drive(), tmp_path, before='<pid name="first" joint="elbow" kp="0" kv="0" input="pos vel"/>')
    ends = []
    for model, controls in ((limited, [3.0, -3.0]), (behind, [0.0, 0.0, 0.1, -0.1]), (arm(1e-3, drive(), tmp_path), [0.1, -0.1])):
        data = mujoco.MjData(model)
        assert model.nu == len(controls)
        data.ctrl[:] = controls
        mujoco.mj_step(model, data, 20)
        ends.append(data.qpos.tolist())
    assert ends[0] == ends[2]
    assert ends[1] == ends[2]


def hinge(train: dict[str, Any], where: Path, step: float) -> Any:
    """The hinge of the tests of `attach`, turned by a train by way of the lines that `write_drive` returns."""
    joint, actuator = lm.mujoco.write_drive(lm.DriveTrain(**train), where / "hinge.drive").split("\n")
    armature = joint.partition("armature=")[2].partition("/")[0]
    text = HINGE.format(step=step).replace('type="hinge"', f'type="hinge" armature={armature}')
    text = text.replace("<worldbody>", '<extension><plugin plugin="lostmotion.drive"/></extension><worldbody>')
    text = text.replace("</mujoco>", f"<actuator>{actuator.replace('JOINT', 'hinge')}</actuator></mujoco>")
    return mujoco.MjModel.from_xml_string(text)


def test_a_joint_behind_belt_and_worm_speeds_up_by_the_torque_over_all_inertias(tmp_path: Path) -> None:
    model = hinge(TRAIN, tmp_path, 1e-3)
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.7
    mujoco.mj_step(model, data, 200)
    assert model.dof_armature[0] == pytest.approx(AT_JOINT, rel=1e-8)
    exact = lm.mujoco.attach(mujoco.MjModel.from_xml_string(HINGE.format(step=1e-3)), {"hinge": lm.DriveTrain(**TRAIN)})
    for _ in range(200):
        exact.step([0.7])
    acceleration = 100.0 * 0.7 / (AT_JOINT + 0.03 + 0.1**2)
    assert [data.qvel[0], exact.data.qvel[0]] == pytest.approx(2 * [0.2 * acceleration], rel=1e-9)
    assert exact.data.qpos[0] == pytest.approx(0.5 * acceleration * 0.2**2, rel=1e-9)


def test_a_joint_that_begins_away_from_0_swings_on_the_spring_of_its_train(tmp_path: Path) -> None:
    stiffness = 400.0
    train = TRAIN | {"springs": {"s": {"shaft": "joint", "stiffness": {"kind": "linear", "stiffness": stiffness}}}}
    w = np.sqrt(stiffness / (AT_JOINT + 0.03 + 0.1**2))
    for step in (2e-3, 1e-3):
        model = hinge(train, tmp_path, step)
        data = mujoco.MjData(model)
        data.qpos[0] = 0.5
        mujoco.mj_step(model, data, round(0.4 / step))
        # MuJoCo advances positions with the speed at the end of a step.
        ahead = -0.5 * step * 0.5 * w * np.sin(0.4 * w)
        assert data.qpos[0] - 0.5 * np.cos(0.4 * w) == pytest.approx(ahead, rel=0.02)


def travelled(kind: str, drive: lm.Scenario, where: Path, step: float) -> float:
    """Where the plugin brings a joint of 80 kg or 80 kg m2 without weight in 0.2 s."""
    file, armature = where / "table", 2e-4 * (2.0 * np.pi / 0.01) ** 2
    lm.mujoco.write_drive(drive, file)
    body = (
        f'<joint name="table" type="{kind}" axis="0 0 1" armature="{armature!r}"/><inertial pos="0 0 0" mass="80" diaginertia="80 80 80"/>'
    )
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{step}" gravity="0 0 0"/><extension><plugin plugin="lostmotion.drive"/></extension>'
        f'<worldbody><body>{body}</body></worldbody><actuator><plugin joint="table" plugin="lostmotion.drive">'
        f'<config key="scenario" value="{file}"/></plugin></actuator></mujoco>'
    )
    data = mujoco.MjData(model)
    for k in range(round(0.2 / step)):
        data.ctrl[:] = 2.0 + 0.5 * np.sin(30.0 * (k + 0.5) * step)
        mujoco.mj_step(model, data)
    return float(data.qpos[0])


def test_a_slide_moves_as_a_hinge_of_the_same_numbers_and_as_attach_to_first_order(tmp_path: Path) -> None:
    motor = {"kind": "torque_source", "rotor_inertia": 2e-4, "friction_torque": 0.05}
    given = {"motors": {"m": {"shaft": "motor", **motor}}, "command": {"m": {}}, "simulation": {"duration": 1.0, "sample_interval": 1e-3}}
    screw = lm.Scenario(
        shafts={"motor": {}},
        slides={"table": {"mass": 30.0, "friction_force": 20.0}},
        screws={"s": {"input": "motor", "output": "table", "lead": 0.01, "stiffness": 8e6}},
        **given,
    )
    gear = {"input": "motor", "output": "table", "ratio": 2.0 * np.pi / 0.01, "stiffness": {"kind": "linear", "stiffness": 8e6}}
    table = {"inertia": 30.0, "friction_torque": 20.0}
    hinge = lm.Scenario(shafts={"motor": {}, "table": table}, gears={"s": gear}, **given)
    body = '<joint name="table" type="slide" axis="0 0 1"/><inertial pos="0 0 0" mass="80" diaginertia="1 1 1"/>'
    text = f'<mujoco><option timestep="0.00025" gravity="0 0 0"/><worldbody><body>{body}</body></worldbody></mujoco>'
    exact = lm.mujoco.attach(mujoco.MjModel.from_xml_string(text), {"table": screw})
    for k in range(800):
        exact.step([2.0 + 0.5 * np.sin(30.0 * (k + 0.5) * 2.5e-4)])
    ends = [travelled("slide", screw, tmp_path, step) for step in (2e-3, 1e-3)]
    assert ends == [travelled("hinge", hinge, tmp_path, step) for step in (2e-3, 1e-3)]
    errors = [end - exact.data.qpos[0] for end in ends]
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.05)
    assert abs(errors[1]) < 0.01 * exact.data.qpos[0]
    with pytest.raises((mujoco.FatalError, ValueError), match="the joint is a hinge, and the train ends at a slide"):
        travelled("hinge", screw, tmp_path, 1e-3)


def test_a_motor_without_a_gear_turns_a_joint_by_its_torque(tmp_path: Path) -> None:
    motor = {"shaft": "joint", "kind": "torque_source", "rated_torque": 2.0, "rotor_inertia": 0.02}
    model = hinge({"shafts": {"joint": {}}, "motors": {"m": motor}}, tmp_path, 1e-3)
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.7
    mujoco.mj_step(model, data, 100)
    assert data.qvel[0] == pytest.approx(0.1 * 0.7 / (0.02 + 0.03 + 0.1**2), rel=1e-12)


def test_of_two_ends_the_one_with_the_name_of_the_joint_is_turned(tmp_path: Path) -> None:
    ends = TRAIN | {"gears": TRAIN["gears"] | {"bevel": {"input": "worm", "output": "flywheel", "ratio": -0.5}}}
    assert "the train ends at joint, flywheel; call the" in refused(lambda: lm.mujoco.write_drive(lm.DriveTrain(**ends), tmp_path / "x"))
    shafts = {"hinge" if name == "joint" else name: shaft for name, shaft in TRAIN["shafts"].items()}
    gears = ends["gears"] | {"worm": ends["gears"]["worm"] | {"output": "hinge"}}
    model = hinge(ends | {"shafts": shafts, "gears": gears}, tmp_path, 1e-3)
    assert model.dof_armature[0] == pytest.approx(AT_JOINT, rel=1e-8)


def test_two_motors_on_a_joint_are_refused(tmp_path: Path) -> None:
    second = {"shaft": "worm", "kind": "torque_source", "rated_torque": 1.0, "rotor_inertia": 1e-4}
    refused(
        lambda: lm.mujoco.write_drive(lm.DriveTrain(**TRAIN | {"motors": TRAIN["motors"] | {"n": second}}), tmp_path / "x"),
        match="2 motors turn it",
    )

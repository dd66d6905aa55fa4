"""Drives in MuJoCo: what robot and drive both have acts once, is refused by name, or is replaced."""

import math
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from refusals import refusals_of, refused
from tables import gear_between, torque_source

mujoco = pytest.importorskip("mujoco", reason='pip install "lostmotion[mujoco]"')

MASS, RADIUS, INERTIA, RATIO, ROTOR, G = 0.8, 0.12, 0.012, 50.0, 2e-6, 9.80665
ARM = """
<mujoco><option timestep="1e-3" gravity="0 0 {gravity}"/>{extension}<worldbody><body {body}>
  <joint name="arm" type="hinge" axis="0 -1 0" {joint}/>
  <inertial pos="0 0 -0.12" mass="0.8" diaginertia="1e-4 4.8e-4 4.8e-4"/></body></worldbody>{actuator}</mujoco>"""


def model(gravity: float = -G, **parts: str) -> Any:
    empty = dict.fromkeys(("extension", "body", "joint", "actuator"), "")
    return mujoco.MjModel.from_xml_string(ARM.format(gravity=gravity, **empty | parts))


def tables(**more: Any) -> dict[str, Any]:
    """A lossless geared arm, whose robot hangs at 0."""
    return {
        "shafts": {"motor": {}, "arm": {"inertia": INERTIA}},
        "motors": {"m": {"shaft": "motor", "kind": "torque_source", "rotor_inertia": ROTOR}},
        "gears": {"g": {"input": "motor", "output": "arm", "ratio": RATIO}},
        "simulation": {"duration": 1.0, "sample_interval": 1e-3},
    } | more


def scenario(**more: Any) -> Any:
    return lm.Scenario(**tables(**more))


WEIGHT = {"shaft": "arm", "mass": MASS, "radius": RADIUS, "error": 1e-4}
ONCE = {"shaft": "arm", "kind": "sine", "amplitude": MASS * G * RADIUS, "order": 1, "phase": math.pi, "error": 1e-4}
POINTS = [k * math.pi / 6 for k in range(12)]
CURVE = {"shaft": "arm", "kind": "curve", "period": 2 * math.pi, "angles": POINTS, "torques": [math.sin(a) for a in POINTS]}
CONTROLLER = {"kind": "continuous", "shaft": "arm", "reference": {"kind": "position"}, "position": {"gain": 0.1, "derivative_gain": 0.01}}
WEIGHTS = {
    "gravity.arm": {"gravity": {"arm": WEIGHT}},
    "angle_torques.unbalance": {"angle_torques": {"unbalance": ONCE}},
    "angle_torques.measured": {"angle_torques": {"measured": CURVE}},
    "shafts.arm.torque": {"shafts": {"motor": {}, "arm": {"inertia": INERTIA, "torque": 0.9}}},
}


def crossing(arm: Any) -> float:
    """When an arm that is released in the horizontal hangs down first [s]."""
    arm.data.qpos[0] = 0.5 * math.pi
    arm.follow()
    for k in range(1000):
        before = arm.data.qpos[0]
        arm.step()
        if arm.data.qpos[0] <= 0.0:
            return float((k + before / (before - arm.data.qpos[0])) * 1e-3)
    raise AssertionError("the arm does not fall")


@pytest.mark.parametrize("key", WEIGHTS)
@pytest.mark.parametrize("form", ["train", "scenario", "controlled"])
def test_weight_and_load_of_the_joint_are_refused_or_left_to_the_robot(key: str, form: str) -> None:
    if form == "train" and key == "shafts.arm.torque":
        pytest.skip("a train has no load torque")
    given = scenario(**WEIGHTS[key], **({"controllers": {"m": CONTROLLER}} if form == "controlled" else {}))
    given = given.train() if form == "train" else given
    refused(lambda: lm.mujoco.attach(model(), {"arm": given}), key)
    arm = lm.mujoco.attach(model(), {"arm": given}, replace=True)
    plain = scenario(**({"controllers": {"m": CONTROLLER}} if form == "controlled" else {}))
    once = lm.mujoco.attach(model(), {"arm": plain})
    for robot in (arm, once):
        for _ in range(50):
            robot.step([0.3])
    assert arm.data.qpos.tolist() == once.data.qpos.tolist()


def test_an_arm_whose_weight_is_replaced_falls_as_a_pendulum() -> None:
    # A quarter of the period from the horizontal is K(1/2)/sqrt(m g r/J), with the complete elliptic integral K.
    whole = INERTIA + RATIO**2 * ROTOR
    right = 1.8540746773013719 / math.sqrt(MASS * G * RADIUS / whole)
    arm = lm.mujoco.attach(model(), {"arm": scenario(gravity={"arm": WEIGHT}).train()}, replace=True)
    assert crossing(arm) == pytest.approx(right, rel=1e-5)


def test_the_load_torque_of_a_short_form_is_refused() -> None:
    given = lm.load("overrunning-load")
    with pytest.raises(lm.InputError) as caught:
        lm.mujoco.attach(model(), {"arm": given})
    assert caught.value.problems[0].keys == ("load.torque",)
    lm.mujoco.attach(model(), {"arm": given}, replace=True).step()
    refused(lambda: lm.mujoco.write_drive(given, "never-written"), "load.torque")


def test_the_weight_of_a_drive_acts_where_the_robot_has_none() -> None:
    # The chords of the weight depart from the sine by at most 1e-4 of it.
    right = crossing(lm.mujoco.attach(model(), {"arm": scenario()}))
    for weightless in (model(gravity=0.0), model(body='gravcomp="1"')):
        arm = lm.mujoco.attach(weightless, {"arm": scenario(gravity={"arm": WEIGHT})})
        assert crossing(arm) == pytest.approx(right, rel=1e-4)


def test_cogging_on_the_joint_and_unbalance_of_the_motor_are_no_weight_of_the_robot() -> None:
    torques = {"cogging": ONCE | {"order": 12}, "unbalance": ONCE | {"shaft": "motor", "amplitude": 1e-4}}
    arm = lm.mujoco.attach(model(), {"arm": scenario(angle_torques=torques)})
    assert sorted(arm.drives["arm"].angle_torques) == ["cogging", "unbalance"]


GEARS = {"g": {"input": "motor", "output": "flange", "ratio": RATIO}}
SHAFTS = {"motor": {}, "flange": {"inertia": 0.9 * INERTIA}, "arm": {"inertia": 0.1 * INERTIA}}
BEFORE = {
    "coupling": (SHAFTS, {"gears": GEARS | {"c": {"input": "flange", "output": "arm", "ratio": -1.0}}}, {"gravity": {"w": WEIGHT | {"shaft": "flange"}}}),
    "clutch": (SHAFTS, {"gears": GEARS, "clutches": {"c": {"input": "flange", "output": "arm", "torque": 30.0, "kind": "safety"}}}, {"gravity": {"w": WEIGHT | {"shaft": "flange"}}}),
    "gear": ({"motor": {}, "arm": {"inertia": INERTIA}}, {}, {"angle_torques": {"w": CURVE | {"shaft": "motor", "period": RATIO * 2 * math.pi, "angles": [RATIO * a for a in POINTS]}}}),
    "belt": (SHAFTS, {"gears": GEARS | {"c": {"input": "flange", "output": "arm", "ratio": 3.0}}}, {"angle_torques": {"w": CURVE | {"shaft": "flange", "period": 6 * math.pi, "angles": [3 * a for a in POINTS]}}}),
}  # fmt: skip


@pytest.mark.parametrize("joined", BEFORE)
def test_a_weight_on_a_shaft_that_turns_with_the_joint_is_refused_or_left_to_the_robot(joined: str) -> None:
    shafts, parts, weight = BEFORE[joined]
    given, plain = scenario(shafts=shafts, **parts, **weight), scenario(shafts=shafts, **parts)
    with pytest.raises(lm.InputError, match="would count twice") as caught:
        lm.mujoco.attach(model(), {"arm": given})
    assert caught.value.problems[0].keys == (f"{next(iter(weight))}.w",)
    assert crossing(lm.mujoco.attach(model(), {"arm": given}, replace=True)) == crossing(lm.mujoco.attach(model(), {"arm": plain}))


def test_loads_before_a_joint_and_on_a_slide_are_named_by_the_keys_of_the_file() -> None:
    motor, moved = (torque_source(1e-5), "<joint name='arm' type='slide' axis='0 0 1'/><geom size='.1' mass='3'/>")
    robot = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody><body>{moved}</body></worldbody></mujoco>")
    for key, value in {"inclination": 0.5 * math.pi, "force": 5.0}.items():
        axis = {"motor": motor, "screw": {"lead": 0.01}, "slide": {"mass": 3.0, key: value}}
        given = lm.Scenario(axis=axis, simulation={"duration": 1.0, "sample_interval": 1e-3})
        with pytest.raises(lm.InputError, match="would count twice") as caught:
            lm.mujoco.attach(robot, {"arm": given})
        assert caught.value.problems[0].keys == (f"axis.slide.{key}",)
        arm = lm.mujoco.attach(robot, {"arm": given}, replace=True)
        arm.step()
        # The fall of 3 kg that turn a rotor by a screw: semi-implicit steps of MuJoCo's 2 ms.
        assert arm.data.qvel[0] == pytest.approx(-2e-3 * 9.81 * 3.0 / (3.0 + 1e-5 * (2 * math.pi / 0.01) ** 2), rel=1e-9)


def test_end_stops_of_joint_and_drive_are_refused_or_those_of_the_drive_stay() -> None:
    k, stopped = (
        50.0,
        {"motor": {}, "arm": {"inertia": INERTIA, "viscous_friction": 2.0, "end_stops": {"lower": -2.0, "upper": 0.5, "stiffness": 50.0}}},
    )
    limited = model(joint='limited="true" range="-114 28"')
    refused(lambda: lm.mujoco.attach(limited, {"arm": scenario(shafts=stopped)}), reason="has range, which would count twice")
    assert lm.mujoco.attach(limited, {"arm": scenario()}).model.jnt_limited[0]
    arm = lm.mujoco.attach(limited, {"arm": scenario(shafts=stopped)}, replace=True)
    for _ in range(5000):
        arm.step([0.1])
    q = arm.data.qpos[0]  # At rest the motor's torque is that of weight and stop.
    assert MASS * G * RADIUS * math.sin(q) + k * (q - 0.5) == pytest.approx(RATIO * 0.1, rel=1e-9)


def test_springs_of_joint_and_drive_are_refused_or_those_of_the_drive_stay() -> None:
    spring = {"end": {"shaft": "arm", "stiffness": {"kind": "linear", "stiffness": 2.0}}}
    sprung = model(joint='stiffness="3"')
    assert "has stiffness, which would count twice" in refused(lambda: lm.mujoco.attach(sprung, {"arm": scenario(springs=spring)}))
    assert lm.mujoco.attach(sprung, {"arm": scenario()}).model.jnt_stiffness[0] == 3.0
    arm = lm.mujoco.attach(sprung, {"arm": scenario(springs=spring)}, replace=True)
    assert arm.model.jnt_stiffness[0] == 0.0
    arm.data.qpos[0] = 0.4
    arm.follow(held=True)
    arm.step()
    # A rigid gear without friction does not hold: (J + i^2 J_r) a = -m g r sin(q) - k q.
    fall = -(MASS * G * RADIUS * math.sin(0.4) + 2.0 * 0.4) / (INERTIA + RATIO**2 * ROTOR)
    assert arm.data.qvel[0] == pytest.approx(1e-3 * fall, rel=1e-3)


ACTUATORS = {
    "motor": '<motor name="a" joint="arm" gear="7" armature="0.3" damping="0.4"/>',
    "position": '<position name="a" joint="arm" kp="40" dampratio="1" armature="0.3"/>',
    "velocity": '<velocity name="a" joint="arm" kv="4"/>',
    "damper": '<damper name="a" joint="arm" kv="4" ctrlrange="0 1"/>',
    "dcmotor": '<dcmotor name="a" joint="arm" motorconst="0.05 0.05" resistance="2"/>',
    "tendon": '<motor name="a" tendon="rope"/>',
    "pid": '<pid name="a" joint="arm" kp="40" kv="3"/>',
}


@pytest.mark.parametrize("kind", ACTUATORS)
def test_nothing_of_an_actuator_stays_beside_its_drive(kind: str) -> None:
    tendon = '<tendon><fixed name="rope"><joint joint="arm" coef="9"/></fixed></tendon>'
    given = model(joint='damping="0.1 0.2 0.3" actuatorfrcrange="-1 1"', actuator=f"{tendon}<actuator>{ACTUATORS[kind]}</actuator>")
    assert "damping and actuatorfrcrange and the actuator 'a', which" in refused(lambda: lm.mujoco.attach(given, {"arm": scenario()}))
    arm, plain = (lm.mujoco.attach(given, {"arm": scenario()}, replace=True), lm.mujoco.attach(model(), {"arm": scenario()}))
    arm.data.ctrl[:] = 0.7
    for robot in (arm, plain):
        robot.data.qpos[0] = 1.0
        robot.follow()
        for _ in range(50):
            robot.step([0.01])
    assert arm.data.qpos.tolist() == plain.data.qpos.tolist()


def test_an_actuator_without_a_name_is_named_by_its_number() -> None:
    motor = '<motor joint="arm"/>'
    unnamed = model(actuator=f"<actuator>{motor}{motor}</actuator>")
    for use in (lambda: lm.mujoco.attach(unnamed, {"arm": scenario()}), lambda: lm.mujoco.from_mjcf(unnamed, "arm")):
        assert "(number 1 of 2) and the actuator without a name (number 2 of 2)" in refused(use)


def test_what_cannot_be_taken_off_is_refused() -> None:
    refused(
        lambda: lm.mujoco.attach(model(body='gravcomp="1"', joint='actuatorgravcomp="true"'), {"arm": scenario()}, replace=True),
        reason="actuatorgravcomp",
    )
    delayed = '<actuator><motor name="a" joint="arm" nsample="4" delay="4e-3"/></actuator>'
    assert "actuators with a delay" in refused(lambda: lm.mujoco.attach(model(actuator=delayed), {"arm": scenario()}, replace=True))
    assert "springs that yield" in refused(lambda: lm.mujoco.attach(model(joint='stiffness="3" springyield="0.1"'), {"arm": scenario()}))


test_what_a_robot_cannot_move_is_refused_by_name = refusals_of(
    lambda more: lm.mujoco.attach(model(), {"arm": scenario(**more)}),
    ({"mass_matrices": {"arms": {"shafts": ["arm"], "matrix": [[3.0]]}}, "shafts": {"motor": {}, "arm": {}}}, ": mass_matrices.arms has the inertia of 'arm'"),
    ({"brakes": {"b": {"shaft": "motor", "torque": 1.0}}, "command": {"b": 1.0}}, ": brakes.b needs a command"),
    ({"shafts": {"motor": {}, "arm": {"speed": 0.0}}}, ": shafts.arm.speed gives a motion, which the robot has"),
    ({"controllers": {"m": CONTROLLER | {"position": {"gain": 1.0, "derivative_gain": 0.1, "derivative_weight": 1.0}}}}, ": derivative_weight = 0"),
    ({"shafts": {"motor": {}}, "gears": {}, "slides": {"table": {"mass": 3.0}}, "screws": {"s": {"input": "motor", "output": "table", "lead": 0.01}}}, ": is a hinge, and the train ends at 'table'"),
)  # fmt: skip


def test_an_arm_behind_a_safety_clutch_is_the_joint() -> None:
    # The inertia of the shaft behind the clutch is that of the robot, not another one.
    shafts = {"motor": {}, "out": {"inertia": 1e-4}, "arm": {"inertia": 5.0}}
    parts = {"gears": {"g": {"input": "motor", "output": "out", "ratio": RATIO}}}
    parts["clutches"] = {"safe": {"input": "out", "output": "arm", "torque": 3.0, "kind": "safety"}}
    arm = lm.mujoco.attach(model(gravity=0.0), {"arm": scenario(shafts=shafts, **parts)})
    for _ in range(10):
        arm.step([0.01])
    assert arm.data.qvel[0] == pytest.approx(0.01 * RATIO * 0.01 / (INERTIA + 1e-4 + RATIO**2 * ROTOR), rel=1e-9)


def test_a_scenario_of_two_stages_turns_a_joint_with_its_controller() -> None:
    stages = {
        "shafts": {"motor": {}, "middle": {"inertia": 1e-5}, "arm": {"inertia": 1.0}},
        "gears": {"first": gear_between("motor", "middle", 5.0), "second": gear_between("middle", "arm", 10.0)},
        "controllers": {"m": CONTROLLER},
    }
    arm = lm.mujoco.attach(model(), {"arm": scenario(**stages)})
    for _ in range(3000):
        arm.step([0.5])
    # At rest i k_p (r - q) = m g r sin(q).
    q = arm.data.qpos[0]
    assert abs(arm.data.qvel[0]) < 1e-6
    assert RATIO * 0.1 * (0.5 - q) == pytest.approx(MASS * G * RADIUS * math.sin(q), rel=1e-6)
    assert arm.gear_loss == pytest.approx(np.zeros(1), abs=1e-9)


def test_a_chain_of_gears_that_is_held_stays_where_it_is() -> None:
    soft = {"kind": "linear", "stiffness": 300.0}
    chain = {
        "shafts": {"motor": {"friction_torque": 0.05}, "middle": {"inertia": 1e-5}, "arm": {"inertia": 1.0}},
        "gears": {"first": gear_between("motor", "middle", -5.0, soft), "second": gear_between("middle", "arm", 10.0, soft)},
    }
    arm = lm.mujoco.attach(model(), {"arm": scenario(**chain)})
    arm.data.qpos[0] = 1.2
    arm.follow(held=True)
    torque = MASS * G * RADIUS * math.sin(1.2)
    assert arm.simulation("arm")["second_twist"] == pytest.approx(torque / 300.0, rel=1e-9)
    assert arm.simulation("arm")["first_twist"] == pytest.approx(torque / 10.0 / 300.0, rel=1e-9)
    for _ in range(200):
        arm.step()
    assert arm.data.qpos[0] == pytest.approx(1.2, abs=1e-12)

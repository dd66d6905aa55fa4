"""Drives of the joints that an MJCF model describes: against MuJoCo itself; what is not taken over is refused by name."""

import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from refusals import refused

mujoco = pytest.importorskip("mujoco", reason='pip install "lostmotion[mujoco]"')

JOINT = (
    '<body><joint name="arm" type="hinge" axis="0 1 0" armature="0.1" damping="0.3"/>'
    '<inertial pos="0.1 0 0" mass="1" diaginertia="0.02 0.03 0.02"/></body>'
)
END, STEP = 0.3, 1e-3


def spec(kind: str = "position", change: Callable[[Any, Any], None] = lambda joint, actuator: None) -> Any:
    """A hinge with an actuator, changed."""
    made = mujoco.MjSpec.from_string(f'<mujoco><option timestep="{STEP}"/><worldbody>{JOINT}</worldbody></mujoco>')
    actuator = made.add_actuator(name="servo", target="arm", trntype=mujoco.mjtTrn.mjTRN_JOINT)
    if kind == "position":
        actuator.set_to_position(kp=30.0, kv=1.5)
    elif kind == "velocity":
        actuator.set_to_velocity(kv=2.0)
    else:
        actuator.set_to_motor()
        actuator.gear[0] = 5.0
    change(made.joint("arm"), actuator)
    return made


def moved(made: Any, control: float, begin: float = 0.0) -> float:
    """Where MuJoCo's own actuator brings the joint, with short steps of RK4."""
    made = made.copy()
    made.option.timestep = STEP / 10.0
    made.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    model = made.compile()
    data = mujoco.MjData(model)
    data.qpos[0] = begin
    for _ in range(round(10.0 * END / STEP)):
        data.ctrl[:] = control
        mujoco.mj_step(model, data)
    return float(data.qpos[0])


def exactly(made: Any, control: float, begin: float = 0.0, **options: Any) -> float:
    """Where the drive that the joint describes brings it."""
    arm = lm.mujoco.attach(made, {"arm": lm.mujoco.from_mjcf(made, "arm", **options)}, replace=True)
    arm.data.qpos[0] = begin
    arm.follow()
    for _ in range(round(END / STEP)):
        arm.step([control])
    return float(arm.data.qpos[0])


# A second order scheme at 1 ms against gravity, which turns with the arm, has an error of about 1e-7 rad in 0.3 s.
ACCURACY = 1e-6


def slide(joint: Any, _actuator: Any, stiffness: float = 0.0) -> None:
    joint.type, joint.stiffness[0] = mujoco.mjtJoint.mjJNT_SLIDE, stiffness


SERVOS: dict[str, tuple[str, Callable[[Any, Any], None], float]] = {
    "position": ("position", lambda _j, a: None, 0.7),
    "damping ratio": ("position", lambda _j, a: a.set_to_position(kp=30.0, dampratio=0.4), 0.7),
    "gear": ("position", lambda _j, a: a.gear.__setitem__(0, 3.0), 0.7),
    "negative gear": ("position", lambda _j, a: a.gear.__setitem__(0, -3.0), 0.7),
    "other gain of the control": ("position", lambda _j, a: a.gainprm.__setitem__(0, 20.0), 0.7),
    "velocity": ("velocity", lambda _j, a: None, 1.2),
    "velocity, gear": ("velocity", lambda _j, a: a.gear.__setitem__(0, -2.0), 1.2),
    "motor": ("motor", lambda _j, a: None, 0.2),
    "motor, gain": ("motor", lambda _j, a: a.gainprm.__setitem__(0, -3.0), 0.2),
    "slide": ("position", slide, 0.7),
    "slide, velocity": ("velocity", slide, 1.2),
    "slide, motor": ("motor", slide, 0.2),
    "slide, spring": ("motor", lambda j, a: slide(j, a, 40.0), 0.2),
    "slide, servo and spring": ("position", lambda j, a: slide(j, a, 40.0), 0.7),
}


@pytest.mark.parametrize("name", SERVOS)
def test_a_servo_moves_as_that_of_mujoco(name: str) -> None:
    kind, change, control = SERVOS[name]
    made = spec(kind, change)
    right = moved(made, control)
    assert exactly(made, control) == pytest.approx(right, abs=ACCURACY)
    assert exactly(made, control, ratio=80.0) == pytest.approx(right, abs=ACCURACY)


def simple(joint: Any, _actuator: Any) -> None:
    """Body whose centre of mass is on its joint: MuJoCo takes its inertia, armature included, from the compiled model."""
    joint.parent.ipos = [0.0, 0.0, 0.0]


@pytest.mark.parametrize("kind", ["position", "velocity", "motor"])
def test_the_armature_of_a_simple_body_counts_once(kind: str) -> None:
    made = spec(kind, simple)
    assert made.compile().body_simple[1]
    assert exactly(made, 0.4) == pytest.approx(moved(made, 0.4), abs=ACCURACY)


def limited(key: str, low: float, high: float) -> Callable[[Any, Any], None]:
    def change(joint: Any, actuator: Any) -> None:
        part = joint if key == "actfrc" else actuator
        setattr(part, f"{key}range", [low, high])
        setattr(part, f"{key}limited", mujoco.mjtLimited.mjLIMITED_TRUE)

    return change


@pytest.mark.parametrize("kind", ["position", "velocity", "motor"])
@pytest.mark.parametrize("key", ["ctrl", "force", "actfrc"])
@pytest.mark.parametrize("ratio", [None, 80.0])
def test_limits_act_as_in_mujoco(kind: str, key: str, ratio: float | None) -> None:
    control = {"position": 0.9, "velocity": 3.0, "motor": 0.9}[kind]
    made = spec(kind, limited(key, -0.4, 0.4))
    right = moved(made, control)
    assert abs(right - moved(spec(kind), control)) > 1e-3  # the limit acts
    assert exactly(made, control, ratio=ratio) == pytest.approx(right, abs=ACCURACY)


@pytest.mark.parametrize(("low", "high"), [(-0.1, 0.3), (0.2, 0.9)])
def test_a_limit_of_one_side_is_taken_over_for_a_motor_and_refused_for_a_servo(low: float, high: float) -> None:
    for control in (-2.0, 2.0):
        made = spec("motor", limited("force", low, high))
        assert exactly(made, control) == pytest.approx(moved(made, control), abs=ACCURACY)
        made = spec("position", limited("ctrl", low, high))
        assert exactly(made, control) == pytest.approx(moved(made, control), abs=ACCURACY)
    made = spec("position", limited("force", low, high))
    refused(lambda: lm.mujoco.from_mjcf(made, "arm"), "forcerange", "actuatorfrcrange", match="must be symmetric")


# A value of each attribute that no motor and no servo has unless it is given.
T = mujoco.mjtLimited.mjLIMITED_TRUE
OTHERS: dict[str, Any] = (
    {"actdim": 1, "actearly": True, "actlimited": T, "actrange": [-0.1, 0.1], "armature": 0.05, "cranklength": 0.2}
    | {"ctrllimited": T, "ctrlrange": [-0.2, 0.2], "ctrlspec": 1, "damping": [0.3, 0.2, 0.1], "delay": 2e-3}
    | {"ffrange": [-1.0, 1.0], "forcelimited": T, "forcerange": [-0.5, 0.5], "gear": [2.0, *[0.0] * 5], "group": 2}
    | {"inheritrange": 0.5, "interp": 1, "lengthrange": [-0.1, 0.1], "nsample": 4, "userdata": [3.0], "velrange": [-0.1, 0.1]}
    | {"biasprm": [0.4, -30.0, -1.5, *[0.0] * 7], "dynprm": [0.3, *[0.0] * 9], "gainprm": [20.0, *[0.0] * 9]}
    | {"biastype": mujoco.mjtBias.mjBIAS_NONE, "dyntype": mujoco.mjtDyn.mjDYN_FILTEREXACT}
    | {"gaintype": mujoco.mjtGain.mjGAIN_AFFINE, "trntype": mujoco.mjtTrn.mjTRN_JOINTINPARENT}
)
# Attributes of an actuator that say which one it is, or are objects of the compiler.
NAMES = {"classname", "compiler", "id", "info", "name", "plugin", "refsite", "signature", "slidersite", "target", "type"}


def test_the_attributes_of_actuators_are_all_listed() -> None:
    made = spec()  # without which its actuator is gone
    actuator = made.actuators[0]
    attributes = {a for a in dir(actuator) if not a.startswith("_") and not callable(getattr(actuator, a))}
    assert attributes == set(OTHERS) | NAMES


@pytest.mark.parametrize("kind", ["position", "motor"])
@pytest.mark.parametrize("attribute", sorted(OTHERS))
def test_no_attribute_of_an_actuator_is_dropped(attribute: str, kind: str) -> None:
    def change(joint: Any, actuator: Any) -> None:
        joint.range, joint.limited = [-0.6, 0.6], T  # which inheritrange needs
        if attribute == "delay":
            actuator.nsample = 4
        setattr(actuator, attribute, OTHERS[attribute])

    made = spec(kind, change)
    try:
        model = made.compile()
    except ValueError:
        return  # MuJoCo refuses it
    try:
        found = exactly(made, 0.5)
    except lm.InputError as error:
        keys = error.problems[0].keys
        assert keys, str(error)
        assert hasattr(model, f"actuator_{keys[0]}"), str(error)
        return
    assert found == pytest.approx(moved(made, 0.5), abs=ACCURACY)


REFUSED = {
    "delay": ("position", lambda _j, a: (setattr(a, "nsample", 4), setattr(a, "delay", 2e-3))),
    "dyntype": ("position", lambda _j, a: a.set_to_position(kp=30.0, timeconst=0.1)),
    "gaintype": ("motor", lambda _j, a: a.set_to_pid(kp=3.0)),
    "dampingpoly": ("motor", lambda _j, a: setattr(a, "damping", [0.1, 0.2, 0.0])),
    "gainprm": ("motor", lambda j, a: (limited("ctrl", 0.0, 1.0)(j, a), a.set_to_damper(kv=2.0))),
    "biasprm": ("position", lambda _j, a: a.biasprm.__setitem__(0, 2.0)),
    "damping": ("motor", lambda j, _a: setattr(j, "damping", [0.1, 0.2, 0.0])),
    "stiffness": ("motor", lambda j, _a: setattr(j, "stiffness", [0.1, 0.2, 0.0])),
    "springyield": ("motor", lambda j, _a: (setattr(j, "stiffness", [3.0, 0.0, 0.0]), setattr(j, "springyield", 0.1))),
}


@pytest.mark.parametrize("key", REFUSED)
def test_what_is_not_taken_over_is_refused_by_name(key: str) -> None:
    kind, change = REFUSED[key]
    made = spec(kind, lambda joint, actuator: (change(joint, actuator), None)[1])
    refused(lambda: lm.mujoco.from_mjcf(made, "arm"), key)


def test_other_actuators_are_refused_by_name() -> None:
    """A motor of direct current, one on a tendon, a second one, a disabled one."""
    dc = '<actuator><dcmotor name="a" joint="arm" motorconst="0.05 0.05" resistance="2"/></actuator>'
    rope = '<tendon><fixed name="rope"><joint joint="arm" coef="9"/></fixed></tendon><actuator><motor name="a" tendon="rope"/></actuator>'
    for text, key in ((dc, "(gain|bias|dyn)type"), (rope, "trntype")):
        made = mujoco.MjSpec.from_string(f"<mujoco><worldbody>{JOINT}</worldbody>{text}</mujoco>")
        with pytest.raises(lm.InputError) as caught:
            lm.mujoco.from_mjcf(made, "arm")
        assert re.fullmatch(key, caught.value.problems[0].keys[0])
    made = spec("motor")
    made.add_actuator(name="other", target="arm", trntype=mujoco.mjtTrn.mjTRN_JOINT)
    refused(lambda: lm.mujoco.from_mjcf(made, "arm"), reason="has the actuator 'servo' and the actuator 'other'; leave one of them")
    model = spec("motor").compile()
    model.opt.disableactuator = 1
    refused(lambda: lm.mujoco.from_mjcf(model, "arm"), "disableactuator")


def test_spring_friction_and_armature_of_the_joint_are_those_of_the_drive() -> None:
    def change(joint: Any, actuator: Any) -> None:
        joint.stiffness, joint.springref, joint.frictionloss = [6.0, 0.0, 0.0], 0.4, 0.02
        actuator.armature, actuator.damping = 0.01, [0.02, 0.0, 0.0]

    made = spec("motor", change)
    found = lm.mujoco.from_mjcf(made, "arm", ratio=100.0)
    train = found.drive
    assert train.motors["motor"].rotor_inertia == pytest.approx((0.1 + 25.0 * 0.01) / 100.0**2)
    assert train.shafts["load"].viscous_friction == pytest.approx(0.3 + 25.0 * 0.02)
    assert train.shafts["load"].friction_torque == 0.02
    assert train.springs["joint"].rest_angle == pytest.approx(math.radians(0.4))
    for kind in ("motor", "position"):
        made = spec(kind, lambda joint, actuator: (change(joint, actuator), setattr(joint, "frictionloss", 0.0))[1])
        assert exactly(made, 0.3, 0.2) == pytest.approx(moved(made, 0.3, 0.2), abs=ACCURACY)


@pytest.mark.parametrize("flag", ["DAMPER", "SPRING", "CLAMPCTRL"])
def test_what_the_model_disables_does_not_act(flag: str) -> None:
    def change(joint: Any, actuator: Any) -> None:
        joint.stiffness = [6.0, 0.0, 0.0]
        limited("ctrl", -0.1, 0.1)(joint, actuator)

    made = spec("position", change)
    with_all = moved(made, 0.5)
    made.option.disableflags |= int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag}"))
    right = moved(made, 0.5)
    assert abs(right - with_all) > 1e-5
    assert exactly(made, 0.5) == pytest.approx(right, abs=ACCURACY)


def test_controls_of_other_drives_are_not_limited_by_the_model() -> None:
    made = spec("motor", limited("ctrl", -0.1, 0.1))
    arm = lm.mujoco.attach(made, {"arm": "schaeffler-rt1-h-20-100"}, replace=True)
    arm.step([0.5])
    assert arm["motor_torque"].tolist() == [0.5]
    with pytest.raises(lm.InputError, match="is turned by its control"):
        given = lm.mujoco.from_mjcf(made, "arm")
        lm.mujoco.attach(made, {"arm": given}, {"arm": lm.load("position-axis").controller}, replace=True)
    refused(lambda: lm.mujoco.from_mjcf(spec("position"), "arm", ratio=-3.0), "ratio")
    assert np.isfinite(exactly(spec("motor"), 0.1))

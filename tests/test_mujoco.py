"""Drives in MuJoCo: against closed systems of equations, the exact core and standing still."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import lostmotion as lm

mujoco = pytest.importorskip("mujoco", reason='pip install "lostmotion[mujoco]"')

RATIO, ROTOR = 100.0, 1e-5

HINGE = """
<mujoco><option timestep="{step}" gravity="0 0 0"/><worldbody><body>
  <joint name="hinge" type="hinge" axis="0 0 1"/><inertial pos="0.1 0 0" mass="1" diaginertia="0.02 0.02 0.03"/>
</body></worldbody></mujoco>"""
ARM = """
<mujoco><option timestep="{step}" gravity="0 0 -9.81"/><worldbody>{world}
  <body name="upper"><joint name="shoulder" type="hinge" axis="0 -1 0"/>
    <inertial pos="0.25 0 0" mass="3" diaginertia="0.01 0.06 0.06"/>
    <body name="lower" pos="0.5 0 0"><joint name="elbow" type="hinge" axis="0 -1 0"/>
      <inertial pos="0.2 0 0" mass="2" diaginertia="0.01 0.03 0.03"/>{tip}
    </body></body>
</worldbody></mujoco>"""


def arm_model(step: float, world: str = "", tip: str = "") -> Any:
    return mujoco.MjModel.from_xml_string(ARM.format(step=step, world=world, tip=tip))


def drive(
    stiffness: float = 2e4,
    gap: float = 0.0,
    friction: float = 0.0,
    bearing: float = 0.0,
    hysteresis: float | None = None,
) -> lm.Drive:
    curve = lm.model.LinearStiffness(stiffness=stiffness)
    return lm.Drive(
        motor=lm.Motor(kind="torque_source", rotor_inertia=ROTOR, friction_torque=friction),
        gearbox=lm.Gearbox(
            ratio=RATIO,
            rated_input_speed="3000 rpm",
            rated_output_torque=100.0,
            stiffness=lm.model.TorsionCurve(slopes=(0.0, stiffness), breaks=(gap / 2,)) if gap else curve,
            hysteresis=None if hysteresis is None else lm.model.Hysteresis(efficiency=hysteresis),
            losses=lm.model.ConstantEfficiency(efficiency=1.0),
        ),
        load=lm.Load(inertia=1.0, friction_torque=bearing),
    )


def robot(step: float, one: lm.Drive, **options: Any) -> Any:
    return lm.mujoco.attach(arm_model(step), {"shoulder": one, "elbow": one}, **options)


# --- equations of the arm, written here ---


def inertia_and_bias(q: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """M(q), and Coriolis and gravity torques of the arm of ARM."""
    m1, l1, c1, i1, m2, c2, i2, g = 3.0, 0.5, 0.25, 0.06, 2.0, 0.2, 0.03, 9.81
    c, s = math.cos(q[1]), math.sin(q[1])
    m22 = i2 + m2 * c2**2
    m12 = m22 + m2 * l1 * c2 * c
    m11 = i1 + m1 * c1**2 + m22 + m2 * l1**2 + 2 * m2 * l1 * c2 * c
    turning = m2 * l1 * c2 * s
    outer = m2 * c2 * g * math.cos(q[0] + q[1])
    return np.array([[m11, m12], [m12, m22]]), np.array(
        [
            -turning * (2 * w[0] * w[1] + w[1] ** 2) + (m1 * c1 + m2 * l1) * g * math.cos(q[0]) + outer,
            turning * w[0] ** 2 + outer,
        ]
    )


def gear_torque(twist: np.ndarray, stiffness: float, gap: float) -> np.ndarray:
    return stiffness * np.sign(twist) * np.maximum(np.abs(twist) - 0.5 * gap, 0.0)


def motor_torques(t: float) -> np.ndarray:
    return np.array([0.3, 0.12]) * np.sin(2.0 * math.pi * np.array([1.0, 1.7]) * t)


def reference(step: float, end: float, stiffness: float, gap: float = 0.0) -> np.ndarray:
    """Angles of the joints, by DOP853 from switching to switching, with motor torques held over each step."""

    def rates(_t: float, y: np.ndarray, motor: np.ndarray, side: np.ndarray) -> np.ndarray:
        q, w, p = y[:2], y[2:4], y[4:6]
        mass, bias = inertia_and_bias(q, w)
        torque = stiffness * (p - q - 0.5 * gap * side) * (side != 0 if gap else 1.0)
        return np.concatenate(
            [w, np.linalg.solve(mass, torque - bias), y[6:8], (motor - torque / RATIO) / (ROTOR * RATIO)]
        )

    y = np.zeros(8)
    side = np.zeros(2)
    for k in range(round(end / step)):
        motor, t = motor_torques((k + 0.5) * step), 0.0
        while t < step:
            events = []
            for j in range(2) if gap else ():
                for edge in (-0.5 * gap, 0.5 * gap):

                    def crosses(_t: float, y: np.ndarray, *_: Any, j: int = j, edge: float = edge) -> float:
                        return float(y[4 + j] - y[j] - edge)

                    # Into the gap from outside, or out of it.
                    crosses.terminal = True  # type: ignore[attr-defined]
                    outward = math.copysign(1.0, edge)
                    crosses.direction = -outward if side[j] == outward else outward  # type: ignore[attr-defined]
                    if side[j] in (0.0, outward):
                        events.append((crosses, j, outward))
            found = solve_ivp(
                rates,
                (t, step),
                y,
                method="DOP853",
                rtol=1e-11,
                atol=1e-12,
                args=(motor, side),
                events=[e for e, *_ in events] or None,
            )
            y, t = found.y[:, -1], float(found.t[-1])
            if found.status == 1:
                for (_, j, outward), times in zip(events, found.t_events, strict=True):
                    if times.size:
                        side = side.copy()
                        side[j] = 0.0 if side[j] else outward
    return y[:2]


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


def energy(arm: Any, stiffness: float, gap: float) -> float:
    mujoco.mj_forward(arm.model, arm.data)
    mujoco.mj_energyPos(arm.model, arm.data)
    mujoco.mj_energyVel(arm.model, arm.data)
    twist = np.maximum(np.abs(arm["twist"]) - 0.5 * gap, 0.0)
    return float(
        sum(arm.data.energy) + (0.5 * stiffness * twist**2).sum() + (0.5 * ROTOR * arm["motor_speed"] ** 2).sum()
    )


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


WALL = '<geom name="wall" type="plane" pos="0.75 0 0" zaxis="-1 0 0" size="2 2 0.1" friction="0"/>'
TIP = '<geom name="tip" type="sphere" pos="0.4 0 0" size="0.03" mass="0" friction="0"/>'


def force_on_wall(step: float, stiffness: float, gap: float) -> np.ndarray:
    """Of a tip that torques press against a wall 3 mm before it, without gravity, at t = 0.6, 0.7 ... 1 s."""
    one = drive(stiffness, gap, friction=0.002, bearing=0.5)
    model = arm_model(step, WALL, TIP)
    model.opt.gravity[:] = 0.0
    arm = lm.mujoco.attach(model, {"shoulder": one, "elbow": one})
    arm.data.qpos[:] = 0.8, -1.2
    arm.follow()
    forces = []
    for k in range(round(1.0 / step)):
        push = min(1.0, k * step / 0.3)
        arm.step([-0.07 * push, 0.06 * push])
        found = np.zeros(6)
        if arm.data.ncon:
            mujoco.mj_contactForce(arm.model, arm.data, 0, found)
        forces.append(found[0])
    every = round(0.1 / step)
    return np.array(forces)[6 * every - 1 :: every]


@pytest.mark.parametrize(("stiffness", "gap"), [(2e4, 0.0), (1e5, 1e-3)])
def test_a_tip_presses_against_a_wall_as_with_short_steps(stiffness: float, gap: float) -> None:
    exact = force_on_wall(2e-4, stiffness, gap)
    assert exact.min() > 20.0
    assert force_on_wall(5e-3, stiffness, gap) == pytest.approx(exact, rel=0.05)


# --- states and wrong use ---


def test_a_state_brings_robot_and_drives_back() -> None:
    arm = robot(2e-3, drive(gap=1e-3, friction=0.01))
    for _ in range(20):
        arm.step([0.2, 0.1])
    kept = arm.state
    runs = []
    for _ in range(2):
        arm.state = kept
        for _ in range(30):
            arm.step([-0.1, 0.2])
        runs.append([*arm.data.qpos, *arm["motor_speed"], *arm["twist"]])
    assert runs[0] == runs[1]
    arm.reset()
    assert arm.data.time == 0.0
    assert arm["motor_speed"].tolist() == [0.0, 0.0]


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
    arm = lm.mujoco.attach(
        mujoco.MjModel.from_xml_string(HINGE.format(step=1e-3)), {"hinge": axis.drive()}, {"hinge": axis.controller}
    )
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


@pytest.mark.parametrize(
    ("drives", "options", "message"),
    [
        ({"elbo": drive()}, {}, 'joint "elbo": is not in the model; did you mean elbow'),
        ({"elbow": "no-such-gearbox"}, {}, "neither a scenario nor a gearbox of the catalogue"),
        ({"elbow": 5}, {}, "is no drive"),
        ({}, {}, "name at least one joint"),
        ({"elbow": drive()}, {"substeps": 0}, "must lie between 1 and 1000"),
        ({"elbow": drive(1e12)}, {}, "at most 1000 are made: shorten option.timestep"),
        ({"elbow": drive()}, {"controllers": {"shoulder": None}}, "has no drive; name it in drives"),
    ],
)
def test_wrong_use_is_one_line(drives: Any, options: Any, message: str) -> None:
    with pytest.raises(lm.InputError, match=message) as caught:
        lm.mujoco.attach(arm_model(1e-3), drives, **options)
    assert "\n" not in str(caught.value)


def test_what_would_count_twice_is_refused_or_replaced() -> None:
    text = ARM.format(step=1e-3, world="", tip="").replace(
        "</worldbody>", '</worldbody><actuator><motor name="servo" joint="elbow"/></actuator>'
    )
    text = text.replace('name="elbow" type="hinge"', 'name="elbow" type="hinge" armature="0.1"')
    spec = mujoco.MjSpec.from_string(text)
    with pytest.raises(lm.InputError, match="has armature and the actuator 'servo', which would count twice"):
        lm.mujoco.attach(spec, {"elbow": drive()})
    arm = lm.mujoco.attach(spec, {"elbow": drive()}, replace=True)
    arm.data.ctrl[:] = 100.0
    arm.step()
    plain = lm.mujoco.attach(arm_model(1e-3), {"elbow": drive()})
    plain.step()
    assert arm.data.qpos.tolist() == plain.data.qpos.tolist()


def test_data_that_was_changed_is_noticed() -> None:
    arm = robot(1e-3, drive())
    arm.data.qpos[1] = 0.3
    with pytest.raises(lm.InputError, match=r"joint 'elbow': data has it at 0\.3 rad, .*call follow\(\)"):
        arm.step()
    arm.follow()
    arm.step()
    with pytest.raises(lm.InputError, match="must be 2 finite numbers, for shoulder, elbow"):
        arm.step([1.0])
    with pytest.raises(lm.InputError, match='joint "wrist" has no drive'):
        arm.step({"wrist": 1.0})


def test_a_gearbox_of_the_catalogue_is_attached_by_its_name() -> None:
    arm = lm.mujoco.attach(arm_model(1e-3), {"elbow": "schaeffler-rt1-h-20-100"})
    arm.step({"elbow": 0.2})
    assert arm["motor_torque"].tolist() == [0.2]


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


def test_what_a_reduction_costs_is_stated() -> None:
    found = lm.mujoco.reduce(lm.load("catalogue-robot-joint"), 0.5, 1.0, 10.0)
    assert found.gear < 100.0  # the losses that depend on the load
    assert 1e-3 < found.error < 0.2


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


def test_a_joint_that_describes_no_drive_is_refused() -> None:
    with pytest.raises(lm.InputError, match="joint 'elbow': has no actuator that says the gear; give ratio="):
        lm.mujoco.from_mjcf(arm_model(1e-3), "elbow")
    with pytest.raises(lm.InputError, match="joint 'elbow': has no armature"):
        lm.mujoco.from_mjcf(arm_model(1e-3), "elbow", ratio=100.0)

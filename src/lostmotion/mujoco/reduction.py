"""Drives as the numbers that MuJoCo and URDF have for a joint."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..inputs.argument_checks import checked
from ..inputs.named_elements import Named
from ..inputs.quantities import Frequency, argument
from ..inputs.refusal_messages import shown
from ..model.drive import Drive
from ..model.motor import ShaftMotor
from ..model.train import DriveTrain
from ..simulation.scenario.scenario import Scenario
from ..simulation.stepping.robot_joints import joint_drive, output_of
from .overlaps import loads_of, weights_of, without_weight

STEPS_PER_PERIOD = 2000
FASTEST_SHARE = 0.1  # Bandwidth of the loop that makes the motion, over the natural frequency of the mesh.


@dataclass(frozen=True)
class Reduction:
    """Best description of a drive in MuJoCo for one motion."""

    armature: float  #: inertia of the drive at the joint [kg·m²], at a slide its mass [kg]
    damping: float  #: [N·m·s/rad], at a slide [N·s/m]
    frictionloss: float  #: [N·m] or [N]
    gear: float  #: torque or force on the joint over torque of the motor
    torque_error: float  #: root mean square [N·m] or [N] of what this leaves of the torque or force on the joint
    torque: float
    """root mean square of the torque [N·m] or force [N] on the joint; of the motor there, where the joint moves nothing but the drive"""
    slides: bool = False  #: whether the joint is a slide

    @property
    def error(self) -> float:
        """Share of the torque on the joint that is not described."""
        return self.torque_error / self.torque

    def mjcf(self, joint: str) -> str:
        """The joint and its motor as MJCF."""
        kind = ' type="slide"' if self.slides else ""
        return (
            f'<joint name="{joint}"{kind} armature="{self.armature:.6g}" damping="{self.damping:.6g}" frictionloss="{self.frictionloss:.6g}"/>'
            f"{self._comment()}\n"
            f'<motor name="{joint}" joint="{joint}" gear="{self.gear:.6g}"/>'
        )

    def _comment(self) -> str:
        return f"  <!-- {100.0 * self.error:.0f} % of the torque is not described -->"

    def urdf(self, joint: str) -> str:
        """The joint as URDF, whose dynamics has no armature: it is a comment there."""
        kind, unit = ("prismatic", "kg") if self.slides else ("revolute", "kg m2")
        return (
            f'<joint name="{joint}" type="{kind}">{self._comment()}\n'
            f'  <dynamics damping="{self.damping:.6g}" friction="{self.frictionloss:.6g}"/>  <!-- armature {self.armature:.6g} {unit}, gear {self.gear:.6g} -->\n'
            "</joint>"
        )


@checked
def reduce(
    drive: Drive | DriveTrain | Scenario, amplitude: float, frequency: Frequency, load_torque: float | None = None
) -> Reduction:
    """Describe a drive by armature, damping, friction loss and gear, best for one motion.

    The drive moves its load along a sum of two sines against a constant load torque. The second sine has 2.3 times
    the frequency and a third of the amplitude. Least squares then fit ``gear * motor_torque - armature * a - damping
    * v - frictionloss * sign(v)`` to the torque on the joint.

    Parameters
    ----------
    drive
        With the inertia of its load, and one motor of any kind, which is taken as a torque source.
    amplitude
        Of the joint [rad], of a slide [m].
    frequency
        [Hz]
    load_torque
        Constant torque [N·m] or force [N] against the joint, such as gravity. The efficiency of the gear acts on it. Left out, zero.

    Returns
    -------
    Reduction
        The fitted values, with the error of the torque.

    Raises
    ------
    InputError
        The drive does not follow the motion, its gears swing too slowly for it, or a scenario has a load torque or a weight and
        `load_torque` is left out.
    The motion has no continuation, as where a worm locks.

    Examples
    --------
    >>> import lostmotion as lm
    >>> found = lm.mujoco.reduce(lm.load("catalogue-robot-joint"), 0.5, 1.0)
    >>> print(found.mjcf("elbow"))
    <joint name="elbow" armature="0.45..." damping="3.17..." frictionloss="11.6..."/>  <!-- ... % of the torque is not described -->
    <motor name="elbow" joint="elbow" gear="100"/>
    """
    scenario = Scenario.of_any(drive)
    train = scenario.tables.train()
    joint = output_of("joint", train)
    amplitude = argument("amplitude", amplitude, train.angle_unit(joint))
    given = load_torque is not None
    load_torque = argument("load_torque", 0.0 if load_torque is None else load_torque, train.torque_unit(joint))
    for name, value in (("amplitude", amplitude), ("frequency", frequency)):
        if not value > 0.0:
            raise InputError(f"{name}: {shown(value)} must be positive")
    if not given and (loads := loads_of(scenario) + weights_of("joint", scenario)):
        raise InputError("is not taken over; give load_torque, or leave the key out", *loads)
    source = _torque_source(without_weight("joint", scenario, replace=True, weighs=True).tables.train())
    columns, target, ratio = _along_sines(source, amplitude, frequency, load_torque)
    if load_torque == 0.0:
        # Without a load torque only the product of gear and motor torque counts: the gear is its ratio.
        values = np.array([ratio, *_not_negative(columns[:, 1:], target - ratio * columns[:, 0])])
    else:
        sign = np.array([math.copysign(1.0, ratio), 1.0, 1.0, 1.0])
        values = sign * _not_negative(sign * columns, target)
    left = target - columns @ values
    gear, armature, damping, loss = map(float, values)
    error, torque, at_motor = (float(np.sqrt(np.mean(x * x))) for x in (left, target, gear * columns[:, 0]))
    return Reduction(armature, damping, loss, gear, error, torque or at_motor, train.is_slide(joint))


def _torque_source(train: DriveTrain) -> DriveTrain:
    """The train with a source of torque in place of its motor."""
    turned = {
        name: ShaftMotor(
            kind="torque_source",
            shaft=motor.shaft,
            rotor_inertia=motor.rotor_inertia,
            friction_torque=motor.friction_torque,
        )
        for name, motor in train.motors.items()
    }
    return train.model_copy(update={"motors": Named(turned)})


def _along_sines(
    train: DriveTrain, amplitude: float, frequency: float, load_torque: float
) -> tuple[np.ndarray, np.ndarray, float]:
    """Motor torque, acceleration, speed and its sign (the last three negative), the torque on the joint, over two periods, and the
    ratio of the motor to the joint."""
    step = 1.0 / (STEPS_PER_PERIOD * frequency)
    joint = output_of("joint", train)
    inertia = train.inertia_of(joint)
    made = joint_drive("joint", train, inertia, step, slides=train.is_slide(joint))
    simulation, ratios = made.simulation, made.ratios()
    ((name, motor),) = train.motors.items()
    ratio, command, load = ratios[motor.shaft], train.variable(name, "command"), train.variable(joint, "load_torque")
    if ratio == 0.0:
        raise InputError(f"no fixed ratio leads from the motor {name} to the shaft {joint}; join them by gears")
    motor_angle, motor_turns = train.variable(motor.shaft, "angle"), train.variable(motor.shaft, "speed")
    omega = 2.0 * math.pi * frequency
    bandwidth = 20.0 * omega
    if made.mesh_frequency > 0.0:
        bandwidth = min(bandwidth, FASTEST_SHARE * made.mesh_frequency)
    if bandwidth < 4.0 * omega:
        raise InputError(
            f"frequency {frequency:g} Hz: is too fast for a mesh that swings at {made.mesh_frequency / (2.0 * math.pi):.4g} Hz; give a lower one"
        )
    whole = inertia + made.reflected_inertia
    friction = abs(ratio) * motor.friction_torque
    friction += sum(abs(ratios[key]) * shaft.friction_torque for key, shaft in train.shafts.items())
    rows: list[tuple[float, float, float, float]] = []
    targets: list[float] = []
    farthest = 0.0
    for k in range(4 * STEPS_PER_PERIOD):
        t = (k + 0.5) * step
        q = v = a = 0.0
        for size, w in ((amplitude, omega), (amplitude / 3.0, 2.3 * omega)):
            q += size * (1.0 - math.cos(w * t))
            v += size * w * math.sin(w * t)
            a += size * w * w * math.cos(w * t)
        # By the motor's own angle and speed, which holds a compliant gear in check.
        angle, motor_speed = simulation[motor_angle] / ratio, simulation[motor_turns] / ratio
        speed = simulation[train.variable(joint, "speed")]
        wanted = whole * (a + 2.0 * bandwidth * (v - motor_speed) + bandwidth * bandwidth * (q - angle))
        torque = (wanted + load_torque + math.copysign(friction, v)) / ratio
        simulation.advance(step, **{command: torque / motor.rated_torque, load: load_torque})
        after = simulation[train.variable(joint, "speed")]
        if k >= 2 * STEPS_PER_PERIOD:
            mean, acceleration = 0.5 * (speed + after), (after - speed) / step
            rows.append((torque, -acceleration, -mean, -float(np.sign(mean))))
            targets.append(inertia * acceleration + load_torque)
            farthest = max(farthest, abs(simulation[train.variable(joint, "angle")] - q))
    if farthest > 0.5 * amplitude:
        raise InputError(
            "the joint does not follow the motion; give a larger amplitude, a load torque that it can move, or less friction on it"
        )
    return np.array(rows), np.array(targets), ratio


def _not_negative(columns: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Least squares in which what would be negative is left out, one after the other."""
    scale = np.maximum(np.abs(columns).max(axis=0), 1e-300)
    kept = list(range(columns.shape[1]))
    while True:
        found = np.linalg.lstsq(columns[:, kept] / scale[kept], target, rcond=None)[0] / scale[kept]
        if len(kept) == 1 or found.min() >= 0.0:
            out = np.zeros(columns.shape[1])
            out[kept] = found
            return out
        kept.pop(int(found.argmin()))

"""Two bodies on hinges, a tendon that is a spring between them, friction loss on the first: what MuJoCo can hold of a drive."""

from __future__ import annotations

import mujoco
import numpy as np
from mujoco import rollout


def model_of(drive: object, step: float) -> mujoco.MjModel:
    """A drive with a torque source, a linear stiffness and no losses in the gear."""
    m, g, load = drive.motor, drive.gearbox, drive.load  # type: ignore[attr-defined]

    def body(name: str, inertia: float, damping: float, friction: float) -> str:
        return f"""
        <body name="{name}">
          <inertial pos="0 0 0" mass="1" diaginertia="1e-9 1e-9 1e-9"/>
          <joint name="{name}" type="hinge" axis="0 0 1" armature="{inertia - 1e-9!r}" damping="{damping!r}"
            frictionloss="{friction!r}" solreffriction="{2.0 * step!r} 1" solimpfriction="0.9999 0.9999 1e-6"/>
        </body>"""

    return mujoco.MjModel.from_xml_string(f"""
    <mujoco>
      <option timestep="{step!r}" gravity="0 0 0" integrator="implicitfast">
        <flag contact="disable" constraint="enable"/>
      </option>
      <worldbody>
        {body("shaft", m.rotor_inertia + g.inertia, g.viscous_friction, m.friction_torque)}
        {body("load", load.inertia, load.viscous_friction, load.friction_torque)}
      </worldbody>
      <tendon>
        <fixed name="gear" stiffness="{g.stiffness.stiffness!r}" springlength="0">
          <joint joint="shaft" coef="{1.0 / g.ratio!r}"/><joint joint="load" coef="-1"/>
        </fixed>
      </tendon>
      <actuator><motor joint="shaft" gear="{m.rated_torque!r}"/></actuator>
    </mujoco>""")


def run(
    model: mujoco.MjModel, amplitude: float, frequency: float, samples: int, interval: float
) -> tuple[np.ndarray, np.ndarray]:
    """Load speed and twist at k * interval; the command is held over each step."""
    step = model.opt.timestep
    every = round(interval / step)
    n = every * (samples - 1)
    command = amplitude * np.sin(2.0 * np.pi * frequency * (np.arange(n) + 0.5) * step)
    data = mujoco.MjData(model)
    start = np.zeros((1, mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)))
    states, _ = rollout.rollout(model, data, start, command[None, :, None])
    q, v = states[0, every - 1 :: every, 1:3], states[0, every - 1 :: every, 3:5]
    ratio = 1.0 / model.wrap_prm[0]
    return np.append(0.0, v[:, 1]), np.append(0.0, q[:, 0] / ratio - q[:, 1])

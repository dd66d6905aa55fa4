"""Does the load stay where it is without power? Judged by runs with command 0, from rest and from motion."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..model.signals import Ramp, TorqueSignal
from ..simulation.drive_tables import Initial
from ..simulation.run import run
from ..simulation.scenario import Scenario

MAX_DURATION = 1000.0  # [s]
SAMPLES = 2000
SLOW = 0.01  # of the rated input speed, where the run itself does not move
STEADY = 1e-3  # relative change from one quarter of a run to the next at which the speed is taken to last
RUNAWAY = 30.0  # [s]; a load that still gets faster then is taken to do so without limit
RAMP = 1.0  # [s], of the load torque from 0


@dataclass(frozen=True)
class Holding:
    """Effect of one load torque on the drive with command 0.

    Speeds [rad/s] of the load; 0: it stays, or comes to rest; infinite: it gets ever faster.
    """

    load_torque: float
    """[N·m]"""
    from_rest: float
    """speed at which it drives the load, once raised slowly on the drive at rest"""
    from_motion: float
    """speed that remains where the power fails in motion"""
    begin: float
    """speed [rad/s] at which the power fails"""

    @property
    def holds(self) -> bool:
        """Whether it holds in both cases."""
        return self.from_rest == 0.0 and self.from_motion == 0.0


def holding(scenario: Scenario, load_torque: float, speed: float) -> Holding:
    """Determine the motion of a drive with command 0 under a constant load torque.

    Parameters
    ----------
    load_torque
        [N·m]
    speed
        Magnitude of the load speed at which the power fails [rad/s]; 0: a hundredth of the rated speed. Its direction is that in
        which the load torque drives.

    Raises
    ------
    SolverError
        As `simulate`.
    """
    if scenario.controller is not None:
        scenario = scenario.replace(controller=None)
    g = scenario.gearbox
    begin = (speed or SLOW * g.rated_input_speed / abs(g.ratio)) * (-1.0 if load_torque > 0.0 else 1.0)
    raised = TorqueSignal(ramps=(Ramp(rise=load_torque, duration=RAMP),))
    moving = Initial(motor_speed=begin * g.ratio, load_speed=begin)
    from_rest = _lasting_speed(scenario, raised, Initial())
    from_motion = _lasting_speed(scenario, TorqueSignal(mean=load_torque), moving)
    return Holding(load_torque, from_rest, from_motion, begin)


def _lasting_speed(scenario: Scenario, load_torque: TorqueSignal, start: Initial) -> float:
    """Load speed [rad/s] that remains; 0 if the motor comes to rest, infinite if it does not settle."""
    duration = 4.0 * RAMP
    while True:
        one = scenario.with_inputs(
            command=0.0,
            load_torque=load_torque,
            duration=duration,
            sample_interval=duration / SAMPLES,
            initial=start,
        )
        found = run(one, energy=False)
        angle = found["load_angle"]
        half, quarter = SAMPLES // 2, SAMPLES // 4
        last, before = angle[-1] - angle[-1 - quarter], angle[-1 - quarter] - angle[-1 - half]
        if not found["motor_speed"][-quarter:].any():
            return 0.0
        if abs(last - before) < STEADY * abs(last) or duration > MAX_DURATION:
            return float(last / (0.25 * duration))
        if abs(last) > abs(before) and duration > RUNAWAY:
            return math.copysign(math.inf, last)
        duration *= 2.0

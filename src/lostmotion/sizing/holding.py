"""Does the load stay where it is without power? Judged by runs with command 0, from rest and from motion."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..inputs.named_elements import Named
from ..model.motor import ShaftMotor
from ..model.shaft_ratio import turns
from ..model.signals import ForceSignal, Ramp, TorqueSignal
from ..model.train import DriveTrain
from ..simulation.forms.common_tables import SimulationTable
from ..simulation.forms.train_tables import TrainInitial
from ..simulation.runs.run import run
from ..simulation.scenario.scenario import Scenario

MAX_DURATION = 1000.0  # [s]
SAMPLES = 2000
SLOW = 0.01  # of the rated input speed, where the run itself does not move
STEADY = 1e-3  # relative change from one quarter of a run to the next at which the speed is taken to last
RUNAWAY = 30.0  # [s]; a load that still gets faster then is taken to do so without limit
RAMP = 1.0  # [s], of the load torque from 0
RATED = 300.0  # [rad/s], of a motor whose speed is not known


@dataclass(frozen=True)
class Holding:
    """Effect of one load on the drive with command 0.

    Speeds [rad/s, m/s] of the load; 0: it stays, or comes to rest; infinite: it gets ever faster.
    """

    load: float  # [N·m], of a slide [N]
    from_rest: float  # speed at which it drives the load, once raised slowly on the drive at rest
    from_motion: float  # speed that remains where the power fails in motion
    begin: float  # speed at which the power fails

    @property
    def holds(self) -> bool:
        """Whether it holds in both cases."""
        return self.from_rest == 0.0 and self.from_motion == 0.0


def holding(scenario: Scenario, load: float, speed: float, shaft: str = "load") -> Holding:
    """Determine the motion of a drive with command 0 under a constant load.

    load: [N·m], of a slide [N]
    speed: magnitude of the load's speed at which the power fails [rad/s, m/s]; 0: a hundredth of a rated speed. Its
        direction is that in which the load drives.
    shaft: the shaft or slide that the load acts on.

    Raises SolverError: as `simulate`.
    """
    train, tables = scenario.train(), scenario.tables
    ratios = {name: turns(train, name, shaft) or 0.0 for name in train.shafts}
    (motor,) = train.motors.values()
    begin = (speed or _slow(train, motor, ratios)) * (-1.0 if load > 0.0 else 1.0)
    still = Scenario.of(tables, checked=False).unchecked(controllers=Named({}), command=Named({}))
    moving = [name for name in train.shafts if name not in scenario.core().massless_shafts()]
    speeds = {name: ratios[name] * begin for name in moving}
    start = TrainInitial(
        speeds={name: w for name, w in speeds.items() if not train.is_slide(name)},
        slide_speeds={name: w for name, w in speeds.items() if train.is_slide(name)},
    )
    raised = {"ramps": (Ramp(rise=load, duration=RAMP),)}
    from_rest = _lasting_speed(still, shaft, motor.shaft, raised, TrainInitial())
    from_motion = _lasting_speed(still, shaft, motor.shaft, {"mean": load}, start)
    return Holding(load, from_rest, from_motion, begin)


def _slow(train: DriveTrain, motor: ShaftMotor, ratios: Mapping[str, float]) -> float:
    """A hundredth of the rated speed of a gear or of the motor, at the load."""
    for gear in train.gears.values():
        if gear.rated_input_speed is not None:
            return SLOW * gear.rated_input_speed / abs(ratios[gear.input])
    rated = motor.rated_speed or (motor.limits and motor.limits.max_speed) or RATED
    return SLOW * rated / abs(ratios[motor.shaft])


def _loaded(still: Scenario, shaft: str, load: Mapping[str, Any]) -> dict[str, Any]:
    """The table that changes where this load acts alone; slides have no end and no slope then."""
    if shaft in still.slides:
        slide = still.slides[shaft].unchecked(force=ForceSignal(**load), inclination=0.0, end_stops=None)
        return {"slides": Named({**still.slides, shaft: slide})}
    turned = still.shafts[shaft].unchecked(torque=TorqueSignal(**load), end_stops=None)
    return {"shafts": Named({**still.shafts, shaft: turned})}


def _lasting_speed(
    still: Scenario, shaft: str, motor_shaft: str, load: Mapping[str, Any], start: TrainInitial
) -> float:
    """Load speed [rad/s] that remains; 0 if the motor comes to rest, infinite if it does not settle."""
    duration, train = 4.0 * RAMP, still.train()
    one = still.unchecked(initial=start, **_loaded(still, shaft, load))
    while True:
        table = SimulationTable(duration=duration, sample_interval=duration / SAMPLES)
        found = run(one.unchecked(simulation=table), energy=False)
        angle = found[train.variable(shaft, "angle")]
        half, quarter = SAMPLES // 2, SAMPLES // 4
        last, before = angle[-1] - angle[-1 - quarter], angle[-1 - quarter] - angle[-1 - half]
        if not found[train.variable(motor_shaft, "speed")][-quarter:].any():
            return 0.0
        if abs(last - before) < STEADY * abs(last) or duration > MAX_DURATION:
            return float(last / (0.25 * duration))
        if abs(last) > abs(before) and duration > RUNAWAY:
            return math.copysign(math.inf, last)
        duration *= 2.0

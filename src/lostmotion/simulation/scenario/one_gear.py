"""Scenarios of one motor, one gearbox and one load, whose numbers the core varies by itself in studies."""

from ...control.continuous import ContinuousController
from ...model.gear import Gear
from ...model.shaft import Shaft
from ...model.train import TrainElements
from ..forms.key_aliases import GEARBOX, LOAD, MOTOR
from .scenario import Scenario

OTHERS = tuple(table for table in TrainElements.model_fields if table not in ("motors", "gears"))


def drive_keys(scenario: Scenario) -> dict[str, str]:
    """Keys of a motor, a gear and its output shaft in the long form, and what a drive calls them."""
    train = scenario.train()
    ((motor, _),), ((gear, between),) = train.motors.items(), train.gears.items()
    load = between.output
    found = {f"shafts.{load}": LOAD, f"gears.{gear}": GEARBOX, f"motors.{motor}": MOTOR, f"command.{motor}": "command"}
    return found | {
        f"slides.{load}.mass": f"{LOAD}.inertia",
        f"slides.{load}.friction_force": f"{LOAD}.friction_torque",
    }


def has_one_gear(scenario: Scenario) -> bool:
    """Whether it is one motor that turns one load through one gearbox."""
    train = scenario.train()
    others = (name for table in OTHERS for name in getattr(train, table))
    if any(others) or scenario.slides or scenario.given():
        return False
    if (len(train.motors), len(train.gears), len(train.shafts)) != (1, 1, 2):
        return False
    ((motor_name, motor),), (gear,) = train.motors.items(), train.gears.values()
    controlled = isinstance(scenario.controllers.get(motor_name), ContinuousController)
    return motor.shaft == gear.input and not controlled and _is_gearbox(gear) and _are_plain(scenario, gear)


def _is_gearbox(gear: Gear) -> bool:
    rated = gear.rated_input_speed is not None and gear.rated_output_torque is not None
    more = gear.housing is not None or gear.transmission_error is not None
    return rated and not more and gear.losses.kind in ("map", "constant_efficiency")


def _are_plain(scenario: Scenario, gear: Gear) -> bool:
    """Whether its shafts have no more than the input and the load of a drive."""
    shafts, plain = scenario.train().shafts, ("inertia", "viscous_friction", "friction_torque")
    return gear.input not in scenario.loads() and all(
        Shaft.like(shafts[shaft]) == Shaft().model_copy(update={key: getattr(shafts[shaft], key) for key in taken})
        for shaft, taken in ((gear.input, plain[:1]), (gear.output, plain))
    )

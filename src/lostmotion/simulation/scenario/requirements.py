"""Requirements of functions on scenarios, with the line that refuses another one."""

from collections.abc import Callable, Iterator

from ...errors import InputError
from ...model.torsion import Rigid
from ...model.train import DriveTrain
from .scenario import Scenario


def need_open_loop(scenario: Scenario, function: str) -> None:
    """Refuses a scenario with controllers, for what follows given commands alone."""
    if scenario.axes():
        table = scenario.key_in_file(scenario.controller_key(next(iter(scenario.axes())))).partition(".")[0]
        none = "None" if table == "controller" else "{}"
        has = f"a {table}" if table == "controller" else table
        raise InputError(
            f"{function}: the scenario has {has}, and commands are to be given here; without controllers it is "
            f"scenario.replace({table}={none}), or in a file [command] over its base"
        )


def need_no_impacts(scenario: Scenario | DriveTrain, function: str) -> None:
    """Refuses a train with rigid flanks or end stops that strike, for what takes motions without impacts."""
    in_file: Callable[[str], str] = str
    if isinstance(scenario, Scenario):
        train, gears, in_file = scenario.train(), scenario.gears_by_key(), scenario.key_in_file
    else:
        train, gears = scenario, {f"gears.{name}": gear for name, gear in scenario.gears.items()}
    for key, gear in gears.items():
        if isinstance(gear.stiffness, Rigid) and gear.stiffness.strikes:
            remedy = (
                "a stiffness" if key.startswith(("screws.", "racks.", "belts.")) else 'a stiffness of the kind "curve"'
            )
            raise InputError(
                f"{function}: {in_file(key)} has rigid flanks with backlash, and this takes no impacts; give it {remedy} in place of "
                "the restitution"
            )
    for key, coupling in train.couplings():
        if coupling.strikes:
            raise InputError(
                f"{function}: {in_file(key)} strikes, and this takes no impacts; take a freewheel in its place"
            )
    for name, shaft in train.shafts.items():
        if shaft.end_stops is not None and shaft.end_stops.stiffness is None:
            key = in_file(f"{'slides' if train.is_slide(name) else 'shafts'}.{name}.end_stops")
            raise InputError(f"{function}: {key} are rigid, and this takes no impacts; give them a stiffness")


def wound(scenario: Scenario) -> Iterator[str]:
    """Names of the steppers whose current follows their winding."""
    motors = scenario.tables.motors.items()
    return (name for name, m in motors if m.kind == "stepper" and m.supply_voltage is not None)


def need_ideal_current(scenario: Scenario, function: str) -> None:
    """Refuses steppers with a winding, whose torque is a product of states: no regime of the exact solver is linear then."""
    for name in wound(scenario):
        raise InputError(
            f"{function}: the torque of a winding is a product of current and angle, which only runs of the adaptive solver have; leave it out for an ideal current",
            f"{scenario.motor_key(name)}.supply_voltage",
        )


def need_free_motion(scenario: Scenario, function: str) -> None:
    """Refuses a train in which the motion of a shaft is given or flanks strike, for what torques alone are to move."""
    need_no_impacts(scenario, function)
    need_ideal_current(scenario, function)
    if given := scenario.given():
        raise InputError(
            f"{function}: key {scenario.given_key(given[0])} gives the motion of a shaft, which torques are to move here; leave it out"
        )

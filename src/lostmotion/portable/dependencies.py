"""Structure of the equations of an FMU: inputs and states on which outputs and derivatives depend at once, in any regime."""

from collections.abc import Collection, Iterator, Mapping

from ..model.train import COUPLINGS, ON_SHAFTS, DriveTrain
from ..simulation.scenario.scenario import Scenario


def dependencies_of(scenario: Scenario, states: Collection[str], inputs: Collection[str]) -> dict[str, list[str]]:
    """Inputs and states by the names of outputs, and of derivatives as ``der(NAME)``; what is not among them may depend on all.

    A state as an output has none: it depends on no input at once, and no other state. Shafts that something may join
    rigidly, such as a stuck contact, accelerate together.
    """
    if scenario.continuous() or scenario.given():
        return {}
    train = scenario.train()
    equations = _Equations(scenario, train)
    known = [*inputs, *states]
    found: dict[str, set[str]] = {name: set() for name in equations.moving}
    angles = {name for shaft in train.shafts if (name := train.variable(shaft, "angle")) in states}
    twists = {train.variable(gear, "twist") for gear in train.gears}
    for shaft in train.shafts:
        angle = train.variable(shaft, "angle")
        found |= {
            f"der({angle})": {train.variable(shaft, "speed")},
            f"der({train.variable(shaft, 'speed')})": equations.of([shaft]),
        }
        found.setdefault(angle, angles | twists)
        found.setdefault(train.variable(shaft, "speed"), equations.of([shaft]))
        found[train.variable(shaft, "contact_torque")] = equations.of([shaft])
    for name, motor in train.motors.items():
        torque, of_motor = (
            train.variable(name, "torque"),
            {train.variable(name, "command"), train.variable(motor.shaft, "speed")},
        )
        found[f"der({torque})"] = of_motor | {torque}
        found.setdefault(torque, of_motor)
    for name, gear in train.gears.items():
        ends = [gear.input, gear.output, *filter(None, [gear.housing])]
        found[f"der({train.variable(name, 'twist')})"] = set().union(*(equations.speeds(shaft) for shaft in ends))
        found[train.variable(name, "output_torque")] = found[train.variable(name, "input_torque")] = equations.of(ends)
    return {name: [k for k in known if k in needed] for name, needed in found.items()}


class _Equations:
    """Numbers that decide the accelerations of shafts."""

    def __init__(self, scenario: Scenario, train: DriveTrain) -> None:
        self._train, self.moving = train, set(scenario.core().moving_states())
        self._massless = set(scenario.core().massless_shafts())
        self._group = {shaft: {shaft} for shaft in train.shafts}
        contacts = scenario.core().contact_names()
        for name, gear in train.gears.items():
            twist = train.variable(name, "twist")
            if twist not in self.moving or train.variable(name, "twist_contact") in contacts:
                self._join(gear.input, gear.output, *filter(None, [gear.housing]))
        for one, other, _ in (*train.held_together(), *train.inertia_couplings()):
            self._join(one, other)
        for shafts in self._beside():
            if not self._massless.isdisjoint(shafts):
                self._join(*shafts)

    def _beside(self) -> Iterator[list[str]]:
        """Shafts between which a torque acts."""
        for table in ("gears", *COUPLINGS):
            for element in getattr(self._train, table).values():
                yield [element.input, element.output, *filter(None, [getattr(element, "housing", None)])]

    def _join(self, *shafts: str) -> None:
        together = set().union(*(self._group[shaft] for shaft in shafts))
        self._group |= dict.fromkeys(together, together)

    def speeds(self, shaft: str) -> set[str]:
        """Numbers that the speed of a shaft depends on: itself, or without inertia the balance of torques."""
        return (
            {self._train.variable(shaft, "speed")}
            if self._train.variable(shaft, "speed") in self.moving
            else self.of([shaft])
        )

    def of(self, shafts: Collection[str]) -> set[str]:
        """Names of all that acts on these shafts, and on the shafts that move with them."""
        train, group = self._train, set().union(*(self._group[shaft] for shaft in shafts))
        found = {train.variable(shaft, "load_torque") for shaft in group}
        for others in self._beside():
            if not group.isdisjoint(others):
                found |= {train.variable(shaft, "speed") for shaft in others}
        found |= {train.variable(shaft, "speed") for shaft in group}
        for name, motor in train.motors.items():
            if motor.shaft in group:
                torque = train.variable(name, "torque")
                found |= {torque} if torque in self.moving else {train.variable(name, "command")}
        for name, gear in train.gears.items():
            if not group.isdisjoint([gear.input, gear.output, gear.housing]):
                found |= {train.variable(name, "twist"), train.variable(gear.input, "angle")}
                found |= set() if gear.housing is None else {train.variable(gear.housing, "angle")}
        for table in ON_SHAFTS:
            on_shafts: Mapping[str, object] = getattr(train, table)
            for name, element in on_shafts.items():
                if (shaft := str(getattr(element, "shaft", ""))) in group:
                    found |= {train.variable(shaft, "angle"), train.variable(name, "command")}
        for name, clutch in train.clutches.items():
            if not group.isdisjoint([clutch.input, clutch.output]):
                found.add(train.variable(name, "command"))
        return found

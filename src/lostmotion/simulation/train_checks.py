"""Checks of a scenario in the long form that involve several of its tables."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any

from ..control.axis import check_torques
from ..errors import InputError
from ..inputs.validation import did_you_mean, shown
from ..model.linear_train import LinearElements
from ..model.signals import CommandSignal
from .given_motion import check_continuous
from .scenario import Scenario
from .train_tables import LINEAR_INITIAL, ShaftTable, SlideTable, TrainInitial


class TrainChecks(Scenario, LinearElements):
    """Base of scenarios in the long form: the checks of their shafts, motions and controllers."""

    if TYPE_CHECKING:
        shafts: Mapping[str, ShaftTable]
        slides: Mapping[str, SlideTable]
        command: Mapping[str, CommandSignal]
        controllers: Mapping[str, Any]
        initial: TrainInitial

        def controlled(self, motor: str) -> str: ...
        def initial_key(self, key: str, shaft: str) -> str: ...
        def _tables(self) -> dict[str, ShaftTable | SlideTable]: ...
        def _kind(self, shaft: str) -> str: ...

    def _check_shafts(self) -> None:
        if not self.shafts and not self.slides:
            raise InputError(
                "there is neither a shaft nor a slide; add [shafts.NAME] or [slides.NAME]", keys=("shafts",)
            )
        for name, shaft in self.shafts.items():
            if shaft.domain != "rotation":
                raise InputError(
                    f"is translation; write the slide as [slides.{name}], with its mass",
                    keys=(f"shafts.{name}.domain",),
                )
        self.check_places(self.shafts, self.slides)
        for name, mass in self.mass_matrices.items():
            for slide in mass.shafts:
                if slide in self.slides and self.slides[slide].inclination != 0.0:
                    raise InputError(
                        "the weight of a slide follows from its mass, "
                        "which the matrix holds; leave the inclination out and give the weight in slides."
                        f"{slide}.force",
                        keys=(f"mass_matrices.{name}", f"slides.{slide}.inclination"),
                    )
        for key, linear in LINEAR_INITIAL.items():
            of_slides = self.linear_drives() if key in ("twists", "hysteresis_capacities") else self.slides
            for given, other in ((key, linear), (linear, key)):
                for name in getattr(self.initial, given):
                    if (name in of_slides) == (given == key):
                        what = (
                            "moves along a straight line"
                            if given == key
                            else "is none that moves along a straight line"
                        )
                        raise InputError(
                            f"{shown(name)} {what}; give initial.{other}.{name}", keys=(f"initial.{given}.{name}",)
                        )

    def _check_given(self) -> None:
        for name in self.given():
            key, shaft = self.given_key(name), self._tables()[name]
            if shaft.speed is not None and shaft.motion is not None:
                raise InputError(
                    "both give the motion; leave one out",
                    keys=(f"{key.removesuffix('.motion')}.speed", key),
                )
            if name in self.initial.of_all("speeds"):
                how = "moves" if name in self.slides else "turns"
                raise InputError(
                    f"both say how fast the {self._kind(name)} {how} at t = 0; leave the initial speed out",
                    keys=(key, self.initial_key("speeds", name)),
                )
            if shaft.motion is None:
                continue
            if name in self.initial.of_all("angles"):
                raise InputError(
                    f"both say where the {self._kind(name)} is at t = 0; leave the initial one out",
                    keys=(key, self.initial_key("angles", name)),
                )
            try:
                check_continuous(shaft.motion, "m" if name in self.slides else "rad")
            except ValueError as problem:
                raise InputError(str(problem), keys=(key,)) from None

    def _check_massless(self, massless: Collection[str]) -> None:
        for key in ("speeds", "slide_speeds"):
            for name in getattr(self.initial, key):
                if name in massless:
                    raise InputError(
                        f"{name} has no inertia, and its speed follows from the torques on it; leave "
                        "it out, or give an inertia",
                        keys=(f"initial.{key}.{name}",),
                    )
        train = self.train()
        for motor, controller in self.axes().items():
            encoders = [e.shaft for e in (controller.encoder, controller.position_encoder) if e is not None]
            for name in {train.motors[motor].shaft, self.controlled(motor), *filter(None, encoders)}:
                if name in massless:
                    raise InputError(
                        f"measures or turns {name}, which has no inertia; give it one", keys=(f"controllers.{motor}",)
                    )

    def _check_controllers(self) -> None:
        motors = self.train().motors
        for name in self.controllers:
            if name not in motors:
                meant = did_you_mean(name, motors, f"the motors are {', '.join(motors) or 'none'}")
                raise InputError(f"is no motor of this train; {meant}", keys=(f"controllers.{name}",))
            if name in self.command:
                raise InputError(
                    "both turn the same motor; leave one of them out",
                    keys=(f"command.{name}", f"controllers.{name}"),
                )
        check_torques(self.axes(), self.initial.motor_torques, "initial.motor_torques.{}")

"""A drive train: shafts joined by gears, clutches and dampers, turned by motors, held by brakes, as frozen objects in SI units."""

from collections.abc import Collection, Iterator, Mapping
from typing import Any, ClassVar, Self, get_args

from pydantic import Field, model_validator

from .. import _core
from ..errors import InputError
from ..inputs.named_elements import Elements, nothing
from ..inputs.part import Part
from ..inputs.refusal_messages import did_you_mean, shown
from .angle_torques import AngleTorque, Gravity
from .couplings import BetweenShafts, Brake, Clutch, Commanded, Freewheel, Ratchet, TorqueLimiter
from .dampers import Damper
from .end_stops import END_STOP
from .gear import Gear
from .mass_matrix import MassMatrix
from .motor import MotorLaw, ShaftMotor
from .shaft import Shaft
from .springs import Spring
from .torsion import Rigid


class TrainElements(Part):
    """The elements of a drive train besides its shafts."""

    mass_matrices: Elements[MassMatrix] = Field(default_factory=nothing)
    motors: Elements[ShaftMotor] = Field(default_factory=nothing)
    gears: Elements[Gear] = Field(default_factory=nothing)
    brakes: Elements[Brake] = Field(default_factory=nothing)
    clutches: Elements[Clutch] = Field(default_factory=nothing)
    freewheels: Elements[Freewheel] = Field(default_factory=nothing)
    dampers: Elements[Damper] = Field(default_factory=nothing)
    torque_limiters: Elements[TorqueLimiter] = Field(default_factory=nothing)
    ratchets: Elements[Ratchet] = Field(default_factory=nothing)
    gravity: Elements[Gravity] = Field(default_factory=nothing)
    angle_torques: Elements[AngleTorque] = Field(default_factory=nothing)
    springs: Elements[Spring] = Field(default_factory=nothing)

    def key_of(self, table: str, name: str) -> str:
        """Key in a file of an element that the core has under this name in one of its tables."""
        if table == "end_stops":
            return f"{self.key_of('shafts', name.removesuffix(END_STOP))}.end_stops"
        written = (t for t, of_core in ON_SHAFTS.items() if of_core == table and name in getattr(self, t))
        return f"{next(written, table)}.{name}"

    def check(self, core: _core.Train) -> None:
        """Refuse a train that was made of these tables and cannot move, or whose motion is not determined.

        Raises InputError: with the key of the element, what is wrong with it, and the remedy.
        """
        if fault := core.check():
            table, name, reason = fault
            raise InputError(reason, *((self.key_of(table, name),) if table else ()))

    def commanded(self) -> list[str]:
        """Names of what has a command: motors, brakes and friction clutches."""
        return [*self.motors, *self.switched()]

    def switched(self) -> dict[str, str]:
        """Keys of brakes and friction clutches by their names."""
        elements = (*self.on_shafts(), *self.couplings())
        keys = (key for key, e in elements if isinstance(e, Commanded) and getattr(e, "kind", "") != "safety")
        return {key.partition(".")[2]: key for key in keys}

    def fixed_gears(self) -> dict[str, Gear]:
        """Gears whose housing stands: the speeds of their two shafts have the ratio."""
        return {name: gear for name, gear in self.gears.items() if gear.housing is None}

    def held_together(self) -> list[tuple[str, str, float]]:
        """(input, output, 1) of what may hold two shafts at one speed, such as clutches and freewheels."""
        return [(c.input, c.output, 1.0) for _, c in self.couplings() if c.holds]

    def couplings(self) -> Iterator[tuple[str, BetweenShafts]]:
        """Key and element of all that joins two shafts and is no gear."""
        for table in COUPLINGS:
            yield from ((f"{table}.{name}", element) for name, element in getattr(self, table).items())

    def on_shafts(self) -> Iterator[tuple[str, Any]]:
        """Key and element of all that acts on one shaft and is no motor."""
        for table in ON_SHAFTS:
            yield from ((f"{table}.{name}", element) for name, element in getattr(self, table).items())

    def references(self) -> Iterator[tuple[str, str]]:
        """Each key that names a shaft, and the name."""
        for name, mass in self.mass_matrices.items():
            yield from ((f"mass_matrices.{name}.shafts.{k}", shaft) for k, shaft in enumerate(mass.shafts))
        for table in TrainElements.model_fields:
            for name, element in getattr(self, table).items():
                for key in ("shaft", "input", "output", "housing"):
                    if getattr(element, key, None) is not None:
                        yield f"{table}.{name}.{key}", getattr(element, key)


def _tables_of(*keys: str, without: type[Part]) -> Iterator[tuple[str, type[Part]]]:
    """Tables of the elements that have these keys, and their parts; of several kinds the first."""
    for table, field in TrainElements.model_fields.items():
        part: Any = get_args(field.annotation)[1]
        while not hasattr(part, "model_fields"):
            part = get_args(part)[0]
        if set(keys) <= part.model_fields.keys() and not issubclass(part, without):
            yield table, part


# What acts on one shaft: tables, and what the core calls them (core/lostmotion/model/train.hpp).
ON_SHAFTS = {table: getattr(part, "table_of_core", table) for table, part in _tables_of("shaft", without=ShaftMotor)}

# What joins two shafts and is no gear: tables, by the names that the core has for them.
COUPLINGS = tuple(table for table, _ in _tables_of("input", "output", without=Gear))


# Quantities of gears, whose names follow the shaft that they act on,
# and those of the sampled controllers of motors, the same in every domain.
OF_GEARS = ("twist", "twist_contact", "hysteresis_capacity", "output_torque", "input_torque")
OF_CONTROLLERS = {
    "reference",
    "pointing_error",
    *(name for name, *_ in (*_core.axis_signals(), *_core.winding_signals())),
}


class DriveTrain(TrainElements):
    """A drive train: shafts, gears, clutches and dampers between them, motors, brakes and torques over angle.

    Examples
    --------
    >>> import lostmotion as lm
    >>> list(lm.load("worm-lowering").train().gears)
    ['coupling', 'worm_gear']
    """

    aliases: ClassVar[Mapping[str, str]] = {}
    """entries of its results with another name than the core gives them; empty: not shown"""
    shafts: Elements[Shaft] = Field(min_length=1)

    def is_slide(self, shaft: str) -> bool:
        """Whether it moves along a straight line."""
        return self.shafts[shaft].domain == "translation"

    def inertia_of(self, shaft: str) -> float:
        """Inertia [kg·m²] of a shaft, mass [kg] of a slide, without rotors and gears: its own or on the diagonal of a mass matrix."""
        held = [mass.of(shaft, shaft) for mass in self.mass_matrices.values() if shaft in mass.shafts]
        return held[0] if held else self.shafts[shaft].inertia

    def refuse_coupled(self, shafts: Collection[str], what: str) -> None:
        """Refuse shafts that a mass matrix couples to others, for what takes each inertia by itself.

        Parameters
        ----------
        what
            What does, and the remedy.
        """
        for name, mass in self.mass_matrices.items():
            for one, other, _ in mass.couples():
                if one in shafts or other in shafts:
                    raise InputError(f"couples {other} and {one}; {what}", f"mass_matrices.{name}")

    def inertia_couplings(self) -> list[tuple[str, str, float]]:
        """(one, other, entry) of all that mass matrices couple, each pair once."""
        return [pair for mass in self.mass_matrices.values() for pair in mass.couples()]

    # Names of result variables, as the core has them (core/lostmotion/model/names.cpp).

    def shown(self, name: str) -> str:
        """The name that an entry of results has; empty: it is not shown."""
        return self.aliases.get(name, name)

    def variable(self, element: str, quantity: str) -> str:
        """The name that a quantity of an element has in results, such as `angle` of a shaft: NAME_angle, of a slide NAME_position."""
        if quantity in OF_CONTROLLERS:
            return self.shown(f"{element}_") + quantity
        name = _core.result_name(element, quantity, self._is_linear(element, quantity))
        return self.shown(name) or name

    def shaft_of(self, variable: str, *quantities: str) -> str:
        """The shaft whose quantity, one of these, has this name in results; empty: there is none."""
        return next((s for s in self.shafts if any(self.variable(s, q) == variable for q in quantities)), "")

    def _is_linear(self, element: str, quantity: str) -> bool:
        """Whether a quantity is one of translation: a torque is a force, and so on."""
        shaft = element.removesuffix(END_STOP)
        if quantity in OF_GEARS and element in self.gears:
            shaft = self.gears[element].input if quantity == "input_torque" else self.gears[element].output
        elif quantity == "torque" and element in self.motors:
            shaft = self.motors[element].shaft
        return shaft in self.shafts and self.is_slide(shaft)

    def flanks(self) -> dict[str, tuple[str, float, float]]:
        """Contacts that touch or part, where others stick or slip: what moves between them, and its least and largest value."""
        found = {
            self.variable(name, "twist_contact"): (
                self.variable(name, "twist"),
                -0.5 * law.backlash,
                0.5 * law.backlash,
            )
            for name, law in ((name, gear.stiffness) for name, gear in self.gears.items())
            if isinstance(law, Rigid) and law.strikes
        }
        for name, shaft in self.shafts.items():
            if (stops := shaft.end_stops) is not None and stops.stiffness is None:
                found[self.variable(name + END_STOP, "contact")] = (
                    self.variable(name, "angle"),
                    stops.lower,
                    stops.upper,
                )
        return found

    def torque_word(self, shaft: str) -> str:
        """Torque or force."""
        return "force" if self.is_slide(shaft) else "torque"

    def angle_unit(self, shaft: str) -> str:
        """Unit of the angle of a shaft, or of the position of a slide."""
        return "m" if self.is_slide(shaft) else "rad"

    def speed_unit(self, shaft: str) -> str:
        """Unit of its speed."""
        return f"{self.angle_unit(shaft)}/s"

    def torque_unit(self, shaft: str) -> str:
        """Unit of torques on a shaft, or of forces on a slide."""
        return "N" if self.is_slide(shaft) else "N*m"

    def __repr__(self) -> str:
        names = {table: ", ".join(getattr(self, table)) for table in ("shafts", *TrainElements.model_fields)}
        return f"DriveTrain({'; '.join(f'{table} {listed}' for table, listed in names.items() if listed)})"

    @classmethod
    def of_tables(cls, **parts: Any) -> Self:
        """The train of parts that are not checked again. Whether it moves is left to a check that knows given motions."""
        made = cls.model_construct(None, **parts)
        made._names_what_it_has()
        return made

    @model_validator(mode="after")
    def _hangs_together(self) -> Self:
        self._names_what_it_has()
        self.check(self.core(self.shafts))
        return self

    def _names_what_it_has(self) -> None:
        known = f"the shafts are {', '.join(self.shafts)}"
        unknown = [
            (f"{shown(shaft)} is no shaft; {did_you_mean(shaft, self.shafts, known)}", key)
            for key, shaft in self.references()
            if shaft not in self.shafts
        ]
        if unknown:
            raise InputError(*unknown[0], more=len(unknown) - 1)
        if twice := [name for name in self.gravity if name in self.angle_torques]:
            raise InputError(
                "have the same name; rename one of them", f"gravity.{twice[0]}", f"angle_torques.{twice[0]}"
            )

    def core(
        self, loaded: Collection[str], driven: Mapping[str, MotorLaw | None] = {}, given: Collection[str] = ()
    ) -> _core.Train:
        """The solver's train, where a load torque acts on some of the shafts, and current loops change the law of some motors.

        The motion of the shafts named in `given` is an input.
        Controllers keep to the torque_limit of the motors that such loops drive.
        """
        train = _core.Train()
        train.name_as(list(self.aliases.items()))
        for name, s in self.shafts.items():
            inputs = {"loaded": name in loaded, "given_motion": name in given}
            train.add_shaft({"name": name, **s.core_fields(), **inputs})
        for name, mass in self.mass_matrices.items():
            train.add_mass_matrix(name, mass.shafts, mass.matrix)
        for name, m in self.motors.items():
            law = driven.get(name)
            train.add_motor(name, shaft=m.shaft, fields=m.as_dc().core_fields() | dict(() if law is None else law))
        for name, g in self.gears.items():
            train.add_gear(name, input=g.input, output=g.output, fields=g.core_fields())
            if g.housing is not None:
                train.set_housing(name, g.housing)
        for table in COUPLINGS:
            for name, coupling in getattr(self, table).items():
                ends = {"input": coupling.input, "output": coupling.output}
                train.add_coupling(table, name, **ends, fields=coupling.core_fields())
        for table, kind in ON_SHAFTS.items():
            for name, element in getattr(self, table).items():
                train.add(kind, name, shaft=element.shaft, fields=element.core_fields())
        for name, s in self.shafts.items():
            if s.end_stops is not None:
                train.add("end_stops", name + END_STOP, shaft=name, fields=s.end_stops.core_fields())
        return train

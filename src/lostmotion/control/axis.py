"""Controllers on a drive train, as the solver takes them."""

from __future__ import annotations

import dataclasses
import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from .. import _core
from ..errors import InputError
from ..inputs.validation import did_you_mean, shown
from ..model.motor import Motor
from ..model.parameters import MotorLaw
from ..model.train import DriveTrain
from ..reproducible import expm1
from .camera import core_camera, core_tracker
from .continuous import ContinuousController
from .controller import Controller
from .filters import core_filter
from .law import Law
from .loops import CurrentLoop, FieldOriented, FirstOrderCurrent, VoltageCommand
from .sample_times import whole_multiple

Bound = tuple[float, list[tuple[_core.Axis, int, int, int, int]]]
"""base tick [s]; of each axis the controller, its motor, the shafts of the position's and of the speed's encoder, and that of its reference"""
OPEN_LOOP: Bound = (1.0, [])
NO_LAWS: Mapping[str, Law] = MappingProxyType({})


def turns(train: DriveTrain, start: str, end: str) -> float | None:
    """How often shaft `start` turns for one turn of `end`, through gears and clutches; None if none lead there."""
    found, waiting = {start: 1.0}, [start]
    joints = [(g.input, g.output, g.ratio) for g in train.fixed_gears().values()]
    joints += train.held_together()
    while waiting:
        here = waiting.pop()
        for one, other, ratio in joints:
            for a, b, i in ((one, other, ratio), (other, one, 1.0 / ratio)):
                if a == here and b not in found:
                    found[b] = found[a] * i
                    waiting.append(b)
    return found.get(end)


@dataclass(frozen=True)
class _Place:
    """Where a controller is in a train."""

    train: DriveTrain
    name: str
    controller: Controller

    @property
    def motor(self) -> Motor:
        return self.train.motors[self.name]

    @property
    def motor_shaft(self) -> str:
        return self.train.motors[self.name].shaft

    @property
    def shaft(self) -> str:
        return self.known("shaft", self.controller.shaft, list(self.train.shafts)[-1])

    def known(self, key: str, shaft: str | None, default: str) -> str:
        if shaft is None:
            return default
        if shaft not in self.train.shafts:
            meant = did_you_mean(shaft, self.train.shafts, f"the shafts are {', '.join(self.train.shafts)}")
            raise InputError(f"{key}: {shown(shaft)} is no shaft; {meant}")
        return shaft

    def ratio(self, start: str, end: str, key: str) -> float:
        i = turns(self.train, start, end)
        if i is None:
            raise InputError(f"{key}: no gear leads from the shaft {start} to {end}; name a shaft that the motor turns")
        return i

    def encoder_shaft(self, key: str) -> str:
        encoder = getattr(self.controller, key)
        return self.known(f"{key}.shaft", None if encoder is None else encoder.shaft, self.motor_shaft)

    def axis(self, ticks: int) -> _core.Axis:
        """The solver's controller; `ticks` of the base tick are its sample time."""
        c = self.controller
        out = _core.Axis()
        out.mode = getattr(_core.Axis.Mode, c.reference.kind)
        out.set_reference(c.reference.pieces(), c.reference.sine_list())
        out.ratio = self.ratio(self.motor_shaft, self.shaft, "shaft")
        out.rated_torque = self.motor.rated_torque
        out.delay.ticks = c.delay * ticks
        for name, _, every in c.schedules():
            getattr(out, f"{name}_schedule").every = every * ticks
        self._encoders(out, ticks)
        self._loops(out)
        self._limits(out)
        if c.camera is not None and c.tracker is not None:
            stream = zlib.crc32(self.name.encode())
            out.camera = core_camera(c.camera, c.sample_time, ticks, stream)
            out.tracker = core_tracker(c.tracker, c.camera.sample_time)
        if c.phase > 0.0:
            phase = whole_multiple(c.phase, c.sample_time, "phase") * ticks
            if phase >= out.position_schedule.every:
                raise InputError(f"phase: {c.phase:g} s is not below the sample time of the position loop; take less")
            out.position_schedule.phase = phase
        if isinstance(c.current, CurrentLoop):
            out.current_loop = self._current(c.current)
        elif isinstance(c.current, FieldOriented):
            out.field_orientation = self._field_oriented(c.current, out.delay)
            out.commutates_by_encoder = self.encoder_shaft("encoder") == self.motor_shaft
        return out

    def _encoders(self, out: _core.Axis, ticks: int) -> None:
        c = self.controller
        if c.encoder is not None:
            shaft = self.encoder_shaft("encoder")
            scale = self.ratio(self.motor_shaft, shaft, "encoder.shaft")
            out.speed_sensor = c.encoder.core(scale, ticks)
        if c.position_encoder is not None:
            shaft = self.encoder_shaft("position_encoder")
            out.two_encoders = True
            out.position_sensor = c.position_encoder.core(
                self.ratio(self.shaft, shaft, "position_encoder.shaft"), ticks
            )
            if c.blend_time is not None:
                out.position_share = -expm1(-c.loop_time("position") / c.blend_time)

    def _loops(self, out: _core.Axis) -> None:
        c = self.controller
        if c.position is not None:
            out.position_loop = c.position.core()
            out.reference_delay = c.position.reference_delay
        if c.speed is None:
            return
        time = c.loop_time("speed")
        out.speed_loop = c.speed.core()
        out.estimate = c.speed.core_estimate(time)
        for key in ("reference_filters", "torque_filters"):
            filters = []
            for k, f in enumerate(getattr(c.speed, key)):
                try:
                    filters.append(core_filter(f, time))
                except InputError as problem:
                    raise InputError(f"speed.{key}[{k}]: {problem}") from None
            setattr(out, "speed_filters" if key == "reference_filters" else key, filters)
        out.feedforward = c.feedforward.core()
        if c.inverse_model is not None:
            on_motor = self.encoder_shaft("encoder" if c.position_encoder is None else "position_encoder") != self.shaft
            out.inverse_model = c.inverse_model.core(self.train, self.name, self.shaft, on_motor=on_motor)
            out.load_observer = c.inverse_model.core_observer(time)
        if c.feedforward.backlash > 0.0:
            out.backlash.backlash = c.feedforward.backlash
            out.backlash.rate = c.feedforward.backlash_rate or 0.0

    def _limits(self, out: _core.Axis) -> None:
        """Those of motor and amplifier that no loop of the currents or voltages keeps to."""
        current = self.controller.current
        if isinstance(current, FieldOriented | VoltageCommand):
            return
        out.torque_limit = self.motor.largest_torque
        line = self.motor.torque_line()
        if line is not None and not isinstance(current, CurrentLoop):
            out.stall_torque, out.torque_droop = line

    def _current(self, loop: CurrentLoop) -> _core.CurrentLoop:
        """Of (2): relative torque for current, 1/k_N for the resistance, so that K = g/(k_N (1 - a))."""
        m = self.motor.as_dc()
        if m.electrical_time_constant is None or m.armature_voltage_constant is None or m.rated_speed is None:
            raise InputError(
                'current.kind: "pi" needs a motor with a winding, and this one is a torque source; take "ideal" or "first_order"'
            )
        k_N = m.armature_voltage_constant
        share = -expm1(-self.controller.loop_time("current") / m.electrical_time_constant)
        out = _core.CurrentLoop()
        out.gain = loop.gain / (k_N * share)
        out.integral_gain = loop.gain / k_N
        out.back_emf = loop.back_emf * (k_N - 1.0) / (k_N * m.rated_speed)
        out.rated_torque = m.rated_torque
        out.limit = math.inf if m.command_limit is None else m.command_limit
        return out

    def _field_oriented(self, loop: FieldOriented, delay: _core.TickDelay) -> _core.FieldOrientation:
        m = self.motor
        if m.kind != "synchronous" or m.winding is None:
            raise InputError(
                f'current.kind: "field_oriented" needs a motor of kind "synchronous", and this one is a {m.kind}; take "pi", "ideal" or "first_order"'
            )
        if m.winding.max_current is None:
            raise InputError(
                'current.kind: "field_oriented" needs the largest current; give motor.winding.max_current_rms or max_current_peak'
            )
        phase = m.winding.phase_values()
        current, time = math.sqrt(2.0) * m.winding.max_current, self.controller.loop_time("current")
        if (phase.inductance_d - phase.inductance_q) * current >= phase.flux_linkage:
            raise InputError(
                'current.kind: "field_oriented": L_d - L_q times the largest current is not below the flux linkage, so that field '
                "weakening would turn the torque around; exchange inductance_d and inductance_q, or lower the largest current"
            )
        out = _core.FieldOrientation()
        out.winding = [float(value) for value in dataclasses.astuple(phase)]
        gains = [
            -loop.gain * phase.resistance / expm1(-phase.resistance * time / L)
            for L in (phase.inductance_d, phase.inductance_q)
        ]
        out.gain_d, out.gain_q = gains
        out.integral_gain = loop.gain * phase.resistance
        out.back_emf, out.decoupling, out.field_weakening = loop.back_emf, loop.decoupling, loop.field_weakening
        out.voltage_limit, out.current_limit = m.phase_voltage, current
        out.weakening_voltage = loop.weakening_voltage * m.phase_voltage
        out.sample_time, out.delay_time = time, self.controller.delay * self.controller.sample_time
        out.delay = delay
        return out


def core_control(
    train: DriveTrain,
    controllers: Mapping[str, Controller],
    key: str = "controllers.{}.",
    laws: Mapping[str, Law] = NO_LAWS,
) -> Bound:
    """The controllers of the motors of a train.

    Parameters
    ----------
    key
        Of the table of one controller in a scenario file, for messages.
    laws
        Of controllers with ``law = true``.

    Raises
    ------
    InputError
        One of them does not fit its motor or its shafts, or their sample times do not nest.
    """
    if not controllers:
        return OPEN_LOOP
    base = min(c.sample_time for c in controllers.values())
    axes = []
    for name, controller in controllers.items():
        place = _Place(train, name, controller)
        try:
            ticks = whole_multiple(controller.sample_time, base, "sample_time")
            position, speed = (place.encoder_shaft(key) for key in ("position_encoder", "encoder"))
            shafts = list(train.shafts)
            axis = place.axis(ticks)
            if name in laws:
                laws[name].set(axis)
            encoders = shafts.index(position), shafts.index(speed)
            axes.append((axis, list(train.motors).index(name), *encoders, shafts.index(place.shaft)))
        except InputError as problem:
            raise InputError(f"key {key.format(name)}{problem}") from None
    return base, axes


def driven(controller: Controller | ContinuousController) -> MotorLaw | None:
    """What a current loop makes of its motor; None where the motor stays what it is.

    One of first order is the law of (2) with k_N = 1: tau dM/dt = M* - M.
    """
    current = controller.current
    if isinstance(current, CurrentLoop | VoltageCommand):
        return None
    if isinstance(current, FirstOrderCurrent):
        changes = {
            "motor.electrical_time_constant": current.time_constant,
            "motor.armature_voltage_constant": 1.0,
            "motor.rated_speed": 1.0,
            "motor.command_limit": math.inf,
        }
        return tuple(changes.items()), False
    return (), True


def motor_laws(controllers: Mapping[str, Controller | ContinuousController]) -> dict[str, MotorLaw | None]:
    """What the current loops make of the motors, by name."""
    return {name: driven(controller) for name, controller in controllers.items()}


def check_torques(controllers: Mapping[str, Controller], torques: Mapping[str, float], key: str) -> None:
    """Refuses torques at t = 0 of motors whose current loop leaves the torque no state.

    Parameters
    ----------
    torques
        By the names of the motors [N·m].
    key
        Of the torque of a motor, for messages.

    Raises
    ------
    InputError
    """
    for name, controller in controllers.items():
        kind = controller.current.kind
        if torques.get(name, 0.0) != 0.0 and driven(controller) == ((), True):
            begins = "no current" if kind == "field_oriented" else "the torque that the controller asks for"
            raise InputError(
                f'key {key.format(name)}: with current.kind = "{kind}" a run begins with {begins}; leave it out'
            )

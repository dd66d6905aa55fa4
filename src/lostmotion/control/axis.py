"""Controllers on a drive train, as the solver takes them."""

import dataclasses
import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from .. import _core
from ..errors import InputError, inside
from ..inputs.core_parameters import Described, ReferenceBlocks
from ..inputs.refusal_messages import did_you_mean, shown
from ..model.motor import Motor, MotorLaw
from ..model.shaft_ratio import turns
from ..model.signals import columns
from ..model.train import DriveTrain
from .continuous import ContinuousController
from .controller import Controller
from .custom_controller import Law
from .encoder import Encoder
from .filters import discrete
from .loops import CurrentLoop, FieldOriented, FirstOrderCurrent, SpeedLoop, VoltageCommand
from .sample_times import whole_multiple

BoundController = tuple[float, list[_core.Axis]]
"""shortest sample time [s], and the controllers with the numbers of their motors and shafts"""
OPEN_LOOP: BoundController = (1.0, [])
NO_LAWS: Mapping[str, Law] = MappingProxyType({})


@dataclass(frozen=True)
class _Place:
    """Position of a controller in a train."""

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
            raise InputError(f"{shown(shaft)} is no shaft; {meant}", key)
        return shaft

    def ratio(self, start: str, end: str, key: str) -> float:
        i = turns(self.train, start, end)
        if i is None:
            raise InputError(f"no gear leads from the shaft {start} to {end}; name a shaft that the motor turns", key)
        return i

    def encoder_shaft(self, key: str) -> str:
        encoder = getattr(self.controller, key)
        return self.known(f"{key}.shaft", None if encoder is None else encoder.shaft, self.motor_shaft)

    def axis(self, samples: int) -> _core.Axis:
        """The solver's controller; its sample time is so many of the shortest one."""
        c = self.controller
        if self.train.is_slide(self.shaft):
            for key, there in (("camera", c.camera), ("reference.target", getattr(c.reference, "target", None))):
                if there is not None:
                    raise InputError(f"gives an angle, and {self.shaft} is a slide; leave it out, or name a shaft", key)
        shafts = list(self.train.shafts)
        out = _core.Axis()
        out.set(
            {
                "motor": list(self.train.motors).index(self.name),
                "position_shaft": shafts.index(self.encoder_shaft("position_encoder")),
                "speed_shaft": shafts.index(self.encoder_shaft("encoder")),
                "reference_shaft": shafts.index(self.shaft),
                "mode": c.reference.kind,
                "reference": {
                    "pieces": columns(("time", "value", "rate", "acceleration", "jerk"), c.reference.pieces()),
                    "sines": columns(("amplitude", "frequency", "phase"), c.reference.sine_list()),
                },
                "ratio": self.ratio(self.motor_shaft, self.shaft, "shaft"),
                "rated_torque": self.motor.rated_torque,
                "delay": c.delay * samples,
                "encoder": self._encoder("encoder", self.motor_shaft, samples),
                "position_encoder": self._encoder("position_encoder", self.shaft, samples),
                "blend_time": c.blend_time,
                "feedforward": c.feedforward.core_fields(),
                "position": c.position and c.position.core_fields(),
                "firmware": c.firmware and c.firmware.core_fields(),
                **self._schedules(samples),
                **({} if c.speed is None else self._speed(c.speed)),
                **self._current(c.delay * samples),
                "camera": self._camera(samples),
                **{key: part.core_fields() for key in ReferenceBlocks.model_fields if (part := getattr(c, key))},
            }
        )
        return out

    def _schedules(self, samples: int) -> dict[str, Any]:
        c = self.controller
        out = {f"{name}_schedule": {"every": every * samples} for name, _, every in c.schedules()}
        if c.phase > 0.0:
            phase = whole_multiple(c.phase, c.sample_time, "phase") * samples
            if phase >= out["position_schedule"]["every"]:
                raise InputError(f"{c.phase:g} s is not below the sample time of the position loop; take less", "phase")
            out["position_schedule"]["phase"] = phase
        return out

    def _encoder(self, key: str, target: str, samples: int) -> dict[str, Any] | None:
        """Fields of an encoder, read as the angle of the shaft `target`."""
        encoder: Encoder | None = getattr(self.controller, key)
        if encoder is None:
            return None
        shaft = self.encoder_shaft(key)
        with inside(key):
            encoder.check_shaft(slides=self.train.is_slide(shaft))
        scale = self.ratio(target, shaft, f"{key}.shaft")
        return {**encoder.core_fields(), "scale": scale, "delay": encoder.delay * samples}

    def _speed(self, loop: SpeedLoop) -> dict[str, Any]:
        c, e = self.controller, loop.estimate
        out: dict[str, Any] = {
            "speed": loop.core_fields(),
            "estimate": {"kind": e.kind} | (e.core_fields() if isinstance(e, Described) else {}),
        }
        for key in ("reference_filters", "torque_filters"):
            out[key] = []
            for k, f in enumerate(getattr(loop, key)):
                try:
                    out[key].append(discrete(f, c.loop_time("speed"))[2])
                except InputError as problem:
                    raise InputError(problem, f"speed.{key}[{k}]") from None
        if c.inverse_model is not None:
            on_motor = self.encoder_shaft("encoder" if c.position_encoder is None else "position_encoder") != self.shaft
            fields = c.inverse_model.solver_fields(self.train, self.name, self.shaft, on_motor=on_motor)
            out["inverse_model"] = fields
        return out

    def _current(self, delay: int) -> dict[str, Any]:
        """The loop of the currents, and the limits of motor and amplifier that no loop of currents or voltages keeps to."""
        current = self.controller.current
        if isinstance(current, FieldOriented):
            own = self.encoder_shaft("encoder") == self.motor_shaft
            fields = current.core_fields() | self._winding() | {"delay": delay}
            return {"field_orientation": fields, "commutates_by_encoder": own}
        if isinstance(current, VoltageCommand):
            return {}
        out: dict[str, Any] = {"torque_limit": self.motor.largest_torque}
        if isinstance(current, CurrentLoop):
            return out | {"current_loop": current.core_fields() | self._armature()}
        if (line := self.motor.torque_line()) is not None:
            out["stall_torque"], out["torque_droop"] = line
        return out

    def _armature(self) -> dict[str, Any]:
        m = self.motor.as_dc()
        keys = ("rated_torque", "rated_speed", "armature_voltage_constant", "electrical_time_constant", "command_limit")
        if m.electrical_time_constant is None or m.armature_voltage_constant is None or m.rated_speed is None:
            raise InputError(
                '"pi" needs a motor with a winding, and this one is a torque source; take "ideal" or "first_order"',
                "current.kind",
            )
        return {key: getattr(m, key) for key in keys}

    def _winding(self) -> dict[str, Any]:
        m = self.motor
        if m.kind != "synchronous" or m.winding is None:
            raise InputError(
                f'"field_oriented" needs a motor of kind "synchronous", and this one is a {m.kind}; take "pi", "ideal" or "first_order"',
                "current.kind",
            )
        if m.winding.max_current is None:
            raise InputError(
                '"field_oriented" needs the largest current; give motor.winding.max_current_rms or max_current_peak',
                "current.kind",
            )
        phase, current = m.winding.phase_values(), math.sqrt(2.0) * m.winding.max_current
        if (phase.inductance_d - phase.inductance_q) * current >= phase.flux_linkage:
            raise InputError(
                '"field_oriented": L_d - L_q times the largest current must be below the flux linkage; exchange '
                "inductance_d and inductance_q, or lower the largest current",
                "current.kind",
            )
        c = self.controller
        times = {"sample_time": c.loop_time("current"), "delay_time": c.delay * c.sample_time}
        return dataclasses.asdict(phase) | times | {"voltage_limit": m.phase_voltage, "current_limit": current}

    def _camera(self, samples: int) -> dict[str, Any] | None:
        c = self.controller
        if c.camera is None or c.tracker is None:
            return None
        every, late = (
            0 if time == 0.0 else whole_multiple(time, c.sample_time, f"camera.{key}") * samples
            for key, time in (("sample_time", c.camera.sample_time), ("latency", c.camera.latency))
        )
        tracker = c.tracker.core_fields() | {"frame_time": c.camera.sample_time}
        of_motor = {"every": every, "late": late, "stream": zlib.crc32(self.name.encode())}
        return c.camera.core_fields() | of_motor | {"tracker": tracker}


def core_control(
    train: DriveTrain, controllers: Mapping[str, Controller], laws: Mapping[str, Law] = NO_LAWS
) -> BoundController:
    """The controllers of the motors of a train.

    laws: of controllers with ``law = true``.

    Raises InputError: one of them does not fit its motor or its shafts, or their sample times do not nest.
    """
    if not controllers:
        return OPEN_LOOP
    base = min(c.sample_time for c in controllers.values())
    axes = []
    for name, controller in controllers.items():
        place = _Place(train, name, controller)
        with inside(f"controllers.{name}"):
            samples = whole_multiple(controller.sample_time, base, "sample_time")
            axis = place.axis(samples)
            if name in laws:
                laws[name].set(axis)
            axes.append(axis)
    return base, axes


def own(control: BoundController) -> BoundController:
    """Copies of the controllers, which may be changed."""
    base, axes = control
    return base, [_core.Axis(axis) for axis in axes]


TORQUE_SOURCE = ("kind", "torque_source")
"""what a current loop makes of a motor whose torque it sets without a state of its own"""


def driven(controller: Controller | ContinuousController) -> MotorLaw | None:
    """Motor as its current loop makes it; None if the motor stays unchanged.

    One of first order is the law of (2) with k_N = 1: tau dM/dt = M* - M.
    """
    current = controller.current
    if isinstance(current, CurrentLoop | VoltageCommand):
        return None
    if isinstance(current, FirstOrderCurrent):
        changes = {
            "kind": "dc",
            "electrical_time_constant": current.time_constant,
            "armature_voltage_constant": 1.0,
            "rated_speed": 1.0,
            "command_limit": math.inf,
            "torque_limit": math.inf,
        }
        return tuple(changes.items())
    return TORQUE_SOURCE, ("torque_limit", math.inf)


def motor_laws(controllers: Mapping[str, Controller | ContinuousController]) -> dict[str, MotorLaw | None]:
    """Laws of the motors with their current loops, by name."""
    return {name: driven(controller) for name, controller in controllers.items()}


def check_torques(controllers: Mapping[str, Controller], torques: Mapping[str, float], key: str) -> None:
    """Refuses torques at t = 0 of motors whose current loop leaves the torque no state.

    torques: by the names of the motors [N·m].
    key: of the torque of a motor, for messages.
    """
    for name, controller in controllers.items():
        kind = controller.current.kind
        if torques.get(name, 0.0) != 0.0 and TORQUE_SOURCE in (driven(controller) or ()):
            begins = "no current" if kind == "field_oriented" else "the torque that the controller asks for"
            raise InputError(f'with current.kind = "{kind}" a run begins with {begins}; leave it out', key.format(name))

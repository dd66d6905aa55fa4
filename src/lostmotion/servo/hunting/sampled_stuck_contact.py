"""One stuck contact under a sampled controller: what slip, stuck interval and controller make of a state over a sample time.

The state ``z`` is the angle of the contact's shaft, its speed, the memory of the controller, and the reading of the
encoder at the break-away. With a current loop of first order, the torque that reaches the contact is the third. The
angle counts from the middle of the encoder step that is read there, the readings from the reference. The states are
those after a sample. Constant loads only shift the integrator.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ... import _core
from ...control.controller import Controller
from ...control.loops import FirstOrderCurrent, IdealCurrent
from ...model.shaft_ratio import turns
from ...response.linearisation import LinearModel
from ...simulation.forms.train_tables import TrainInitial
from ..linear_regimes import Axis
from .continuous_stuck_contact import NONE, AtRestError, UndecidableError, only_contact, others, slow_regimes
from .hunting_decision import FOREVER

ROUNDING = 1e-15  # of a number of encoder steps, by which its computation may change it
DOUBLINGS = 40  # of the time until what is not the ramp of the integrator has settled
SETTLED = 1e-9  # relative change of the ramp from frame to frame
MOST_SETTLING = 20_000  # ticks


@dataclass(frozen=True)
class RigidPlant:
    """A rigid axis at its contact: ``J w' = J a w + M - T_C``, ``M`` being a gain times the command."""

    shaft: str
    breakaway: float  # T_S
    sliding: float  # T_C
    inertia: float  # inertia of all that turns, at the contact
    viscous: float  # rate by which the speed decays without torque, not positive [1/s]
    gain: float
    lag: float  # time constant of the torque [s]; 0: the torque follows the controller at once


@dataclass(frozen=True)
class SampledSlip(RigidPlant):
    """Matrices of slip, stuck interval and controller over a sample time, the slip being forward."""

    name: str
    tick: float  # [s]
    step: float  # q, resolution of the encoder at the contact's shaft; 0 for an ideal one
    offset: float  # f: the reference is this share of a step beyond the middle of one, from -1/2 to 1/2
    ratio: float  # turns of the encoder for one of the contact
    slip: np.ndarray
    push: np.ndarray  # change that friction adds to a forward slip over a tick
    stuck: np.ndarray
    samples: tuple[tuple[np.ndarray, np.ndarray], ...]
    """for each tick of a frame, matrix of the state, and column of the reading of the encoder less that at the break-away"""
    held: np.ndarray  # row of the torque at the contact, without friction
    command: np.ndarray  # row of the torque that it goes to
    limited: tuple[tuple[np.ndarray, float], ...]  # rows of what the controller limits, with what is left of each limit

    @property
    def excess(self) -> float:
        """T_S - T_C."""
        return self.breakaway - self.sliding

    @property
    def frame(self) -> int:
        """Ticks after which all loops repeat."""
        return len(self.samples)

    @cached_property
    def reading(self) -> np.ndarray:
        """Row of the angle that an encoder without steps reads, less the reading at the break-away."""
        row = np.zeros(len(self.held))
        row[0] = self.ratio
        return row

    @cached_property
    def linear(self) -> tuple[np.ndarray, ...]:
        """Matrix of the state with an encoder without steps, for each tick of a frame."""
        return tuple(matrix + np.outer(column, self.reading) for matrix, column in self.samples)

    @property
    def quantum(self) -> float:
        """Step of the reading for a step of the contact's shaft."""
        return self.step * self.ratio

    @cached_property
    def ramp(self) -> SettledStuckState:
        """The settled stuck state."""
        return SettledStuckState.of(self)


@dataclass(frozen=True)
class SettledStuckState:
    """The settled stuck state after each tick of a frame: ``reading * z + torque * b``, with the torque at the contact."""

    ticks: int  # until all but the integrator has settled
    z: tuple[np.ndarray, ...]
    b: tuple[np.ndarray, ...]
    rises: tuple[float, ...]  # by which the torque has risen at each tick, per reading

    @classmethod
    def of(cls, slip: SampledSlip) -> SettledStuckState:
        """The settled state, found by following the stuck interval for ever twice as long.

        Raises AtRestError: nothing winds up.
        Raises UndecidableError: it does not settle, or winds up otherwise than in proportion to the error.
        """
        n = len(slip.held)
        maps = [S @ slip.stuck for S, _ in slip.samples]
        frame = np.linalg.multi_dot([np.eye(n), *maps[::-1], np.eye(n)])
        start, whole, ticks = np.eye(n)[n - 1], frame, slip.frame
        for _ in range(DOUBLINGS):
            a, b, c = (whole @ start, frame @ whole @ start, frame @ frame @ whole @ start)
            if np.abs(c - 2.0 * b + a).max() <= SETTLED * np.abs(b - a).max() or ticks > MOST_SETTLING:
                break
            whole, ticks = whole @ whole, 2 * ticks
        along = b - a
        wound = float(slip.held @ along)
        if abs(wound) <= SETTLED * np.abs(slip.held @ a):
            raise AtRestError(
                "no integrator winds up while the contact is stuck, so that it stays stuck once all has settled"
            )
        if ticks > MOST_SETTLING or wound > 0.0:
            raise UndecidableError(
                "the integrator does not wind up in proportion to the error while the contact is stuck"
            )
        states, before, rises = [], a, []
        for one in maps:
            after = one @ before
            rises.append(float(slip.held @ (after - before)))
            states.append(after)
            before = after
        directions, last = [], states[-1]
        for one, here in zip(maps, states, strict=True):
            last = one @ last
            directions.append((last - here) / wound)
        z = tuple(here - (slip.held @ here) * b for here, b in zip(states, directions, strict=True))
        return cls(ticks + slip.frame, z, tuple(directions), tuple(rises))


def sampled_slip(axis: Axis) -> SampledSlip:
    """The matrices of an axis with a sampled position controller.

    Raises UndecidableError: the axis has other contacts, soft gears, or a controller that is not linear within its
        limits.
    Raises AtRestError: a limit of the controller keeps it from freeing the contact.
    """
    if reasons := [*others(axis.train), *_nonlinear(axis)]:
        raise UndecidableError(f"the slip is not one linear regime: it has {', '.join(reasons)}")
    return _assembled(axis, _plant_of(axis, *only_contact(axis.scenario, TrainInitial())))


def _nonlinear(axis: Axis) -> Any:
    """Parts of a controller that are not linear, but for its limits and the steps of its encoder."""
    c: Controller = axis.controller
    if not isinstance(c.current, IdealCurrent | FirstOrderCurrent):
        yield f'current.kind = "{c.current.kind}" (take "ideal" or "first_order")'
    if axis.train.motors[axis.motor].torque_line() is not None:
        yield "a torque-speed line of the motor (take a torque_source)"
    if c.position_encoder is not None:
        yield "a position_encoder (give one encoder to both loops)"
    if c.encoder is not None and c.encoder.error > 0.0:
        yield "an encoder with an error within its period"
    for key in ("inverse_model", "camera"):
        if getattr(c, key) is not None:
            yield key
    if c.position is not None and c.position.dead_zone is not None:
        yield "a dead zone of the integrator"


def _plant_of(axis: Axis, shaft: str, breakaway: float) -> RigidPlant:
    train = axis.train
    still, forward, reverse = slow_regimes(axis.scenario, shaft)
    row = np.eye(len(forward.states))[forward.states.index(train.variable(shaft, "speed"))]
    friction = 0.5 * (forward.rate - reverse.rate)
    along = friction / (row @ friction)
    viscous = float(row @ forward.A @ along)
    turned = forward.A @ along - viscous * along
    if np.abs(forward.A @ turned).max() > NONE * np.abs(forward.A).max():
        raise UndecidableError("a gear or spring between its shafts is soft; take a rigid one")
    k = forward.outputs.index(train.variable(shaft, "contact_torque"))
    sliding = float(0.5 * (forward.offset[k] - reverse.offset[k]))
    gain, push, lag = _torque(axis, still, forward, row, k)
    inertia = sliding / abs(float(row @ friction))
    if abs(push * inertia - gain) > NONE * abs(gain):
        raise UndecidableError("the torque that frees the contact is not the one that moves it")
    same = abs(breakaway - sliding) <= NONE * breakaway
    return RigidPlant(shaft, sliding if same else breakaway, sliding, inertia, viscous, gain, lag)


def _torque(
    axis: Axis, still: LinearModel, forward: LinearModel, speed: np.ndarray, contact: int
) -> tuple[float, float, float]:
    """Torque at the contact and acceleration of its shaft for a command of 1, and the time constant of the torque."""
    u, current = forward.inputs.index(axis.train.variable(axis.motor, "command")), axis.controller.current
    if not isinstance(current, FirstOrderCurrent):
        return float(still.D[contact, u]), float(speed @ forward.B[:, u]), 0.0
    m = forward.states.index(axis.train.variable(axis.motor, "torque"))
    torque = forward.B[m, u] * current.time_constant
    return float(still.C[contact, m] * torque), float(speed @ forward.A[:, m] * torque), current.time_constant


def _assembled(axis: Axis, plant: RigidPlant) -> SampledSlip:
    law, _, encoder = axis.law
    tick, frame = axis.controller.sample_time, math.lcm(*(n for _, _, n in axis.controller.schedules()))
    options: dict[str, Any] = {"outermost": _core.Loop.position, "cut": False, "sample_time": tick}
    steps = [_core.linear_step(law, sample=law.position_phase + j, **options) for j in range(frame)]
    names = [name for name, *_ in _core.axis_signals()]
    torque, speed = names.index("torque_reference"), names.index("speed_reference")
    kept = _remembered(steps, {_core.COMMAND_SLOT, torque, speed})
    ratio = turns(axis.train, encoder, plant.shaft) or 1.0
    own = 2 if plant.lag == 0.0 else 3
    n = own + len(kept) + 1
    samples = []
    for step in steps:
        slots, inputs = step[np.ix_(kept, kept)], step[kept, len(step) :]
        S, U = np.eye(n), np.zeros(n)
        S[own:-1, own:-1], U[own:-1] = slots, inputs[:, 1]
        S[own:-1, 1], S[own:-1, -1] = inputs[:, 2] * ratio, inputs[:, 1]
        samples.append((S, U))
    rows = {slot: np.eye(n)[own + k] for k, slot in enumerate(kept)}
    command = plant.gain * rows[_core.COMMAND_SLOT]
    slip, push, stuck = _propagated(plant, tick, command, own)
    resolution, offset = _steps(axis, encoder)
    return SampledSlip(
        **vars(plant),
        name=axis.train.variable(plant.shaft, "contact"),
        tick=tick,
        step=resolution / abs(ratio),
        offset=offset,
        ratio=ratio,
        slip=slip,
        push=push,
        stuck=stuck,
        samples=tuple(samples),
        held=command if own == 2 else np.eye(n)[2],
        command=command,
        limited=_limits(axis, plant, rows[torque], rows[speed]),
    )


def _remembered(steps: list[np.ndarray], kept: set[int]) -> list[int]:
    """The slots that the command and the signals with limits follow from."""
    size = len(steps[0])
    while True:
        found = kept.union(*(np.flatnonzero(step[i, :size]).tolist() for step in steps for i in kept))
        if found == kept:
            break
        kept = found
    if any(np.any(step[sorted(kept), size + 3]) for step in steps):
        raise UndecidableError("its controller reads the torque of the motor")
    return sorted(kept)


def _propagated(
    plant: RigidPlant, tick: float, command: np.ndarray, own: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Matrix of a tick of the slip, what friction adds to it, and the matrix of a tick of the stuck interval."""
    from scipy.linalg import expm

    def over_tick(*, slips: bool) -> np.ndarray:
        """Angle, speed, torque, command and 1."""
        A = np.zeros((5, 5))
        if slips:
            A[0, 1], A[1, 1], A[1, 4] = 1.0, plant.viscous, -plant.sliding / plant.inertia
            A[1, 3 if plant.lag == 0.0 else 2] = 1.0 / plant.inertia
        if plant.lag > 0.0:
            A[2, 2], A[2, 3] = -1.0 / plant.lag, 1.0 / plant.lag
        return np.asarray(expm(A * tick))

    n, found = len(command), []
    for slips in (True, False):
        exact, matrix = over_tick(slips=slips), np.eye(n)
        matrix[:own, :own] = exact[:own, :own]
        matrix[:own] += np.outer(exact[:own, 3], command)
        push = np.concatenate([exact[:own, 4], np.zeros(n - own)])
        found.append((matrix, push))
    (slip, push), (stuck, _) = found
    stuck[1] = 0.0
    return slip, push, stuck


def _steps(axis: Axis, encoder: str) -> tuple[float, float]:
    """Resolution of the encoder, and by which share of a step the reference is beyond the middle of one."""
    c, train = axis.controller, axis.train
    step = 0.0 if c.encoder is None else c.encoder.step
    if step == 0.0:
        return 0.0, 0.0
    count = c.reference.pieces()[-1][1] * (turns(train, encoder, axis.shaft) or 1.0) / step
    offset = count - round(count)
    return step, offset if abs(offset) > ROUNDING * abs(
        count
    ) else 0.0  # a multiple of the step, to rounding, is a reading


def _limits(
    axis: Axis, plant: RigidPlant, torque: np.ndarray, speed: np.ndarray
) -> tuple[tuple[np.ndarray, float], ...]:
    """Rows with the rest of the limits of torque and speed, less the torque of constant loads."""
    c, motor = axis.controller, axis.train.motors[axis.motor]
    assert c.speed is not None
    assert c.position is not None
    own = c.speed.torque_limit if c.speed.torque_limit is not None else math.inf
    per_torque = abs(plant.gain) / motor.rated_torque
    loads = [
        s.breakpoint_list()[-1][1]
        for name, s in axis.scenario.signals().items()
        if name.endswith(("_load_torque", "_load_force"))
    ]
    rest = sum(map(abs, loads)) / per_torque
    limit = min(own, motor.largest_torque)
    if plant.breakaway / per_torque > limit + rest:
        raise AtRestError("the limit of the controller is below what frees the contact, so that it stays stuck")
    if plant.breakaway / per_torque > limit - rest:
        raise UndecidableError("the limit of the controller is near what frees the contact under the load")
    found = [(torque, limit - rest)]
    if c.position.speed_limit is not None:
        found.append((speed, c.position.speed_limit * abs(axis.ratio)))
    return tuple((row, left) for row, left in found if math.isfinite(left))


def never_rests(contact: SampledSlip) -> bool:
    """Whether no reading of the encoder is the reference, so that the integrator winds up until the contact breaks away."""
    if contact.step == 0.0:
        return False
    per_time = (
        -sum(contact.ramp.rises)
        / (contact.frame * contact.tick)
        * abs(contact.offset)
        * contact.step
        * abs(contact.ratio)
    )
    return per_time * FOREVER > 2.0 * contact.breakaway

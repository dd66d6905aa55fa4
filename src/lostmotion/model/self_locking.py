"""Behaviour of a gear while its load drives it, before any run: it locks, lowers smoothly, chatters or jams.

docs/self-locking.md derives it. The laws are the laws of the solver: losses and linear regimes come from the core.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from .. import _core
from ..errors import InputError, prefixed
from ..inputs.argument_checks import checked
from ..inputs.quantities import Speed, Torque
from ..inputs.refusal_messages import did_you_mean
from .gear import Gear
from .gearbox import Gearbox
from .shaft_ratio import joints_of, tied
from .torsion import Rigid
from .train import DriveTrain

if TYPE_CHECKING:
    import numpy as np

SLOW = 1.0  # [rad/s], where a gear has no rated speed
ROUNDING = 1e-7  # of the fastest rate, within which a motion neither grows nor dies out

Lowering = Literal["smooth", "chatters", "jams"]


@dataclass(frozen=True)
class Overrunning:
    """Efficiencies of a gear at one load, and what follows from them alone."""

    load_torque: float
    """M at the output, > 0 [N·m]"""
    input_speed: float
    """input speed of the motion [rad/s]"""
    forward_efficiency: float
    """eta_f in motion, while the input drives"""
    backward_efficiency: float
    """eta_b in motion, while the output drives; 0 or less: it stops its load"""
    static_efficiency: float
    """eta_b at rest; 0 or less: it holds its load"""
    slope: float
    """i dT_1/dT_2 in motion, the local slope; eta_b itself where the loss is proportional to the load"""
    input_torque: float
    """at the input, breaks the load loose downward, without the friction of the shaft [N·m]; < 0: the load drives"""

    @property
    def holds(self) -> bool:
        """Whether it holds the load at rest."""
        return self.static_efficiency <= 0.0

    @property
    def stops(self) -> bool:
        """Whether it brings a load to rest that drives it in motion."""
        return self.backward_efficiency <= 0.0

    @property
    def critical_inertia_ratio(self) -> float:
        """J_2/(J_1 i²) above which a motion under this load is unstable without damping."""
        return -1.0 / self.slope if self.slope < 0.0 else math.inf

    def __str__(self) -> str:
        efficiency = (
            f"backward efficiency {self.static_efficiency:.3g} at rest, {self.backward_efficiency:.3g} in motion"
        )
        if not self.holds:
            return f"not self-locking: the load drives it ({efficiency})"
        if not self.stops:
            return f"holds its load at rest, but does not stop it in motion ({efficiency})"
        return f"self-locking: holds its load at rest and stops it in motion ({efficiency})"


@dataclass(frozen=True)
class SelfLocking:
    """The verdict on a gear in its train."""

    gear: str
    overrunning: Overrunning
    lowering: Lowering
    """smooth, chatters (the mesh winds up, the input locks and breaks loose again), or jams (no motion or several)"""
    rate: float
    """at which a disturbance of the steady motion grows [1/s]; 0: it dies out, or lasts"""
    undamped_rate: float
    """the same without viscous friction, mesh damping and back-e.m.f., as in the closed form [1/s]"""
    inertia_ratio: float
    """J_2/(J_1 i²) of what is rigidly joined to output and input of the gear"""
    least_torque: float
    """least torque of the motor that breaks the load loose downward, with the dry friction up to it [N·m]; < 0: the load drives the motor"""
    motor: str
    """motor with that torque; empty: there is none, and the torque is that at the input of the gear"""
    moves_slide: bool = False
    """whether the load torque is a force [N] on a slide"""

    @property
    def notable(self) -> bool:
        """Whether it locks, or makes the motion unstable: its input is pushed the less, the more the load pulls."""
        return self.overrunning.holds or (self.lowering != "smooth" and self.overrunning.slope < 0.0)

    @property
    def brief(self) -> str:
        """Torque for lowering the load, and the kind of the motion."""
        torque = f"{abs(self.least_torque):.4g} N·m of {self.motor or 'the input'}"
        takes = f"takes more than {torque}" if self.least_torque > 0.0 else f"is held back by at least {torque}"
        return f"{takes}; {self._motion()}"

    @property
    def remedy(self) -> str:
        """Against chatter or jamming; empty where there is neither."""
        if self.lowering == "jams":
            return "give the gear a stiffness"
        if self.lowering == "chatters":
            return "more inertia on the input shaft, damping of the mesh, or a lighter load helps"
        return ""

    def __str__(self) -> str:
        at = self.overrunning
        return f"{self.gear}: {at}; lowering {at.load_torque:.4g} {'N' if self.moves_slide else 'N·m'} {self.brief}"

    def _motion(self) -> str:
        critical = self.overrunning.critical_inertia_ratio
        ratio = f"inertia ratio J_2/(J_1 i²) {self.inertia_ratio:.3g}, critical {critical:.3g}"
        if self.lowering == "jams":
            return f"jams, rigid friction has no motion or several ({ratio})"
        if self.lowering == "chatters":
            return f"chatters, a disturbance grows at {self.rate:.4g} 1/s ({ratio})"
        if self.undamped_rate > 0.0:
            return f"smooth by its damping, without which a disturbance would grow at {self.undamped_rate:.4g} 1/s ({ratio})"
        return f"smooth ({ratio})" if math.isfinite(critical) else "smooth"


@checked
def overrunning(
    gear: Gear | Gearbox, load_torque: Torque | None = None, input_speed: Speed | None = None
) -> Overrunning:
    """Return the efficiencies of a gear while its load drives it.

    Parameters
    ----------
    gear : Gear or Gearbox
        The gear.
    load_torque : float, optional
        Torque at the output [N·m]. Default: the rated one.
    input_speed : float, optional
        Speed of the input [rad/s]. Default: the rated one. Only a loss map depends on it.

    Returns
    -------
    Overrunning
        The efficiencies, and whether the gear is self-locking.

    Raises
    ------
    InputError
        Neither a torque nor a rated one is given.

    Examples
    --------
    >>> import lostmotion as lm
    >>> print(lm.sizing.overrunning(lm.gearbox("wittenstein-tp010-mf-10")))
    not self-locking: the load drives it (backward efficiency 0.884 at rest, 0.89 in motion)
    """
    part = gear if isinstance(gear, Gear) else Gear.of(gear, input="input", output="output")
    core = _core.Train()
    core.add_gear("gear", input=part.input, output=part.output, fields=part.core_fields())
    return _overrunning(core, 0, part, load_torque, input_speed)


def _overrunning(
    core: _core.Train, index: int, gear: Gear, load_torque: float | None, input_speed: float | None
) -> Overrunning:
    rated = gear.rated_output_torque
    if load_torque is None and rated is None:
        raise InputError("load_torque is missing, and the gear has no rated_output_torque; give one of them")
    M = abs(rated if load_torque is None else load_torque)  # type: ignore[arg-type]
    if M == 0.0:
        raise InputError("load_torque: 0 N·m drives nothing; give the torque that pulls at the gear")
    w = input_speed or gear.rated_input_speed or SLOW
    static, (back, slope), forward = (
        core.mesh_loss(index, -M, 0.0)[0],
        core.mesh_loss(index, -M, w),
        core.mesh_loss(index, M, w)[0],
    )
    return Overrunning(
        load_torque=M,
        input_speed=abs(w),
        forward_efficiency=M / (M + forward),
        backward_efficiency=1.0 - back / M,
        static_efficiency=1.0 - static / M,
        slope=1.0 + slope,
        input_torque=(static - M) / abs(gear.ratio),
    )


@checked
def self_locking(
    train: DriveTrain, gear: str, load_torque: Torque | None = None, input_speed: Speed | None = None
) -> SelfLocking:
    """Decide whether a gear of a train holds a load that drives it through its output shaft.

    The verdict follows from the linear regime of the whole train in a steady motion downward: its friction slips, clutches and
    freewheels are closed, brakes open. Torques over angle and transmission errors, which change within a turn, are left out.

    Parameters
    ----------
    train : DriveTrain
        The train.
    gear : str
        Name of the gear.
    load_torque : float, optional
        Torque M on the output shaft of the gear [N·m]. Default: its rated torque.
    input_speed : float, optional
        Speed of the motion at the gear's input [rad/s]. Default: its rated speed, or 1 rad/s. It counts if losses, friction or drag
        depend on the speed.

    Returns
    -------
    SelfLocking
        Whether the gear holds and stops its load, the least torque that lowers it, and whether that is smooth.

    Raises
    ------
    InputError
        The train has no such gear, or one whose housing turns; no torque is given, and the gear has no rated one.

    Examples
    --------
    >>> import lostmotion as lm
    >>> verdict = lm.sizing.self_locking(lm.load("worm-lowering").train(), "worm_gear", load_torque=20.0)
    >>> str(verdict).split(" (")[0]
    'worm_gear: self-locking: holds its load at rest and stops it in motion'
    """
    if gear not in train.gears:
        known = list(train.gears)
        meant = did_you_mean(gear, known, f"there are {', '.join(known)}" if known else "there is none")
        raise InputError(f"{gear} is no gear of this train; {meant}")
    if turning := [name for name, g in train.gears.items() if g.housing is not None]:
        raise InputError(
            f"the housing of gear {turning[0]} turns; what its load drives has no verdict here, only a run"
        )
    core = train.core(())
    part = train.gears[gear]
    with prefixed(f"key gears.{gear}"):
        at = _overrunning(core, list(train.gears).index(gear), part, load_torque, input_speed)
    speeds = _speeds(train, part, -at.input_speed)
    path = _path(train, part)
    torques = _torques(train, gear, path, at)
    names, rate, determined = core.steady_regime([speeds.get(s, 0.0) for s in train.shafts], torques)
    growing, undamped = _growth(names, rate)
    J_1, J_2 = (_rigid_inertia(train, core, gear, shaft) for shaft in (part.input, part.output))
    least, motor = _least_torque(train, core, part, path, at)
    lowering: Lowering = "smooth"
    if not determined:
        lowering = "jams"
    elif any(v.imag != 0.0 for v in growing) or (growing and undamped > 0.0):
        lowering = "chatters"
    return SelfLocking(
        gear=gear,
        overrunning=at,
        lowering=lowering,
        rate=max((v.real for v in growing), default=0.0) if lowering == "chatters" else 0.0,
        undamped_rate=undamped,
        inertia_ratio=J_2 / (J_1 * part.ratio**2) if J_1 > 0.0 else math.inf,
        least_torque=least,
        motor=motor,
        moves_slide=train.is_slide(part.output),
    )


def _growth(names: list[str], rate: np.ndarray) -> tuple[list[complex], float]:
    """The eigenvalues that grow [1/s], and the fastest growth without what depends on speeds alone and without motors."""
    import numpy as np

    values = np.linalg.eigvals(rate)
    limit = ROUNDING * float(abs(values).max(initial=0.0))
    growing = [complex(v.real, v.imag if abs(v.imag) > limit else 0.0) for v in values if v.real > limit]
    speeds = [k for k, name in enumerate(names) if name.endswith("_speed")]
    twists = [k for k, name in enumerate(names) if name.endswith(("twist", "_deflection"))]
    # w' = a d, d' = b w: the squares of the rates are the eigenvalues of b a.
    squares = np.linalg.eigvals(rate[np.ix_(twists, speeds)] @ rate[np.ix_(speeds, twists)]).astype(complex)
    fastest = float(abs(squares).max(initial=0.0))
    rates = np.sqrt(squares[abs(squares) > ROUNDING * fastest])
    undamped = max((float(r.real) for r in rates if r.real > ROUNDING * math.sqrt(fastest)), default=0.0)
    return growing, undamped


def _speeds(train: DriveTrain, gear: Gear, speed: float) -> dict[str, float]:
    """Speeds of all shafts that turn with the input of a gear; what only a damper joins to them turns along without slip."""
    speeds: dict[str, float] = {}
    ends = [ends for d in train.dampers.values() for ends in ((d.input, d.output), (d.output, d.input))]
    dragged = [(gear.input, speed)]
    while dragged:
        speeds = tied(speeds | dict(dragged[:1]), joints_of(train))
        dragged = [(there, speeds[here]) for here, there in ends if here in speeds and there not in speeds]
    return speeds


def _path(train: DriveTrain, gear: Gear) -> list[str]:
    """Gears from the input of a gear up to the next motor; empty if there is none, or it is on that shaft."""
    driven = {m.shaft for m in train.motors.values()}
    waiting: list[tuple[str, list[str]]] = [(gear.input, [])]
    seen = {gear.input, gear.output}
    while waiting:
        shaft, path = waiting.pop(0)
        if shaft in driven:
            return path
        for name, g in train.gears.items():
            if g.output == shaft and g.input not in seen:
                seen.add(g.input)
                waiting.append((g.input, [*path, name]))
    return []


def _torques(train: DriveTrain, gear: str, path: list[str], at: Overrunning) -> list[float]:
    """T_2 of each gear in the steady motion [N·m], to find the segments of their laws. In the gear it is the torque
    of the load. On the way from the motor it is the torque of the motor, on the way to the load the torque of the
    load, and 0 elsewhere."""
    torques = dict.fromkeys(train.gears, 0.0)
    load = math.copysign(at.load_torque, train.gears[gear].ratio)  # the input turns backward
    torques[gear] = load
    torque = at.backward_efficiency * load / train.gears[gear].ratio
    for name in path:
        torques[name] = torque
        torque /= train.gears[name].ratio
    shaft, torque = train.gears[gear].output, load
    while below := [n for n, g in train.gears.items() if g.input == shaft and torques[n] == 0.0]:
        name = below[0]
        torque *= train.gears[name].ratio
        torques[name], shaft = torque, train.gears[name].output
    return list(torques.values())


def _rigid_inertia(train: DriveTrain, core: _core.Train, gear: str, shaft: str) -> float:
    """Inertia [kg·m²] at a shaft, with all that rigid gears beside this one join to it."""
    inertias = {name: J for name, (J, _) in zip(train.shafts, core.shafts(), strict=True)}
    rigid = [g for name, g in train.gears.items() if name != gear and isinstance(g.stiffness, Rigid)]
    factors = tied({shaft: 1.0}, [(g.input, g.output, g.ratio) for g in rigid])
    together = sum(inertias[name] * factor**2 for name, factor in factors.items())
    for one, other, coupling in train.inertia_couplings():
        together += 2.0 * coupling * factors.get(one, 0.0) * factors.get(other, 0.0)
    return together


def _least_torque(
    train: DriveTrain, core: _core.Train, gear: Gear, path: list[str], at: Overrunning
) -> tuple[float, str]:
    """Torque [N·m] that just breaks the load loose downward, at the next motor or else at the input; and the motor."""
    holding = {name: friction for name, (_, friction) in zip(train.shafts, core.shafts(), strict=True)}
    places = list(train.gears)
    shaft = gear.input
    torque = at.input_torque + holding[shaft]
    for name in path:
        stage = train.gears[name]
        torque = (torque + core.mesh_loss(places.index(name), torque, 0.0)[0]) / abs(stage.ratio)
        shaft = stage.input
        torque += holding[shaft]
    return torque, next((name for name, m in train.motors.items() if m.shaft == shaft), "")

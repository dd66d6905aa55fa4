"""Virtual test rig: what manufacturers measure of a gearbox, measured on the simulated one.

Nothing here reads the loss map or the torsion curve back; every figure comes out of a simulated run, as on the rigs of
figures 6 to 8 of the paper.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ..data_sheets.sheets import GearboxSheet
from ..errors import InputError
from ..inputs.arguments import checked
from ..inputs.quantities import Count, Number, Speed, Torque
from ..inputs.validation import shown
from ..model.parts import Drive, Gearbox, Load, Motor, Rigid
from ..model.signals import CommandSignal, Samples, TorqueSignal
from ..simulation.run import simulate
from ..simulation.scenario import Initial
from ..simulation.switchings import switchings_of

if TYPE_CHECKING:
    import xarray

T = TypeVar("T")

FLYWHEEL = 1e9  # [kg m2] on the input: keeps its speed, or stands still, whatever the gearbox does
RIG_FREQUENCY = 20.0  # [Hz] of the load on the stiffest segment of the curve, damped critically
SETTLING = 4.0  # [s] until a steady state is read
RAMP = 400.0  # [s] of a slow ramp
LOST_MOTION_LOAD = 0.03  # of rated torque, where lost motion is read


class RigError(ValueError):
    """A measurement did not settle."""


@dataclass(frozen=True)
class Loop:
    """One closed torsion loop: twist [rad] and torque [N·m] over a slow cycle between -amplitude and amplitude."""

    amplitude: float
    twist: Any
    torque: Any

    @property
    def width(self) -> float:
        """Twist between the branches where the torque has just gone to zero, backlash included [rad]."""
        half = len(self.torque) // 2
        return abs(self._end(slice(0, half + 1), +1.0) - self._end(slice(half, None), -1.0))

    def _end(self, branch: slice, sign: float) -> float:
        """Where a branch that unloads from this sign reaches zero torque, by its last two points before."""
        twist, torque = self.twist[branch], sign * self.torque[branch]
        k = np.flatnonzero(torque > 1e-3 * self.amplitude)
        run = k[: np.argmax(np.diff(k, append=len(twist) + 1) > 1) + 1][-2:] if len(k) > 2 else k
        (d0, d1), (T0, T1) = twist[run], torque[run]
        return float(d1 - T1 * (d1 - d0) / (T1 - T0))

    @property
    def area(self) -> float:
        """Energy lost in one cycle [J]."""
        return abs(float(np.trapezoid(self.torque, self.twist)))


@dataclass(frozen=True)
class Comparison:
    """One figure of the data sheet beside the rig's."""

    figure: str
    unit: str
    catalogue: float
    rig: float
    remark: str = ""

    @property
    def difference(self) -> float:
        """Relative."""
        return self.rig / self.catalogue - 1.0


def _positive(name: str, torque: float) -> float:
    if not torque > 0.0:
        raise InputError(f"{name}: {torque:g} N·m must be greater than 0")
    return torque


class TestRig:
    """Rig with one gearbox on it.

    Parameters
    ----------
    gearbox
        Any but a rigid one.
    """

    __test__ = False  # no test case of pytest

    @checked
    def __init__(self, gearbox: Gearbox) -> None:
        if isinstance(gearbox.stiffness, Rigid):
            raise InputError("a rigid gearbox has no torsion to measure; give gearbox.stiffness a compliance")
        self.gearbox = gearbox
        self.breaks, self.slopes = gearbox.stiffness.pieces()
        k = max(self.slopes)
        omega = 2.0 * np.pi * RIG_FREQUENCY
        self.load = Load(inertia=k / omega**2, viscous_friction=2.0 * k / omega)

    def _twist_at(self, torque: float) -> float:
        """Where the torsion curve has this torque: a start without transient."""
        rest, previous = abs(torque), 0.0
        for b, slope in zip([*self.breaks, np.inf], self.slopes, strict=True):
            if slope > 0.0 and rest <= slope * (b - previous):
                return float(np.copysign(previous + rest / slope, torque))
            rest, previous = rest - slope * (b - previous), b
        raise AssertionError("the last piece has no end")

    def _flywheel(self) -> Drive:
        motor = Motor(kind="torque_source", rotor_inertia=FLYWHEEL)
        return Drive(motor=motor, gearbox=self.gearbox, load=self.load)

    # --- (a), (e): steady state ---

    @checked
    def steady(self, input_speed: Speed, load: Number) -> tuple[float, float]:
        """(input torque, output torque) [N·m] at an input speed [rad/s] and a relative load, < 0 overrunning."""
        g = self.gearbox
        torque, speed = load * g.rated_output_torque, input_speed / g.ratio
        result = simulate(
            self._flywheel(),
            load_torque=torque - self.load.viscous_friction * speed,
            duration=SETTLING,
            sample_interval=SETTLING / 50.0,
            initial=Initial(motor_speed=input_speed, load_speed=speed, twist=self._twist_at(torque)),
            energy=False,
        )
        last = result.isel(time=slice(-10, None))
        T_1, T_2 = float(last["input_torque"].mean()), float(last["output_torque"].mean())
        if float(np.ptp(last["output_torque"].values)) > 1e-6 * g.rated_output_torque:
            raise RigError(f"no steady state at {input_speed:.4g} rad/s and load {load:g} within {SETTLING:g} s")
        return T_1, T_2

    @checked
    def efficiency(self, input_speed: Speed, load: Number) -> float:
        """Output power / input power while the motor drives, input / output while the load does."""
        T_1, T_2 = self.steady(input_speed, load)
        driving = T_2 / (self.gearbox.ratio * T_1)
        return driving if load > 0.0 else max(0.0, 1.0 / driving)

    @checked
    def efficiency_map(
        self, speeds: Iterable[Speed], loads: Iterable[Number], progress: Callable[[], None] = lambda: None
    ) -> xarray.Dataset:
        """Efficiency and loss torque over input speed [rad/s] and relative load; `progress` is called for each load."""
        g = self.gearbox
        speeds, loads = list(speeds), list(loads)
        if not speeds or not loads:
            raise InputError("a map of the efficiency needs at least one speed and one load")
        rows = []
        for mu in loads:
            rows.append([self.steady(n, mu) for n in speeds])
            progress()
        import xarray as xr

        pairs = np.array(rows)
        T_1, T_2 = pairs[..., 0], pairs[..., 1]
        return xr.Dataset(
            {
                "efficiency": (("load", "input_speed"), T_2 / (g.ratio * T_1), {"units": "1"}),
                "loss_torque": (("load", "input_speed"), T_1 - T_2 / g.ratio, {"units": "N*m"}),
            },
            coords={
                "load": ("load", loads, {"units": "1", "long_name": "output torque / rated output torque"}),
                "input_speed": ("input_speed", speeds, {"units": "rad/s"}),
            },
        )

    @checked
    def no_load_torque(self, input_speed: Speed) -> float:
        """Input torque [N·m] that turns the unloaded gearbox at this speed [rad/s]."""
        return self.steady(input_speed, 0.0)[0]

    # --- (b), (c): input locked, load ramped slowly ---

    @checked
    def torsion(self, turning_points: Iterable[Torque], samples: Count = 2000) -> xarray.Dataset:
        """Twist and torque while the load torque goes from 0 through the turning points [N·m], one ramp each."""
        points = [0.0, *turning_points]
        times = [RAMP * k for k in range(len(points))]
        # The locked input is a flywheel at rest; the load torque pulls against the output.
        return simulate(
            self._flywheel(),
            load_torque=TorqueSignal(samples=Samples(times=tuple(times), values=tuple(points))),
            duration=times[-1],
            sample_interval=RAMP / samples,
            energy=False,
        )

    @checked
    def virgin_curve(self, torque: Torque) -> tuple[Any, Any]:
        """(twist [rad], torque [N·m]) of the first loading up to a torque."""
        result = self.torsion([torque])
        return result["twist"].values, result["output_torque"].values

    @checked
    def stiffness(self, torques: Iterable[Torque], largest: Torque) -> list[float]:
        """K1, K2, ... [N·m/rad]: slopes between the given torques [N·m], and from the last up to `largest`."""
        edges = [0.0, *torques, largest]
        if any(low >= high for low, high in itertools.pairwise(edges)):
            raise InputError(f"torques {shown([*torques, largest])} N·m must rise, from above 0 up to the largest")
        twist, torque = self.virgin_curve(largest)
        out = []
        for low, high in itertools.pairwise(edges):
            inside = (torque > low + 0.1 * (high - low)) & (torque < high - 0.1 * (high - low))
            if np.count_nonzero(inside) < 3:
                twist, torque = self.virgin_curve(high)  # a short piece needs a ramp of its own
                inside = (torque > low + 0.1 * (high - low)) & (torque < high - 0.1 * (high - low))
            out.append(float(np.polyfit(twist[inside], torque[inside], 1)[0]))
        return out

    @checked
    def backlash(self, torque: Torque) -> float:
        """Total gap [rad]: twice where the first loaded segment, taken up to `torque` [N·m], meets zero torque."""
        twist, T = self.virgin_curve(_positive("torque", torque))
        inside = (0.1 * torque < T) & (0.9 * torque > T)
        slope, offset = np.polyfit(twist[inside], T[inside], 1)
        return float(-2.0 * offset / slope)

    @checked
    def loop(self, amplitude: Torque) -> Loop:
        """The loop that a slow load between -amplitude and amplitude [N·m] settles on."""
        samples, amplitude = 2000, _positive("amplitude", amplitude)
        result = self.torsion([amplitude, -amplitude, amplitude, -amplitude, amplitude], samples)
        last = result.isel(time=slice(3 * samples, None))
        return Loop(amplitude, last["twist"].values, last["output_torque"].values)

    def lost_motion(self) -> float:
        """Twist [rad] between loads of -3 % and +3 % of rated torque."""
        loop = self.loop(LOST_MOTION_LOAD * self.gearbox.rated_output_torque)
        return float(np.ptp(loop.twist))

    # --- (d): breaking loose ---

    @checked
    def starting_torque(self, load: Number = 0.0) -> float:
        """Input torque [N·m] that sets the gearbox in motion against a relative load, by a slow ramp."""
        g = self.gearbox
        against = load * g.rated_output_torque
        begin, most = against / g.ratio, (1.0 + 4.0 * load) * g.rated_output_torque / g.ratio
        result = simulate(
            self._braked(),
            command=CommandSignal(samples=Samples(times=(0.0, RAMP), values=(begin, begin + most))),
            load_torque=against,
            duration=RAMP,
            sample_interval=RAMP,
            initial=Initial(twist=self._twist_at(against)),
            energy=False,
        )
        return begin + most * self._break_away(result)[0] / RAMP

    def backdriving_torque(self) -> float | None:
        """Output torque [N·m] that sets the gearbox in motion with a free input, by a slow ramp; None: it holds three times its rated torque."""
        g = self.gearbox
        result = simulate(
            self._braked(),
            load_torque=TorqueSignal(samples=Samples(times=(0.0, RAMP), values=(0.0, -3.0 * g.rated_output_torque))),
            duration=RAMP,
            sample_interval=RAMP,
            energy=False,
        )
        try:
            return abs(self._break_away(result)[1])
        except RigError:
            return None

    def _braked(self) -> Drive:
        """The gearbox driven by a torque; a damper on the input, without effect at rest, keeps it slow once loose."""
        g = self.gearbox
        damper = g.rated_output_torque / g.ratio / (1e-3 * g.rated_input_speed)
        motor = Motor(kind="torque_source", rotor_inertia=g.inertia or self.load.inertia / g.ratio**2)
        return Drive(motor=motor, gearbox=g.model_copy(update={"viscous_friction": damper}), load=self.load)

    @staticmethod
    def _break_away(result: xarray.Dataset) -> tuple[float, float]:
        """(instant [s], output torque [N·m]) at which the input shaft first starts to turn."""
        switchings = switchings_of(result)
        freed = (switchings["input_contact_before"] == 0) & (switchings["input_contact_after"] != 0)
        events = np.flatnonzero(freed.values)
        if len(events) == 0:
            raise RigError("the input shaft never started to turn")
        k = events[0]
        return float(switchings["instant"][k]), float(switchings["output_torque_before"][k])


@dataclass(frozen=True)
class RigReport:
    """All measurements of one gearbox."""

    gearbox: Gearbox
    map: xarray.Dataset
    """efficiency and loss torque, motor driving"""
    no_load: tuple[Any, Any]
    """input speeds [rad/s], torques [N·m]"""
    virgin: tuple[Any, Any]
    """twist [rad], torque [N·m] of the first loading"""
    loops: tuple[Loop, ...]
    """at falling amplitudes, the largest at rated torque"""
    starting_torque: float
    backdriving_torque: float | None
    lost_motion: float
    comparisons: tuple[Comparison, ...] = field(default=())


# What the rig measures beside its comparisons: parts of rated speed, and relative loads.
SPEEDS = (0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0)
LOADS = (0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0, 1.25, 1.5)
LOOPS = (1.0, 0.6, 0.3)
WORK = len(LOADS) + len(LOOPS) + 6  # how often `measure` reports progress


@checked
def measure(
    gearbox: Gearbox,
    sheet: GearboxSheet | None = None,
    notes: Iterable[str] = (),
    progress: Callable[[], None] = lambda: None,
) -> RigReport:
    """Measure all figures of a gearbox.

    Parameters
    ----------
    sheet
        Figures to compare with.
    notes
        Of the loss map's making; a contradiction among the figures is pointed out beside them.
    progress
        Called `WORK` times.
    """
    rig = TestRig(gearbox)
    T_2R, n_1R = gearbox.rated_output_torque, gearbox.rated_input_speed
    speeds = n_1R * np.array(SPEEDS)

    def done(measured: T) -> T:
        progress()
        return measured

    return RigReport(
        gearbox=gearbox,
        map=rig.efficiency_map(speeds, LOADS, progress),
        no_load=(speeds, done(np.array([rig.no_load_torque(n) for n in speeds]))),
        virgin=done(rig.virgin_curve(1.2 * T_2R)),
        loops=tuple(done(rig.loop(share * T_2R)) for share in LOOPS),
        starting_torque=done(rig.starting_torque()),
        backdriving_torque=done(rig.backdriving_torque()),
        lost_motion=done(rig.lost_motion()),
        comparisons=done(() if sheet is None else tuple(_compare(rig, sheet, tuple(notes)))),
    )


def _compare(rig: TestRig, sheet: GearboxSheet, notes: tuple[str, ...]) -> Iterable[Comparison]:
    """Each figure of the sheet beside the same measured."""
    contradiction = "contradicts the no-load torque; see note" if any("Contradiction" in n for n in notes) else ""
    figures = sheet.losses
    rpm = 30.0 / np.pi

    def here(temperature: float | None) -> bool:
        """Whether a figure is of the temperature that the gearbox was made for."""
        return temperature in (None, figures.temperature)

    for p in filter(lambda p: here(p.temperature), figures.all_efficiencies()):
        what = f"efficiency at {rpm * p.input_speed:.0f} rpm, load {p.load:g}"
        yield Comparison(what, "1", p.efficiency, rig.efficiency(p.input_speed, p.load), contradiction)
    for p in filter(lambda p: here(p.temperature), figures.backdrive_efficiency):
        what = f"back-drive efficiency at {rpm * p.input_speed:.0f} rpm, load {p.load:g}"
        yield Comparison(what, "1", p.efficiency, rig.efficiency(p.input_speed, -p.load), contradiction)
    for q in filter(lambda q: here(q.temperature), figures.no_load_torque):
        what = f"no-load torque at {rpm * q.input_speed:.0f} rpm"
        yield Comparison(what, "N·m", q.torque, rig.no_load_torque(q.input_speed))
    if figures.starting_torque is not None and here(figures.starting_temperature):
        yield Comparison("starting torque", "N·m", figures.starting_torque, rig.starting_torque())
    if figures.backdriving_torque is not None and here(figures.backdriving_temperature):
        yield Comparison("back-driving torque", "N·m", figures.backdriving_torque, rig.backdriving_torque() or np.inf)
    if figures.static_efficiency is not None:
        eta = rig.gearbox.rated_output_torque / (rig.gearbox.ratio * rig.starting_torque(1.0))
        yield Comparison("static efficiency at rated load", "1", figures.static_efficiency, eta)
    if sheet.stiffness is not None:
        torques = sheet.stiffness.torques
        largest = max(1.5 * (torques[-1] if torques else 0.0), rig.gearbox.rated_output_torque)
        measured = rig.stiffness(torques, largest)
        for k, (printed, value) in enumerate(zip(sheet.stiffness.slopes, measured, strict=True)):
            yield Comparison(f"torsional stiffness K{k + 1}", "N·m/rad", printed, value)
    if sheet.backlash:
        first = sheet.stiffness.torques[0] if sheet.stiffness and sheet.stiffness.torques else 0.0
        value = rig.backlash(first or 0.5 * rig.gearbox.rated_output_torque)
        yield Comparison("backlash", "arcmin", np.degrees(sheet.backlash) * 60.0, np.degrees(value) * 60.0)
    if sheet.hysteresis_loss is not None:
        value = rig.loop(rig.gearbox.rated_output_torque).width
        yield Comparison(
            "hysteresis loss", "arcmin", np.degrees(sheet.hysteresis_loss) * 60.0, np.degrees(value) * 60.0
        )

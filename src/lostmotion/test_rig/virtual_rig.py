"""Virtual test rig: what manufacturers measure of a gearbox or a screw, measured on the simulated one.

Nothing here reads the loss map or the torsion curve. Every value is measured in a simulated run, as on the rigs of
figures 6 to 8 of the paper.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from ..control.command import CommandSignal
from ..errors import InputError
from ..inputs.argument_checks import checked
from ..inputs.memory_limits import check_free
from ..inputs.quantities import Count, Number, Speed, Torque
from ..inputs.refusal_messages import shown
from ..model.drive import Drive
from ..model.gear import Gear
from ..model.gearbox import Gearbox
from ..model.load import Load
from ..model.motor import Motor
from ..model.signals import Samples, TorqueSignal
from ..model.torsion import Rigid
from ..simulation.forms.drive_tables import Initial
from ..simulation.runs.results import RunArrays
from ..simulation.runs.run import run
from ..simulation.scenario.scenario import Scenario
from .torsion_loop import Loop, break_away, gap, segment

PAIR = 100.0  # bytes for a point of a map

if TYPE_CHECKING:
    import xarray

FLYWHEEL = 1e9  # [kg m2] on the input: keeps its speed, or stays at rest, whatever the gearbox does
LARGE_TORQUE = 100.0  # at the input [N·m]
SETTLING = 4.0  # [s] until a steady state is read
RAMP = 400.0  # [s] of a slow ramp
RIGID_LOAD = (
    0.01  # inertia of the load on a rigid gearbox, of that on its input: with a large one a lossy rigid mesh may jam
)
LOST_MOTION_LOAD = 0.03  # of rated torque, where lost motion is read


class RigError(ValueError):
    """A measurement did not settle."""


class TestRig:
    """Rig with one gearbox on it.

    Parameters
    ----------
    gearbox
        A rigid one has no torsion to measure; a gear of a drive train is measured alone, as `Gear.gearbox` says.
    """

    __test__ = False  # no test case of pytest
    unit = "N·m"  # of the load
    frequency = 20.0  # [Hz] of the load on the stiffest segment of the curve, damped critically
    without_torsion = "a rigid gearbox has no torsion to measure; give gearbox.stiffness a compliance"

    @checked
    def __init__(self, gearbox: Gearbox | Gear) -> None:
        self._mount(gearbox)

    def _mount(self, gearbox: Gearbox | Gear, drag: float = 0.0) -> None:
        """Put a gearbox on the rig, with a dry friction on its input shaft [N·m]."""
        if isinstance(gearbox, Gear):
            gearbox = gearbox.gearbox()
        self.gearbox = gearbox = gearbox.forward()
        self.drag = drag
        self.rigid = isinstance(gearbox.stiffness, Rigid)  # without a twist
        self.load = self._load()

    def _load(self) -> Load:
        """Damped critically on the gearbox; on a rigid one, where nothing swings, small beside the input shaft."""
        stiffness = self.gearbox.stiffness
        if isinstance(stiffness, Rigid):
            return Load(inertia=RIGID_LOAD * (self.gearbox.inertia or 1.0) * self.gearbox.ratio**2)
        k = max(stiffness.all_slopes())
        omega = 2.0 * np.pi * self.frequency
        return Load(inertia=k / omega**2, viscous_friction=2.0 * k / omega)

    def _twist_at(self, torque: float) -> float:
        """Twist of the torsion curve at this torque, for a start without transient."""
        stiffness = self.gearbox.stiffness
        return 0.0 if isinstance(stiffness, Rigid) else stiffness.core().twist(torque)

    @staticmethod
    def _run(drive: Drive, **surroundings: Any) -> RunArrays:
        return run(Scenario.of_drive(drive, **surroundings), energy=False)

    def _flywheel(self) -> Drive:
        # So large that its speed does not sink notably under the torque of a large gear of low ratio either.
        share = max(1.0, self.gearbox.rated_output_torque / self.gearbox.ratio / LARGE_TORQUE)
        return Drive(motor=self._input(share * FLYWHEEL), gearbox=self.gearbox, load=self.load)

    def _input(self, inertia: float) -> Motor:
        """The motor of the rig, with the drag of what is on it."""
        return Motor(kind="torque_source", rotor_inertia=inertia, friction_torque=self.drag)

    def _positive(self, name: str, torque: float) -> float:
        if not torque > 0.0:
            raise InputError(f"{name}: {torque:g} {self.unit} must be greater than 0")
        return torque

    # --- (a), (e): steady state ---

    @checked
    def steady(self, input_speed: Speed, load: Number) -> tuple[float, float]:
        """(input torque, output torque) [N·m] at an input speed [rad/s] and a relative load, < 0 overrunning."""
        g = self.gearbox
        torque, speed = load * g.rated_output_torque, input_speed / g.ratio
        result = self._run(
            self._flywheel(),
            load_torque=torque - self.load.viscous_friction * speed,
            duration=SETTLING,
            sample_interval=SETTLING / 50.0,
            initial=Initial(motor_speed=input_speed, load_speed=speed, twist=self._twist_at(torque)),
        )
        in_end, out_end = result["input_torque"][-10:], result["output_torque"][-10:]
        T_1, T_2 = float(in_end.mean()), float(out_end.mean())
        if float(np.ptp(out_end)) > 1e-6 * g.rated_output_torque:
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
        points = len(speeds) * len(loads)
        check_free(PAIR * points, f"{points:.3g} points of the map", "give fewer speeds or loads")
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
        """Twist and torque while the load torque goes from 0 through the turning points [N·m], one ramp each.

        Raises
        ------
        InputError
            The gearbox is rigid.
        """
        return self._torsion(turning_points, samples).dataset()

    def _torsion(self, turning_points: Iterable[float], samples: int = 2000) -> RunArrays:
        """The same without a dataset."""
        if self.rigid:
            raise InputError(self.without_torsion)
        points = [0.0, *turning_points]
        times = [RAMP * k for k in range(len(points))]
        # The locked input is a flywheel at rest; the load torque pulls against the output.
        return self._run(
            self._flywheel(),
            load_torque=TorqueSignal(samples=Samples(times=tuple(times), values=tuple(points))),
            duration=times[-1],
            sample_interval=RAMP / samples,
        )

    @checked
    def initial_loading_curve(self, torque: Torque) -> tuple[Any, Any]:
        """(twist [rad], torque [N·m]) of the first loading up to a torque."""
        result = self._torsion([torque])
        return result["twist"], result["output_torque"]

    @checked
    def stiffness(self, torques: Iterable[Torque], up_to: Torque) -> list[float]:
        """K1, K2, ... [N·m/rad]: slopes between the given torques [N·m], and from the last up to `up_to`."""
        edges = [0.0, *torques, up_to]
        if any(low >= high for low, high in itertools.pairwise(edges)):
            raise InputError(
                f"torques {shown([*torques, up_to])} {self.unit} must rise, from above 0 up to the last one"
            )
        twist, torque = self.initial_loading_curve(up_to)
        out = []
        for low, high in itertools.pairwise(edges):
            slope, _ = segment(twist, torque, low, high)
            if np.isnan(slope):
                twist, torque = self.initial_loading_curve(high)  # a short piece needs a ramp of its own
                slope, _ = segment(twist, torque, low, high)
            out.append(slope)
        return out

    @checked
    def backlash(self, torque: Torque) -> float:
        """Total gap [rad]: twice where the first loaded segment, taken up to `torque` [N·m], meets zero torque."""
        return gap(*self.initial_loading_curve(self._positive("torque", torque)), torque)

    @checked
    def loop(self, amplitude: Torque) -> Loop:
        """The loop that a slow load between -amplitude and amplitude [N·m] settles on."""
        samples, amplitude = 2000, self._positive("amplitude", amplitude)
        result = self._torsion([amplitude, -amplitude, amplitude, -amplitude, amplitude], samples)
        return Loop(amplitude, result["twist"][3 * samples :], result["output_torque"][3 * samples :])

    def lost_motion(self) -> float:
        """Twist [rad] between loads of -3 % and +3 % of rated torque; 0 of a rigid gearbox."""
        if self.rigid:
            return 0.0
        loop = self.loop(LOST_MOTION_LOAD * self.gearbox.rated_output_torque)
        return float(np.ptp(loop.twist))

    # --- (d): breaking loose ---

    @checked
    def starting_torque(self, load: Number = 0.0) -> float:
        """Input torque [N·m] that sets the gearbox in motion against a relative load, by a slow ramp."""
        g = self.gearbox
        against = load * g.rated_output_torque
        begin, rise = against / g.ratio, (1.0 + 4.0 * load) * g.rated_output_torque / g.ratio + 2.0 * self.drag
        result = self._run(
            self._braked(),
            command=CommandSignal(samples=Samples(times=(0.0, RAMP), values=(begin, begin + rise))),
            load_torque=against,
            duration=RAMP,
            sample_interval=RAMP,
            initial=Initial(twist=self._twist_at(against)),
        )
        return begin + rise * self._break_away(result)[0] / RAMP

    def backdriving_torque(self) -> float | None:
        """Output torque [N·m] that sets the gearbox in motion with a free input, by a slow ramp; None: it holds three times its rated torque."""
        g = self.gearbox
        result = self._run(
            self._braked(),
            load_torque=TorqueSignal(samples=Samples(times=(0.0, RAMP), values=(0.0, -3.0 * g.rated_output_torque))),
            duration=RAMP,
            sample_interval=RAMP,
        )
        try:
            return abs(self._break_away(result)[1])
        except RigError:
            return None

    def _braked(self) -> Drive:
        """The gearbox driven by a torque; a damper on the input, without effect at rest, keeps it slow once loose."""
        g = self.gearbox
        damper = g.rated_output_torque / g.ratio / (1e-3 * g.rated_input_speed)
        motor = self._input(g.inertia or self.load.inertia / g.ratio**2)
        return Drive(motor=motor, gearbox=g.model_copy(update={"viscous_friction": damper}), load=self.load)

    @staticmethod
    def _break_away(result: RunArrays) -> tuple[float, float]:
        """(instant [s], output torque [N·m]) at which the input shaft first starts to turn: at once where nothing holds it."""
        if (found := break_away(result)) is not None and result["input_contact"][0] == 0:
            return found["instant"], found["output_torque_before"]
        if result["input_contact"][-1] == 0:  # it rests, and has never switched
            raise RigError("the input shaft never started to turn")
        return 0.0, float(result["output_torque"][0])

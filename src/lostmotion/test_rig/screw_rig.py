"""Virtual test rig for screws: play, stiffness, drag and losses, measured on the simulated axis.

Nothing here reads the stiffness or the losses back; every value comes out of a run of a screw between a shaft and a slide.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from typing import Any

import numpy as np

from ..errors import InputError
from ..inputs.arguments import checked
from ..inputs.quantities import Force, Number, Speed
from ..model.linear import ScrewData
from ..model.torsion import Rigid
from ..simulation.runs.results import RunArrays
from ..simulation.runs.run import run
from ..simulation.scenario.scenario import Scenario
from .torsion_loop import Loop, break_away, gap, segment
from .virtual_rig import LOST_MOTION_LOAD, RAMP, RigError

LOCKED = 1e12  # [N m] of friction on the input while it is locked
FLYWHEEL = 1e9  # [kg m2] on the input: keeps its speed whatever the screw does
COASTING = 100.0  # [kg m2] on the input while it coasts
COASTING_TIME = 1.0  # [s]
LIGHT_SHAFT = 1e-3  # [kg m2] on the input where a torque or a force sets it in motion
SETTLING = 0.5  # [s] until a steady state is read
RIG_FREQUENCY = 200.0  # [Hz] of the slide on the stiffest segment, damped critically
LIGHT = 1.0  # [kg] of the slide where its inertia should not count
TURN = 100.0  # [s] of the slow turn in which the pitch error is read
SAMPLES = 1000  # of a ramp
MOST = 3.0  # of the load: how far the search for a force that drives the screw back goes


class ScrewRig:
    """Rig with one screw on it: an input shaft, the screw, and a slide that a force acts on.

    screw: a rigid one has no stiffness to measure.
    load: axial force [N] that measurements refer to, such as a tenth of the dynamic capacity.

    Examples
    --------
    >>> import lostmotion as lm
    >>> screw = lm.model.Screw(input="motor", output="table", lead="10 mm", stiffness="200 N/um", efficiency=0.9, drag_torque=0.1)
    >>> rig = ScrewRig(screw, load=1000.0)
    >>> round(rig.stiffness()[0] / 1e6), round(rig.drag_torque(100.0), 6), round(rig.efficiency(1.0), 6)
    (200, 0.1, 0.9)
    """

    __test__ = False  # no test case of pytest

    @checked
    def __init__(self, screw: ScrewData, *, load: Force) -> None:
        if not load > 0.0:
            raise InputError(f"load: {load:g} N must be greater than 0")
        self.screw, self.load = screw, load
        self._travel = screw.travel() / (2.0 * np.pi)  # [m/rad]
        gear = screw.gear("input", "slide")
        self._inertia = gear.inertia
        self.rigid = isinstance(gear.stiffness, Rigid)  # without any deflection
        self._k = 0.0 if isinstance(gear.stiffness, Rigid) else max(gear.stiffness.all_slopes())
        omega = 2.0 * np.pi * RIG_FREQUENCY
        self._mass = LIGHT if self.rigid else self._k / omega**2
        self._damping = 0.0 if self.rigid else 2.0 * self._k / omega

    def _run(
        self,
        duration: float,
        samples: int,
        *,
        inertia: float,
        friction: float = 0.0,
        viscous: float = 0.0,
        mass: float | None = None,
        damping: float = 0.0,
        force: Any = 0.0,
        command: Any = None,
        speed: float = 0.0,
        deflection: float = 0.0,
        without_error: bool = False,
    ) -> RunArrays:
        """A run of the axis; friction is the rig's on the input shaft, beside the screw's own drag."""
        screw = {n: getattr(self.screw, n) for n in self.screw.model_fields_set if n in ScrewData.model_fields}
        if without_error:
            screw.pop("pitch_error", None)
        initial: dict[str, Any] = {"speeds": {"input": speed}, "slide_speeds": {"slide": self._travel * speed}}
        if deflection and not self.rigid:
            initial["deflections"] = {"screw": deflection}
        tables: dict[str, Any] = {
            "shafts": {"input": {"inertia": inertia, "friction_torque": friction, "viscous_friction": viscous}},
            "slides": {
                "slide": {"mass": self._mass if mass is None else mass, "viscous_friction": damping, "force": force}
            },
            "screws": {"screw": {"input": "input", "output": "slide", **screw}},
            "initial": initial,
            "simulation": {"duration": duration, "sample_interval": duration / samples},
        }
        if command is not None:
            tables["motors"] = {
                "motor": {"shaft": "input", "kind": "torque_source", "rotor_inertia": 0.0, "rated_torque": 1.0}
            }
            tables["command"] = {"motor": command}
        return run(Scenario(**tables), energy=False)

    # --- the input locked: deflection under an axial force ---

    def _loaded(self, forces: list[float], samples: int) -> RunArrays:
        """Slow ramps of the force through some values, the input locked."""
        if self.rigid:
            raise InputError("a rigid screw has no deflection to measure; give it a stiffness")
        times = [RAMP * k for k in range(len(forces))]
        return self._run(
            times[-1],
            samples * (len(forces) - 1),
            inertia=1.0,
            friction=LOCKED,
            damping=self._damping,
            force={"samples": {"times": times, "values": forces}},
        )

    def _deflection(self, result: RunArrays) -> Any:
        """Deflection of the slide towards the side to which the force pushes it [m]."""
        return -(result["slide_position"] - result["slide_position"][0])

    @checked
    def first_loading(self, force: Force) -> tuple[Any, Any]:
        """(deflection [m], force [N]) while a slow force rises from 0."""
        result = self._loaded([0.0, force], SAMPLES)
        return self._deflection(result), np.linspace(0.0, force, SAMPLES + 1)

    def stiffness(self, breaks: Iterable[float] = ()) -> list[float]:
        """Mean axial stiffness [N/m] of each segment between some forces [N], in the middle 80 % of the segment."""
        ends = [0.0, *breaks]
        ends.append(max(self.load, 1.5 * ends[-1]))
        x, F = self.first_loading(ends[-1])
        return [segment(x, F, low, high)[0] for low, high in itertools.pairwise(ends)]

    @checked
    def loop(self, amplitude: Force) -> Loop:
        """The loop that a slow force between -amplitude and amplitude [N] settles on: deflection [m] over force."""
        result = self._loaded([0.0, amplitude, -amplitude, amplitude, -amplitude, amplitude], SAMPLES)
        ramps = np.interp(np.arange(2 * SAMPLES + 1), [0, SAMPLES, 2 * SAMPLES], [amplitude, -amplitude, amplitude])
        return Loop(amplitude, self._deflection(result)[3 * SAMPLES :], ramps)

    def lost_motion(self) -> float:
        """Travel of the slide [m] between forces of -3 % and +3 % of the load, the input locked; 0 of a rigid screw."""
        if self.rigid:
            return 0.0
        return float(np.ptp(self.loop(LOST_MOTION_LOAD * self.load).twist))

    @checked
    def backlash(self, force: Force) -> float:
        """Axial play [m]: twice where the first loaded segment, taken up to a force [N], meets zero force."""
        return gap(*self.first_loading(force), force)

    # --- in motion ---

    @checked
    def drag_torque(self, speed: Speed) -> float:
        """Torque [N·m] that keeps the unloaded screw turning at a speed [rad/s]: the mean deceleration of a coasting flywheel."""
        result = self._run(COASTING_TIME, 10, inertia=COASTING, mass=LIGHT, speed=speed, without_error=True)
        inertia = COASTING + self._inertia + LIGHT * self._travel**2
        lost = speed - float(result["input_speed"][-1])
        return inertia * lost / COASTING_TIME

    @checked
    def efficiency(self, share: Number) -> float:
        """Power out over power in of the thread at a share of the load, without the drag; < 0: the slide drives."""
        speed = 10.0
        force = share * self.load
        result = self._run(
            SETTLING,
            50,
            inertia=FLYWHEEL,
            damping=self._damping,
            force=force - self._damping * self._travel * speed,
            speed=speed,
            deflection=self._at(force),
            without_error=True,
        )
        T = result["screw_input_torque"][-10:]
        if float(np.ptp(T)) > 1e-6 * self.load * self._travel:
            raise RigError(f"no steady state at {share:g} of the load within {SETTLING:g} s")
        driving = force * self._travel / float(T.mean())
        return driving if share > 0.0 else max(0.0, 1.0 / driving)

    def pitch_error(self) -> float:
        """Travel of the slide minus the travel of the lead [m], from peak to peak over a slow turn without a force."""
        speed = 2.0 * np.pi / TURN
        result = self._run(TURN, 720, inertia=FLYWHEEL, mass=LIGHT, damping=self._slow(), speed=speed)
        ideal = self._travel * result["input_angle"]
        return float(np.ptp((result["slide_position"] - ideal)[72:]))

    def _slow(self) -> float:
        """Damping of a light slide [N·s/m], critical on the stiffest segment; none of a rigid screw."""
        return 0.0 if self.rigid else 2.0 * float(np.sqrt(self._k * LIGHT))

    def _at(self, force: float) -> float:
        """Deflection of the screw at this force, for a start without transient."""
        if self.rigid or self.screw.stiffness_curve is not None:
            return 0.0
        return float(np.copysign(0.5 * self.screw.backlash + abs(force) / self._k, force))

    def backdriving_force(self) -> float | None:
        """Axial force [N] that sets the screw in motion with a free input, by a slow ramp; None: it holds three times the load."""
        most = MOST * self.load
        result = self._run(
            RAMP,
            10,
            inertia=LIGHT_SHAFT,
            viscous=self._brake(),
            damping=self._damping,
            force={"samples": {"times": [0.0, RAMP], "values": [0.0, -most]}},
            deflection=-0.5 * self.screw.backlash,
        )
        instant = self._starts(result)
        return None if instant is None else most * instant / RAMP

    def starting_torque(self) -> float:
        """Torque [N·m] on the input that sets the screw in motion against the load, by a slow ramp."""
        begin = self.load * self._travel
        rise = 4.0 * begin + 2.0 * self.screw.drag_torque
        result = self._run(
            RAMP,
            10,
            inertia=LIGHT_SHAFT,
            viscous=self._brake(),
            damping=self._damping,
            force=self.load,
            command={"samples": {"times": [0.0, RAMP], "values": [begin, begin + rise]}},
            deflection=self._at(self.load),
        )
        instant = self._starts(result)
        if instant is None:
            raise RigError("the input shaft never started to turn")
        return begin + rise * instant / RAMP

    def _brake(self) -> float:
        """A damper on the input [N·m·s/rad], without effect at rest, which keeps the screw slow once it is loose."""
        return 1e3 * self.load * self._travel

    @staticmethod
    def _starts(result: RunArrays) -> float | None:
        """The instant [s] at which the input shaft first starts to turn, 0 where nothing holds it; None: never."""
        if "input_contact" not in result or result["input_contact"][0] != 0:
            return 0.0
        found = break_away(result)
        return None if found is None else found["instant"]

"""Virtual test rig for screws: the rig of gearboxes, whose output is then a slide, with the drag and the pitch error of a screw."""

from __future__ import annotations

import math

import numpy as np

from ..errors import InputError
from ..inputs.argument_checks import checked
from ..inputs.quantities import Force, Speed
from ..model.drive import Drive
from ..model.load import Load
from ..model.screw import ScrewData
from ..model.torsion import Rigid
from ..simulation.forms.drive_tables import Initial
from ..simulation.runs.run import run
from ..simulation.scenario.scenario import Scenario
from ..units.practical import RPM
from .virtual_rig import FLYWHEEL, TestRig

RATED = 1000.0 / RPM  # [rad/s] at which the drag is compared
COASTING = 100.0  # [kg m2] on the input while it coasts
COASTING_TIME = 1.0  # [s]
LIGHT = 1.0  # [kg] of the slide where its inertia should not count
TURN = 100.0  # [s] of the slow turn in which the pitch error is read


class ScrewRig(TestRig):
    """Rig with one screw on it: an input shaft, the screw, and a slide that a force acts on.

    A slide is the output of a gearbox in units of translation: twists are deflections [m], output torques are forces [N].

    screw: a rigid one has no stiffness to measure.
    load: axial force [N] that measurements refer to, such as a tenth of the dynamic capacity.

    Examples
    --------
    >>> import lostmotion as lm
    >>> screw = lm.model.Screw(input="motor", output="table", lead="10 mm", stiffness="200 N/um", efficiency=0.9, drag_torque=0.1)
    >>> rig = ScrewRig(screw, load=1000.0)
    >>> round(rig.stiffness([], 1000.0)[0] / 1e6), round(rig.drag_torque(100.0), 6), round(rig.efficiency(10.0, 1.0), 6)
    (200, 0.1, 0.9)
    """

    unit = "N"
    frequency = 200.0
    without_torsion = "a rigid screw has no deflection to measure; give it a stiffness"

    @checked
    def __init__(self, screw: ScrewData, *, load: Force) -> None:
        if not load > 0.0:
            raise InputError(f"load: {load:g} N must be greater than 0")
        self.screw = screw
        rated = {"rated_output_torque": load, "rated_input_speed": RATED}
        self._mount(screw.gear("input", "slide").model_copy(update=rated), screw.drag_torque)

    @checked
    def drag_torque(self, speed: Speed) -> float:
        """Torque [N·m] that keeps the unloaded screw turning at a speed [rad/s]: the mean deceleration of a coasting flywheel."""
        g, load = self.gearbox, Load(inertia=LIGHT)
        result = self._run(
            Drive(motor=self._input(COASTING), gearbox=g, load=load),
            duration=COASTING_TIME,
            sample_interval=COASTING_TIME / 10.0,
            initial=Initial(motor_speed=speed, load_speed=speed / g.ratio),
        )
        inertia = COASTING + (g.inertia or 0.0) + LIGHT / g.ratio**2
        return inertia * (speed - float(result["motor_speed"][-1])) / COASTING_TIME

    def pitch_error(self) -> float:
        """Travel of the slide minus the travel of the lead [m], from peak to peak over a slow turn without a force."""
        speed, travel = 2.0 * np.pi / TURN, 1.0 / self.screw.ratio()
        screw = {n: getattr(self.screw, n) for n in self.screw.model_fields_set if n in ScrewData.model_fields}
        stiffness = self.gearbox.stiffness
        damping = 0.0 if isinstance(stiffness, Rigid) else 2.0 * math.sqrt(max(stiffness.all_slopes()) * LIGHT)
        result = run(
            Scenario(
                shafts={"input": {"inertia": FLYWHEEL}},
                slides={"slide": {"mass": LIGHT, "viscous_friction": damping}},
                screws={"screw": {"input": "input", "output": "slide", **screw}},
                initial={"speeds": {"input": speed}, "slide_speeds": {"slide": travel * speed}},
                simulation={"duration": TURN, "sample_interval": TURN / 720.0},
            ),
            energy=False,
        )
        error = result["slide_position"] - travel * result["input_angle"]
        return float(np.ptp(error[72:]))

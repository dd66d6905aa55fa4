"""Figures of docs/motors.md: a synchronous motor in a cycle that repeats, and beyond the voltage of its magnets."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from figure_files import save

import lostmotion as lm
from lostmotion.reports.figure_style import FAINT, FIRST, SECOND
from lostmotion.reports.panels import Curve, Panel
from lostmotion.sizing.winding_temperature import TwoBodies, mean_square

CYCLE = 20.0  # s: one second of acceleration, 4 s of rest, one of braking, and so on


def scenario() -> lm.Scenario:
    """A flywheel on the motor `maxon-ec-i-52-606793` with field orientation, sped up and braked with 0.7 N·m."""
    base = lm.load(
        "step-to-standstill", {"motor.from": "maxon-ec-i-52-606793", "motor.kind": "torque_source", "command": 0.0}
    )
    sine = lm.load("step-to-standstill", {"motor.from": "maxon-ec-i-52-606793", "motor.kind": "synchronous"}).motor
    limits = base.motor.limits.model_copy(update={"resistance": None, "torque_constant": None})
    motor = base.motor.model_copy(
        update={"winding": sine.winding, "limits": limits, "rated_torque": 1.0, "dc_voltage": 24.0}
    )
    times, torque = (0.0, 5.0, 6.0, 10.0, 15.0, 16.0), (1.1, -1.1, 0.2, -1.1, 1.1, -0.2)
    steps = np.diff(torque, prepend=0.0)
    return base.replace(
        motor=motor.model_dump(),
        command={"steps": [{"height": float(h), "time": t} for h, t in zip(steps, times, strict=True)]},
        simulation={"duration": CYCLE, "sample_interval": 0.02},
    )


def write(out: Path) -> None:
    """The page's figures into a directory."""
    write_weakening(out)
    result = lm.simulate(scenario())
    current = lm.sizing.motor_current(result)
    steady = lm.sizing.temperatures(result, repeated=True)
    time = result["time"].values
    curves = (
        Curve("phase, amplitude", time, current["current"].values, SECOND),
        Curve("rms", time, current["current_rms"].values, FIRST),
    )
    motor = lm.simulation.scenario_of(result).motor
    bodies = TwoBodies.of(motor, 25.0)
    long = np.concatenate([n * CYCLE + time[:-1] for n in range(360)])  # from cold, cycle by cycle
    torque = np.tile(result["motor_torque"].values[:-1], 360)
    hours = long[:: len(time) - 1] / 3600.0
    winding, case = (T[:: len(time) - 1] for T in bodies.course(long, mean_square(torque), (25.0, 25.0)))
    ends = [float(steady[f"{name}_temperature"][-1]) for name in ("winding", "case")]
    warming = (
        Curve("winding", hours, winding, FIRST),
        Curve("case", hours, case, SECOND),
        *(Curve("repeated for ever", [0.0, hours[-1]], [end, end], FAINT, None if k == 0 else "_") for k, end in enumerate(ends)),
    )  # fmt: skip
    within = (
        Curve("winding", time, steady["winding_temperature"].values, FIRST),
        Curve("case", time, steady["case_temperature"].values, SECOND),
    )
    panels = [
        Panel("one cycle", "time [s]", "current [A]", curves),
        Panel("from cold, at the end of each cycle", "time [h]", "temperature [°C]", warming),
        Panel("the cycle repeated for ever", "time [s]", "temperature [°C]", within),
    ]
    save(panels, 3, (13.0, 3.4), out, "motors-temperatures")


def write_weakening(out: Path) -> None:
    """The shipped scenario beyond the voltage."""
    result = lm.simulate(lm.load("field-weakening"))
    time, rpm = result["time"].values, 30.0 / np.pi
    speed = (
        Curve("reference", time, rpm * result["m_speed_reference"].values, FAINT),
        Curve("motor", time, rpm * result["motor_speed"].values, FIRST),
    )
    currents = (
        Curve("across the magnets, $i_q$", time, result["m_quadrature_current"].values, SECOND),
        Curve("along the magnets, $i_d$", time, result["m_direct_current"].values, FIRST),
    )
    of_motor = lm.sizing.motor_current(result)
    limit = of_motor.attrs["voltage_limit"]
    voltage = (
        Curve("motor", time, of_motor["voltage"].values, FIRST),
        Curve("largest", [time[0], time[-1]], [limit, limit], FAINT),
    )
    panels = [
        Panel("speed", "time [s]", "speed [rpm]", speed),
        Panel("currents, amplitude", "time [s]", "current [A]", currents),
        Panel("voltage, amplitude of a phase", "time [s]", "voltage [V]", voltage),
    ]
    save(panels, 3, (13.0, 3.4), out, "motors-field-weakening")

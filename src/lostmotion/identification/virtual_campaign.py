"""A test campaign before there is a test bench: experiments of the virtual rig as logs, and the file that identifies the gearbox from them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from ..atomic_writer import write_bytes
from ..errors import InputError
from ..inputs.argument_checks import checked
from ..inputs.quantities import Count
from ..inputs.toml_text import toml_text
from ..model.angle_torques import TorqueHarmonic
from ..model.gear import Gear
from ..model.gearbox import Gearbox
from ..model.losses import LossMap
from ..model.torsion import TorsionCurve
from ..simulation.scenario.scenario import Scenario
from ..simulation.scenario.scenario_files import scenario_text
from .readers.log import Channel, Log
from .rig.rig_scenario import Rig
from .task.identification_file import Identification
from .virtual_logs import virtual_log

INTERVAL = 5e-3  # [s] between samples
PERIOD = 4.0  # [s] of a ramp
RISE = 0.5  # [s] until a run without ramp has its full torque
DAMPING = 0.05  # damping ratio of the mesh, which data sheets do not give
HALF = "locked-ramp-half"  # the smaller loop of a gearbox with hysteresis
OFF = 1.25  # by which start values are off, so that the logs have to bring them back
ENCODERS = {"motor_angle": 2 * math.pi / 2**16, "output_angle": 2 * math.pi / 2**22}  # steps [rad]
TORQUE_NOISE = 2e-3  # of the rated output torque
LOAD_INERTIA = 2.0  # inertia of the load machine over the gearbox's inertia at the output
SLOW = 20.0  # times the coefficient of the brake at which the rated torque gives the rated speed, for the ripple
PHASE_OFF = 0.5  # [rad] by which the start value of the ripple's phase is off


def experiments(gearbox: Gearbox, ripple: TorqueHarmonic | None = None) -> list[Log]:
    """Locked ramp, runs without load, back-driving, runs against a brake: time, header and inputs of each.

    Torques go up to the rated one, speeds to about the rated one; the header says whether the output is locked, and the
    coefficient of the brake [N·m·s/rad]. With a torque ripple, it also turns slowly under a constant torque. With hysteresis there is
    a locked ramp up to half the torque, too, and the header says how far a log reaches.
    """
    torque, speed = gearbox.rated_output_torque, gearbox.rated_input_speed
    motor = torque / gearbox.ratio
    brake = torque / (speed / gearbox.ratio)
    rotor = _rotor(gearbox) + (1.0 + LOAD_INERTIA) * gearbox.inertia
    time = np.arange(0.0, 2 * PERIOD, INTERVAL)
    short = np.arange(0.0, PERIOD, INTERVAL)
    swing = 0.5 * motor / (rotor * speed)  # [rad/s] at which half the rated torque brings the rotor to its rated speed

    def plan(name: str, t: np.ndarray, locked: float, brake: float, command: np.ndarray, load: np.ndarray) -> Log:
        channels = {"motor_torque": Channel(command, "N*m"), "load_torque": Channel(load, "N*m")}
        reach = {"reach": 0.5 if name == HALF else 1.0} if _has_hysteresis(gearbox) else {}
        return Log(f"{name}.csv", t, channels, {"locked": locked, "brake": brake, **reach})

    still = np.zeros(len(short))
    rise = np.where(
        short < RISE, 0.5 - 0.5 * np.cos(math.pi * short / RISE), 1.0
    )  # a jump would leave the drive ringing
    slow = [plan("ripple", short, 0.0, SLOW * brake, rise * 0.5 * motor, still)] if ripple is not None else []
    locked = 1.2 * motor * 2.0 / math.pi * np.arcsin(np.sin(2 * math.pi * time / PERIOD))  # a triangle wave
    loops = [plan("locked-ramp", time, 1.0, 0.0, locked, np.zeros(len(time)))]
    if _has_hysteresis(gearbox):
        loops.append(plan(HALF, time, 1.0, 0.0, 0.5 * locked, np.zeros(len(time))))
    return [
        *loops,
        plan("no-load", short, 0.0, 0.0, rise * 0.5 * motor * np.cos(swing * short), still),
        plan("no-load-slow", short, 0.0, 0.0, rise * 0.25 * motor * np.cos(swing * short), still),
        plan("back-driving", short, 0.0, 0.0, still, rise * 0.6 * torque * np.cos(swing * short)),
        plan("braked", short, 0.0, brake, rise * 0.9 * motor * np.sin(2 * math.pi * short), still),
        plan("braked-slow", short, 0.0, 4.0 * brake, rise * motor * np.sin(math.pi * short), still),
        *slow,
    ]


def _rotor(gearbox: Gearbox) -> float:
    """Inertia of the rig's motor [kg·m²]: the gearbox's inertia, so that neither hides the other."""
    if not gearbox.inertia > 0.0:
        raise InputError("the gearbox has no inertia, by which the runs of the rig are chosen; add it")
    return gearbox.inertia


def rig_scenario(gearbox: Gearbox, title: str = "", ripple: TorqueHarmonic | None = None) -> Scenario:
    """The rig: a motor as a source of torque, the gearbox, and a load machine that may be locked or brake."""
    gear = Gear.of(gearbox, input="motor", output="output").model_dump()
    inertia = LOAD_INERTIA * gearbox.inertia * gearbox.ratio**2
    tables: dict[str, Any] = {
        "shafts": {"motor": {}, "output": {"inertia": inertia, "torque": {"mean": 0.0}}},
        "motors": {
            "drive": {"shaft": "motor", "kind": "torque_source", "rated_torque": 1.0, "rotor_inertia": _rotor(gearbox)}
        },
        "gears": {"gearbox": gear | {"mesh_damping": mesh_damping(gearbox)}},
        "simulation": {"duration": PERIOD, "sample_interval": INTERVAL},
    }
    if ripple is not None:
        tables["angle_torques"] = {"ripple": ripple}
    return Scenario(title=title, **tables)


def mesh_damping(gearbox: Gearbox) -> float:
    """Mesh damping of the gear on the rig [N·m·s/rad]: its own, or 5 % of critical on the first stiffness; 0 if rigid."""
    if gearbox.mesh_damping > 0.0:
        return gearbox.mesh_damping
    slopes = [k for k in gearbox.stiffness.all_slopes() if k > 0.0] if gearbox.stiffness.kind != "rigid" else []
    if not slopes:
        return 0.0
    motor, load = (factor * gearbox.inertia * gearbox.ratio**2 for factor in (2.0, LOAD_INERTIA))
    return 2.0 * DAMPING * math.sqrt(slopes[0] * motor * load / (motor + load))


def parameters(gearbox: Gearbox, ripple: TorqueHarmonic | None = None) -> tuple[dict[str, float], dict[str, Any]]:
    """Parameters of the campaign: values by name, SI, and the formulas of the scenario by dotted key."""
    values = {"inertia": gearbox.inertia}
    formulas: dict[str, Any] = {"gears.gearbox.inertia": "inertia"}
    match gearbox.stiffness:
        case TorsionCurve(slopes=slopes, backlash=backlash):
            names = [f"stiffness_{k + 1}" for k in range(len(slopes))]
            values |= {name: slope for name, slope in zip(names, slopes, strict=True) if slope > 0.0}
            formulas["gears.gearbox.stiffness.slopes"] = [name if name in values else 0.0 for name in names]
            if backlash > 0.0:
                values["backlash"] = backlash
                formulas["gears.gearbox.stiffness.backlash"] = "backlash"
        case stiffness if stiffness.kind == "linear":
            values["stiffness"] = stiffness.stiffness
            formulas["gears.gearbox.stiffness.stiffness"] = "stiffness"
    if damping := mesh_damping(gearbox):
        values["mesh_damping"] = damping
        formulas["gears.gearbox.mesh_damping"] = "mesh_damping"
    if _has_hysteresis(gearbox):
        assert gearbox.hysteresis is not None
        values["hysteresis_efficiency"] = gearbox.hysteresis.efficiency
        formulas["gears.gearbox.hysteresis.efficiency"] = "hysteresis_efficiency"
    losses = gearbox.losses
    if isinstance(losses, LossMap):
        speeds, loads, table = losses.whole()
        idle = [float(np.interp(0.0, loads, [row[k] for row in table])) for k in range(len(speeds))]
        values |= {"no_load_losses": 1.0, "load_losses": 1.0}
        formulas["gears.gearbox.losses"] = {
            "kind": "map",
            "speeds": speeds,
            "loads": loads,
            "values": [
                [f"max(0, {z!r}*no_load_losses + {m - z!r}*load_losses)" for m, z in zip(row, idle, strict=True)]
                for row in table
            ],
        }
    else:
        values["efficiency"] = losses.efficiency
        formulas["gears.gearbox.losses.efficiency"] = "efficiency"
    if ripple is not None:
        values |= {"ripple_torque": ripple.amplitude, "ripple_phase": ripple.phase}
        formulas["angle_torques.ripple.amplitude"] = "ripple_torque"
        formulas["angle_torques.ripple.phase"] = "ripple_phase"
    return values, formulas


def _has_hysteresis(gearbox: Gearbox) -> bool:
    return gearbox.hysteresis is not None and gearbox.hysteresis.efficiency < 1.0


def _ladder(gearbox: Gearbox, names: Iterable[str]) -> dict[str, Any]:
    """Models of a gearbox with hysteresis: without and with it, and the held-out smaller loop that decides between them."""
    if not _has_hysteresis(gearbox):
        return {}
    plain = [name for name in names if name != "hysteresis_efficiency"]
    rungs = [{"name": "without hysteresis", "free": plain}, {"name": "hysteresis", "free": ["hysteresis_efficiency"]}]
    return {"ladder": rungs}


def identification(gearbox: Gearbox, title: str = "", ripple: TorqueHarmonic | None = None) -> dict[str, Any]:
    """The identification file of the campaign, as tables."""
    values, formulas = parameters(gearbox, ripple)
    locked = 100.0 * gearbox.rated_output_torque
    noise = deviations(gearbox)
    return {
        "title": title,
        "scenario": "rig.toml",
        "record": "gear.gearbox",
        "logs": {
            "files": ["logs/*.csv"],
            **({"held_out": "locked == 1 and reach < 1"} if _has_hysteresis(gearbox) else {}),
        },
        "inputs": {
            "drive_command": {"channel": "motor_torque", "interpolation": "linear"},
            "output_load_torque": {"channel": "load_torque", "interpolation": "linear"},
        },
        "measured": {
            "motor_angle": {"channel": "motor_angle", "variable": "motor_angle", **_encoder("motor_angle", noise)},
            "output_angle": {"channel": "output_angle", "variable": "output_angle", **_encoder("output_angle", noise)},
            "output_torque": {
                "channel": "output_torque",
                "variable": "gearbox_output_torque",
                "deviation": noise["output_torque"],
            },
        },
        "set": {
            "shafts.output.friction_torque": f"{locked!r}*locked",
            "shafts.output.viscous_friction": "brake",
            **formulas,
        },
        "parameters": {name: _free(name, value) for name, value in values.items()},
        **_ladder(gearbox, values),
        # Without hysteresis the sensors alone cause the errors; with it, the long errors of runs that turn at other instants
        # have minima in which the linear loss stays.
        "fit": {
            "loss": "huber" if _has_hysteresis(gearbox) else "linear",
            "first": "locked == 1 or brake > 0",
        },  # they do not ring, and have few impacts
    }


def _encoder(name: str, noise: dict[str, float]) -> dict[str, float]:
    return {"resolution": ENCODERS[name], "deviation": noise[name]}


def _free(name: str, value: float) -> dict[str, Any]:
    if name == "ripple_phase":
        return {"start": value + PHASE_OFF, "min": value - math.pi, "max": value + math.pi}
    if name in ("efficiency", "hysteresis_efficiency"):
        off = {"off": 1.0} if name == "hysteresis_efficiency" else {}
        return {"start": 1.0 - OFF * (1.0 - value), "min": 0.01, "max": 1.0, **off}
    return {"start": OFF * value, "min": 0.1 * value, "max": 10.0 * value, "logarithmic": True}


def deviations(gearbox: Gearbox) -> dict[str, float]:
    """Standard deviations of the measured channels: of encoders their noise of half a step, and their steps."""
    steps = {name: math.hypot(0.5, 1.0 / math.sqrt(12.0)) * step for name, step in ENCODERS.items()}
    return steps | {"output_torque": TORQUE_NOISE * gearbox.rated_output_torque}


@checked
def write_campaign(
    directory: str | Path,
    gearbox: Gearbox,
    *,
    title: str = "",
    ripple: TorqueHarmonic | None = None,
    seed: Count = 1,
    progress: Callable[[str], None] | None = None,
) -> Path:
    """Write logs of the virtual rig with noise and sensor resolution, the rig, and the identification file.

    Parameters
    ----------
    directory : str or Path
        Directory for ``identify.toml``, ``rig.toml`` and ``logs/*.csv``; made if missing.
    gearbox : Gearbox
        The gearbox on the rig.
    title : str
        Title of the files.
    ripple : TorqueHarmonic, optional
        A torque over the angle of the shaft ``motor`` or ``output`` of the rig, which data sheets do not give. It adds a slow run
        under a constant torque. Amplitude and phase of the ripple become parameters, too.
    seed : int
        Seed of the noise.
    progress : callable, optional
        Called with the name of each log that is written.

    Returns
    -------
    Path
        The identification file.

    Raises
    ------
    InputError
        The gearbox has no inertia, or the ripple is on another shaft.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import lostmotion as lm
    >>> gearbox = lm.gearbox("schaeffler-rt1-h-20-100")
    >>> with TemporaryDirectory() as folder:
    ...     task = lm.identification.write_campaign(folder, gearbox)
    ...     print(task.name, sorted(path.name for path in Path(folder, "logs").iterdir())[:2])
    identify.toml ['back-driving.csv', 'braked-slow.csv']
    """
    if ripple is not None and ripple.shaft not in ("motor", "output"):
        raise InputError(f'ripple: shaft is "{ripple.shaft}"; the shafts of the rig are "motor" and "output"')
    directory = Path(directory)
    gearbox = gearbox.forward()
    scenario = rig_scenario(gearbox, title, ripple)
    tables = identification(gearbox, title, ripple)
    (directory / "logs").mkdir(parents=True, exist_ok=True)
    write_bytes(directory / "rig.toml", scenario_text(scenario, title).encode())
    note = "Logs of the virtual rig: start values are 25 % off, and found again as well as such sensors allow."
    write_bytes(directory / "identify.toml", toml_text(tables, note).encode())
    rig = Rig(Identification(**tables), directory)
    noise = deviations(gearbox) | {name: 0.5 * step for name, step in ENCODERS.items()}
    values, _ = parameters(gearbox, ripple)
    for k, plan in enumerate(experiments(gearbox, ripple)):
        log = virtual_log(rig, plan, values, noise=noise, seed=seed + k)
        write_bytes(directory / "logs" / plan.name, _csv(log).encode())
        if progress is not None:
            progress(plan.name)
    return directory / "identify.toml"


def _csv(log: Log) -> str:
    units = {"motor_torque": "N*m", "load_torque": "N*m", "output_torque": "N*m"}
    lines = [f"# {key}: {value!r}" for key, value in log.header.items()]
    lines.append(",".join(["time [s]", *(f"{name} [{units.get(name, 'rad')}]" for name in log.channels)]))
    rows = zip(log.time, *(channel.values for channel in log.channels.values()), strict=True)
    lines += [",".join([f"{row[0]:.4f}", *(f"{x:.9g}" for x in row[1:])]) for row in rows]
    return "\n".join(lines) + "\n"

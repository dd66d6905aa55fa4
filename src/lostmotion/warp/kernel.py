"""The walk of the core as kernels of Warp. The text is taken from the core; this file says which arrays they read and write."""

# mypy: disable-error-code="valid-type, untyped-decorator, no-untyped-def"

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import warp as wp

SHEET = {
    "rotor_inertia": "motor.rotor_inertia",
    "motor_friction": "motor.friction_torque",
    "rated_torque": "motor.rated_torque",
    "rated_speed": "motor.rated_speed",
    "time_constant": "motor.electrical_time_constant",
    "voltage_constant": "motor.armature_voltage_constant",
    "command_limit": "",
    "motor_inertia": "",
    "motor_viscous": "",
    "shaft_friction": "",
    "shaft_breakaway": "",
    "ratio": "gearbox.ratio",
    "gear_inertia": "gearbox.inertia",
    "gear_viscous": "gearbox.viscous_friction",
    "hysteresis_efficiency": "gearbox.hysteresis.efficiency",
    "rated_input_speed": "gearbox.rated_input_speed",
    "rated_output_torque": "gearbox.rated_output_torque",
    "drive_efficiency": "gearbox.losses.efficiency",
    "backdrive_efficiency": "",
    "mesh_damping": "gearbox.mesh_damping",
    "backlash": "gearbox.stiffness.backlash",
    "load_inertia": "load.inertia",
    "load_viscous": "load.viscous_friction",
    "load_friction": "load.friction_torque",
    "load_breakaway": "",
}
"""numbers of the core's `DriveSheet` in its order, each with its key in the short form where it may be written"""
STATES = ("q", "a", "v", "d", "hysteresis", "held")
MODES = ("motor", "twist", "load", "flanks", "piece", "cell", "back", "known")
LISTS = ("lower", "upper", "slope", "offset", "root", "reach", "inverse", "speeds", "loads", "values")
NUMBERS = ("half_gap", "steepest")
WHOLE = ("pieces", "zero", "losses", "n_speeds", "n_loads", "most_degree")
FLAGS = ("has_gap", "rigid", "delays_torque", "limits_damping", "torque_source")
CORE = "loss_grid.hpp", "drive_lane.hpp", "drive_series.hpp", "drive_walk.hpp"
DEGREE = {"float32": 14, "float64": 23}
NUMBER = {"float32": wp.float32, "float64": wp.float64}
LIMIT = 1e30  # in place of infinity, which single precision has, too, but compilers may assume away

TOLD = ("load_torque", "speed", "per_torque", "command", "angle")
"""what an engine was told before a step: load torque and the speed that it leads to, with its derivative; the inputs of the law"""
MOST_ARMATURE = 1e4  # what an engine is told of a joint that friction holds, over the inertia of the joint
START = """
    typedef {real} real;
    constexpr real ROUNDING = real({epsilon});
    {text}
    const int n = drives.count;
    DriveLaws laws;
    {laws}
    DriveSheet sheet;
    {sheet}
    DriveState x;
    {state}
    x.angle = 0;
"""
ADVANCE = """
    const DriveNumbers numbers = sheet.numbers(laws);
    DriveWalk walk(laws, numbers, x, commands.data[i], loads.data[i]);
    walk.bold = true;
    if (answers) walk.differ(0, 1);
    const real before = x.a - x.v;
    if (!walk.advance(step)) walk.doubts |= DriveWalk::no_regime;
    x = walk.x;
    if (answers) {{
        const real per_torque = walk.tangent[1] - walk.tangent[2];
        drives.shown.data[4 * n + i] = sheet.load_inertia * ((x.a - x.v) - before) / step + loads.data[i];
        drives.shown.data[5 * n + i] = per_torque < 0 ? sheet.load_inertia + step / per_torque : -real({most});
    }}
    {out}
    drives.angles.data[i] += x.angle;
    drives.doubts.data[i] = walk.doubts;
    drives.switchings.data[i] += walk.switchings;
    drives.doubtful.data[i] += walk.doubts != 0;
    const real torque = walk.r.output.at(x);
"""
JOINT = """
    const int world = i % engine.worlds, joint = i / engine.worlds, dof = world * engine.n_dofs + engine.dofs.data[joint];
    float& position = engine.positions.data[world * engine.n_positions + engine.places.data[joint]];
    float& speed = engine.speeds.data[dof];
    // While all other joints keep their speed, the joint has the inertia of the diagonal of the mass matrix.
    const real per_torque = engine.told.data[2 * n + i];
    if (per_torque < 0)
        sheet.load_inertia = real(engine.masses.data[world * engine.n_masses + engine.diagonal.data[joint]] - engine.armatures.data[dof]);
    const DriveNumbers numbers = sheet.numbers(laws);
    const real inertia = sheet.load_inertia, least = step / (inertia * real({most_armature}));
    JointStep it = {{laws, numbers, step, engine.samples, engine.has_law != 0}};
    it.stiffness = engine.gains.data[i];
    it.damping = engine.gains.data[n + i];
    real load_torque = 0;
    int doubts = 0;
    if (per_torque < 0) {{
        // The engine has found a speed with the line that it was told. The load torque of that line at this speed moves the drive.
        it.command = engine.told.data[3 * n + i];
        it.angle = engine.told.data[4 * n + i];
        load_torque = engine.told.data[i] + (real(speed) - engine.told.data[n + i]) / per_torque;
        it.run(x, load_torque);
        x = it.end;
        doubts = it.doubts;
        drives.switchings.data[i] += it.switchings;
        drives.doubtful.data[i] += it.doubts != 0;
        position += (float)(x.angle - step * real(speed));  // the engine has moved on with the speed at the end
        speed = (float)it.speed;
    }} else {{
        x.a = real(speed);
    }}
    x.angle = 0;
    {out}
    it.command = engine.told.data[3 * n + i] = commands.data[i];
    it.angle = engine.told.data[4 * n + i] = real(position);
    it.run(x, load_torque);
    drives.doubts.data[i] = doubts | it.doubts;
    const real acceleration = (it.speed - (x.a - x.v)) / step;
    real slope = it.per_torque < -least ? it.per_torque : -least, armature = -step / slope - inertia;
    if (armature < 0) {{
        armature = 0;
        slope = -step / inertia;
    }}
    engine.told.data[i] = load_torque;
    engine.told.data[n + i] = it.speed;
    engine.told.data[2 * n + i] = slope;
    engine.armatures.data[dof] = (float)armature;
    engine.forces.data[dof] = (float)((inertia + armature) * acceleration + load_torque);
    DriveWalk now(laws, numbers, x, 0, load_torque);
    const real torque = x.known && now.make() ? now.r.output.at(x) : real(0);
"""
SHOW = """
    const real ratio = sheet.ratio;
    drives.shown.data[i] = ratio * x.a;
    drives.shown.data[n + i] = x.a - x.v;
    drives.shown.data[2 * n + i] = x.d;
    drives.shown.data[3 * n + i] = torque;
"""


def _source(name: str) -> str:
    """Text of a header: beside this file where the package is installed, else of the core in the checkout."""
    core = Path(__file__).parents[3] / "core" / "lostmotion"
    places = [Path(__file__).with_name(name), core / "batch" / name, core / "parts" / name]
    return next(place for place in places if place.exists()).read_text(encoding="utf-8")


def _body(dtype: str, last: str, *headers: str) -> str:
    """Text of a kernel: a drive `i` of `drives` is read, and what `last` does with it."""
    single = dtype == "float32"
    starts = [f"laws.{name} = drives.tables.data + drives.offsets.data[{k}];" for k, name in enumerate(LISTS[:7])]
    starts += [
        f"laws.map.{name} = drives.tables.data + drives.offsets.data[{7 + k}];" for k, name in enumerate(LISTS[7:])
    ]
    starts += [f"laws.{name} = drives.tables.data[{k}];" for k, name in enumerate(NUMBERS)]
    whole = [
        f"laws.{'map.' if name.startswith('n_') else ''}{name} = drives.shape.data[{k}];"
        for k, name in enumerate(WHOLE)
    ]
    flags = [f"laws.{name} = drives.shape.data[{len(WHOLE) + k}] != 0;" for k, name in enumerate(FLAGS)]
    modes = {"motor": "signed char", "twist": "signed char", "load": "signed char", "flanks": "signed char"}
    read = [f"x.{name} = drives.states.data[{k} * n + i];" for k, name in enumerate(STATES)]
    read += [
        f"x.{name} = ({modes.get(name, 'short')})drives.modes.data[{k} * n + i];" for k, name in enumerate(MODES[:-1])
    ]
    write = [f"drives.states.data[{k} * n + i] = x.{name};" for k, name in enumerate(STATES)]
    write += [f"drives.modes.data[{k} * n + i] = x.{name};" for k, name in enumerate(MODES)]
    return (START + last + SHOW).format(
        real="float" if single else "double",
        epsilon="1.1920929e-7f" if single else "2.220446049250313e-16",
        text="\n".join(_source(name) for name in (*CORE, *headers)),
        laws="\n    ".join(starts + whole + flags),
        sheet="\n    ".join(f"sheet.{name} = drives.sheets.data[{k} * n + i];" for k, name in enumerate(SHEET)),
        state="\n    ".join([*read, f"x.known = drives.modes.data[{len(MODES) - 1} * n + i] != 0;"]),
        out="\n    ".join(write),
        most_armature=MOST_ARMATURE,
        most=LIMIT,
    )


@cache
def drive_arrays(dtype: str) -> Any:
    """The arrays of drives, as a structure of Warp."""
    number = NUMBER[dtype]

    @wp.struct
    class DriveArrays:
        count: wp.int32
        tables: wp.array(dtype=number)
        offsets: wp.array(dtype=wp.int32)
        shape: wp.array(dtype=wp.int32)
        sheets: wp.array(dtype=number)
        states: wp.array(dtype=number)
        angles: wp.array(dtype=wp.float64)
        modes: wp.array(dtype=wp.int32)
        shown: wp.array(dtype=number)
        doubts: wp.array(dtype=wp.int32)
        switchings: wp.array(dtype=wp.int32)
        doubtful: wp.array(dtype=wp.int32)

    return DriveArrays


@cache
def engine_arrays(dtype: str) -> Any:
    """Data that drives read and write of the joints that they turn, as a structure of Warp."""
    number = NUMBER[dtype]

    @wp.struct
    class EngineArrays:
        worlds: wp.int32
        n_dofs: wp.int32
        n_positions: wp.int32
        n_masses: wp.int32
        samples: wp.int32
        has_law: wp.int32
        dofs: wp.array(dtype=wp.int32)
        places: wp.array(dtype=wp.int32)
        diagonal: wp.array(dtype=wp.int32)
        gains: wp.array(dtype=number)
        told: wp.array(dtype=number)
        positions: wp.array2d(dtype=wp.float32)
        speeds: wp.array2d(dtype=wp.float32)
        armatures: wp.array2d(dtype=wp.float32)
        forces: wp.array2d(dtype=wp.float32)
        masses: wp.array2d(dtype=wp.float32)

    return EngineArrays


@cache
def advance_kernel(dtype: str) -> Any:
    """The kernel that advances drives with numbers of a type. Drives of all kinds share it."""
    number = NUMBER[dtype]
    arrays = drive_arrays(dtype)

    @wp.func_native(_body(dtype, ADVANCE))
    def walk(
        i: wp.int32,
        drives: arrays,
        commands: wp.array(dtype=number),
        loads: wp.array(dtype=number),
        step: number,
        answers: wp.int32,
    ): ...

    @wp.kernel(enable_backward=False, module="unique")
    def advance(
        drives: arrays, commands: wp.array(dtype=number), loads: wp.array(dtype=number), step: number, answers: wp.int32
    ):
        walk(wp.tid(), drives, commands, loads, step, answers)

    return advance


@cache
def joint_kernel(dtype: str) -> Any:
    """The kernel by which drives follow what an engine has found, and tell it what acts in the next step."""
    number = NUMBER[dtype]
    arrays, joints = drive_arrays(dtype), engine_arrays(dtype)

    @wp.func_native(_body(dtype, JOINT, "joint_step.hpp"))
    def turn(i: wp.int32, drives: arrays, engine: joints, commands: wp.array(dtype=number), step: number): ...

    @wp.kernel(enable_backward=False, module="unique")
    def before(drives: arrays, engine: joints, commands: wp.array(dtype=number), step: number):
        turn(wp.tid(), drives, engine, commands, step)

    return before


def packed(laws: dict[str, Any], dtype: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Numbers of the laws in one array, the places of its lists, and its whole numbers and flags."""
    degree = DEGREE[dtype]
    rounding = np.finfo(dtype).eps / 16.0
    factorial = np.cumprod(np.arange(2.0, degree + 2.0)) * rounding
    reach = [0.0, *(factorial[d - 1] ** (1.0 / d) for d in range(1, degree + 1))]
    lists = dict(laws) | {"reach": reach, "inverse": [0.0, *(1.0 / k for k in range(1, degree + 2))]}
    parts = [np.clip(np.asarray(lists[name], dtype=float), -LIMIT, LIMIT) for name in LISTS]
    first = np.array([laws[name] for name in NUMBERS], dtype=float)
    offsets = np.cumsum([len(first), *(len(part) for part in parts)])[:-1]
    whole = {**laws, "pieces": len(laws["slope"]), "n_speeds": len(laws["speeds"]), "n_loads": len(laws["loads"]), "most_degree": degree}  # fmt: skip
    shape = np.array([int(whole[name]) for name in (*WHOLE, *FLAGS)], dtype=np.int32)
    return np.concatenate([first, *parts]).astype(dtype), offsets.astype(np.int32), shape

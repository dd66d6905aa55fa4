"""The walk of the core as a kernel of Warp. Its text is that of the core; this file says which arrays it reads and writes."""

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
CORE = "loss_grid.hpp", "drive_walk.hpp"
DEGREE = {"float32": 14, "float64": 23}
LIMIT = 1e30  # in place of infinity, which single precision has, too, but compilers may assume away

BODY = """
    typedef {real} real;
    constexpr real ROUNDING = real({epsilon});
    {text}
    DriveLaws laws;
    {laws}
    DriveSheet sheet;
    {sheet}
    DriveState x;
    {state}
    x.angle = 0;
    const DriveNumbers numbers = sheet.numbers(laws);
    DriveWalk walk(laws, numbers, x, commands.data[i], loads.data[i]);
    walk.bold = true;
    if (!walk.advance(step)) walk.doubts |= DriveWalk::no_regime;
    x = walk.x;
    {out}
    angles.data[i] += x.angle;
    doubts.data[i] = walk.doubts;
    switchings.data[i] += walk.switchings;
    doubtful.data[i] += walk.doubts != 0;
    const real ratio = sheet.ratio;
    shown.data[i] = ratio * x.a;
    shown.data[n + i] = x.a - x.v;
    shown.data[2 * n + i] = x.d;
    shown.data[3 * n + i] = walk.r.output.at(x);
"""


def _source(name: str) -> str:
    """Text of a header of the core: beside this file where the package is installed, else in the checkout."""
    beside = Path(__file__).with_name(name)
    core = Path(__file__).parents[3] / "core" / "lostmotion"
    places = [beside, core / "batch" / name, core / "parts" / name]
    return next(place for place in places if place.exists()).read_text(encoding="utf-8")


@cache
def kernel_of(dtype: str) -> Any:
    """The kernel for numbers of a type. Drives of all kinds share it."""
    single = dtype == "float32"
    starts = [f"laws.{name} = tables.data + offsets.data[{k}];" for k, name in enumerate(LISTS[:7])]
    starts += [f"laws.map.{name} = tables.data + offsets.data[{7 + k}];" for k, name in enumerate(LISTS[7:])]
    starts += [f"laws.{name} = tables.data[{k}];" for k, name in enumerate(NUMBERS)]
    whole = [f"laws.{'map.' if name.startswith('n_') else ''}{name} = shape.data[{k}];" for k, name in enumerate(WHOLE)]
    flags = [f"laws.{name} = shape.data[{len(WHOLE) + k}] != 0;" for k, name in enumerate(FLAGS)]
    modes = {"motor": "signed char", "twist": "signed char", "load": "signed char", "flanks": "signed char"}
    read = [f"x.{name} = states.data[{k} * n + i];" for k, name in enumerate(STATES)]
    read += [f"x.{name} = ({modes.get(name, 'short')})modes.data[{k} * n + i];" for k, name in enumerate(MODES[:-1])]
    write = [f"states.data[{k} * n + i] = x.{name};" for k, name in enumerate(STATES)]
    body = BODY.format(
        real="float" if single else "double",
        epsilon="1.1920929e-7f" if single else "2.220446049250313e-16",
        text="\n".join(_source(name) for name in CORE),
        laws="\n    ".join(starts + whole + flags),
        sheet="\n    ".join(f"sheet.{name} = sheets.data[{k} * n + i];" for k, name in enumerate(SHEET)),
        state="\n    ".join([*read, f"x.known = modes.data[{len(MODES) - 1} * n + i] != 0;"]),
        out="\n    ".join(write + [f"modes.data[{k} * n + i] = x.{name};" for k, name in enumerate(MODES)]),
    )
    number = wp.float32 if single else wp.float64

    @wp.func_native(body)
    def walk(
        i: wp.int32,
        n: wp.int32,
        tables: wp.array(dtype=number),
        offsets: wp.array(dtype=wp.int32),
        shape: wp.array(dtype=wp.int32),
        sheets: wp.array(dtype=number),
        states: wp.array(dtype=number),
        angles: wp.array(dtype=wp.float64),
        modes: wp.array(dtype=wp.int32),
        commands: wp.array(dtype=number),
        loads: wp.array(dtype=number),
        step: number,
        shown: wp.array(dtype=number),
        doubts: wp.array(dtype=wp.int32),
        switchings: wp.array(dtype=wp.int32),
        doubtful: wp.array(dtype=wp.int32),
    ): ...

    @wp.kernel(enable_backward=False, module="unique")
    def advance(
        n: wp.int32,
        tables: wp.array(dtype=number),
        offsets: wp.array(dtype=wp.int32),
        shape: wp.array(dtype=wp.int32),
        sheets: wp.array(dtype=number),
        states: wp.array(dtype=number),
        angles: wp.array(dtype=wp.float64),
        modes: wp.array(dtype=wp.int32),
        commands: wp.array(dtype=number),
        loads: wp.array(dtype=number),
        step: number,
        shown: wp.array(dtype=number),
        doubts: wp.array(dtype=wp.int32),
        switchings: wp.array(dtype=wp.int32),
        doubtful: wp.array(dtype=wp.int32),
    ):
        walk(
            wp.tid(), n, tables, offsets, shape, sheets, states, angles, modes, commands, loads, step, shown,
            doubts, switchings, doubtful,
        )  # fmt: skip

    return advance


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

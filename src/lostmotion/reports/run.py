"""A run as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..errors import visible
from ..simulation.results import RawResult, energy_of, is_train_result
from ..simulation.switchings import ATTRIBUTE as SWITCHINGS
from ..simulation.switchings import names_in, unpacked
from ..simulation.train_scenario import TrainScenario
from ..simulation.windings import errors_of

if TYPE_CHECKING:
    import xarray


def summary(result: xarray.Dataset | RawResult) -> str:
    """A run in a few lines: the end, the extremes, the contacts, the energy."""
    if is_train_result(result):
        return train_summary(result)

    def last(name: str) -> float:
        return float(np.asarray(result[name])[-1])

    def peak(name: str) -> float:
        return float(np.max(np.abs(np.asarray(result[name]))))

    stuck = float(np.mean(np.asarray(result["input_contact"]) == 0))
    lines = [
        visible(result.attrs["title"]) or "(no title)",
        f"  {last('time'):g} s, {result.attrs['switching_count']} events, solver {result.attrs['solver']}",
        f"  at the end: motor {last('motor_speed'):.6g} rad/s, load {last('load_speed'):.6g} rad/s "
        f"at {last('load_angle'):.6g} rad, twist {1e3 * last('twist'):.4g} mrad",
        f"  peak: motor torque {peak('motor_torque'):.4g} N·m, output torque "
        f"{peak('output_torque'):.4g} N·m, load speed {peak('load_speed'):.4g} rad/s",
        f"  input shaft stuck for {100.0 * stuck:.1f} % of the samples",
    ]
    if "energy" in result.attrs:
        e = energy_of(result)
        names = (
            "gear_losses",
            "hysteresis",
            "motor_friction",
            "input_damper",
            "load_damper",
            "load_friction",
            "load_work",
        )
        parts = ", ".join(f"{name.replace('_', ' ')} {e[name]:.4g}" for name in names if e[name] != 0.0)
        lines.append(
            f"  energy [J]: from the motor {e['source']:.4g}; {parts}; stored {e['kinetic_change'] + e['elastic_change']:.4g}"
        )
        if e["turned_over"] > 0.0:
            lines.append(f"  energy balance closes to {abs(e['residual']) / e['turned_over']:.1e}")
    lines += [*contact_lines(result), *error_lines(result)]
    lines += [f"  warning: {result.attrs['warning']}"] if "warning" in result.attrs else []
    lines += [f"  note: {result.attrs['note']}"] if "note" in result.attrs else []
    return "\n".join(lines)


def contact_lines(result: xarray.Dataset | RawResult) -> list[str]:
    """How often each contact has come to stick, slipped again and turned around, of the switchings that the result keeps."""
    if not result.attrs.get(SWITCHINGS):
        return []
    names = names_in(result.attrs)
    modes = unpacked(result.attrs)
    found = []
    for name in (n.removesuffix("_before") for n in names if n.endswith("_contact_before")):
        before, after = (modes[:, names.index(f"{name}_{when}")] for when in ("before", "after"))
        counts = {
            "sticks": (before != 0) & (after == 0),
            "slips": (before == 0) & (after != 0),
            "turns around": (before != 0) & (after == -before),
        }
        parts = [f"{what} {n}" for what, rows in counts.items() if (n := int(rows.sum()))]
        if parts:
            found.append(f"{name.removesuffix('_contact').replace('_', ' ')} {', '.join(parts)}")
    return [f"  contacts [times]: {'; '.join(found)}"] if found else []


def error_lines(result: xarray.Dataset | RawResult) -> list[str]:
    """By how much currents, torques and speeds of motors under field-oriented control may be wrong, and their largest values."""
    bounds = errors_of(result)
    if not bounds:
        return []
    shown = (
        f"{name.replace('_', ' ')} {bound:.1e} of {np.max(np.abs(np.asarray(result[name]))):.4g} {unit}"
        for (name, bound), unit in zip(bounds.items(), ("A", "A", "N·m", "rad/s") * len(bounds), strict=False)
    )
    return [f"  error of the field-oriented control at most: {', '.join(shown)}"]


def train_summary(result: xarray.Dataset | RawResult) -> str:
    """A run of a drive train in a few lines: each element at the end and at its peak, and the energy."""
    scenario = TrainScenario.from_json(result.attrs["scenario"])
    train = scenario.train()

    def end_and_peak(name: str, unit: str, factor: float = 1.0) -> str:
        values = factor * np.asarray(result[name])
        return f"{values[-1]:.5g} {unit}, peak {np.max(np.abs(values)):.5g}"

    time = float(np.asarray(result["time"])[-1])
    lines = [
        visible(result.attrs["title"]) or "(no title)",
        f"  {time:g} s, {result.attrs['switching_count']} events, solver {result.attrs['solver']}; at the end:",
    ]
    for name in train.motors:
        lines.append(f"  motor {name}: {end_and_peak(f'{name}_torque', 'N·m')}")
    for name in train.shafts:
        angle = f"{name}_angle"
        at = f"; at {float(np.asarray(result[angle])[-1]):.6g} rad" if angle in result else ""
        lines.append(f"  shaft {name}: {end_and_peak(f'{name}_speed', 'rad/s')}{at}")
    for name, gear in train.gears.items():
        twist = "" if gear.stiffness.kind == "rigid" else f"; twist {end_and_peak(f'{name}_twist', 'mrad', 1e3)}"
        lines.append(f"  gear {name}: {end_and_peak(f'{name}_output_torque', 'N·m')}{twist}")
    if "energy" in result.attrs:
        e = energy_of(result)
        apart = ("residual", "turned_over")
        parts = ", ".join(f"{name} {value:.4g}" for name, value in e.items() if value != 0.0 and name not in apart)
        lines.append(f"  energy [J]: {parts or 'none'}")
        if e["turned_over"] > 0.0:
            lines.append(f"  energy balance closes to {abs(e['residual']) / e['turned_over']:.1e}")
    lines += [*contact_lines(result), *error_lines(result)]
    lines += [f"  {kind}: {result.attrs[kind]}" for kind in ("warning", "note") if kind in result.attrs]
    return "\n".join(lines)

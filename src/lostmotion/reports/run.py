"""A run as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..simulation.results import RawResult, energy_of

if TYPE_CHECKING:
    import xarray


def summary(result: xarray.Dataset | RawResult) -> str:
    """A run in a few lines: the end, the extremes, the contacts, the energy."""

    def last(name: str) -> float:
        return float(np.asarray(result[name])[-1])

    def peak(name: str) -> float:
        return float(np.max(np.abs(np.asarray(result[name]))))

    stuck = float(np.mean(np.asarray(result["input_contact"]) == 0))
    lines = [
        result.attrs["title"] or "(no title)",
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
    lines += [f"  warning: {result.attrs['warning']}"] if "warning" in result.attrs else []
    lines += [f"  note: {result.attrs['note']}"] if "note" in result.attrs else []
    return "\n".join(lines)

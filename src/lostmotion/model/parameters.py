"""The parameters of a drive that are plain numbers, as the core's table names them."""

from __future__ import annotations

from typing import Any

from .. import _core

PARAMETERS = tuple(key for key, _ in _core.parameters())
"""such as ``motor.rotor_inertia``: as a scenario file names them"""

MotorLaw = tuple[tuple[tuple[str, float], ...], bool]
"""changed numbers of a motor's law, as a current loop makes it, and whether it is a torque source"""


def numbers(part: Any, table: str) -> dict[str, float]:
    """The parameters of a part that stands in a table of a scenario file, without those that it has not or leaves out."""
    keys = (key for key in PARAMETERS if key.startswith(f"{table}."))
    return {key: value for key in keys if (value := _number(part, key.split(".")[1:])) is not None}


def _number(part: Any, names: list[str]) -> float | None:
    for name in names:
        part = getattr(part, name, None)
    return None if part is None else float(part)

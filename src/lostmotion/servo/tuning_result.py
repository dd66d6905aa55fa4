"""The gains of an axis as a rule has found them, in the words of scenarios and of manufacturers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any, Literal

from ..errors import InputError, need
from ..inputs.argument_checks import ScenarioName, checked
from ..inputs.schema import follow, unit_in_schema
from ..simulation.forms.axis_form import file_schema
from ..simulation.forms.set_by_dotted_key import parse_override
from ..simulation.forms.slide_units import unit_of_slides
from ..simulation.runs.loading import load
from ..simulation.scenario.scenario import Scenario
from ..simulation.scenario.scenario_files import CHANGED, title_with
from ..units.practical import printed

GAINS = (".speed.gain", ".position.gain")  # ends of their keys, which a file may leave out
Amperes = Literal["peak", "dc", "of the data sheet"]  # amplitude of a phase, current of an armature, or not known
CURRENTS: dict[Amperes, str] = {
    "peak": "current of a phase",
    "dc": "current of the armature",
    "of the data sheet": "amperes as in limits.torque_constant",
}


@dataclass(frozen=True)
class Tuning:
    """Gains of an axis, and the scenario with these gains."""

    rule: str
    why: str
    """data of the gains, in one line"""
    scenario: Scenario
    gain: float
    """K_p of the speed loop, torque of the motor per speed of the motor [N·m·s/rad]"""
    integral_gain: float
    """K_i [N·m/rad]"""
    position_gain: float | None
    """K_v [1/s]; None without a position loop"""
    filter_time: float
    """time constant of the filter of the speed reference [s]; 0: none"""
    torque_constant: float | None
    """torque constant of the motor [N·m/A], if its data contain it; for a winding per ampere of amplitude of a phase"""
    changed: Mapping[str, tuple[Any, Any]] = field(default_factory=dict)
    """old and new value [SI] of each key of the scenario that differs; None where there is none"""
    linear_motor: bool = False
    """whether the motor moves a slide: gains in [N·s/m] and [N/m]"""
    amperes: Amperes = "of the data sheet"
    """amperes of `torque_constant`"""

    def without(self, missing: Sequence[str]) -> Tuning:
        """The same gains, found for a scenario that lacked some of them."""
        changed = {key: (None if key in missing else old, new) for key, (old, new) in self.changed.items()}
        return replace(self, changed=changed)

    @property
    def integral_time(self) -> float:
        """T_i = K_p/K_i [s]; infinite without an integrator."""
        return self.gain / self.integral_gain if self.integral_gain else math.inf

    def conventions(self) -> list[tuple[str, str, str]]:
        """The same gains as manufacturers of drives write them: (what, value with unit, where it is written so).

        Currents of a winding are in amperes rms of a phase, as data sheets print them, and as amplitudes.
        """
        rows: list[tuple[str, str, str]] = []

        def add(value: str, where: str, what: str = "") -> None:
            rows.append((what, value, where))

        slides, per_minute = self.linear_motor, math.pi / 30.0
        force, speed = ("N", "(m/s)") if slides else ("N·m", "(rad/s)")
        of_motor = f"{'force of' if slides else 'torque at'} the motor per speed of the motor"
        add(f"{self.gain:.5g} {force}/{speed}", of_motor, "speed loop, gain")
        if not slides:
            add(f"{self.gain * per_minute:.5g} N·m/rpm", "the same per revolution in a minute")
        if (constant := self.torque_constant) is not None:
            amps, unit = self.gain / constant, "A"
            if self.amperes == "peak":
                add(f"{amps:.5g} A peak/{speed}", f"amplitude of a phase, with {constant:.4g} {force}/A peak")
                amps, constant, unit = amps / math.sqrt(2.0), constant * math.sqrt(2.0), "A rms"
            add(f"{amps:.5g} {unit}/{speed}", f"{CURRENTS[self.amperes]}, with {constant:.4g} {force}/{unit}")
            if not slides:
                add(f"{1e3 * amps * per_minute:.5g} m{unit}/rpm", "the same per revolution in a minute")
        if self.integral_gain:
            time = self.gain / self.integral_gain
            add(f"{1e3 * time:.5g} ms", "K_p/K_i, reset time T_N", "speed loop, integral time")
            add(f"{1.0 / time:.5g} 1/s", "its inverse")
            add(f"{self.integral_gain:.5g} {'N/m' if slides else 'N·m/rad'}", "parallel form, K_i")
        if self.filter_time:
            add(f"{1e3 * self.filter_time:.5g} ms", "time constant", "filter of the speed reference")
        if (K_v := self.position_gain) is not None:
            add(f"{K_v:.5g} 1/s", "K_v", "position loop, gain")
            add(f"{0.06 * K_v:.5g} (m/min)/mm", "K_v of linear axes: 1/s times 0.06")
        return rows

    def changes(self) -> list[tuple[str, str, str]]:
        """Changes by the tuning: (key of the scenario, old value, new value), with units.

        Examples
        --------
        >>> for key, old, new in lm.tune(lm.load("position-axis"), rule="suited").changes():
        ...     print(f"{key}: {old} -> {new}")
        controller.position.gain: 10 1/s -> 25.4241 1/s
        controller.speed.gain: 0.00829 N·m·s/rad -> 0.00829231 N·m·s/rad
        controller.speed.integral_gain: 0.1266 N·m/rad -> 0.126631 N·m/rad
        """
        units = {key: self._unit(key) for key in self.changed}
        return [(key, _value(old, units[key]), _value(new, units[key])) for key, (old, new) in self.changed.items()]

    @checked
    def write(self, path: Path, source: ScenarioName | Path, overrides: Iterable[str] = ()) -> None:
        """Write the tuned scenario as a file.

        Comments and order of the source file are kept where it can carry the new values; else the file is a new one, of
        the whole scenario. Either way it loads to `scenario`, which is checked before the file gets its name.

        Parameters
        ----------
        path
            Of the new file (.toml).
        source
            Scenario file or name that the tuned scenario was loaded from.
        overrides
            Changes with which it was loaded, as ``KEY=VALUE``.

        Raises
        ------
        InputError
            The file cannot be written; nothing is left behind.

        Examples
        --------
        >>> tuned = lm.tune(lm.load("position-axis"), rule="suited")
        >>> tuned.write("tuned.toml", "position-axis")
        >>> lm.load("tuned.toml") == tuned.scenario
        True
        """
        need("tomlkit", "Writing a tuned scenario", "control")
        from ..simulation.scenario.scenario_writer import write_changed

        if path.suffix != ".toml":
            raise InputError(f"{path}: a scenario is a TOML file; its name must end in .toml")
        values = dict(map(parse_override, overrides))
        values |= {key: _with_unit(new, self._unit(key)) for key, (_, new) in self.changed.items()}
        notes = [f" by the rule {self.rule}: {self.why}"]
        notes += [f": {key}, {old} -> {new}" for key, old, new in self.changes()]
        write_changed(path, self.scenario, source, values, notes)

    def _unit(self, key: str) -> str | None:
        """The SI unit of a key of the scenario: of a slide m and N in place of rad and N*m."""
        unit = _unit(key)
        return unit and unit_of_slides(self.scenario.model_dump(), key, unit)

    def __str__(self) -> str:
        """The gains with units, in the words of a scenario and of manufacturers."""
        return "\n".join([f"rule {self.rule}: {self.why}", *aligned(self.conventions())])


def load_untuned(source: str | Path, overrides: Iterable[str], missing: list[str]) -> Scenario:
    """The scenario of a file that may leave out the gains to be found, or the tables of their loops.

    They are 1 in it; their keys are added to `missing`.
    """
    given = [*overrides, *(f"{key}=1" for key in missing)]
    try:
        loaded = load(source, given)
    except InputError as error:
        keys = missing_gains(error)
        if not keys or set(keys) & {text.partition("=")[0] for text in given}:
            raise
        missing += keys
        return load_untuned(source, overrides, missing)
    plain = loaded.title.partition(CHANGED)[0]
    title = title_with(plain, [text.partition("=")[0].strip() for text in overrides])
    return loaded.model_copy(update={"title": title}) if missing else loaded


def missing_gains(error: InputError) -> list[str]:
    """Keys of the gains that a file lacks, also with the table of their loop."""
    keys = [key for p in error.problems if "missing" in p.reason for key in p.keys if key.endswith(GAINS)]
    loops = [(key, loop) for p in error.problems for key in p.keys for loop in GAINS if _lacks(p.reason, loop)]
    return keys + [f"{key}{loop}" for key, loop in loops]


def _lacks(reason: str, gain: str) -> bool:
    return reason.startswith(f"lacks {gain.split('.')[1]}, ")


def aligned(rows: list[tuple[str, str, str]]) -> list[str]:
    """Lines of such rows, in columns."""
    return [f"{what:<30} {value:<24} {where}" for what, value, where in rows]


def differences(old: Any, new: Any, key: str) -> Iterator[tuple[str, tuple[Any, Any]]]:
    """Values that differ between nested tables, by dotted key; keys that are removed first."""
    if not isinstance(old, Mapping) or not isinstance(new, Mapping):
        if old != new:
            yield key, (old, new)
        return
    for name in sorted(new, key=lambda name: new[name] is not None):
        yield from differences(old.get(name), new[name], f"{key}.{name}")


@cache
def _unit(key: str) -> str | None:
    """The SI unit of a key of a scenario, for shafts."""
    _, nodes = follow(file_schema(), tuple(key.split(".")))
    return next((unit for node in nodes if (unit := unit_in_schema(node)) is not None), None)


def _with_unit(value: Any, unit: str | None) -> Any:
    """A value as a scenario file writes it."""
    if isinstance(value, float) and unit not in (None, "", "1"):
        return f"{value!r} {unit}"
    if isinstance(value, list | tuple):
        return [{k: v for k, v in f.items() if v is not None} if isinstance(f, Mapping) else f for f in value]
    return value


def _value(value: Any, unit: str | None) -> str:
    """A value with its unit, for readers."""
    if value is None or (isinstance(value, list | tuple) and not value):
        return "none"
    if isinstance(value, list | tuple):
        return ", ".join(" ".join(f"{k} {_value(v, None)}" for k, v in f.items() if v is not None) for f in value)
    return f"{value:.6g} {printed(unit or '')}".strip() if isinstance(value, float) else str(value)

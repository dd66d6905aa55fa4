"""A first identification file from a directory of logs: channels, units, sample times, and what is in doubt about them."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError, visible
from ...inputs.argument_checks import checked
from ...inputs.refusal_messages import listed
from ...simulation.scenario.scenario import Scenario
from ...simulation.scenario.scenario_files import find_scenario, load
from ...units.practical import counted
from ..readers.channel_units import channel_unit
from ..readers.log import Log
from ..readers.log_files import READERS, read_log
from ..rig.rig_scenario import units_of
from .prepare import alike
from .screening import screened

MOST_LOGS = 2000
RATE = 2e-3  # by which the sample time of a log may differ from the sample time of most logs
SAMPLE = re.compile(r", such as '.*' in line \d+")  # in notes: differs from log to log
MOST_LINES = 40  # of doubts of one kind
COMMANDS = ("goal", "command", "cmd", "reference", "ref", "setpoint", "target", "desired", "demand", "set")
MOTIONS = {"rad": "angle", "m": "position", "rad/s": "speed", "m/s": "speed"}
QUANTITIES = {
    "rad": ("position", "pos", "angle", "theta", "encoder", "deg"),
    "rad/s": ("speed", "velocity", "vel", "omega", "rpm"),
    "N*m": ("torque", "moment"),
    "A": ("current",),
    "V": ("voltage", "volts", "volt"),
    "N": ("force",),
}
PLACEHOLDER = "RIG.toml"
NAMELESS = {"shafts": "SHAFT", "slides": "SLIDE"}
SOUGHT = (
    "inertia",
    "rotor_inertia",
    "mass",
    "viscous_friction",
    "friction_torque",
    "friction_force",
)  # of shafts, slides, motors, linear motors


@dataclass
class _Seen:
    """A channel in all logs that have it."""

    name: str
    units: dict[str, list[str]] = field(default_factory=dict)
    """units as in the files, with the names of the logs that have each"""
    logs: int = 0
    low: float = math.inf
    high: float = -math.inf
    noise: list[float] = field(default_factory=list)
    """standard deviation of what differs between neighbours, of each log"""

    @property
    def unit(self) -> str:
        """Unit of most logs."""
        return max(self.units, key=lambda unit: len(self.units[unit])) if self.units else ""

    def factor(self, unit: str) -> float:
        """Factor from a unit of the files to the usual one; 1 where one of them is not known."""
        return _factor(unit) / _factor(self.unit) if unit else 1.0

    @property
    def words(self) -> list[str]:
        """Words of its name."""
        return "".join(c.lower() if c.isalnum() else " " for c in self.name).split()

    @property
    def is_command(self) -> bool:
        """Whether its name says that it is what is wanted."""
        return any(word in COMMANDS for word in self.words)

    @property
    def quantity(self) -> str:
        """SI unit by the unit in the files, else by its name; empty if neither tells."""
        try:
            unit = channel_unit("", self.unit, "", "")[1] if self.unit else ""
        except InputError:
            unit = ""
        if unit in QUANTITIES or unit in MOTIONS:
            return unit
        return next((unit for unit, names in QUANTITIES.items() if any(word in names for word in self.words)), "")


@checked
def first_task(
    directory: str | Path, *, home: str | Path = "", rig: str | Path = "", progress: Callable[[str], None] | None = None
) -> str:
    """Propose an identification file for the logs in a directory and in those below it.

    Parameters
    ----------
    directory
        Where the logs are.
    home
        Where the file will be, to which its names are relative; left out, the directory of the logs.
    rig
        Scenario of the rig, by which inputs, measured variables and parameters get their names; left out, these names are to be
        written by hand.
    progress
        Is called with the name of each log that is read.

    Returns
    -------
    str
        Text of the file (TOML). What is in doubt stands in comments that begin with ``Doubt:``.

    Raises
    ------
    InputError
        There are no logs, or none can be read.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import lostmotion as lm
    >>> with TemporaryDirectory() as folder:
    ...     rows = [f"{0.01 * k},{k % 7}" for k in range(20)]
    ...     _ = Path(folder, "log.csv").write_text("\\n".join(["time [s],angle [deg]", *rows]))
    ...     text = lm.identification.first_task(folder)
    >>> print(*[line for line in text.splitlines() if "ample time" in line])
    # Sample time: 10 ms; logs last 0.19 s.
    """
    directory = Path(directory)
    paths = _files(directory)
    logs: list[tuple[Path, Log]] = []
    refused: list[str] = []
    for path in paths:
        if progress is not None:
            progress(path.name)
        try:
            logs.append((path, read_log(path)))
        except InputError as problem:
            refused.append(str(problem))
    if not logs:
        raise InputError(f"{directory}: none of its {len(paths)} logs can be read; the first: {refused[0]}")
    seen = _channels([log for _, log in logs])
    scenario = load(find_scenario(str(rig), Path.cwd())).long() if str(rig) else None
    measured, inputs = _roles(seen)
    doubts = [f"{text}; it is left out" for text in refused]
    doubts += _doubts(logs, seen, measured, inputs)
    home = Path(home) if str(home) else directory
    scenario_name = Path(os.path.relpath(rig, home)).as_posix() if str(rig) and Path(rig).is_file() else str(rig)
    return "\n".join(
        [
            "# First identification file, written by `lostmotion identify new`. Check the lines with Doubt:, then run",
            "#   lostmotion identify identify.toml -o identified",
            f"title = {_text(directory.resolve().name)}",
            *_rig_lines(scenario_name),
            "",
            *_log_lines(home, [path for path, _ in logs], [log for _, log in logs]),
            *_channel_lines(seen, len(logs)),
            *_some(doubts),
            "",
            *_input_lines(inputs, scenario),
            *_measured_lines(measured, scenario),
            *_parameter_lines(scenario, linear=any(_bodies(None, c)[0] == "slides" for c in measured)),
            "",
        ]
    )


def _files(directory: Path) -> list[Path]:
    if not directory.is_dir():
        raise InputError(f"{directory}: is no directory; name the one that holds the logs")
    found = []
    for folder, inner, names in os.walk(directory):
        inner[:] = sorted(name for name in inner if not name.startswith("."))
        found += [Path(folder, name) for name in sorted(names) if Path(name).suffix.lower() in READERS]
        if len(found) > MOST_LOGS:
            raise InputError(f"{directory}: has more than {MOST_LOGS} logs; name a directory with some of them")
    if not found:
        raise InputError(f"{directory}: has no log; logs end in {', '.join(READERS)}")
    return found


def _channels(logs: Sequence[Log]) -> list[_Seen]:
    found: dict[str, _Seen] = {}
    for log in logs:
        for name, channel in log.channels.items():
            own = found.setdefault(name, _Seen(name))
            own.logs += 1
            own.units.setdefault(channel.unit, []).append(log.name)
    for log in logs:
        for name, channel in log.channels.items():
            own = found[name]
            x = own.factor(channel.unit) * channel.values[np.isfinite(channel.values)]
            if len(x):
                own.low, own.high = min(own.low, float(x.min())), max(own.high, float(x.max()))
            if len(x) > 3:
                own.noise.append(float(np.std(np.diff(x, 2))) / math.sqrt(6.0))  # of white noise
    return list(found.values())


def _roles(seen: Sequence[_Seen]) -> tuple[list[_Seen], list[_Seen]]:
    """(channels to compare, channels that act) by their quantities and names; without any sign the first is compared."""
    motion = [c for c in seen if c.quantity in MOTIONS and not c.is_command]
    commands = [c for c in seen if c.is_command]
    drives = [c for c in seen if c.quantity in ("N*m", "N", "A", "V") and not c.is_command]
    measured = (
        [c for c in motion if c.quantity in ("rad", "m")]
        or motion
        or [c for c in seen if c not in commands][:1]
        or list(seen[:1])
    )
    return measured, [c for c in commands or drives if c not in measured]


def _doubts(
    logs: Sequence[tuple[Path, Log]], seen: Sequence[_Seen], measured: Sequence[_Seen], inputs: Sequence[_Seen]
) -> list[str]:
    """Defects of logs, and differences between them."""
    notes: dict[str, tuple[str, list[str]]] = {}
    for path, log in logs:
        own = [c.name for c in measured if c.name in log.channels]
        acting = [c.name for c in inputs if c.name in log.channels]
        try:
            found: Iterable[str] = screened(log, own, acting).notes
        except InputError as problem:
            found = [problem.reason]
        for note in found:
            _, names = notes.setdefault(alike(SAMPLE.sub("", note)), (SAMPLE.sub("", note), []))
            names.append(path.name)
    doubts = [f"{n[0]}{f' and {len(n) - 1} more' if len(n) > 1 else ''}: {note}" for note, n in notes.values()]
    for c in seen:
        if len(c.units) > 1:
            doubts += [_about_units(c, unit, names) for unit, names in c.units.items() if unit != c.unit]
        if c.logs < len(logs) and c in (*measured, *inputs):
            doubts.append(f"channel {c.name} is in {c.logs} of {len(logs)} logs; the others cannot be used")
    return doubts + _about_rates([log for _, log in logs if len(log.time) > 1])


def _about_units(c: _Seen, unit: str, names: Sequence[str]) -> str:
    """Reading of the logs that have another unit than most."""
    some = f"{', '.join(names[:3])}{f' and {len(names) - 3} more' if len(names) > 3 else ''}"
    if not unit:
        return f"channel {c.name} has no unit in {some}, so that it is read in SI there; in most logs it is in {c.unit}"
    return f"channel {c.name} is in {unit} in {some}, in most logs in {c.unit or 'no unit'}; each is converted to SI by its own unit"


def _about_rates(logs: Sequence[Log]) -> list[str]:
    """Logs whose mean sample time differs from the mean sample time of most logs: another rate, or a clock that runs fast or slow."""
    steps = np.array([log.interval for log in logs])
    other = [log for log, step in zip(logs, steps, strict=True) if abs(step / np.median(steps) - 1.0) > RATE]
    if not other:
        return []
    some = f"{other[0].name}{f' and {len(other) - 1} more' if len(other) > 1 else ''}"
    text = f"sample times differ between logs: {1e3 * steps.min():.4g} to {1e3 * steps.max():.4g} ms"
    return [f"{text}; not as in most: {some} (another rate, or a clock that runs fast or slow)"]


# --- lines of the file ---


def _text(value: str) -> str:
    """A string of TOML."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _comment(text: str) -> str:
    return f"# {visible(' '.join(text.split()))}"


def _some(doubts: list[str]) -> list[str]:
    lines = [_comment(f"Doubt: {text}") for text in doubts[:MOST_LINES]]
    more = len(doubts) - MOST_LINES
    return [*lines, *([f"# and {more} more"] if more > 0 else [])]


def _rig_lines(rig: str) -> list[str]:
    if rig:
        return [f"scenario = {_text(rig)}"]
    return [
        f"scenario = {_text(PLACEHOLDER)}",
        "# Doubt: name the rig in place of RIG.toml, and its variables below in place of SHAFT, SLIDE, MOTOR; or delete this file, and",
        "# `lostmotion identify new DIR --rig RIG.toml` writes these names.",
    ]


def _log_lines(home: Path, paths: Sequence[Path], logs: Sequence[Log]) -> list[str]:
    patterns = dict.fromkeys(
        (Path(os.path.relpath(path.parent, home)) / f"*{path.suffix}").as_posix() for path in paths
    )
    steps, lengths = (
        [log.interval for log in logs if len(log.time) > 1],
        [log.duration for log in logs if len(log.time)],
    )
    lines = ["[logs]", f"files = [{', '.join(map(_text, patterns))}]"]
    if any("decimal commas" in note for log in logs for note in log.notes):
        lines.append('decimal = ","')
    lines.append(f"# Sample time: {_range(1e3 * np.array(steps))} ms; logs last {_range(np.array(lengths))} s.")
    values: dict[str, dict[Any, int]] = {}
    for log in logs:
        for key, value in log.header.items():
            if isinstance(value, int | float | str):
                counts = values.setdefault(key, {})
                counts[value] = counts.get(value, 0) + 1
    for key, counts in values.items():
        shown = listed(f"{v:g}" if isinstance(v, float) else str(v) for v in counts)
        lines.append(_comment(f"Header: {key} is {shown} (in {sum(counts.values())} of {len(logs)} logs)"))
    divides = [key for key, counts in values.items() if len(counts) > 1 and key.isidentifier()]
    key, value = (divides[0], next(iter(values[divides[0]]))) if divides else ("file", paths[-1].name)
    own = f"{value:g}" if isinstance(value, float) else repr(value)
    return [*lines, f"# held_out = {_text(f'{key} == {own}')}  # logs that are kept from the fit, to test it"]


def _range(values: np.ndarray) -> str:
    low, high = (f"{x:.4g}" for x in (values.min(), values.max())) if len(values) else ("?", "?")
    return low if low == high else f"{low} to {high}"


def _channel_lines(seen: Sequence[_Seen], count: int) -> list[str]:
    lines = ["", f"# Channels, in {counted(count, 'log')}:"]
    for c in seen:
        unit = c.unit or "no unit"
        some = f", in {c.logs} of them" if c.logs < count else ""
        lines.append(_comment(f"  {c.name} [{unit}]: {c.low:.4g} to {c.high:.4g}{some}"))
    return lines


def _keyed(names: Iterable[str]) -> list[str]:
    """Names as keys of TOML that differ."""
    found: list[str] = []
    for name in names:
        key = "".join(c if c.isalnum() and c.isascii() else "_" for c in name).strip("_") or "channel"
        found.append(key if key not in found else f"{key}_{len(found) + 1}")
    return found


def _about_unit(c: _Seen) -> list[str]:
    if c.unit:
        return []
    return [
        f'# Doubt: its files name no unit, so that it is read in SI{f" ({c.quantity})" if c.quantity else ""}; else: unit = "..."'
    ]


def _input_lines(inputs: Sequence[_Seen], scenario: Scenario | None) -> list[str]:
    if not inputs:
        return [
            '# Doubt: no channel is known to act on the rig; if one does, add [inputs.NAME] with channel = "..."',
            "",
        ]
    kinds = dict.fromkeys(MOTIONS, "_reference")
    free = _signals(scenario)
    units = {} if scenario is None else units_of(scenario)
    lines: list[str] = []
    for k, c in enumerate(inputs):
        wanted = kinds.get(c.quantity, "_command")
        fits = (
            [name for name in free if name.endswith(wanted)]
            or [name for name in free if name.endswith("_command")]
            or free
        )
        fits = [n for n in fits if units.get(n) == c.quantity] + [n for n in fits if units.get(n) != c.quantity]
        if scenario is not None and not fits:
            lines += [_comment(f"Doubt: nothing is left on the rig that channel {c.name} could act on"), ""]
            continue
        name = fits[0] if fits else f"MOTOR{k + 1 if k else ''}{wanted}"
        lines += [f"[inputs.{name}]", f"channel = {_text(c.name)}", *_about_unit(c)]
        lines += _scale_lines(name, c.quantity, scenario) + _about_kind(c, name, units)
        if len(fits) > 1:
            lines.append(_comment(f"Doubt: it may act as {listed(fits[1:])} just as well"))
        lines.append("")
        free = [other for other in free if other != name]
    return lines


def _scale_lines(name: str, quantity: str, scenario: Scenario | None) -> list[str]:
    """Factor from a channel to a command, which is a multiple of the rated torque or voltage."""
    if not name.endswith("_command") or quantity not in ("N*m", "N", "A", "V"):
        return []
    motor = None if scenario is None else scenario.train().motors.get(name.removesuffix("_command"))
    if quantity in ("N*m", "N") and (motor is None or motor.kind == "torque_source"):
        rated = 1.0 if motor is None else motor.rated_torque
        return [] if rated == 1.0 else [f"scale = {1.0 / rated!r}  # a command is a multiple of {rated:g} {quantity}"]
    voltage = quantity == "V" or (motor is not None and motor.kind != "torque_source")
    what, factor = ("voltage", "1/rated_voltage") if voltage else ("torque", "torque_constant")
    text = f"it is in {quantity}, and a command is a multiple of the rated {what}"
    return [f'# Doubt: {text}; give scale = "...", such as {factor}']


def _signals(scenario: Scenario | None) -> list[str]:
    if scenario is None:
        return []
    return [*scenario.signals(), *(scenario.train().variable(name, "reference") for name in scenario.axes())]


def _about_kind(c: _Seen, variable: str, units: Mapping[str, str]) -> list[str]:
    """Doubt about a length that stands for an angle, or an angle for a length."""
    kind, wanted = MOTIONS.get(c.quantity), units.get(variable, "")
    if kind is None or wanted not in MOTIONS or c.quantity == wanted:
        return []
    return [_comment(f'Doubt: it is in {c.quantity}, and {variable} is in {wanted}; give scale = "..." between both')]


def _measured_lines(measured: Sequence[_Seen], scenario: Scenario | None) -> list[str]:
    lines: list[str] = []
    units = {} if scenario is None else units_of(scenario)
    for c, key in zip(measured, _keyed(c.name for c in measured), strict=True):
        table, bodies = _bodies(scenario, c)
        named = [body for body in bodies if body.lower() in c.words]
        body = (named or bodies[-1:] or [NAMELESS[table]])[0]
        rest = "position" if table == "slides" else "angle"
        variable = f"{body}_{'speed' if c.quantity in ('rad/s', 'm/s') else rest}"
        lines += [f"[measured.{key}]", f"channel = {_text(c.name)}", f'variable = "{variable}"', *_about_unit(c)]
        lines += _about_kind(c, variable, units)
        if c.quantity not in MOTIONS:
            lines.append("# Doubt: neither its name nor its unit says that it is an angle or a speed")
        if len(bodies) > 1 and not named:
            lines.append(_comment(f"Doubt: it may be that of another of the {table}: {listed(bodies[:-1])}"))
        if len(measured) > 1:
            noise = float(np.median(c.noise)) if c.noise else 0.0
            factor = _factor(c.unit)
            deviation = factor * (noise or 1e-3 * (c.high - c.low) or 1.0)
            lines += [
                f"deviation = {deviation:.3g}",
                "# Doubt: standard deviation of its errors in SI, by neighbouring samples",
            ]
        lines.append("")
    return lines


def _bodies(scenario: Scenario | None, c: _Seen) -> tuple[str, list[str]]:
    """(table, its names) of what a channel may show the motion of: slides if it is in metres, or named as one of them."""
    linear = c.quantity in ("m", "m/s")
    if scenario is None:
        return "slides" if linear else "shafts", []
    slides, shafts = list(scenario.slides), list(scenario.shafts)
    linear = linear or (c.quantity not in MOTIONS and any(name.lower() in c.words for name in slides))
    return ("slides", slides) if slides and (linear or not shafts) else ("shafts", shafts)


def _factor(unit: str) -> float:
    try:
        return channel_unit("", unit, "", "")[0]
    except InputError:
        return 1.0


def _parameter_lines(scenario: Scenario | None, *, linear: bool) -> list[str]:
    found: dict[str, float] = {}
    for table in ("shafts", "slides", "motors", "linear_motors") if scenario is not None else ():
        for name, part in getattr(scenario, table).items():
            for key in SOUGHT:
                value = getattr(part, key, None)
                if isinstance(value, float) and value > 0.0:
                    found[f"{table}.{name}.{key}"] = value
    if not found:
        nameless = "slides.SLIDE.friction_force" if linear else "shafts.SHAFT.friction_torque"
        found = {nameless: 1.0} if scenario is None else {}
    names = _keyed("_".join(key.split(".")[1:]) for key in found)
    if not found:
        return ["# Doubt: the rig states no inertia and no friction; name what is sought", "[set]", "", "[parameters]"]
    lines = ["# What is sought, from the values of the rig.", "[set]"]
    lines += [f"{_text(key)} = {_text(name)}" for key, name in zip(found, names, strict=True)]
    lines += ["", "[parameters]"]
    for name, value in zip(names, found.values(), strict=True):
        lines.append(
            f"{name} = {{ start = {value!r}, min = {value / 100.0!r}, max = {value * 100.0!r}, logarithmic = true }}"
        )
    return lines

"""Frequency response of closed loops: what controllers and drive do under a sine of a reference or a load."""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from .. import _core
from ..control.custom_controller import Law
from ..interruptible_threads import thread_pool
from ..model.train import DriveTrain
from ..simulation.scenario.scenario import Scenario
from ..simulation.variables_of_trains import signals_of
from .closed_loop import AxisSignal, ClosedLoop, Motion, Search, mean_of
from .plant import Plant
from .windows import Window, fitting


def windows_for(plant: Plant, frequencies: Sequence[float]) -> list[Window]:
    """The nearest frequencies whose periods fit the sample times, each once."""
    tick, frame = frame_of(plant.scenario)
    found = [fitting(f, tick, frame) for f in frequencies]
    return list({w.frequency: w for w in reversed(found)}.values())[::-1]


def frame_of(scenario: Scenario) -> tuple[float, int]:
    """Base tick [s], and after how many of them the sample times of all controllers and their delays repeat."""
    base = min(c.sample_time for c in scenario.axes().values())
    frame = 1
    for c in scenario.axes().values():
        own = round(c.sample_time / base)
        loops = {name: every * own for name, _, every in c.schedules()}
        delays = [e.delay * own for e in (c.encoder, c.position_encoder) if e is not None and e.delay]
        span = getattr(c.speed.estimate, "span", 1) if c.speed is not None else 1
        frame = math.lcm(frame, own, *loops.values(), *delays, span * loops["speed"])
    return base, frame


def axis_signals(scenario: Scenario) -> Iterator[AxisSignal]:
    """The variables of the controllers; repeating states of windings, behind all that the controllers remember."""

    def titled(name: str, motor: str) -> str:
        return scenario.train().variable(motor, name)

    base, axes = scenario.control({name: Law(_nothing) for name, c in scenario.axes().items() if c.law})
    first, own, winding = 0, len(_core.axis_signals()), _core.winding_signals()
    count = sum(axis.slots()[0] for axis in axes)
    for k, (motor, c) in enumerate(scenario.axes().items()):
        mode = c.reference.kind
        every = {loop: n * round(c.sample_time / base) for loop, _, n in c.schedules()}
        for slot, (name, _, _) in enumerate(_core.axis_signals()):
            if name not in signals_of(c):
                continue
            outer = mode == "position" and name in ("position_reference", "measured_position", "speed_reference")
            title = titled(name, motor)
            if c.law or mode == "torque":  # computed at each tick
                yield AxisSignal(title, first + slot, 1, 0)
            elif outer:
                yield AxisSignal(title, first + slot, every["position"], round(c.phase / base))
            else:
                yield AxisSignal(title, first + slot, every["speed"], 0)
        for n, (name, unit, _) in enumerate(winding):
            if name in signals_of(c) and unit != "J":
                yield AxisSignal(titled(name, motor), count + k * (own + len(winding)) + own + n, 0, 0)
        first += axes[k].slots()[0]


def _nothing(*_: Any) -> float:
    return 0.0


def respond_closed(
    plant: Plant,
    source: str,
    amplitudes: Sequence[float],
    windows: Sequence[Window],
    *,
    harmonics: int,
    max_periods: int,
    law: Any,
    threads: int,
    progress: Callable[[], None] | None,
) -> dict[str, Any]:
    """Arrays as `respond` returns them for open loops, with a row for each amplitude and window."""
    signals = list(axis_signals(plant.scenario))

    def row(point: tuple[float, Window]) -> dict[str, Any]:
        amplitude, window = point
        found = Search(ClosedLoop(plant, source, amplitude, window, law), signals, max_periods).find()
        return _row(plant, (source, amplitude), window, found, harmonics)

    rows = []
    with thread_pool(1 if law is not None else threads) as pool:  # a law may keep something of its own
        for found in pool.map(row, itertools.product(amplitudes, windows)):
            rows.append(found)
            if progress is not None:
                progress()
    return {key: np.array([row[key] for row in rows]) for key in rows[0]}


def _row(
    plant: Plant, source: tuple[str, float], window: Window, motion: Motion | str, harmonics: int
) -> dict[str, Any]:
    """The values of one point, by the names of the core's values."""
    count = len(plant.channels)
    row: dict[str, Any] = {"error": "", "converged": True, "residual": math.nan, "periods": 0, "newton_steps": 0}
    row |= {"harmonics": np.full((count, harmonics + 1, 2), math.nan), "mean_square": np.full(count, math.nan)}
    row |= dict.fromkeys(("motor_power", "load_power", "gear_loss", "angle_advance", "spread"), math.nan)
    if isinstance(motion, str):
        return row | {"error": motion}
    row |= {"residual": motion.residual, "periods": motion.windows * window.periods, "newton_steps": motion.jumps}
    row |= {"angle_advance": motion.advance, "spread": motion.spread} | _powers(plant, motion.plant)
    repeats = motion.plant.shape[1] // window.samples * window.periods
    angles = np.tile(window.angle(window.offsets), motion.plant.shape[1] // window.samples)
    values = {name: (angles, y) for name, y in zip(plant.channels, motion.plant, strict=False)} | motion.signals
    for k, name in enumerate(plant.channels):
        if name in plant.references or name == source[0]:
            mean = mean_of(plant.references[name]) if name in plant.references else plant.signals[name].mean
            c, square = _of_sine(mean, source[1] if name == source[0] else 0.0, harmonics)
        else:
            instants, y = values[name]
            c, square = _harmonics(instants, y, harmonics, repeats)
        row["harmonics"][k] = np.stack([c.real, c.imag], axis=-1)
        row["mean_square"][k] = square
    return row


def _of_sine(mean: float, amplitude: float, harmonics: int) -> tuple[np.ndarray, float]:
    c = np.zeros(harmonics + 1, complex)
    c[:2] = mean, -1j * amplitude
    return c, mean**2 + 0.5 * amplitude**2


def _harmonics(angles: np.ndarray, y: np.ndarray, harmonics: int, periods: int) -> tuple[np.ndarray, float]:
    """Complex amplitudes and the mean square of samples over some periods; NaN from half the sampling frequency on."""
    n = np.arange(harmonics + 1)
    c = np.array([np.mean(y * np.exp(-1j * k * angles)) for k in n]) * np.where(n > 0, 2.0, 1.0)
    return np.where(2 * n * periods < len(y), c, np.nan), float(np.mean(y**2))


def _powers(plant: Plant, samples: np.ndarray) -> dict[str, float]:
    """Mean powers of the samples [W]: of all motors, out of the last gears, lost in all gears."""
    values = dict(zip(plant.channels, samples, strict=False))
    motors, gears = _of_train(plant.scenario.train())

    def power(torque: str, speed: str) -> float:
        return float(np.mean(values[torque] * values[speed]))

    return {
        "motor_power": sum(power(*pair) for pair in motors),
        "load_power": sum(power(*out) for _, out, last in gears if last),
        "gear_loss": sum(power(*into) - power(*out) for into, out, _ in gears),
    }


def _of_train(train: DriveTrain) -> tuple[list[tuple[str, str]], list[tuple[tuple[str, str], tuple[str, str], bool]]]:
    """Torque and speed of the motors, and of the gears at input and output, with whether the output turns no other gear."""
    motors = [
        (train.variable(name, "torque"), train.variable(motor.shaft, "speed")) for name, motor in train.motors.items()
    ]
    driving = {gear.input for gear in train.gears.values()}
    gears = [
        (
            (train.variable(name, "input_torque"), train.variable(g.input, "speed")),
            (train.variable(name, "output_torque"), train.variable(g.output, "speed")),
            g.output not in driving,
        )
        for name, g in train.gears.items()
    ]
    return motors, gears

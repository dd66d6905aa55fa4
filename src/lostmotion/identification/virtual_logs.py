"""Logs of a virtual rig: what an axis with given values would show, with noise and quantisation."""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from .preparation.prepare import prepared
from .readers.channel_units import channel_unit
from .readers.log import Channel, Log
from .rig.rig_runs import run_log
from .rig.rig_scenario import Rig
from .task.file_formulas import number


def virtual_log(
    rig: Rig,
    plan: Log,
    values: Mapping[str, float],
    *,
    rung: int = -1,
    noise: Mapping[str, float] | None = None,
    seed: int = 0,
) -> Log:
    """The log that an experiment would give.

    rig: what is measured.
    plan: time, header and inputs of the experiment; the measured channels need not be there, but for what formulas take
        of them, such as ``first_position``.
    values: of the parameters and nuisances, SI; others have their start values.
    rung: index of the candidate model; -1: the last.
    noise: standard deviations of the measured channels by name, SI.
    seed: of the noise.
    """
    task = rig.task
    known = {name: p.start for name, p in {**task.parameters, **task.nuisance}.items()} | dict(values)
    zeros = {
        m.channel: Channel(np.zeros(len(plan.time)), m.unit)
        for m in task.measured.values()
        if m.channel not in plan.channels
    }
    log = prepared(task, replace(plan, channels={**zeros, **plan.channels}), rig.units)
    run = run_log(rig, log, known, rung % len(rig.rungs()))
    draw = np.random.default_rng(seed)
    channels = dict(plan.channels)
    for name, m in task.measured.items():
        x = run[name] + draw.normal(size=len(log.time)) * (noise or {}).get(name, 0.0)
        step = number(m.resolution, {}, f"measured.{name}.resolution")
        x = step * np.round(x / step) if step > 0.0 else x
        of_plan = plan.channels[m.channel].unit if m.channel in plan.channels else ""
        factor, _ = channel_unit(m.unit, of_plan, rig.units.get(m.variable, ""), f"measured.{name}")
        channels[m.channel] = Channel(x / factor, m.unit or of_plan)
    return replace(plan, channels=channels)


def write_servo_json(path: Path, log: Log) -> None:
    """A log as JSON in the layout of servo recorders."""
    names = list(log.channels)
    rows = np.array([log.channels[name].values for name in names]).T
    entries: list[dict[str, Any]] = [
        {**dict(zip(names, map(float, row), strict=True)), "timestamp": float(t)}
        for t, row in zip(log.time, rows, strict=True)
    ]
    path.write_text(json.dumps({**log.header, "entries": entries}), encoding="utf-8")

"""Parts of a drive train that nothing joins: each is a train of its own, solved alone, and their results are one again."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import Any

import numpy as np

from ...control.axis import BoundController, own
from ...control.controller import Controller
from ...inputs.cached_values import kept
from ...inputs.named_elements import Named
from ...model.linear_train import LinearElements
from ...model.train import COUPLINGS
from ..forms.train_tables import TrainInitial
from ..scenario.scenario import Scenario

INSTANT, LEADING = 0, 2  # of a switching: column of its instant, and number of columns before those of contacts
NO_CONTACT = 2.0
SIDE_BY_SIDE = 1_000_000  # ticks: the longest run that another one may have beside it, which Ctrl-C does not end
SUMS = ("residual", "stored_change", "turned_over")  # of the ledger, over all elements


@kept
def parts_of(scenario: Scenario) -> list[Any]:
    """The trains that a scenario consists of, in the order of their first shafts; most often itself alone.

    Shafts belong together that a gear, its housing, a clutch, a freewheel, a damper, a mass matrix, or a controller joins.
    """
    groups = _groups(scenario)
    return [scenario] if len(groups) == 1 else [_part(scenario.long(), shafts) for shafts in groups]


def _groups(scenario: Scenario) -> list[list[str]]:
    shafts = scenario.train().shafts
    group = {shaft: {shaft} for shaft in shafts}
    for joined in _joined(scenario):
        together = set().union(*(group[shaft] for shaft in joined))
        for shaft in together:
            group[shaft] = together
    found: list[list[str]] = []
    for shaft in shafts:
        if not any(shaft in others for others in found):
            found.append([s for s in shafts if s in group[shaft]])
    return found


def _joined(scenario: Scenario) -> Iterator[list[str]]:
    """Shafts that something joins."""
    train = scenario.train()
    for table in ("gears", *COUPLINGS):
        for element in getattr(train, table).values():
            yield [element.input, element.output, *filter(None, [getattr(element, "housing", None)])]
    yield from ([one, other] for one, other, _ in train.inertia_couplings())
    last = list(train.shafts)[-1]
    controllers: dict[str, Any] = {**scenario.axes(), **scenario.continuous()}
    for name, controller in controllers.items():
        shafts = [train.motors[name].shaft, controller.shaft or last]
        encoders = [getattr(controller, key, None) for key in ("encoder", "position_encoder")]
        yield shafts + [encoder.shaft for encoder in encoders if encoder is not None and encoder.shaft is not None]


def _part(scenario: Scenario, shafts: Collection[str]) -> Scenario:
    """The scenario of some of its shafts, whose values have been checked with the whole."""
    train = scenario.train()
    kept: dict[str, Any] = {
        table: Named({name: s for name, s in getattr(scenario, table).items() if name in shafts})
        for table in ("shafts", "slides")
    }
    for table in LinearElements.model_fields.keys() - {"mass_matrices"}:
        kept[table] = Named({name: e for name, e in getattr(scenario, table).items() if _stands_on(e) in shafts})
    masses = scenario.mass_matrices.items()
    kept["mass_matrices"] = Named({n: m.among(shafts) for n, m in masses if not set(m.shafts).isdisjoint(shafts)})
    motors = {name for name, motor in train.motors.items() if motor.shaft in shafts}
    gears = {name for name, gear in train.gears.items() if gear.input in shafts}
    last = list(train.shafts)[-1]
    kept["controllers"] = Named(
        {
            name: c if c.shaft is not None else c.model_copy(update={"shaft": last})
            for name, c in scenario.controllers.items()
            if name in motors
        }
    )
    commanded = [*motors, *kept["brakes"], *kept["clutches"]]
    kept["command"] = Named({name: c for name, c in scenario.command.items() if name in commanded})
    states = {
        f"{name}_{state}" for name, c in scenario.continuous().items() if name in motors for state in c.system().states
    }
    mine: dict[str, Collection[str]] = {
        "speeds": shafts,
        "angles": shafts,
        "positions": shafts,
        "slide_speeds": shafts,
        "twists": gears,
        "deflections": gears,
        "hysteresis_capacities": gears,
        "hysteresis_forces": gears,
        "motor_torques": motors,
        "controller_states": states,
    }
    initial = {
        table: Named({name: v for name, v in getattr(scenario.initial, table).items() if name in names})
        for table, names in mine.items()
    }
    # A part without a reference of a position does not begin on one.
    references = [c.reference for c in kept["controllers"].values() if isinstance(c, Controller)]
    on_reference = scenario.initial.on_reference and any(r.kind == "position" for r in references)
    return scenario.model_copy(update=kept | {"initial": TrainInitial(**initial, on_reference=on_reference)})


def _stands_on(element: Any) -> str:
    """One of the shafts and slides that an element acts on."""
    return str(next(name for key in ("shaft", "input", "slide") if (name := getattr(element, key, None)) is not None))


def control_of_part(control: BoundController, whole: Scenario, part: Scenario) -> BoundController:
    """Controllers that belong to a part."""
    tick, axes = control
    motors, shafts = list(whole.train().motors), list(whole.train().shafts)
    motor_of = {motors.index(name): k for k, name in enumerate(part.train().motors)}
    shaft_of = {shafts.index(name): k for k, name in enumerate(part.train().shafts)}
    mine = own((tick, [axis for axis in axes if axis.motor in motor_of]))
    for axis in mine[1]:
        places = {key: shaft_of[getattr(axis, key)] for key in ("position_shaft", "speed_shaft", "reference_shaft")}
        axis.set({"motor": motor_of[axis.motor], **places})
    return mine


def joined_results(
    whole: Scenario, parts: Sequence[Scenario], results: Sequence[dict[str, Any]], most: int
) -> dict[str, Any]:
    """Result of the whole train from the results of its parts.

    results: of the parts, with `channels` and `contacts`, their names.
    most: switchings that are kept.
    """
    core = whole.core()
    rows = {name: row for r in results for name, row in zip(r["channels"], r["values"], strict=True)}
    signals = {
        name: row
        for part, r in zip(parts, results, strict=True)
        for name, row in zip(part.axes(), r["control"], strict=True)
    }
    ledgers = [r["energy"] for r in results]
    entries = sorted({entry for ledger in ledgers for entry in ledger})
    return {
        "values": [rows[name] for name, *_ in core.channels()],
        "control": [signals[name] for name in whole.axes()],
        "switchings": _joined_switchings(core.contact_names(), rows, results)[:most],
        **{n: sum(r[n] for r in results) for n in ("switching_count", "steps", "mode_trials", "mode_fallbacks")},
        "end_state": dict(sorted(item for r in results for item in r["end_state"].items())),
        "energy": {entry: sum(ledger[entry] for ledger in ledgers if entry in ledger) for entry in entries},
        "left_data_at": min(r["left_data_at"] for r in results),
    }


def _joined_switchings(
    contacts: Sequence[str], rows: dict[str, np.ndarray], results: Sequence[dict[str, Any]]
) -> np.ndarray:
    """The switchings in the order of time; contacts of the other parts are as their own last switching has left them."""
    n = len(contacts)
    count = sum(len(r["switchings"]) for r in results)
    table = np.full((count, LEADING + 2 * n), np.nan)
    first, at = 0, {name: k for k, name in enumerate(contacts)}
    start = np.array([rows[name][0] if name in rows else NO_CONTACT for name in contacts])
    for r in results:
        own, width = np.asarray(r["switchings"]), len(r["contacts"])
        places = [at[name] for name in r["contacts"]]
        here = slice(first, first + len(own))
        table[here, :LEADING] = own[:, :LEADING]
        table[here, [LEADING + k for k in places]] = own[:, LEADING : LEADING + width]
        table[here, [LEADING + n + k for k in places]] = own[:, LEADING + width :]
        if len(own):
            start[places] = own[0, LEADING : LEADING + width]
        first += len(own)
    table = table[np.argsort(table[:, INSTANT], kind="stable")]
    before, after = table[:, LEADING : LEADING + n], table[:, LEADING + n :]  # views
    known = np.where(np.isnan(after), -1, np.arange(count)[:, None])
    last = np.maximum.accumulate(known, axis=0)
    now = np.where(last < 0, start, np.take_along_axis(after, np.maximum(last, 0), axis=0))
    others = np.isnan(before)
    before[others] = np.vstack([start, now[:-1]])[others]
    after[others] = now[others]
    return table

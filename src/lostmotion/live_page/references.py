"""References of sampled controllers, as the page takes and changes them."""

import itertools
import math
from collections.abc import Iterator
from typing import Any

from ..control.references import PositionReference, Reference
from ..model.signals import TimeFunction
from ..simulation.forms.slide_units import of_slides
from ..simulation.scenario.scenario import Scenario
from ..simulation.variables_of_trains import REFERENCE_UNITS
from . import sliders
from .sliders import Place, Range, Slider

LIMITS = (("speed", "rad/s"), ("acceleration", "rad/s^2"), ("jerk", "rad/s^3"))


def signal_view(signal: TimeFunction[Any], duration: float) -> dict[str, Any]:
    """Signal as page/src/core_input.ts describes it, with a sine and a step of height 0 for the sliders of one."""
    others = (getattr(signal, key, None) for key in ("chirp", "samples", "wind"))
    return {
        "mean": signal.mean,
        "sines": signal.sine_list() or [(0.0, 1.0, 0.0)],
        "steps": [(s.height, s.time) for s in signal.steps] or [sliders.no_step(duration)],
        "ramps": [(r.rise, r.duration, r.begin) for r in signal.ramps],
        "courses": [part.breakpoints() for part in others if part is not None],
    }


def reference_view(reference: Reference[Any], duration: float) -> dict[str, Any] | None:
    """Reference as a signal with its moves; None for a reference that follows a target, which the page cannot change."""
    moves, timed = None, []
    if isinstance(reference, PositionReference):
        if reference.target is not None:
            return None
        if _has_sliders(reference):
            own = ("start", "begin", "speed", "acceleration", "jerk", "dwell")
            moves = {key: getattr(reference, key) for key in own}
            moves["moves"] = [m.model_dump(exclude={"duration", "law"}) for m in reference.moves]
        elif reference.moves:
            points = reference._pieces()[-1]
            timed = [[*(p for p, q in itertools.pairwise(points) if p[0] < q[0]), points[-1]]]
    view = signal_view(reference, duration)
    return view | {"courses": [*view["courses"], *timed], "moves": moves}


def _has_sliders(reference: PositionReference) -> bool:
    """Whether the page can change its moves. It has no laws of moves with a duration, which are drawn as they are."""
    return bool(reference.moves) and all(move.duration is None for move in reference.moves)


def reference_sliders(scenario: Scenario) -> Iterator[Slider]:
    """Sliders of the moves of each reference; without moves, of its mean, its first sine and its steps."""
    for number, (motor, controller) in enumerate(scenario.axes().items()):
        reference, key = controller.reference, f"{scenario.controller_key(motor)}.reference"
        group = f"Reference of {motor.replace('_', ' ')}" if len(scenario.axes()) > 1 else "Reference"
        forces, positions = scenario.sliding()[scenario.prefix(motor)]
        if isinstance(reference, PositionReference) and reference.moves:
            if _has_sliders(reference):
                yield from _of_moves(reference, key, group, number, slides=positions)
            continue
        if isinstance(reference, PositionReference) and reference.target is not None:
            continue
        parts = (reference.mean, reference.amplitude or 0.0, *(s.height for s in reference.steps))
        sizes = [abs(float(size)) for size in (*parts, *(r.rise for r in reference.ramps))]
        most = 1.5 * max(sizes) or {"position": math.pi, "speed": 10.0, "torque": 1.0}[reference.kind]
        own = REFERENCE_UNITS[reference.kind]
        unit = of_slides(own, positions=positions and reference.kind != "torque", forces=forces)
        duration = scenario.simulation.duration
        yield from sliders.of_signal(reference, key, group, unit, {"reference": number}, most, duration)


def _of_moves(reference: PositionReference, key: str, group: str, number: int, *, slides: bool) -> Iterator[Slider]:
    def slider(end: str, label: str, unit: str, value: float, reach: Range, path: Place) -> Slider:
        return Slider(f"{key}.{end}", group, label, unit, value, reach, {"reference": number, "path": ["moves", *path]})

    places = [reference.start, *(move.to for move in reference.moves)]
    span = 1.5 * max(abs(p) for p in places) or math.pi
    for k, move in enumerate(reference.moves[:6]):
        label = f"move {k + 1} to" if len(reference.moves) > 1 else "move to"
        yield slider(
            f"moves.{k}.to", label, "m" if slides else "angle", move.to, Range(-span, span), ["moves", k, "to"]
        )
    for name, unit in LIMITS:
        value = getattr(reference, name)
        if value is not None and any(getattr(move, name) is None for move in reference.moves):
            si = of_slides(unit, positions=slides, forces=False)
            yield slider(name, f"{name} limit", si, value, sliders.around(value), [name])
    usual = max(reference.dwell, 0.25)
    if any(move.dwell is None for move in reference.moves):
        yield slider("dwell", "dwell", "s", reference.dwell, Range(0.0, 4.0 * usual), ["dwell"])

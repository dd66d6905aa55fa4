"""References of sampled controllers, as the page takes and changes them."""

import itertools
import math
from collections.abc import Iterator
from typing import Any

from ..control.controller import Controller
from ..control.references import PositionReference, Reference
from ..simulation.forms.slide_units import of_slides
from ..simulation.variables_of_trains import REFERENCE_UNITS
from . import sliders
from .sliders import Place, Range, Slider

LIMITS = (("speed", "rad/s"), ("acceleration", "rad/s^2"), ("jerk", "rad/s^3"))


def reference_view(reference: Reference[Any], duration: float) -> dict[str, Any] | None:
    """Reference as page/src/core_input.ts describes it, with a sine and a step of height 0 for the sliders of one.

    None for what follows a target, which the page cannot change.
    """
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
    return {
        "mean": reference.mean,
        "sines": reference.sine_list() or [(0.0, 1.0, 0.0)],
        "steps": [(s.height, s.time) for s in reference.steps] or [sliders.no_step(duration)],
        "ramps": [(r.rise, r.duration, r.begin) for r in reference.ramps],
        "courses": [*([] if reference.samples is None else [reference.samples.breakpoints()]), *timed],
        "moves": moves,
    }


def _has_sliders(reference: PositionReference) -> bool:
    """Whether the page can change its moves. It has no laws of moves with a duration, which are drawn as they are."""
    return bool(reference.moves) and all(move.duration is None for move in reference.moves)


def reference_sliders(
    controller: Controller,
    key: str,
    group: str,
    number: int,
    duration: float,
    sliding: tuple[bool, bool] = (False, False),
) -> Iterator[Slider]:
    """Sliders of the moves of a reference; without moves, of its mean, its first sine and its steps.

    key: table of the reference in the scenario file.
    number: among the controllers.
    sliding: whether the motor moves a slide, and whether the position is the position of a slide.
    """
    reference = controller.reference
    positions = sliding[1] and reference.kind != "torque"
    unit = of_slides(REFERENCE_UNITS[reference.kind], positions=positions, forces=sliding[0])
    if isinstance(reference, PositionReference) and reference.moves:
        if _has_sliders(reference):
            yield from _of_moves(reference, key, group, number, slides=sliding[1])
        return
    if isinstance(reference, PositionReference) and reference.target is not None:
        return
    sizes = [abs(float(v)) for v in (reference.mean, reference.amplitude or 0.0)]
    sizes += [abs(float(part)) for s in reference.steps for part in (s.height,)]
    sizes += [abs(float(r.rise)) for r in reference.ramps]
    most = 1.5 * max(sizes) or {"position": math.pi, "speed": 10.0, "torque": 1.0}[reference.kind]
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

"""Drawing of a scenario on the page: its elements with the names of their variables, as page/src/description.ts describes them."""

from typing import Any

from ..model.losses import LossMap
from ..model.torsion import Rigid, TorsionCurve
from ..simulation.scenario.scenario import Scenario


def drawn(scenario: Scenario) -> dict[str, Any]:
    """Drawing of a scenario."""
    names = [name for name, *_ in scenario.core().channels()]

    def known(name: str) -> str | None:
        return name if name in names else None

    train = scenario.train()
    with_motor = {m.shaft for m in train.motors.values()}
    shafts = [
        {
            "name": n,
            "speed": train.variable(n, "speed"),
            "angle": known(train.variable(n, "angle")),
            "contact": known(train.variable(n, "contact")),
            "motor": n in with_motor,
            "slide": train.is_slide(n),
        }
        for n in train.shafts
    ]
    gears = [
        {
            "name": n,
            "input": g.input,
            "output": g.output,
            "fixed": g.housing is None,
            "twist": None if isinstance(g.stiffness, Rigid) else known(train.variable(n, "twist")),
            "output_torque": train.variable(n, "output_torque"),
            **_laws(g),
        }
        for n, g in train.gears.items()
    ]
    motors = [
        {
            "name": n,
            "shaft": m.shaft,
            "torque": train.variable(n, "torque"),
            "command": None if m.kind == "stepper" else known(train.variable(n, "command")),
        }
        for n, m in train.motors.items()
    ]
    twists = {train.variable(n, "twist_contact"): n for n in train.gears}
    rigid = {contact for contact, n in twists.items() if isinstance(train.gears[n].stiffness, Rigid)}
    labels = {train.variable(n, "contact"): n for n in train.shafts} | {c: f"{n} twist" for c, n in twists.items()}
    sliding = {train.variable(n, "contact") for n in train.shafts if train.is_slide(n)}
    sliding |= {contact for contact, n in twists.items() if train.is_slide(train.gears[n].output)}
    labels |= {contact: contact.removesuffix("_contact") for contact in sliding}
    return {
        "shafts": shafts,
        "gears": gears,
        "motors": motors,
        "contacts": [
            {"label": labels.get(c, c.removesuffix("_contact")).replace("_", " "), "variable": c, "slide": c in sliding}
            for c in names
            if c.endswith("_contact") and c not in rigid
        ],
    }


def stepper_figures(scenario: Scenario) -> list[dict[str, Any]]:
    """Charts over time of the fields of steppers."""
    train = scenario.train()
    steppers = [name for name, motor in train.motors.items() if motor.kind == "stepper"]
    series = {
        "Field": [{"variable": train.variable(n, "command"), "label": n} for n in steppers],
        "Field before the rotor, electrical angle": [
            {"variable": train.variable(n, "electrical_angle"), "label": n} for n in steppers
        ],
    }
    return [{"title": title, "unit": "rad", "series": lines} for title, lines in series.items() if lines]


def axis_figures(scenario: Scenario, motor: str) -> list[dict[str, Any]]:
    """Charts over time of the controller of a motor."""
    prefix, quantity = scenario.prefix(motor), scenario.axes()[motor].reference.kind
    if quantity == "torque":
        return []
    suffix = f" of {motor.replace('_', ' ')}" if prefix else ""
    motor_slides, shaft_slides = scenario.sliding()[prefix]
    unit = ("m" if shaft_slides else "rad") if quantity == "position" else "m/s" if motor_slides else "rad/s"
    reference, measured = f"{prefix}{quantity}_reference", f"{prefix}measured_{quantity}"
    followed = [{"variable": reference, "label": "reference"}, {"variable": measured, "label": "measured"}]
    error = [{"variable": reference, "minus": measured, "label": "reference − measured"}]
    return [
        {"title": f"{quantity.capitalize()}{suffix}", "unit": unit, "series": followed},
        {"title": f"Measured following error{suffix}", "unit": unit, "series": error},
    ]


def _laws(gear: Any) -> dict[str, Any]:
    losses = None
    if isinstance(gear.losses, LossMap):
        rated = {"rated_speed": gear.rated_input_speed, "rated_torque": gear.rated_output_torque}
        losses = dict(zip(("speeds", "loads", "values"), gear.losses.whole(), strict=True)) | rated
    stiffness = gear.stiffness
    return {
        "ratio": gear.ratio,
        "backlash": _open(stiffness) if isinstance(stiffness, TorsionCurve) else 0.0,
        "losses": losses,
    }


def _open(curve: TorsionCurve) -> float:
    """The twist over which a curve carries nothing [rad], both ways."""
    return 2.0 * curve.core().side(forward=True)[0][0] if curve.has_gap else 0.0

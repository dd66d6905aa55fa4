"""Angles of shafts that a run does not record, such as that of a motor with an encoder: through the gears behind them."""

from __future__ import annotations

from collections.abc import Collection

from ...model.torsion import Rigid
from ...simulation.scenario.scenario import Scenario


def angle_terms(scenario: Scenario, shaft: str, recorded: Collection[str]) -> dict[str, float]:
    """The angle of a shaft as a sum of recorded variables: factors by name, empty where gears do not give it.

    A gear without housing and transmission error has ``input angle = ratio * (output angle + twist)``.
    """
    train = scenario.train()
    own = train.angle_of(shaft) if shaft in train.shafts else f"{shaft}_angle"
    if own in recorded:
        return {own: 1.0}
    for name, gear in train.gears.items():
        if gear.input != shaft or gear.housing is not None or gear.transmission_error is not None:
            continue
        behind = angle_terms(scenario, gear.output, recorded)
        if not behind:
            continue
        terms = {variable: gear.ratio * factor for variable, factor in behind.items()}
        return terms if isinstance(gear.stiffness, Rigid) else terms | {train.twist_of(name): gear.ratio}
    return {}

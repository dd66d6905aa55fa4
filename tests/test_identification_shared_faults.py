"""Faults that many logs share are the model's: they are said once, with what the logs have in common, and no log is dropped."""

from __future__ import annotations

import numpy as np
import pytest

from dry_friction import angles
from lostmotion.identification.logs import Channel, Log
from lostmotion.identification.screening import frozen_stretches, screened

TIME = np.arange(800) / 200


def stuck(amplitude: float = 0.35, coulomb: float = 0.2) -> np.ndarray:
    """An angle that rests for a while at each reversal, since the torque is below the friction."""
    return angles(amplitude * np.sin(2 * np.pi * 0.7 * TIME), 5e-3, coulomb=coulomb)


@pytest.mark.parametrize("rounded", [12, 6, 4])
def test_a_load_that_rests_below_its_friction_is_not_frozen(rounded: int) -> None:
    angle = np.round(stuck(), rounded)
    assert np.sum(np.diff(angle) == 0.0) > 100
    assert frozen_stretches(angle) == []
    speed = np.gradient(stuck(), TIME)
    speed[np.abs(speed) < 1e-9] = 0.0
    assert frozen_stretches(speed) == []
    log = Log("a.csv", TIME, {"angle": Channel(angle, "rad")})
    assert not any("frozen" in note for note in screened(log, ["angle"], []).notes)


@pytest.mark.parametrize("noise", [0.0, 1e-3])
@pytest.mark.parametrize("value", ["last", "zero"])
def test_a_sensor_that_stops_in_a_motion_is_frozen(noise: float, value: str) -> None:
    angle = 1.0 + np.sin(3.0 * TIME) + noise * np.random.default_rng(0).normal(size=len(TIME))
    angle[250:310] = angle[250] if value == "last" else 0.0
    assert frozen_stretches(angle) == [(250, 310)]


def test_another_channel_that_moves_tells_a_frozen_sensor_from_a_load_at_rest() -> None:
    angle = stuck()
    begin, end = max(
        ((a, b) for a in range(len(angle)) for b in (int(np.argmax(angle[a:] != angle[a])) + a,) if b - a > 25),
        key=lambda s: s[1] - s[0],
    )
    moving = np.sin(3.0 * TIME)
    assert (begin, end) in frozen_stretches(angle, [moving])
    assert frozen_stretches(angle, [angle]) == []

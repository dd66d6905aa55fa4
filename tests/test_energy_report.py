"""Inputs beyond what numbers resolve are refused; an energy ledger that does not close is reported."""

from __future__ import annotations

import json
from typing import Any

import pytest

import lostmotion as lm
from conftest import ALL_SCENARIOS

NAMED = {path.stem: path for path in ALL_SCENARIOS}


@pytest.mark.parametrize(
    ("scenario", "changes", "key"),
    [
        ("position-axis", {"gearbox.losses.speeds": [0.0, 1e-17, 1.0]}, "speeds"),
        ("backlash-reversing-load", {"gearbox.losses.loads": [0.0, 0.5, 0.5 + 1e-12]}, "loads"),
        (
            "backlash-reversing-load",
            {"gearbox.stiffness.breaks": [1e-3, 1e-3 + 1e-15], "gearbox.stiffness.slopes": [1e3, 1e4, 1e5]},
            "breaks",
        ),
    ],
)
def test_breakpoints_that_the_solver_cannot_tell_apart_are_refused(
    scenario: str, changes: dict[str, Any], key: str
) -> None:
    with pytest.raises(lm.InputError, match=rf"{key}.*differ by less than 1e-09 of the largest.*leave one of them out"):
        lm.load(NAMED[scenario], changes)


def test_a_ledger_that_does_not_close_is_reported() -> None:
    run = lm.simulate(lm.load(NAMED["backlash-reversing-load"], {"gearbox.ratio": 1e-5}))
    energy = json.loads(run.attrs["energy"])
    share = abs(energy["residual"]) / energy["turned_over"]
    assert run.attrs["energy_residual"] == share
    assert (share > 1e-6) == ("energy balance" in run.attrs.get("warning", ""))
    good = lm.simulate(lm.load(NAMED["backlash-reversing-load"]))
    assert good.attrs["energy_residual"] < 1e-9
    assert "warning" not in good.attrs

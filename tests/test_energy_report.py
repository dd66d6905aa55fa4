"""Inputs beyond what numbers resolve are refused; an energy ledger that does not close is reported."""

import json
from typing import Any

import pytest

import lostmotion as lm
from conftest import ALL_SCENARIOS
from refusals import refused

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
def test_breakpoints_that_the_solver_cannot_tell_apart_are_refused(scenario: str, changes: dict[str, Any], key: str) -> None:
    refused(lambda: lm.load(NAMED[scenario], changes), match=rf"{key}.*differ by less than 1e-09 of the largest.*leave one of them out")


def test_a_ledger_that_does_not_close_is_reported() -> None:
    run = lm.simulate(lm.load(NAMED["backlash-reversing-load"], {"gearbox.ratio": 1e-5}), energy=True)
    energy = json.loads(run.attrs["energy"])
    share = abs(energy["residual"]) / energy["turned_over"]
    assert run.attrs["energy_residual"] == share
    assert (share > 1e-6) == ("energy balance" in run.attrs.get("warning", ""))
    good = lm.simulate(lm.load(NAMED["backlash-reversing-load"]), energy=True)
    assert good.attrs["energy_residual"] < 1e-9
    assert "warning" not in good.attrs


@pytest.mark.parametrize("ratio", [1e-3, 1e-4, 1e-5])
def test_the_motion_tends_to_a_limit_as_its_ratio_goes_to_zero(ratio: float) -> None:
    """The rotor reflects ratio^2 of its inertia and ratio of its friction: the motion differs from the limit by that."""
    run, limit = (lm.simulate(lm.load(NAMED["backlash-reversing-load"], {"gearbox.ratio": r}), energy=True) for r in (ratio, 1e-7))
    assert run.attrs["energy_residual"] < 1e-12
    assert "warning" not in run.attrs
    apart = float(abs(run["load_speed"] - limit["load_speed"]).max())
    assert 1e-3 * ratio < apart < 1e-2 * ratio


@pytest.mark.parametrize("ratio", [1e-2, 1e-4, 1e-6, 3e-7])
def test_the_ledger_of_a_locked_worm_keeps_changes_far_below_what_it_stores(ratio: float) -> None:
    """The load stores 0.02 J in the mesh. The motor winds the coupling to T i/k and lets it go down to its friction."""
    run = lm.simulate(lm.load(NAMED["worm-lowering"], {"gears.coupling.ratio": ratio}), energy=True)
    energy = lm.energy_of(run)
    torque, friction, k = 0.15, 0.01, 500.0
    wound, left = (torque - friction) / k, friction / k
    expected = {"motor: motor": torque * wound, "rotor: dry friction": friction * (2.0 * wound - left), "stored_change": 0.5 * k * left**2}
    for name, per_square in expected.items():
        assert energy[name] == pytest.approx(per_square * ratio**2, rel=1e-9), name
    assert run.attrs["energy_residual"] < 1e-9
    assert "warning" not in run.attrs


@pytest.mark.parametrize("ratio", [1e-7, 1e-8])
def test_a_motion_faster_than_the_clock_is_no_accumulation(ratio: float) -> None:
    """The damper of the coupling slows the rotor at c/(i^2 J) = 2.5e16 1/s and more: 1e-17 s is 0 beside 0.1 s."""
    with pytest.raises(lm.SolverError, match="or what numbers resolve") as refusal:
        lm.simulate(lm.load(NAMED["worm-lowering"], {"gears.coupling.ratio": ratio}))
    assert "accumulate" not in str(refusal.value)

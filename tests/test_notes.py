"""Notes of parts after an override: none is left that is no longer true, and those that are still true stay."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import lostmotion as lm
from conftest import ROOT
from lostmotion.cli import app
from lostmotion.model.notes import still_true

MAP = {
    "kind": "map",
    "speeds": [0.0, 1.0],
    "loads": [0.0, 1.0],
    "values": [[0.01, 0.02], [0.03, 0.05]],
    "mirrored": True,
}
ESTIMATED = "nord-si50-i10"  # whose efficiency is not printed


def with_base(tmp_path: Path) -> lm.Scenario:
    shutil.copy(ROOT / "scenarios" / "paper-2dof-nl-small.toml", tmp_path / "old.toml")
    shutil.copy(ROOT / "scenarios" / "paper-2dof-nl-large.toml", tmp_path)
    losses = "\n".join(f"{key} = {json.dumps(value)}" for key, value in MAP.items())
    (tmp_path / "own.toml").write_text(f'base = "old.toml"\n[gearbox.losses]\n{losses}\n')
    return lm.load(tmp_path / "own.toml")


WAYS: dict[str, Callable[[Path], lm.Scenario]] = {
    "overrides": lambda _: lm.load("paper-2dof-nl-small", {"gearbox.losses": MAP}),
    "one key": lambda _: lm.load(
        "paper-2dof-nl-small",
        {"gearbox.losses.values": lm.load("paper-2dof-nl-small").gearbox.losses.model_dump()["values"]},
    ),
    "replace": lambda _: lm.load("paper-2dof-nl-small").replace(**{"gearbox.losses": MAP}),
    "base": with_base,
}


@pytest.mark.parametrize("way", WAYS)
def test_a_loss_table_that_was_replaced_is_no_stand_in(way: str, tmp_path: Path) -> None:
    before = lm.load("paper-2dof-nl-small")
    assert "stand-in" in before.gearbox.note
    scenario = WAYS[way](tmp_path)
    assert "stand-in" not in scenario.gearbox.note
    assert "stand-in" not in str(lm.simulate(scenario).attrs.get("note", ""))


def test_a_note_that_is_still_true_stays() -> None:
    for changes in ({"load.inertia": 2.0}, {"gearbox.ratio": 80.0}, {"gearbox.hysteresis.efficiency": 0.9}):
        assert "stand-in" in lm.load("paper-2dof-nl-small", changes).gearbox.note
    own = lm.load("paper-2dof-nl-small", {"gearbox.losses": MAP, "gearbox.note": "The table of our rig."})
    assert own.gearbox.note == "The table of our rig."


def test_a_record_whose_losses_are_given_says_nothing_of_its_own() -> None:
    whole = {"gearbox": {"from": "paper-gearbox"}}
    assert "stand-in" in lm.load("paper-2dof-nl-small", whole).gearbox.note
    given: dict[str, Any] = {"gearbox": {"from": "paper-gearbox", "losses": MAP}}
    assert "stand-in" not in lm.load("paper-2dof-nl-small", given).gearbox.note


def test_what_is_said_of_a_friction_that_is_not_printed_goes_when_it_is_given() -> None:
    joint = "catalogue-robot-joint"
    changes = {"motor": {"from": "siemens-1ft7044-ak7"}}
    assert "friction" in lm.load(joint, changes).motor.note
    for key in (
        {"motor": {"from": "siemens-1ft7044-ak7", "friction_torque": 0.05}},
        changes | {"motor.friction_torque": 0.05},
    ):
        note = lm.load(joint, key).motor.note
        assert "friction" not in note.partition("cannot")[0]
        assert "torque source" in note  # still one
    assert "friction" not in lm.load(joint, changes).replace(**{"motor.friction_torque": 0.05}).motor.note


def test_losses_that_replace_estimated_ones_are_no_estimate() -> None:
    estimated = next(
        record.name
        for record in lm.catalogue()
        if record.name.startswith("harmonic")
        or (getattr(record, "loss_estimate", lambda: None)() is not None and not record.missing())
    )
    scenario = lm.load("catalogue-robot-joint", {"gearbox": {"from": estimated}})
    assert scenario.gearbox.loss_range is not None
    assert "estimated" in scenario.gearbox.note
    changed = scenario.replace(**{"gearbox.losses": MAP})
    assert changed.gearbox.loss_range is None
    assert "estimated" not in changed.gearbox.note
    assert changed.gearbox.losses == lm.load("paper-2dof-nl-small", {"gearbox.losses": MAP}).gearbox.losses


def test_the_rig_says_of_a_record_what_is_true_of_the_gearbox_that_it_measures() -> None:
    said = CliRunner().invoke(app, ["rig", "paper-gearbox"]).output
    assert "stand-in" in said
    own = ["--set", "losses={kind='constant_efficiency', efficiency=0.9}"]
    done = CliRunner().invoke(app, ["rig", "paper-gearbox", *own])
    assert "stand-in" not in done.output


@pytest.mark.parametrize(
    ("note", "changed", "left"),
    [
        ("The friction of M is not given and taken as 0. M runs as a torque source, since its winding is not given.", ["friction_torque"], "M runs as a torque source, since its winding is not given."),
        ("A note on nothing.", ["losses", "stiffness"], "A note on nothing."),
        ("All losses are multiplied by 1.3.", ["ratio"], "All losses are multiplied by 1.3."),
        ("", ["losses"], ""),
    ],
)  # fmt: skip
def test_sentences_about_a_changed_value_go(note: str, changed: list[str], left: str) -> None:
    assert still_true(note, changed) == left


# --- titles ---


def test_a_title_names_the_values_that_were_changed_below_it(tmp_path: Path) -> None:
    """The joint of the title swings at 1 Hz, the changed one at 2 Hz."""
    plain = lm.load("catalogue-robot-joint").title
    changes = {"command.frequency": "2 Hz", "simulation.duration": 1.0}
    assert lm.load("catalogue-robot-joint", changes).title == f"{plain}; changed: command.frequency"
    assert lm.load("catalogue-robot-joint", {"simulation.duration": 1.0}).title == plain
    assert lm.load("catalogue-robot-joint", {"title": "Mine", "command.frequency": 2.0}).title == "Mine"
    file = tmp_path / "run.csv"
    lm.save(lm.simulate(lm.load("catalogue-robot-joint", changes)), file)
    again = lm.load(file, {"load.inertia": 2.0, "command.frequency": 3.0})
    assert again.title == f"{plain}; changed: command.frequency, load.inertia"
    many = {f"load.{key}": 1.0 for key in ("inertia", "friction_torque", "viscous_friction")}
    assert lm.load("catalogue-robot-joint", {**changes, **many}).title.endswith(", load.inertia, ...")

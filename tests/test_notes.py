"""Notes of parts after an override: none is left that is no longer true, and those that are still true stay."""

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import lostmotion as lm
from conftest import ROOT
from lostmotion.cli import app
from lostmotion.inputs.toml_text import toml_text
from refusals import refused

MAP = {"kind": "map", "speeds": [0.0, 1.0], "loads": [0.0, 1.0], "values": [[0.01, 0.02], [0.03, 0.05]], "mirrored": True}


def train(tmp_path: Path, **changes: Any) -> lm.Scenario:
    gear = {"gearbox": "paper-gearbox", "input": "a", "output": "b"} | changes
    shafts = {"a": {"inertia": 1e-3}, "b": {"inertia": 1.0}}
    time = {"duration": 0.1, "sample_interval": 0.01}
    (tmp_path / "train.toml").write_text(toml_text({"shafts": shafts, "gears": {"stage": gear}, "simulation": time}))
    return lm.load(tmp_path / "train.toml")


def with_base(tmp_path: Path) -> lm.Scenario:
    shutil.copy(ROOT / "scenarios" / "paper-2dof-nl-small.toml", tmp_path / "old.toml")
    shutil.copy(ROOT / "scenarios" / "paper-2dof-nl-large.toml", tmp_path)
    losses = "\n".join(f"{key} = {json.dumps(value)}" for key, value in MAP.items())
    (tmp_path / "own.toml").write_text(f'base = "old.toml"\n[gearbox.losses]\n{losses}\n')
    return lm.load(tmp_path / "own.toml")


WAYS: dict[str, Callable[[Path], lm.Scenario]] = {
    "overrides": lambda _: lm.load("paper-2dof-nl-small", {"gearbox.losses": MAP}),
    "one key": lambda _: lm.load("paper-2dof-nl-small", {"gearbox.losses.values.0.0": 0.03}),
    "replace": lambda _: lm.load("paper-2dof-nl-small").replace(**{"gearbox.losses": MAP}),
    "base": with_base,
    "beside its record": lambda _: lm.load("paper-2dof-nl-small", {"gearbox": {"from": "paper-gearbox", "losses": MAP}}),
    "train": lambda path: train(path, losses=MAP),
    "train, override": lambda path: lm.load(train(path) and path / "train.toml", {"gears.stage.losses": MAP}),
    "train, replace": lambda path: train(path).replace(**{"gears.stage.losses": MAP}),
}


@pytest.mark.parametrize("way", WAYS)
def test_a_loss_table_that_was_replaced_is_no_stand_in(way: str, tmp_path: Path) -> None:
    assert "stand-in" in lm.load("paper-2dof-nl-small").note()
    assert "stand-in" in train(tmp_path).note()
    scenario = WAYS[way](tmp_path)
    assert scenario.note() == ""
    assert "note" not in lm.simulate(scenario).attrs


def test_a_note_that_is_still_true_stays() -> None:
    same = {"gearbox.losses.values": lm.load("paper-2dof-nl-small").gearbox.losses.model_dump()["values"]}
    for changes in (same, {"load.inertia": 2.0}, {"gearbox.ratio": 80.0}, {"gearbox.hysteresis.efficiency": 0.9}):
        for scenario in (lm.load("paper-2dof-nl-small", changes), lm.load("paper-2dof-nl-small").replace(**changes)):
            assert "stand-in" in scenario.note()
    own = {"gearbox.note": {"losses": "The table of our rig."}}
    for both in (own | {"gearbox.losses": MAP}, {"gearbox.losses": MAP} | own):
        assert lm.load("paper-2dof-nl-small", both).note() == "The table of our rig."
    text = {"gearbox.note": "The losses of our rig."}
    assert lm.load("paper-2dof-nl-small", text).replace(**{"gearbox.losses": MAP}).note() == "The losses of our rig."


def test_a_note_is_about_the_value_that_it_names_whatever_its_words_are(tmp_path: Path) -> None:
    """The note of an own record speaks of losses and is about the backlash; another is about one limit of several."""
    shutil.copy(ROOT / "src" / "lostmotion" / "catalogue" / "paper.toml", tmp_path / "own.toml")
    text = (tmp_path / "own.toml").read_text()
    note = 'note = {stiffness = "No loss of the gap is known.", "limits.max_input_speed" = "Of a torn page."}'
    (tmp_path / "own.toml").write_text(re.sub("note.losses = .*", note, text))
    table = {"from": str(tmp_path / "own.toml")}
    joint = lm.load("paper-2dof-nl-small", {"gearbox": table})
    for changes, left in (
        ({"gearbox.losses": MAP}, {"stiffness", "limits.max_input_speed"}),
        ({"gearbox.stiffness.backlash": "1 arcmin"}, {"limits.max_input_speed"}),
        ({"gearbox.limits.max_input_speed": "5000 rpm"}, {"stiffness"}),
        ({"gearbox.limits.average_input_speed": "3000 rpm"}, {"stiffness", "limits.max_input_speed"}),
    ):
        assert joint.replace(**changes).gearbox.note.keys() == left
        assert lm.load("paper-2dof-nl-small", {"gearbox": table, **changes}).gearbox.note.keys() == left
    worn = lm.load("paper-2dof-nl-small", {"gearbox": {**table, "added_backlash": "1 arcmin"}})
    assert worn.gearbox.note.keys() == {"limits.max_input_speed"}
    refused(lambda: lm.load("paper-2dof-nl-small", {"gearbox.note": {"lossez": "A misprint."}}), "gearbox.note")


def test_what_is_said_of_a_friction_that_is_not_printed_goes_when_it_is_given() -> None:
    joint = "catalogue-robot-joint"
    changes = {"motor": {"from": "siemens-1ft7044-ak7"}}
    assert lm.load(joint, changes).motor.note.keys() == {"winding", "kind", "friction_torque"}
    for scenario in (
        lm.load(joint, {"motor": {"from": "siemens-1ft7044-ak7", "friction_torque": 0.05}}),
        lm.load(joint, changes | {"motor.friction_torque": 0.05}),
        lm.load(joint, changes).replace(**{"motor.friction_torque": 0.05}),
    ):
        assert scenario.motor.note.keys() == {"winding", "kind"}  # still a torque source


def test_losses_that_replace_estimated_ones_are_no_estimate() -> None:
    estimated = next(r.name for r in lm.catalogue() if r.kind in ("planetary", "strain_wave") and r.level() == "estimated losses")
    scenario = lm.load("catalogue-robot-joint", {"gearbox": {"from": estimated}})
    assert scenario.gearbox.loss_range is not None
    assert "estimated" in scenario.gearbox.note["losses"]
    changed = scenario.replace(**{"gearbox.losses": MAP})
    assert changed.gearbox.loss_range is None
    assert "losses" not in changed.gearbox.note


def test_the_rig_says_of_a_record_what_is_true_of_the_gearbox_that_it_measures() -> None:
    said = CliRunner().invoke(app, ["rig", "paper-gearbox"]).output
    assert "stand-in" in said
    own = ["--set", "losses={kind='constant_efficiency', efficiency=0.9}"]
    done = CliRunner().invoke(app, ["rig", "paper-gearbox", *own])
    assert "stand-in" not in done.output


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

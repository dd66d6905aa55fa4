"""The virtual rig's experiments as logs: the gearbox that they are of is found in them again."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

import lostmotion as lm
from lostmotion.cli.entry import app
from lostmotion.identification.virtual_campaign import OFF, experiments, parameters, rig_scenario
from lostmotion.simulation.scenario.scenario_files import gearbox_from_record
from refusals import refused

NAME = "schaeffler-rt1-h-20-100"


@pytest.fixture(scope="module")
def gearbox() -> lm.Gearbox:
    return gearbox_from_record(NAME, ())[0]


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Written by the command."""
    directory = tmp_path_factory.mktemp("campaign")
    run = CliRunner().invoke(app, ["rig", NAME, "--logs", str(directory)])
    assert run.exit_code == 0, run.output
    assert f"lostmotion identify {directory / 'identify.toml'}" in run.output.replace("\n", "")
    return directory


def test_the_gearbox_is_found_again(campaign: Path, gearbox: lm.Gearbox) -> None:
    result = lm.identify(campaign / "identify.toml")
    truth = parameters(gearbox)[0]
    assert set(truth) == set(result.values) and len(truth) == 7
    # From 25 % off to what encoders and a torque sensor allow; of seven intervals of 95 % three or more miss with probability 4e-3.
    for name, value in truth.items():
        assert result.task.parameters[name].start == pytest.approx(OFF * value)
        assert result.values[name] == pytest.approx(value, rel=1e-3)
    held = [result.intervals[name].low <= value <= result.intervals[name].high for name, value in truth.items()]
    assert sum(held) >= 5
    for error in result.errors:
        deviation = result.task.measured[error.channel].deviation
        assert deviation is not None
        assert error.rmse == pytest.approx(deviation, rel=0.15), (error.log, error.channel)


def test_a_gearbox_with_backlash_is_found_again(tmp_path: Path) -> None:
    """Run after run with impacts; a search that begins with all logs ends with a quarter of the stiffness."""
    planetary = gearbox_from_record("bonfiglioli-tq060-2-25", ())[0]
    result = lm.identify(lm.identification.write_campaign(tmp_path, planetary))
    truth = parameters(planetary)[0]
    assert truth["backlash"] > 1e-3
    for name, value in truth.items():
        assert result.values[name] == pytest.approx(value, rel=2e-3), name


def test_hysteresis_is_chosen_by_the_loop_held_out_and_found_within_its_interval(gearbox: lm.Gearbox, tmp_path: Path) -> None:
    lossy = gearbox.model_copy(update={"hysteresis": lm.model.Hysteresis(efficiency=0.9)})
    result = lm.identify(lm.identification.write_campaign(tmp_path, lossy))
    without, with_it = result.rungs
    assert [e.log for e in result.errors if e.held_out] == ["locked-ramp-half.csv"] * 3
    assert result.chosen == 1 and with_it.held_out < 0.8 * without.held_out
    interval = result.intervals["hysteresis_efficiency"]
    assert interval.low <= 0.9 <= interval.high and interval.high - interval.low < 0.02
    sheet = tmp_path / "gearbox.toml"
    sheet.write_text(result.record_text())
    found = lm.gearbox(str(sheet)).hysteresis
    assert found is not None and found.efficiency == result.values["hysteresis_efficiency"]


def test_a_torque_ripple_is_found_by_a_slow_run(tmp_path: Path) -> None:
    directory = tmp_path / "campaign"
    run = CliRunner().invoke(app, ["rig", NAME, "--logs", str(directory), "--ripple", "2 0.004 N*m"])
    assert run.exit_code == 0, run.output
    assert (directory / "logs" / "ripple.csv").exists()
    for name in ("back-driving", "braked-slow", "no-load-slow"):  # the others determine all values
        (directory / "logs" / f"{name}.csv").unlink()
    result = lm.identify(directory / "identify.toml")
    for name, truth, resolution in (("ripple_torque", 0.004, 4e-6), ("ripple_phase", 0.0, 1e-3)):
        interval = result.intervals[name]
        assert interval.high - interval.low < resolution
        assert abs(result.values[name] - truth) < resolution


@pytest.mark.parametrize("text", ["0.02 N*m", "2", "2 0.02 N", "2 -1 N*m", "x 1 N*m"])
def test_a_torque_ripple_that_is_none_is_refused(text: str, tmp_path: Path) -> None:
    run = CliRunner().invoke(app, ["rig", NAME, "--logs", str(tmp_path / "campaign"), "--ripple", text])
    assert run.exit_code != 0
    assert isinstance(run.exception, lm.InputError)
    assert str(run.exception).startswith("--ripple: ")
    assert not (tmp_path / "campaign" / "logs").exists()


def test_the_rig_is_locked_driven_and_driven_back(gearbox: lm.Gearbox) -> None:
    plans = {plan.name: plan for plan in experiments(gearbox)}
    assert [name for name, plan in plans.items() if plan.header["locked"]] == ["locked-ramp.csv"]
    assert not plans["back-driving.csv"].values("motor_torque").any()
    # Up to the rated torque: 1.2 of it at the input, of which losses take a part.
    assert abs(plans["locked-ramp.csv"].values("motor_torque")).max() * gearbox.ratio == pytest.approx(
        1.2 * gearbox.rated_output_torque, rel=1e-3
    )
    for plan in plans.values():  # no jump that would leave the drive ringing
        for channel in plan.channels.values():
            assert abs(channel.values[0]) < 1e-12


@pytest.mark.parametrize(("stiffness", "losses", "names"), [
    (lm.model.LinearStiffness(stiffness=1e4), lm.model.ConstantEfficiency(efficiency=0.9), ["stiffness", "efficiency"]),
    (lm.model.TorsionCurve(slopes=(1e4,), backlash=1e-3), lm.model.ConstantEfficiency(efficiency=0.9), ["stiffness_1", "backlash", "efficiency"]),
    (lm.model.Rigid(), lm.model.ConstantEfficiency(efficiency=0.9), ["efficiency"]),
])  # fmt: skip
def test_every_law_of_a_gearbox_has_its_parameters(stiffness: object, losses: object, names: list[str], gearbox: lm.Gearbox) -> None:
    changed = lm.Gearbox(**{**gearbox.model_dump(), "stiffness": stiffness, "losses": losses})
    assert [name for name in parameters(changed)[0] if name not in ("inertia", "mesh_damping")] == names
    assert rig_scenario(changed).gears["gearbox"].ratio == gearbox.ratio


def test_a_gearbox_without_inertia_is_refused(gearbox: lm.Gearbox, tmp_path: Path) -> None:
    massless = lm.Gearbox(**{**gearbox.model_dump(), "inertia": 0.0})
    assert "has no inertia" in refused(lambda: lm.identification.write_campaign(tmp_path / "campaign", massless))
    assert not (tmp_path / "campaign").exists()

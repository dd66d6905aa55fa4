"""Datasets and their files."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import lostmotion as lm
from lostmotion.simulation.runs.energy_ledger import largest_stored, with_energy
from lostmotion.simulation.variables import VARIABLES
from refusals import refused


@pytest.fixture(scope="module")
def result(request: pytest.FixtureRequest) -> xr.Dataset:
    return lm.simulate(lm.load(request.config.rootpath / "scenarios" / "paper-2dof-nl-small.toml"), energy=True)


def test_every_variable_is_there_with_unit_and_meaning(result: xr.Dataset) -> None:
    for variable in VARIABLES:
        assert result[variable.name].attrs["units"] == variable.unit
        assert result[variable.name].attrs["long_name"] == variable.meaning
        assert result[variable.name].dims == ("time",)
    sampled = {name for name, v in result.data_vars.items() if v.dims == ("time",)}
    assert sampled == {v.name for v in VARIABLES}
    assert result["time"].attrs["units"] == "s"


@pytest.mark.parametrize("ending", [".nc", ".csv", ".parquet"])
def test_a_result_file_reads_back_unchanged(result: xr.Dataset, tmp_path: Path, ending: str) -> None:
    lm.save(result, tmp_path / f"r{ending}")
    back = lm.open_result(tmp_path / f"r{ending}")
    xr.testing.assert_identical(back.drop_attrs(), result.drop_attrs())
    for name in result.variables:
        assert {k: np.asarray(v).tolist() for k, v in back[name].attrs.items()} == {
            k: np.asarray(v).tolist() for k, v in result[name].attrs.items()
        }
    assert {k: str(v) for k, v in back.attrs.items()} == {k: str(v) for k, v in result.attrs.items()}


@pytest.mark.parametrize("ending", [".nc", ".csv", ".parquet"])
def test_a_result_file_alone_can_be_run_again(result: xr.Dataset, tmp_path: Path, ending: str) -> None:
    lm.save(result, tmp_path / f"r{ending}")
    again = lm.simulate(lm.simulation.scenario_of(lm.open_result(tmp_path / f"r{ending}")), energy=True)
    xr.testing.assert_identical(again, result)


def test_other_programs_read_the_files(result: xr.Dataset, tmp_path: Path) -> None:
    import pandas as pd

    lm.save(result, tmp_path / "r.csv")
    lm.save(result, tmp_path / "r.parquet")
    csv = pd.read_csv(tmp_path / "r.csv", comment="#")
    assert csv["load_speed [rad/s]"].to_numpy() == pytest.approx(result["load_speed"].values, abs=0.0)
    parquet = pd.read_parquet(tmp_path / "r.parquet")
    assert parquet["twist"].to_numpy() == pytest.approx(result["twist"].values, abs=0.0)


def test_a_data_frame_has_one_row_for_each_sample_and_one_for_each_switching(result: xr.Dataset) -> None:
    frame = result.to_dataframe()
    assert list(frame.columns) == [v.name for v in VARIABLES]
    assert len(frame) == result.sizes["time"] == 2001
    assert len(lm.switchings_of(result).to_dataframe()) == result.attrs["switching_count"]


@pytest.mark.parametrize("ending", [".nc", ".csv", ".parquet"])
def test_a_run_without_any_switching_is_saved_as_one_with(tmp_path: Path, ending: str, small: Path) -> None:
    short = lm.load(small, {"simulation.duration": 1e-5, "simulation.sample_interval": 1e-5})
    quiet = lm.simulate(short.replace(**{"command.amplitude": 0.0}), energy=True)
    assert lm.switchings_of(quiet).sizes["switching"] == 0
    lm.save(quiet, tmp_path / f"r{ending}")
    xr.testing.assert_identical(lm.open_result(tmp_path / f"r{ending}"), quiet)


def test_switchings_are_a_group_of_the_netcdf_file(result: xr.Dataset, tmp_path: Path) -> None:
    import h5netcdf

    lm.save(result, tmp_path / "r.nc")
    with h5netcdf.File(tmp_path / "r.nc") as file:
        assert set(file.dimensions) == {"time"}
        assert file.groups["switchings"].dimensions["switching"].size == result.attrs["switching_count"]
        assert file.groups["switchings"]["instant"].attrs["units"] == "s"


def test_a_result_can_be_written_by_xarray_itself(result: xr.Dataset, tmp_path: Path) -> None:
    result.to_netcdf(tmp_path / "r.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "r.nc", engine="h5netcdf") as back:
        xr.testing.assert_identical(lm.switchings_of(back), lm.switchings_of(result))


@pytest.mark.parametrize("ending", [".nc", ".csv", ".parquet"])
def test_a_periodic_motion_which_has_no_switchings_is_saved_too(small: Path, tmp_path: Path, ending: str) -> None:
    scenario = lm.load(small)
    motion = lm.periodic_motion(scenario.drive(), scenario.command)
    lm.save(motion, tmp_path / f"m{ending}")
    back = lm.open_result(tmp_path / f"m{ending}")
    assert back.attrs["period"] == motion.attrs["period"]
    xr.testing.assert_equal(back["twist"].drop_vars("time"), motion["twist"].drop_vars("time"))


def test_a_csv_file_that_is_cut_at_the_end_of_a_line_is_refused(result: xr.Dataset, tmp_path: Path) -> None:
    lm.save(result, tmp_path / "r.csv")
    lines = (tmp_path / "r.csv").read_text().splitlines(keepends=True)
    for kept, words in ((1000, "998 of the 2001 samples"), (3, "1 of the 2001 samples"), (2, "is no CSV file")):
        (tmp_path / "cut.csv").write_text("".join(lines[:kept]))
        with pytest.raises(lm.InputError, match=words):
            lm.open_result(tmp_path / "cut.csv")
    (tmp_path / "cut.csv").write_text("".join([*lines, lines[-1]]))
    assert "2002 of the 2001 samples" in refused(lambda: lm.open_result(tmp_path / "cut.csv"))


def test_a_csv_file_without_the_number_of_its_samples_is_refused(result: xr.Dataset, tmp_path: Path) -> None:
    lm.save(result, tmp_path / "r.csv")
    text = (tmp_path / "r.csv").read_text()
    assert text.count(', "samples": 2001') == 1
    (tmp_path / "cut.csv").write_text(text.replace(', "samples": 2001', ""))
    with pytest.raises(lm.InputError, match="is no result of lostmotion"):
        lm.open_result(tmp_path / "cut.csv")


def test_what_is_no_result_has_no_switchings() -> None:
    assert "has no switchings; give a result of simulate" in refused(lambda: lm.switchings_of(xr.Dataset()))


def test_energy_balance_closes_to_rounding(result: xr.Dataset) -> None:
    ledger = lm.energy_of(result)
    assert abs(ledger["residual"]) < 1e-9 * ledger["turned_over"]
    heat = ("input_damper", "motor_friction", "gear_losses", "hysteresis", "load_damper", "load_friction")
    stored = ledger["kinetic_change"] + ledger["elastic_change"]
    balance = ledger["source"] - sum(ledger[k] for k in heat) - ledger["load_work"] - stored
    assert balance == pytest.approx(ledger["residual"], abs=1e-15)


def test_switchings_carry_both_limits_of_the_output_torque(result: xr.Dataset) -> None:
    # At a turning point of the twist the hysteresis torque jumps; elsewhere the output torque is continuous.
    switchings = lm.switchings_of(result)
    jump = np.abs(switchings["output_torque_after"] - switchings["output_torque_before"]).values
    twist_changes = (switchings["twist_contact_before"] != switchings["twist_contact_after"]).values
    assert jump[twist_changes].max() > 0.01
    assert np.all(jump[~twist_changes] < 1e-9)
    assert np.all(np.diff(switchings["instant"].values) >= 0.0)
    assert switchings.sizes["switching"] == result.attrs["switching_count"]


def test_samples_at_a_jump_are_right_limits(large: Path) -> None:
    steps = {"steps": [{"height": 0.5, "time": 0.01}]}
    scenario = lm.load(large, {"command": steps, "simulation.duration": 0.02, "simulation.sample_interval": 0.005})
    assert lm.simulate(scenario)["command"].values.tolist() == [0.0, 0.0, 0.5, 0.5, 0.5]


def test_efficiency_is_useful_over_fed_in_torque(result: xr.Dataset) -> None:
    eta = result["efficiency"].values
    moving = result["motor_speed"].values != 0.0
    assert np.all(np.isnan(eta[~moving]))
    assert np.all((eta[moving] >= 0.0) & (eta[moving] < 1.0))
    mu = result["output_torque"].values * np.sign(result["motor_speed"].values) / 51.6
    driving = moving & (mu > 0.0)
    m = result["loss_coefficient"].values
    assert eta[driving] == pytest.approx(mu[driving] / (mu[driving] + m[driving]), rel=1e-12)


def test_leaving_the_data_of_the_loss_map_is_said(large: Path) -> None:
    inside = lm.simulate(lm.load(large))
    assert "warning" not in inside.attrs
    outside = lm.simulate(lm.load(large, {"load.torque": 100.0}))
    assert "outside its data" in outside.attrs["warning"]


def test_the_note_on_the_stand_in_table_travels_with_the_result(result: xr.Dataset) -> None:
    assert "stand-in" in result.attrs["note"]
    assert json.loads(result.attrs["scenario"])["gearbox"]["note"]["losses"] == result.attrs["note"]


@pytest.mark.parametrize(("residual", "turned_over", "share"), [(1.9e-39, 5.9e-43, 0.0), (1e-9, 1e-8, 0.1)])
def test_a_balance_of_energies_that_rounding_makes_is_not_open(residual: float, turned_over: float, share: float) -> None:
    """A shaft held by friction may have 1e-20 rad/s by rounding; what a torque of 0.5 N·m does in a rounding of a radian is far more."""
    bound = largest_stored({"motor_torque": np.array([0.5, -0.2]), "load_speed": np.array([1e-20, 0.0])})
    found = with_energy({}, {"residual": residual, "turned_over": turned_over}, bound)
    assert found["energy_residual"] == pytest.approx(share)
    assert ("warning" in found) == (share > 0.0)

"""Datasets and their files."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import lostmotion as lm
from conftest import ALL_SCENARIOS
from lostmotion.reports.run import summary
from lostmotion.reports.study import read_table
from lostmotion.simulation.runs.energy_ledger import largest_stored, with_energy
from lostmotion.simulation.variables import VARIABLES
from lostmotion.studies.expressions.functions import FUNCTIONS
from lostmotion.studies.runs.chunk import scenario_of_run
from refusals import refusals_of, refused
from tables import run_of
from test_drive_train import train


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


SHORT = {"simulation.duration": 1e-5, "simulation.sample_interval": 1e-5, "command.amplitude": 0.0}
SAVED = {
    "run": lambda: lm.simulate(lm.load("paper-2dof-nl-small"), energy=True),
    "run without switchings": lambda: lm.simulate(lm.load("paper-2dof-nl-small", SHORT), energy=True),
    "train": lambda: lm.simulate(train(), energy=True),
    "periodic motion": lambda: lm.periodic_motion(lm.load("paper-2dof-nl-small")),
}


@pytest.mark.parametrize("ending", [".nc", ".csv", ".parquet"])
@pytest.mark.parametrize("what", SAVED)
def test_a_result_file_reads_back_unchanged(what: str, tmp_path: Path, ending: str) -> None:
    result, path = SAVED[what](), tmp_path / f"r{ending}"
    lm.save(result, path)
    back = lm.open_result(path)
    assert back.attrs.keys() == result.attrs.keys()
    if what == "periodic motion":
        assert back.attrs["period"] == result.attrs["period"]
        xr.testing.assert_equal(back["twist"].drop_vars("time"), result["twist"].drop_vars("time"))
        return
    xr.testing.assert_identical(back, result)
    switchings = lm.switchings_of(result)
    xr.testing.assert_identical(lm.switchings_of(back), switchings)
    assert (switchings.sizes["switching"] == 0) == (what == "run without switchings")
    xr.testing.assert_identical(lm.simulate(lm.simulation.scenario_of(back), energy=True), result)  # it alone can be run again
    xr.testing.assert_identical(lm.simulate(lm.load(path), energy=True), result)


def test_other_programs_read_the_files(result: xr.Dataset, tmp_path: Path) -> None:
    import pandas as pd

    lm.save(result, tmp_path / "r.csv")
    lm.save(result, tmp_path / "r.parquet")
    csv = pd.read_csv(tmp_path / "r.csv", comment="#")
    assert csv["load_speed [rad/s]"].to_numpy() == pytest.approx(result["load_speed"].values, abs=0.0)
    parquet = pd.read_parquet(tmp_path / "r.parquet")
    assert parquet["twist"].to_numpy() == pytest.approx(result["twist"].values, abs=0.0)
    frame = result.to_dataframe()
    assert list(frame.columns) == [v.name for v in VARIABLES]
    assert len(frame) == result.sizes["time"] == 2001
    assert len(lm.switchings_of(result).to_dataframe()) == result.attrs["switching_count"]
    result.to_netcdf(tmp_path / "r.nc", engine="h5netcdf")  # by xarray itself
    with xr.open_dataset(tmp_path / "r.nc", engine="h5netcdf") as back:
        xr.testing.assert_identical(lm.switchings_of(back), lm.switchings_of(result))


def test_switchings_are_a_group_of_the_netcdf_file(result: xr.Dataset, tmp_path: Path) -> None:
    import h5netcdf

    lm.save(result, tmp_path / "r.nc")
    with h5netcdf.File(tmp_path / "r.nc") as file:
        assert set(file.dimensions) == {"time"}
        assert file.groups["switchings"].dimensions["switching"].size == result.attrs["switching_count"]
        assert file.groups["switchings"]["instant"].attrs["units"] == "s"


def test_a_csv_file_that_is_cut_at_the_end_of_a_line_is_refused(result: xr.Dataset, tmp_path: Path) -> None:
    lm.save(result, tmp_path / "r.csv")
    text = (tmp_path / "r.csv").read_text()
    lines, count = text.splitlines(keepends=True), ', "samples": 2001'
    assert text.count(count) == 1
    for content, words in (
        (lines[:1000], "998 of the 2001 samples"),
        (lines[:3], "1 of the 2001 samples"),
        (lines[:2], "is no CSV file"),
        ([*lines, lines[-1]], "2002 of the 2001 samples"),
        ([text.replace(count, "")], "is no result of lostmotion"),
    ):
        (tmp_path / "cut.csv").write_text("".join(content))
        refused(lambda: lm.open_result(tmp_path / "cut.csv"), match=words)
    refused(lambda: lm.switchings_of(xr.Dataset()), reason="has no switchings; give a result of simulate")


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


def test_efficiency_is_useful_over_fed_in_torque(result: xr.Dataset) -> None:
    eta = result["efficiency"].values
    moving = result["motor_speed"].values != 0.0
    assert np.all(np.isnan(eta[~moving]))
    assert np.all((eta[moving] >= 0.0) & (eta[moving] < 1.0))
    mu = result["output_torque"].values * np.sign(result["motor_speed"].values) / 51.6
    driving = moving & (mu > 0.0)
    m = result["loss_coefficient"].values
    assert eta[driving] == pytest.approx(mu[driving] / (mu[driving] + m[driving]), rel=1e-12)


def test_notes_and_warnings_travel_with_the_result(result: xr.Dataset, large: Path) -> None:
    assert "stand-in" in result.attrs["note"]
    assert json.loads(result.attrs["scenario"])["gearbox"]["note"]["losses"] == result.attrs["note"]
    assert "warning" not in lm.simulate(lm.load(large)).attrs
    assert "outside its data" in lm.simulate(lm.load(large, {"load.torque": 100.0})).attrs["warning"]
    steps = {"steps": [{"height": 0.5, "time": 0.01}]}  # samples at a jump are right limits
    scenario = lm.load(large, {"command": steps, "simulation.duration": 0.02, "simulation.sample_interval": 0.005})
    assert lm.simulate(scenario)["command"].values.tolist() == [0.0, 0.0, 0.5, 0.5, 0.5]


@pytest.mark.parametrize(("residual", "turned_over", "share"), [(1.9e-39, 5.9e-43, 0.0), (1e-9, 1e-8, 0.1)])
def test_a_balance_of_energies_that_rounding_makes_is_not_open(residual: float, turned_over: float, share: float) -> None:
    """A shaft held by friction may have 1e-20 rad/s by rounding; what a torque of 0.5 N·m does in a rounding of a radian is far more."""
    bound = largest_stored({"motor_torque": np.array([0.5, -0.2]), "load_speed": np.array([1e-20, 0.0])})
    found = with_energy({}, {"residual": residual, "turned_over": turned_over}, bound)
    assert found["energy_residual"] == pytest.approx(share)
    assert ("warning" in found) == (share > 0.0)


# --- inputs beyond what numbers resolve are refused; an energy ledger that does not close is reported ---
NAMED = {path.stem: path for path in ALL_SCENARIOS}


LEAST = ": differ by less than 1e-09 of the largest"
test_breakpoints_that_the_solver_cannot_tell_apart_are_refused = refusals_of(
    lambda name, changes: lm.load(NAMED[name], changes),
    ("position-axis", {"gearbox.losses.speeds": [0.0, 1e-17, 1.0]}, LEAST),
    ("backlash-reversing-load", {"gearbox.losses.loads": [0.0, 0.5, 0.5 + 1e-12]}, LEAST),
    ("backlash-reversing-load", {"gearbox.stiffness.breaks": [1e-3, 1e-3 + 1e-15], "gearbox.stiffness.slopes": [1e3, 1e4, 1e5]}, LEAST),
)


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


@pytest.mark.parametrize("ratio", [1e-2, 1e-4, 1e-6, 3e-7, 1e-7])
def test_the_ledger_of_a_locked_worm_keeps_changes_far_below_what_it_stores(ratio: float) -> None:
    """The load stores 0.02 J in the mesh. The motor winds the coupling to T i/k and lets it go down to its friction.

    Below 5e-7 the damper stops the rotor within the rounding of the instant.
    """
    run = lm.simulate(lm.load(NAMED["worm-lowering"], {"gears.coupling.ratio": ratio}), energy=True)
    energy = lm.energy_of(run)
    torque, friction, k = 0.15, 0.01, 500.0
    wound, left = (torque - friction) / k, friction / k
    expected = {"motor: motor": torque * wound, "rotor: dry friction": friction * (2.0 * wound - left), "stored_change": 0.5 * k * left**2}
    for name, per_square in expected.items():
        assert energy[name] == pytest.approx(per_square * ratio**2, rel=1e-9), name
    assert run.attrs["energy_residual"] < 1e-9
    assert "warning" not in run.attrs


@pytest.mark.parametrize("ratio", [1e-8, 1e-9])
def test_a_motion_faster_than_the_clock_is_no_accumulation(ratio: float) -> None:
    """The damper of the coupling slows the rotor at c/(i^2 J) = 2.5e18 1/s and more: 4e-19 s is 0 beside 0.1 s."""
    with pytest.raises(lm.SolverError, match="or what numbers resolve") as refusal:
        lm.simulate(lm.load(NAMED["worm-lowering"], {"gears.coupling.ratio": ratio}))
    assert "accumulate" not in str(refusal.value)


# --- trains without motor and load torque move freely, as closed forms say ---
@pytest.mark.parametrize("ratio", [-4.0, 1.0, 5.0])
def test_two_shafts_and_a_compliant_gear_vibrate_freely(ratio: float) -> None:
    """No motor and no load torque: d = d0 cos(w t) with w^2 = k (1/(J_1 i^2) + 1/J_2); motion and ledger to rounding."""
    J_1, J_2, k, d0 = 1e-3, 5.0, 2000.0, 1e-3
    scenario = lm.Scenario(
        shafts={"a": {"inertia": J_1}, "b": {"inertia": J_2}},
        gears={"g": {"input": "a", "output": "b", "ratio": ratio, "stiffness": {"kind": "linear", "stiffness": k}}},
        initial={"twists": {"g": d0}},
        simulation={"duration": 1.0, "sample_interval": 0.01},
    )
    run = lm.simulate(scenario)
    w, t = math.sqrt(k * (1.0 / (J_1 * ratio**2) + 1.0 / J_2)), run["time"].values
    assert np.abs(run["g_twist"].values - d0 * np.cos(w * t)).max() < 1e-12 * d0 * w
    speed_b = k * d0 / (J_2 * w) * np.sin(w * t)
    assert run["b_speed"].values == pytest.approx(speed_b, abs=1e-9 * float(abs(speed_b).max()))
    assert run["a_speed"].values == pytest.approx(-J_2 / (J_1 * ratio) * speed_b, rel=1e-9, abs=1e-9)
    assert abs(lm.energy_of(run)["residual"]) < 1e-12 * k * d0**2
    assert run.attrs.get("energy_residual", 0.0) < 1e-12


# --- the last sample of a run is its end, also where the duration is no multiple of the sample interval ---
END = 2.449489743  # a lift of 3 m with 1 m/s^2
WINCH: dict[str, Any] = {
    "shafts": {"drum": {"inertia": 0.8125, "friction_torque": 1300.0}},
    "slides": {"load": {"mass": 250.0, "inclination": math.pi / 2.0, "speed": {"ramps": [{"rise": END, "duration": END}]}}},
    "racks": {"rope": {"input": "drum", "output": "load", "travel_per_turn": 0.4 * math.pi}},
    "simulation": {"duration": END, "sample_interval": 0.01},
}
# A shaft that a constant torque of 1 N m accelerates: its speed is the time.
RISING: dict[str, Any] = {"shafts": {"s": {"inertia": 1.0, "torque": {"mean": -1.0}}}, "simulation": run_of(1.03, 0.1)}


def rising(duration: float, interval: float = 0.1) -> lm.Scenario:
    return lm.Scenario(**RISING | {"simulation": {"duration": duration, "sample_interval": interval}})


@pytest.mark.parametrize("solver", ["exact", "dormand-prince"])
def test_samples_of_a_lift_end_where_its_energies_do(solver: Any) -> None:
    """T = m (g + a) r + 1300 + J a/r = 1844.4 N m at the drum, which turns by 15 rad."""
    result = lm.simulate(lm.Scenario(**WINCH), solver=solver)
    torque = 250.0 * (9.80665 + 1.0) * 0.2 + 1300.0 + 0.8125 / 0.2
    assert result.time.values[:245].tolist() == [0.01 * k for k in range(245)]
    assert result.time.values[245:].tolist() == [END]
    assert float(result["load_position"][-1]) == pytest.approx(0.5 * END**2, rel=1e-12)
    assert abs(float(result["load_drive_force"][-1])) * 0.2 == pytest.approx(torque, rel=1e-12)
    if solver == "exact":
        assert lm.energy_of(result)["load: given motion"] == pytest.approx(torque * 2.5 * END**2, rel=1e-12)


@pytest.mark.parametrize(
    ("duration", "interval", "ends"),
    [
        (1.0, 0.1, [0.8, 0.9, 1.0]),
        (0.3, 0.1, [0.1, 0.2, 3 * 0.1]),  # 0.3 is 3 * 0.1 but for rounding
        (1.03, 0.1, [0.9, 1.0, 1.03]),
        (0.15, 0.1, [0.0, 0.1, 0.15]),
        (100.0, 7.0, [91.0, 98.0, 100.0]),  # long steps
    ],
)
def test_instants_are_multiples_of_the_interval_and_the_end(duration: float, interval: float, ends: list[float]) -> None:
    result = lm.simulate(rising(duration, interval))
    assert result.time.values[-3:] == pytest.approx(ends, rel=1e-15, abs=0.0)
    assert np.allclose(result["s_speed"], result.time, rtol=1e-14, atol=0.0)
    assert np.allclose(result["s_angle"], 0.5 * result.time**2, rtol=1e-14, atol=0.0)


@pytest.mark.parametrize("level", [0.015625, 0.01])
def test_other_samples_have_the_bits_of_a_run_without_it(level: float) -> None:
    """Samples by strides of powers of two, and by single steps."""
    scenario = lm.load("paper-2dof-nl-small")
    whole = lm.simulate(scenario.with_inputs(duration=64 * level, sample_interval=level))
    part = lm.simulate(scenario.with_inputs(duration=63.4 * level, sample_interval=level))
    assert len(part.time) == 65
    for name in ("motor_speed", "load_angle", "twist", "output_torque"):
        assert part[name].values[:64].tolist() == whole[name].values[:64].tolist()
    fine = lm.simulate(scenario.with_inputs(duration=63.4 * level, sample_interval=0.1 * level))
    assert float(part["load_angle"][-1]) == pytest.approx(float(fine["load_angle"][-1]), rel=1e-12)


def test_signals_of_a_controller_end_with_the_run() -> None:
    """They are what they are at that instant among samples of any interval."""
    coarse, fine = (
        lm.simulate(lm.load("position-axis").replace(**{"simulation.duration": 0.0505, "simulation.sample_interval": interval}))
        for interval in (0.004, 0.0005)
    )
    assert float(coarse.time[-1]) == 0.0505
    assert {"position_reference", "command", "measured_position"} <= set(coarse)
    for name in coarse:
        assert float(coarse[name][-1]) == pytest.approx(float(fine[name][-1]), rel=1e-10, abs=1e-13)


def test_the_summary_is_that_of_the_end() -> None:
    lines = summary(lm.simulate(rising(1.03)))
    assert "1.03 s" in lines
    assert "1.03 rad/s" in lines


@pytest.mark.parametrize("engine", ["core", "one by one"])
def test_a_mean_over_samples_weighs_the_last_by_its_interval(tmp_path: Path, engine: str) -> None:
    """A mean is that of single runs to the bit, and does not jump by a sample where the duration grows by a billionth."""
    vary = [{"key": "load.inertia", "values": [2.0, 3.0]}]
    if engine == "one by one":  # a key that the core does not know
        vary.append({"key": "gearbox.stiffness.breaks", "relative": True, "values": [1.0]})
    keep = {"end": "final(load_speed)", "mean": "mean(load_speed)", "rms": "rms(load_speed)", "method": "load_speed.mean()"}
    rows = {}
    for duration in (0.2, 0.2 * (1.0 + 1e-9), 0.205):
        times = {"simulation.duration": duration, "simulation.sample_interval": 0.02}
        scenario = lm.load("paper-2dof-nl-small").replace(**times)
        study = lm.studies.Study(scenario=scenario, design="grid", vary=vary, keep=keep)
        rows[duration] = read_table(lm.study(study, tmp_path / f"{duration!r}")).to_pydict()
        for run in (0, 1):
            result = lm.simulate(scenario_of_run(study, run))
            v, w = result["load_speed"].values, np.diff(result.time, prepend=-0.02) / 0.02
            assert rows[duration]["end"][run] == v[-1]
            assert rows[duration]["mean"][run] == float(FUNCTIONS["mean"].of_values(result["load_speed"]))
            for name in ("mean", "method"):
                assert rows[duration][name][run] == pytest.approx(np.sum(w * v) / np.sum(w), rel=1e-12)
            assert rows[duration]["rms"][run] == pytest.approx(math.sqrt(np.sum(w * v * v) / np.sum(w)), rel=1e-12)
    for name in keep:
        assert rows[0.2 * (1.0 + 1e-9)][name] == pytest.approx(rows[0.2][name], rel=1e-7)
        assert rows[0.205][name] != rows[0.2][name]


@pytest.mark.parametrize(("interval", "said"), [(0.1, True), (1e-3, False)])
def test_a_summary_says_that_its_peaks_are_those_of_few_samples(interval: float, said: bool) -> None:
    """A command of 3 Hz every 0.1 s has 3.33 samples in a period."""
    scenario = lm.load("paper-2dof-nl-large").replace(command={"amplitude": 0.5, "frequency": 3.0}, simulation=run_of(0.5, interval))
    text = summary(lm.simulate(scenario))
    assert ("peaks are those of the samples, 3.33 in a period of 3 Hz" in text) == said

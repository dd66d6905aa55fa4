"""The last sample of a run is its end, also where the duration is no multiple of the sample interval."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from lostmotion.reports.run import summary
from lostmotion.reports.study import read_table
from lostmotion.studies.expressions.functions import FUNCTIONS
from lostmotion.studies.runs.chunk import scenario_of_run

END = 2.449489743  # a lift of 3 m with 1 m/s^2
WINCH: dict[str, Any] = {
    "shafts": {"drum": {"inertia": 0.8125, "friction_torque": 1300.0}},
    "slides": {"load": {"mass": 250.0, "inclination": math.pi / 2.0, "speed": {"ramps": [{"rise": END, "duration": END}]}}},
    "racks": {"rope": {"input": "drum", "output": "load", "travel_per_turn": 0.4 * math.pi}},
    "simulation": {"duration": END, "sample_interval": 0.01},
}
# A shaft that a constant torque of 1 N m accelerates: its speed is the time.
RISING: dict[str, Any] = {
    "shafts": {"s": {"inertia": 1.0, "torque": {"mean": -1.0}}},
    "simulation": {"duration": 1.03, "sample_interval": 0.1},
}


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
    scenario = lm.load("paper-2dof-nl-large").replace(
        command={"amplitude": 0.5, "frequency": 3.0}, simulation={"duration": 0.5, "sample_interval": interval}
    )
    text = summary(lm.simulate(scenario))
    assert ("peaks are those of the samples, 3.33 in a period of 3 Hz" in text) == said

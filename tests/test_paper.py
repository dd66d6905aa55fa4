"""The paper's constants, its frequency response, and everything that `reproduce` writes."""

import csv
import html
import itertools
import re
from pathlib import Path

import numpy as np
import pytest

import lostmotion as lm
import paper_equations
from conftest import ROOT
from html_pages import Page, charts
from lostmotion.paper import AMPLITUDES, MODELS, constants, paper_scenario
from lostmotion.paper.figures import draw, figure_specs
from lostmotion.paper.quoted_numbers import Facts, facts
from lostmotion.paper.reproduce import WORK, reproduce
from lostmotion.paper.runs import Results, compute, stuck_intervals

# From the data and formulas of the paper, worked out by hand: name, recomputed, from the printed t_m0 and T_RC (where it differs).
EXPECTED = {
    "f_T0": (65.495, 65.495),
    "T_MR": (62.357, 62.357),
    "T_ZR": (269.386, 269.386),
    "j_RC": (36.131, 36.131),
    "beta_RC": (5.3201, 5.3201),
    "T_RC": (230.47, 233.4),
    "t_m0": (2.507, 2.31),
    "T_mc": (65.02, 61.478),
    "f_RC": (55.04, 56.603),
    "xi_RC": (11.25, 10.938),
    "omega_MRC": (365.3, 374.82),
    "f_-3dB": (2.451, 2.593),
    "lambda_-3dB": (0.0445, 0.0458),
    "T_MZ": (5.554, 5.252),
}


def test_constants_are_those_of_the_repaired_table() -> None:
    table = {c.name: c for c in constants()}
    assert set(table) == set(EXPECTED)
    for name, (recomputed, from_printed) in EXPECTED.items():
        digits = len(str(recomputed).replace(".", "").lstrip("0"))
        assert table[name].recomputed == pytest.approx(recomputed, rel=0.6 * 10.0 ** (1 - digits))
        assert table[name].from_printed == pytest.approx(from_printed, rel=6e-4)


def test_the_time_constant_of_the_disturbance_is_that_of_the_steady_speed() -> None:
    """Steady (2) and (3) of the rigid drive without command, under a disturbance torque of 1 N·m."""
    from paper_equations import INPUT_DAMPING, LOAD_DAMPING

    reflect = 1.0 / (90.0 * 0.9)
    motor = [1.0, 2.1169 / 345.6]
    shaft = [0.521, -INPUT_DAMPING - LOAD_DAMPING * reflect / 90.0]
    _, speed = np.linalg.solve([motor, shaft], [0.0, reflect])
    (row,) = (c for c in constants() if c.name == "T_MZ")
    assert row.printed == 5.17
    assert row.recomputed == pytest.approx(-2.0 * speed, rel=1e-9)
    # From the printed T_mc = 61.48 ms and j_RC = 36.1, which have three digits.
    assert row.from_printed == pytest.approx(61.48e-3 * 2.0 * reflect / (36.1 * 80e-7), rel=2e-3)


@pytest.fixture(scope="module")
def results() -> Results:
    return compute()


@pytest.fixture(scope="module")
def found(results: Results) -> Facts:
    return facts(results)


@pytest.mark.parametrize(("amplitude", "mean", "energy", "distortion"), [("large", 0.83, 0.886, 0.014), ("small", 0.18, 0.26, 0.64)])
def test_efficiencies_and_distortion_are_those_of_a_second_method(
    found: Facts, amplitude: str, mean: float, energy: float, distortion: float
) -> None:
    """Printed equations, stepped through time; its error is of the order of the step, 50 us of a period of 1 s."""
    step, period = 5e-5, 20_000
    T_1, T_2, motor_speed, load_speed = paper_equations.run(AMPLITUDES[amplitude], 3.0, step)
    last = np.abs(np.fft.rfft(load_speed[2 * period :]))
    assert found.distortion[amplitude] == pytest.approx(np.sqrt(np.sum(last[2:] ** 2)) / last[1], rel=0.01)
    T_1, T_2, motor_speed, load_speed = (x[: 2 * period] for x in (T_1, T_2, motor_speed, load_speed))
    moves = motor_speed != 0.0
    drives, driven = T_2 * motor_speed > 0.0, T_1 * motor_speed < 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        efficiency = np.where(drives, T_2 / (90.0 * T_1), np.where(driven, 90.0 * T_1 / T_2, 0.0))
    assert found.mean_efficiency[amplitude] == pytest.approx(efficiency[moves].mean(), abs=2e-3)
    power = np.maximum(T_2 * load_speed, 0.0).sum() / np.maximum(T_1 * motor_speed, 0.0).sum()
    assert found.energy_efficiency[amplitude] == pytest.approx(power, abs=2e-3)
    assert found.stuck["2-DOF-NL", amplitude] == pytest.approx(1.0 - moves.mean(), abs=2e-3)
    assert not np.any(load_speed[np.argmax(load_speed != 0.0) :] == 0.0)
    assert found.load_rests["2-DOF-NL", amplitude] == 0.0
    # As the report rounds them.
    assert round(found.mean_efficiency[amplitude], 2) == mean
    assert round(found.energy_efficiency[amplitude], len(str(energy)) - 2) == energy
    assert round(found.distortion[amplitude], len(str(distortion)) - 2) == distortion


def test_the_first_picture_is_described_by_what_the_runs_show(found: Facts) -> None:
    stuck, rigid = (100.0 * found.stuck[model, "small"] for model in ("2-DOF-NL", "1-DOF-L"))
    words = f"is stuck for {stuck:.0f} % of the time, the linear ones for about {rigid:.0f} %"
    assert words in (ROOT / "docs" / "index.md").read_text()


def test_only_the_rigid_model_brings_the_load_to_rest(found: Facts) -> None:
    assert found.load_rests["1-DOF-L", "small"] > 0.1
    assert found.load_rests["2-DOF-L", "small"] == 0.0


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("amplitude", AMPLITUDES)
def test_intervals_that_are_shaded_are_those_of_the_contact(results: Results, model: str, amplitude: str) -> None:
    run = results.runs[model, amplitude]
    time = run["time"].values
    inside = np.zeros(len(time), dtype=bool)
    intervals = stuck_intervals(run)
    for begin, end in intervals:
        inside |= (time >= begin) & (time <= end)
    # A sample at a switching may be of either regime.
    assert np.sum(inside != (run["input_contact"].values == 0)) <= 2 * len(intervals)
    assert all(a[1] < b[0] for a, b in itertools.pairwise(intervals))


def test_stuck_intervals_are_shaded(results: Results, found: Facts) -> None:
    (spec,) = (s for s in figure_specs(results, found) if s.number == "11")
    drawn = [[patch.get_extents().transformed(axes.transData.inverted()) for patch in axes.patches] for axes in draw(spec).axes]
    for amplitude, boxes in zip(AMPLITUDES, drawn, strict=False):
        expected = stuck_intervals(results.runs["2-DOF-NL", amplitude])
        np.testing.assert_allclose([(box.x0, box.x1) for box in boxes], expected, atol=1e-9)


@pytest.mark.parametrize("model", ["1-DOF-L", "2-DOF-L"])
def test_bearing_friction_takes_its_share_of_a_slow_small_command(found: Facts, model: str) -> None:
    """The describing function of a dead zone of T_10/(M_DR k_N); slow enough at 0.1 Hz for two digits."""
    x = 0.016 / (0.521 * 3.1169) / 0.025
    share = 1.0 - 2.0 / np.pi * (np.arcsin(x) + x * np.sqrt(1.0 - x * x))
    assert found.lowest_gain[model, "small"] == pytest.approx(share, abs=0.005)
    assert round(share, 2) == 0.51


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, int]:
    steps = []
    directory = tmp_path_factory.mktemp("paper")
    reproduce(directory / "new", lambda: steps.append(1), ("png", "svg"))
    return directory / "new", len(steps)


NUMBERS = ("01", "05", "07", "08", "09", *map(str, range(10, 19)))


def test_reproduce_writes_every_figure_its_data_and_the_report(report: tuple[Path, int]) -> None:
    directory, _ = report
    expected = {f"figure-{n}.{e}" for n in NUMBERS for e in ("png", "svg", "csv")} | {"constants.csv", "report.html"}
    assert {p.name for p in directory.iterdir()} == expected - {"figure-01.csv"}  # the schematics have no data
    for n in NUMBERS:
        assert (directory / f"figure-{n}.png").read_bytes().startswith(b"\x89PNG")
        assert "<svg" in (directory / f"figure-{n}.svg").read_text()[:2000]


def test_progress_reaches_its_end(report: tuple[Path, int]) -> None:
    assert report[1] == WORK


def test_the_report_needs_nothing_beside_it_and_is_well_formed(report: tuple[Path, int]) -> None:
    text = (report[0] / "report.html").read_text()
    page = Page(text)
    assert not page.faults
    assert ("tr", "differs") in page.classes
    assert not re.findall(r'(?:src|href)="(?!data:)', text)
    assert "stand-in" in text
    for name in EXPECTED:
        assert f"<td>{name}</td>" in text


def test_figures_are_in_the_order_of_the_paper(report: tuple[Path, int]) -> None:
    text = (report[0] / "report.html").read_text()
    assert tuple(re.findall(r'<section id="figure-(\d+)">', text)) == NUMBERS
    assert "<b>Figures 1 to 4 and 6. Schematics.</b>" in text


def test_the_report_states_what_the_runs_show(report: tuple[Path, int], found: Facts) -> None:
    text = html.unescape(re.sub(r"<[^>]*>", " ", (report[0] / "report.html").read_text()))
    text = " ".join(text.split())
    assert "is 64 % at E CA = 0.025 and 1.4 % at 1.0275" in text
    assert "stuck for 41 % of the time (shaded). Its load is at rest only before it first moves." in text
    for values in ("0.832 0.176", "0.886 0.259"):
        assert values in text
    assert "stops in every half period" not in text
    deviations = text.split("Deviations from the paper")[1]
    for name in ("T_RC", "t_m0", "T_mc", "f_RC", "xi_RC", "omega_MRC", "f_-3dB", "lambda_-3dB", "T_MZ"):
        assert name in deviations.split("The constants in three columns")[0]
    for place in ("(13), sign of T 2P", "loss for negative load", "hysteresis at the start"):
        assert place in deviations


def rows_of(report: tuple[Path, int], number: str, panel: str, curve: str) -> np.ndarray:
    """x and y of a curve."""
    rows = csv.DictReader((report[0] / f"figure-{number}.csv").read_text().splitlines())
    return np.array([[float(r["x"]), float(r["y"])] for r in rows if (r["panel"], r["curve"]) == (panel, curve)]).T


def test_figure_data_are_the_runs(report: tuple[Path, int]) -> None:
    run = lm.simulate(paper_scenario("2-DOF-NL", "small"))
    _, speed = rows_of(report, "11", "speed, amplitude 0.025", "2-DOF-NL")
    assert speed.tolist() == run["load_speed"].values.tolist()
    shown = charts((report[0] / "report.html").read_text())
    (chart,) = (c for c in shown if c["title"] == "speed, amplitude 0.025" and "range" not in c["x"])
    (line,) = (line for line in chart["lines"] if line["label"] == "2-DOF-NL")
    assert line["y"].tolist() == run["load_speed"].values.tolist()


def test_differences_are_those_of_the_runs(report: tuple[Path, int]) -> None:
    """Curves that coincide have a panel of their difference, and the small loop a panel without the torque of the spring."""
    linear, other = (lm.simulate(paper_scenario(model, "large"))["load_speed"].values for model in ("2-DOF-L", "1-DOF-L"))
    shown = rows_of(report, "11", "difference from 2-DOF-L, amplitude 1.0275", "1-DOF-L")[1][: len(linear)]
    assert shown.tolist() == (other - linear).tolist()
    twist, hysteresis = rows_of(report, "14", "hysteresis, amplitude 0.025", "2-DOF-NL")
    _, torque = rows_of(report, "14", "amplitude 0.025", "2-DOF-NL")
    assert np.abs(3.0 * twist).max() < 0.6  # within the first segment, whose slope is 1.59 N·m / 0.6 mrad
    np.testing.assert_allclose(hysteresis, torque - 3.0 * twist * 1.59 / 0.6 / 51.6, atol=1e-12)
    assert np.ptp(hysteresis) > 1e-3


def test_the_torsion_curve_has_the_printed_breakpoints_and_slopes(report: tuple[Path, int]) -> None:
    twist, torque = rows_of(report, "07", "torque", "breakpoints of (14)")
    np.testing.assert_allclose(twist, [0.6, 3.0], rtol=1e-12)
    np.testing.assert_allclose(torque, [1.59, 52.47], rtol=1e-12)
    at, measured = rows_of(report, "07", "torque", "2-DOF-NL")
    np.testing.assert_allclose(np.interp(twist, at, measured), torque, atol=1.2 * 51.6 / 2000)  # a sample
    at, slope = rows_of(report, "07", "stiffness", "2-DOF-NL")
    np.testing.assert_allclose(np.interp([0.3, 1.8, 3.2], at, slope), [0.1, 0.8, 1.0], rtol=0.01)


def test_the_hysteresis_loops_are_as_wide_as_16_says(report: tuple[Path, int]) -> None:
    """A closed loop of amplitude T turns at P + h = T with h = 0.035 P, and its branches are 2 h apart."""
    for share in (1.0, 0.6, 0.3):
        twist, torque = rows_of(report, "08", "loops", f"±{100 * share:.0f} % of rated torque")
        crossings = np.flatnonzero(twist[:-1] * twist[1:] < 0.0)
        (first, second) = torque[crossings]
        assert abs(first - second) == pytest.approx(2.0 * 0.035 / 1.035 * share, rel=0.02)


@pytest.mark.parametrize(("panel", "value"), [("amplitude 1.0275", 1.0275), ("amplitude 0.025", 0.025)])
def test_the_frequency_response_shows_closed_form_models_and_cutoff(report: tuple[Path, int], panel: str, value: float) -> None:
    """(10) from the constants by hand; 1-DOF-L beside it is the periodic motion with the friction of its bearings."""
    f, closed = rows_of(report, "17", panel, "1-DOF-L, closed form")
    x = f / EXPECTED["f_RC"][0]
    expected = 20.0 * np.log10(1.0 / np.hypot(1.0 - x**2, 2.0 * 11.249 * x))
    np.testing.assert_allclose(closed, expected, atol=20.0 * np.log10(1.001))
    rigid = paper_scenario("1-DOF-L", "large").drive()
    alone = lm.frequency_response(rigid, [float(f[20])], [value])
    expected = np.abs(alone["response"].sel(output="load_speed").item()) * 90.0 / EXPECTED["omega_MRC"][0]
    shown = rows_of(report, "17", panel, "1-DOF-L")[1][20]
    assert shown == pytest.approx(20.0 * np.log10(expected), abs=20.0 * np.log10(1.0001))
    for model in ("2-DOF-L", "2-DOF-NL"):
        assert rows_of(report, "17", panel, model).shape == rows_of(report, "18", panel, model).shape == (2, 61)
    np.testing.assert_allclose(rows_of(report, "17", panel, "-3 dB")[1], 20.0 * np.log10(2.0**-0.5), rtol=1e-12)
    assert set(rows_of(report, "17", panel, "2.6 Hz, printed")[0]) == {2.6}

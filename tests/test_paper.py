"""The paper's constants, its frequency response, and everything that `reproduce` writes."""

import csv
from pathlib import Path

import pytest

import lostmotion as lm
from lostmotion.model.drive import Drive
from lostmotion.paper import constants, paper_scenario
from lostmotion.paper.reproduce import WORK, reproduce

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
}


def test_constants_are_those_of_the_repaired_table() -> None:
    table = {c.name: c for c in constants()}
    assert set(table) == set(EXPECTED)
    for name, (recomputed, from_printed) in EXPECTED.items():
        digits = len(str(recomputed).replace(".", "").lstrip("0"))
        assert table[name].recomputed == pytest.approx(recomputed, rel=0.6 * 10.0 ** (1 - digits))
        assert table[name].from_printed == pytest.approx(from_printed, rel=6e-4)


def frictionless(drive: Drive) -> Drive:
    motor = drive.motor.model_copy(update={"friction_torque": 0.0})
    return Drive(motor=motor, gearbox=drive.gearbox, load=drive.load)


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, int]:
    steps = []
    directory = tmp_path_factory.mktemp("paper")
    reproduce(directory / "new", lambda: steps.append(1))
    return directory / "new", len(steps)


def test_reproduce_writes_every_figure_its_data_and_the_report(report: tuple[Path, int]) -> None:
    directory, _ = report
    numbers = ["05", "09", *map(str, range(10, 19))]
    expected = {f"figure-{n}.{e}" for n in numbers for e in ("png", "svg", "csv")} | {"constants.csv", "report.html"}
    assert {p.name for p in directory.iterdir()} == expected
    for n in numbers:
        assert (directory / f"figure-{n}.png").read_bytes().startswith(b"\x89PNG")
        assert "<svg" in (directory / f"figure-{n}.svg").read_text()[:2000]


def test_progress_reaches_its_end(report: tuple[Path, int]) -> None:
    assert report[1] == WORK


def test_the_report_needs_nothing_beside_it(report: tuple[Path, int]) -> None:
    page = (report[0] / "report.html").read_text()
    assert page.count("data:image/png;base64,") == 11
    assert 'src="http' not in page
    assert "href=" not in page
    assert "stand-in" in page
    for name in EXPECTED:
        assert f"<td>{name}</td>" in page


def test_figure_data_are_the_runs(report: tuple[Path, int]) -> None:
    rows = list(csv.DictReader((report[0] / "figure-11.csv").read_text().splitlines()))
    chosen = [r for r in rows if r["panel"] == "speed, E_CA = 0.025" and r["curve"] == "2-DOF-NL"]
    run = lm.simulate(paper_scenario("2-DOF-NL", "small"))
    assert [float(r["y"]) for r in chosen] == run["load_speed"].values.tolist()
    response = list(csv.DictReader((report[0] / "figure-17.csv").read_text().splitlines()))
    assert len([r for r in response if "0.025" in r["curve"]]) >= 60

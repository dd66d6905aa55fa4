"""Conditions on files and folders, and errors of conditions that the fit has not seen, against closed forms."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from identification_logs import released, spring_task
from lostmotion.identification.identify import identify_task
from lostmotion.reports.identification import identification_report
from refusals import refusals_of

TIME = np.arange(0.0, 2.0, 0.02)
BEGIN = 0.01  # m
MASSES = {"light": 95.0, "heavy": 120.0}  # kg, by folder


@pytest.fixture
def folders(tmp_path: Path) -> Path:
    """Two logs in each of two folders, the masses of which differ."""
    for folder, mass in MASSES.items():
        (tmp_path / folder).mkdir()
        for name, arm in (("a.csv", 1), ("b.csv", 2)):
            rows = "\n".join(f"{t!r},{x!r}" for t, x in zip(TIME.tolist(), released(TIME, BEGIN, mass).tolist(), strict=True))
            (tmp_path / folder / name).write_text(f"# arm: {arm}\ntime [s],pos [rad]\n{rows}\n")
    return tmp_path


def run(directory: Path, fit: dict[str, Any] | None = None, **logs: Any) -> lm.identification.IdentificationResult:
    more = {"logs": {"files": ["*/*.csv"], **logs}, "fit": {"regression": False, "loss": "linear"} | (fit or {})}
    return identify_task(spring_task(directory, **more), directory)


@pytest.mark.parametrize(("condition", "held_out"), [
    ('folder == "heavy"', {"heavy/a.csv", "heavy/b.csv"}),
    ('file == "b.csv" or folder == "heavy"', {"heavy/a.csv", "heavy/b.csv", "light/b.csv"}),
    ('file == "a.csv" and folder == "light"', {"light/a.csv"}),
])  # fmt: skip
def test_logs_are_held_out_by_their_file_and_folder(folders: Path, condition: str, held_out: set[str]) -> None:
    result = run(folders, held_out=condition)
    assert {log.name for log in result.logs if log.held_out} == held_out
    if "heavy/b.csv" in held_out:
        assert result.values["mass"] == pytest.approx(MASSES["light"], rel=1e-6)


def test_the_search_begins_with_a_folder(folders: Path) -> None:
    result = run(folders, {"first": 'folder == "light"'})
    assert {log.name for log in result.logs if log.first} == {"light/a.csv", "light/b.csv"}


def test_a_header_with_the_key_file_counts(folders: Path) -> None:
    path = folders / "light" / "a.csv"
    path.write_text("# file: first\n" + path.read_text())
    result = run(folders, held_out='file == "first"')
    assert [log.name for log in result.logs if log.held_out] == ["light/a.csv"]
    assert any("file in its header counts" in note for note in result.notes["light/a.csv"])


def test_the_error_of_a_condition_left_out_is_that_of_the_closed_form(folders: Path) -> None:
    """Without one folder the fit finds the mass of the other, with which the motion is off by what the closed forms differ."""
    result = run(folders, {"leave_out": ["folder", "arm"]})
    apart = float(np.mean(np.abs(released(TIME, BEGIN, MASSES["light"]) - released(TIME, BEGIN, MASSES["heavy"]))))
    found = {c.name: c for c in result.conditions}
    assert list(found) == ["folder = heavy", "folder = light", "arm = 1", "arm = 2"]
    for name in ("folder = heavy", "folder = light"):
        assert found[name].logs == 2
        assert found[name].left_out == pytest.approx(apart, rel=1e-3)
        assert 0.2 * apart < found[name].fitted < 0.8 * apart  # the mass that suits all is between
    for name in ("arm = 1", "arm = 2"):  # both arms have both masses, so that nothing changes
        assert found[name].left_out == pytest.approx(found[name].fitted, rel=1e-6)
    lines = [line for line in result.lines() if "when fitted without them" in line]
    assert (
        len(lines) == 4
        and f"folder = heavy (2 logs): mean absolute error {math.degrees(found['folder = heavy'].fitted):.4g} deg" in lines[0]
    )
    table = next(part for part in identification_report("x", result).parts if "Leave one" in getattr(part, "title", ""))
    assert [row[0] for row in table.rows] == list(found)
    assert 90.0 < result.values["mass"] < 125.0  # of the fit to all, which stays


test_a_key_that_does_not_divide_the_logs_is_refused = refusals_of(
    lambda keys, *, folders: run(folders, {"leave_out": keys}, header={"kind": 3.0}),
    (["folders"], "fit.leave_out: heavy/a.csv has no 'folders' in its header; did you mean folder?"),
    (["zzz"], "fit.leave_out: give it with logs.header"),
    (["kind"], "fit.leave_out: 'kind' is 3.0 in all fitted logs; leave it out of the list"),
)

"""Logs as instruments and recorders leave them: headers of many lines, a time for each channel, cut lines, words in place of numbers."""

import json
from pathlib import Path

import numpy as np
import pytest

import lostmotion as lm
from lostmotion.identification.readers.log_files import read_log
from refusals import refused

TIME = np.round(np.arange(60) * 0.002, 3)
X, Y = np.round(np.sin(20 * TIME), 6), np.round(np.cos(30 * TIME), 6)


def rows(separator: str = ",", decimal: str = ".") -> list[str]:
    lines = [separator.join([f"{t:.3f}", f"{x:.6f}", f"{y:.6f}"]) for t, x, y in zip(TIME, X, Y, strict=True)]
    return [line.replace(".", decimal) for line in lines]


def read(path: Path, lines: list[str] | str) -> lm.identification.Log:
    path.write_text(lines if isinstance(lines, str) else "\n".join(lines))
    return read_log(path)


@pytest.mark.parametrize(("separator", "decimal"), [(",", "."), (";", ","), ("\t", ","), (" ", ".")])
@pytest.mark.parametrize("damage", ["cut", "cut within a number", "cut to another number", "ERROR", "short line", "first cell"])
def test_a_damaged_line_or_cell_costs_only_itself(tmp_path: Path, damage: str, separator: str, decimal: str) -> None:
    lines = rows(separator, decimal)
    gone = {"cut": 59, "cut within a number": 59, "cut to another number": 59, "ERROR": 30, "short line": 30, "first cell": 0}[damage]
    cells = lines[gone].split(separator)
    lines[gone] = separator.join(
        {
            "cut": cells[:2],
            "cut within a number": [*cells[:1], "-"],
            "cut to another number": [*cells[:2], cells[2][:-3]],
            "short line": cells[:1],
        }.get(damage, [cells[0], "ERROR", cells[2]])
    )
    log = read(tmp_path / "a.csv", [separator.join(["time", "x", "y"]), *lines])
    number = gone + 2
    assert any(f"line {number}" in note for note in log.notes), log.notes
    kept = np.arange(60) != gone
    whole = len(log.time) == 60  # the sample of a word stays, without a number
    assert whole == (damage in ("ERROR", "first cell"))
    x, y = log.values("x"), log.values("y")
    assert np.array_equal(log.time[kept] if whole else log.time, TIME[kept])
    assert np.array_equal(x[kept] if whole else x, X[kept])
    assert np.array_equal(y, Y if whole else Y[kept])
    assert not whole or np.isnan(x[gone])


def test_a_column_of_words_is_left_out_and_named(tmp_path: Path) -> None:
    log = read(tmp_path / "a.csv", ["time,x,y,state", *(f"{line},OK" for line in rows())])
    assert list(log.channels) == ["x", "y"]
    assert any("state" in note for note in log.notes)


def test_many_damaged_lines_are_refused(tmp_path: Path) -> None:
    lines = [line if k % 5 else line[:8] for k, line in enumerate(rows())]
    assert "for 3 columns" in refused(lambda: read(tmp_path / "a.csv", ["time,x,y", *lines]))


def test_quoted_names_with_units_behind_blanks(tmp_path: Path) -> None:
    log = read(tmp_path / "a.csv", ['"Time [ms]", "X.pos [mm]", "X.torque [N*m]"', *rows()])
    assert {name: c.unit for name, c in log.channels.items()} == {"X.pos": "mm", "X.torque": "N*m"}
    assert np.allclose(log.time, 1e-3 * TIME, rtol=1e-15)


def scope(names: list[str], columns: list[np.ndarray], times: list[np.ndarray], decimal: str = ",") -> list[str]:
    """Export of a PLC scope: lines of `key value` for the file, then for each channel, then pairs of time in ms and value."""
    keys = {"Name": names, "SampleTime[ms]": ["2"] * len(names), "SymbolComment": [""] * len(names)}
    head = ["Name\tScope01", "File\t", "StartRecord\t128783093223690000\tFriday\t13:08:42", ""]
    head += ["\t".join(f"{key}\t{value}" for value in values) for key, values in keys.items()] + [""]
    body = []
    for k in range(max(map(len, columns))):
        cells = []
        for t, x in zip(times, columns, strict=True):
            cells += [f"{1e3 * t[k]:.3f}", f"{x[k]:.6f}"] if k < len(x) else ["", ""]
        body.append("\t".join(cells).replace(".", decimal))
    return [*head, *body, "EOF"]


@pytest.mark.parametrize("decimal", [",", "."])
@pytest.mark.parametrize("count", [1, 2, 3])
def test_an_export_of_a_scope_has_a_time_for_each_channel(tmp_path: Path, count: int, decimal: str) -> None:
    names, values = ["ActPos", "ActTorque", "Setpoint"][:count], [X, Y, X + Y][:count]
    log = read(tmp_path / "scope.csv", scope(names, values, [TIME] * count, decimal))
    assert list(log.channels) == names
    assert np.allclose(log.time, TIME, atol=1e-12)
    for name, x in zip(names, values, strict=True):
        assert np.allclose(log.values(name), x, atol=1e-6)


def test_channels_of_another_rate_are_read_at_the_times_of_the_first(tmp_path: Path) -> None:
    """The second channel has every second sample, and is straight in between."""
    line = 3.0 * TIME - 0.05
    log = read(tmp_path / "scope.csv", scope(["fast", "slow"], [X, line[::2]], [TIME, TIME[::2]]))
    assert np.array_equal(np.isfinite(log.values("slow")), TIME[::2][-1] >= TIME)
    assert np.allclose(log.values("slow")[:-1], line[:-1], atol=2e-6)
    assert any("slow" in note and "straight lines" in note for note in log.notes)


def test_lines_above_the_heading_of_an_instrument_are_the_header(tmp_path: Path) -> None:
    head = ["Model,TX3", "Firmware,1.20", "Record Length,60", "", "Gain,2.5", "TIME,CH1,CH2", "s,V,A"]
    log = read(tmp_path / "a.csv", [*head, *rows()])
    assert {name: c.unit for name, c in log.channels.items()} == {"CH1": "V", "CH2": "A"}
    assert log.header == {"Model": "TX3", "Firmware": 1.2, "Record_Length": 60.0, "Gain": 2.5}
    assert np.array_equal(log.values("CH1"), X)


def test_json_with_an_array_for_each_channel(tmp_path: Path) -> None:
    data = {"l": 0.1, "m": 0.3, "servo": "MX", "positions": X.tolist(), "timestamps": TIME.tolist()}
    log = read(tmp_path / "a.json", json.dumps(data))
    assert list(log.channels) == ["positions"]
    assert log.header == {"l": 0.1, "m": 0.3, "servo": "MX"}
    assert np.array_equal(log.time, TIME) and np.array_equal(log.values("positions"), X)


@pytest.mark.parametrize("layout", ["objects", "lines", "rows", "inside"])
def test_json_in_other_shapes_and_with_units_in_its_names(tmp_path: Path, layout: str) -> None:
    names, table = ["Time [ms]", "X.pos [mm]"], [[1e3 * t, x] for t, x in zip(TIME.tolist(), X.tolist(), strict=True)]
    objects = [dict(zip(names, row, strict=True)) for row in table]
    arrays = {name: [row[k] for row in table] for k, name in enumerate(names)}
    data = {"objects": objects, "rows": [names, *table], "inside": {"robot": "R1", "data": arrays}}.get(layout)
    text = "\n".join(map(json.dumps, objects)) if layout == "lines" else json.dumps(data)
    log = read(tmp_path / ("a.jsonl" if layout == "lines" else "a.json"), text)
    assert {name: c.unit for name, c in log.channels.items()} == {"X.pos": "mm"}
    assert np.allclose(log.time, TIME, rtol=1e-15) and np.array_equal(log.values("X.pos"), X)
    assert log.header == ({"robot": "R1"} if layout == "inside" else {})


@pytest.mark.parametrize("layout", ["entries", "arrays"])
def test_json_that_is_cut_off_or_holds_a_word_is_read_but_for_that(tmp_path: Path, layout: str) -> None:
    x: list[float | str] = [*X.tolist()]
    if layout == "entries":
        entries = [{"timestamp": t, "x": v} for t, v in zip(TIME.tolist(), x, strict=True)]
        entries[20]["x"] = "ERROR"
        text = json.dumps({"m": 0.3, "entries": entries})
    else:
        x[20] = "ERROR"
        text = json.dumps({"m": 0.3, "timestamps": TIME.tolist(), "x": x})
    log = read(tmp_path / "a.json", text[:-12])
    assert 58 <= len(log.time) < 60
    assert np.array_equal(np.flatnonzero(np.isnan(log.values("x"))), [20])
    assert np.array_equal(np.delete(log.values("x"), 20), np.delete(X[: len(log.time)], 20))
    assert any("cut off" in note for note in log.notes) and any("ERROR" in note for note in log.notes)


def test_the_first_file_of_a_linear_axis_has_its_slide(tmp_path: Path) -> None:
    (tmp_path / "logs").mkdir()
    head = "time [ms],pos [mm],torque [N*m]"
    (tmp_path / "logs" / "a.csv").write_text("\n".join([head, *rows()]))
    (tmp_path / "rig.toml").write_text(
        """
shafts.motor = {}
slides.table = { mass = "40 kg", friction_force = "20 N" }
motors.drive = { shaft = "motor", kind = "torque_source", rated_torque = "1 N m", rotor_inertia = 0.0 }
screws.screw = { input = "motor", output = "table", lead = "10 mm" }
simulation = { duration = "1 s", sample_interval = "1 ms" }
"""
    )
    text = lm.identification.first_task(tmp_path / "logs", rig=tmp_path / "rig.toml")
    assert 'variable = "table_position"' in text
    assert '"slides.table.mass" = "table_mass"' in text and '"slides.table.friction_force"' in text
    assert "[inputs.drive_command]" in text
    (tmp_path / "logs" / "identify.toml").write_text(text)
    task, directory = lm.identification.load_identification(tmp_path / "logs" / "identify.toml")
    assert list(task.measured) == ["pos"] and directory == tmp_path / "logs"

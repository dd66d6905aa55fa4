"""Logs of all formats read alike; what is wrong with one is dropped and listed, or refused in one line."""

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lostmotion.identification.preparation.screening import screened
from lostmotion.identification.readers.channel_units import channel_unit
from lostmotion.identification.readers.log import Channel, Log
from lostmotion.identification.readers.log_files import find_logs, read_log
from refusals import refused

TIME = np.arange(200) * 0.01
ANGLE = np.sin(3.0 * TIME)


def entries() -> list[dict[str, Any]]:
    return [{"timestamp": float(t), "position": float(x)} for t, x in zip(TIME, ANGLE, strict=True)]


def as_csv(path: Path) -> None:
    rows = "\n".join(f"{1e3 * t:.6f};{np.degrees(x):.12g}" for t, x in zip(TIME, ANGLE, strict=True))
    path.write_text(f"# mass: 0.5\n# unit position: deg\ntime [ms];position\n{rows}\n")


def as_mat5(path: Path) -> None:
    import scipy.io

    scipy.io.savemat(path, {"t": TIME[:, None], "position": ANGLE[:, None], "mass": 0.5})


def as_mat73(path: Path) -> None:
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        file["t"], file["position"], file["mass"] = TIME[None], ANGLE[None], [[0.5]]
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file")


def as_parquet(path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    field = pa.field("position", pa.float64(), metadata={"unit": "deg"})
    schema = pa.schema([pa.field("time", pa.float64()), field], metadata={"mass": "0.5"})
    pq.write_table(pa.table([pa.array(TIME), pa.array(np.degrees(ANGLE))], schema=schema), path)


def as_tdms(path: Path) -> None:
    nptdms = pytest.importorskip("nptdms")
    channel = nptdms.ChannelObject(
        "run", "position", np.degrees(ANGLE), properties={"unit_string": "deg", "wf_increment": 0.01, "wf_start_offset": 0.0}
    )
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.RootObject({"mass": 0.5}), channel])


def as_mdf(path: Path) -> None:
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(np.degrees(ANGLE), TIME, unit="deg", name="position")])
        file.save(path)


def as_npz(path: Path) -> None:
    np.savez_compressed(path, t=TIME, position=ANGLE, mass=0.5, kind="servo")


def as_npy(path: Path) -> None:
    np.save(path, np.array(list(zip(TIME, ANGLE, strict=True)), dtype=[("t", "f8"), ("position", "f8")]))


def as_hdf5(path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        run = file.create_group("run")
        run["time"], run["position"] = 1e3 * TIME, np.degrees(ANGLE)
        run["time"].attrs["units"], run["position"].attrs["units"] = "ms", "deg"
        file.attrs["mass"], file.attrs["operator"] = 0.5, "somebody"


def as_xlsx(path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(["# mass", 0.5])
    sheet.append(["time [ms]", "position [deg]"])
    for t, x in zip(TIME, ANGLE, strict=True):
        sheet.append([1e3 * t, np.degrees(x)])
    book.save(path)


def as_json(path: Path) -> None:
    path.write_text(json.dumps({"mass": 0.5, "entries": entries()}))


@pytest.mark.parametrize(("name", "write", "header"), [
    ("log.csv", as_csv, {"mass": 0.5}),
    ("log5.mat", as_mat5, {"mass": 0.5}),
    ("log73.mat", as_mat73, {"mass": 0.5}),
    ("log.parquet", as_parquet, {"mass": 0.5}),
    ("log.tdms", as_tdms, {"mass": 0.5}),
    ("log.mf4", as_mdf, {}),
    ("log.npz", as_npz, {"mass": 0.5}),
    ("log.npy", as_npy, {}),
    ("log.xlsx", as_xlsx, {"mass": 0.5}),
    ("log.h5", as_hdf5, {"mass": 0.5, "operator": "somebody"}),
    ("log.json", as_json, {"mass": 0.5}),
])  # fmt: skip
def test_every_format_gives_the_same_log(tmp_path: Path, name: str, write: Callable[[Path], Any], header: dict[str, Any]) -> None:
    write(tmp_path / name)
    log = read_log(tmp_path / name)
    assert log.time == pytest.approx(TIME, abs=1e-9)
    channel = log.channels["run/position" if name == "log.h5" else "position"]
    assert channel.values * channel_unit("", channel.unit, "rad", name)[0] == pytest.approx(ANGLE, abs=1e-9)
    assert header.items() <= log.header.items()


def as_mcap(path: Path, encoding: str = "json") -> None:
    """A position at TIME, a goal every 40 ms; publish times, beside which log times are late."""
    mcap = pytest.importorskip("mcap.writer")
    begin = 1_700_000_000_000_000_000
    with path.open("wb") as stream:
        writer = mcap.Writer(stream)
        writer.start()
        schema = writer.register_schema("joint", "jsonschema", b"{}")
        state = writer.register_channel("/servo/state", encoding, schema)
        goal = writer.register_channel("/servo/goal", encoding, schema)
        for k, (t, x) in enumerate(zip(TIME, ANGLE, strict=True)):
            at = begin + round(1e9 * t)
            message = {"joint": {"position": [x, -x]}, "enabled": True, "name": "servo"}
            writer.add_message(state, at + 3_000_000, json.dumps(message).encode(), at)
            if k % 4 == 0:
                writer.add_message(goal, at + 3_000_000, json.dumps({"position": 2.0 * t}).encode(), at)
        writer.add_metadata("rig", {"mass": "0.5", "unit": "left"})
        writer.finish()


def test_messages_of_an_mcap_file_are_channels_at_the_times_of_one_topic(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    as_mcap(path)
    log = read_log(path)
    assert log.time == pytest.approx(TIME, abs=1e-9)
    state = {f"servo/state.{name}" for name in ("joint.position[0]", "joint.position[1]", "enabled")}
    assert set(log.channels) == state | {"servo/goal.position"}
    assert log.values("servo/state.joint.position[1]") == pytest.approx(-ANGLE)
    goal = log.values("servo/goal.position")
    assert goal[:197] == pytest.approx(2.0 * TIME[:197], abs=1e-9)  # straight lines up to the last message
    assert log.header == {"mass": 0.5, "unit": "left"}
    assert any("servo/goal" in note for note in log.notes)
    assert read_log(path, time="/servo/goal").time == pytest.approx(TIME[::4], abs=1e-9)
    refused(lambda: read_log(path, time="servo/stat"), reason="has no topic servo/stat; its topics are servo/state, servo/goal")
    stamps = r"message 1 has no header.stamp .* give logs.time = 'servo/goal'"
    refused(lambda: read_log(path, time="/servo/goal.header.stamp"), match=stamps)


def test_an_mcap_file_that_is_neither_in_json_nor_of_ros_is_refused_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    as_mcap(path, "protobuf")
    refused(lambda: read_log(path), reason="has no topic in JSON or of ROS (protobuf); record in one of these")
    as_mcap(path)
    for content in (path.read_bytes()[:-300], path.read_bytes()[:300], b"something else"):
        path.write_bytes(content)
        refused(lambda: read_log(path), reason="is not an MCAP file that mcap reads")


JOINT = "std_msgs/Header header\nfloat64[] position\nbool enabled\nstring name\nuint8[] image\n"
HEADER = "=" * 80 + "\nMSG: std_msgs/Header\n"
ROS1 = JOINT + HEADER + "uint32 seq\ntime stamp\nstring frame_id\n"
ROS2 = (
    JOINT
    + HEADER
    + "builtin_interfaces/Time stamp\nstring frame_id\n"
    + "=" * 80
    + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)
JITTER = np.arange(len(TIME)) * 7919 % 4001 * 1000  # ns by which a message is published after its stamp


def ros1_message(stamp: int, position: float) -> bytes:
    """Little endian, without padding, as its wire format says."""
    text = struct.pack("<III", 1, *divmod(stamp, 10**9)) + struct.pack("<I", 4) + b"base"
    text += struct.pack("<Idd?", 2, position, -position, True) + struct.pack("<I", 5) + b"servo"
    return text + struct.pack("<I", 200) + bytes(200)


def ros2_message(stamp: int, position: float) -> bytes:
    """Plain CDR, little endian: numbers at multiples of their size, words with an end."""
    text = struct.pack("<iI", *divmod(stamp, 10**9)) + struct.pack("<I", 5) + b"base\0" + bytes(3)
    text += struct.pack("<I", 2) + bytes(-(len(text) + 4) % 8) + struct.pack("<dd?", position, -position, True)
    text += bytes(-len(text) % 4) + struct.pack("<I", 6) + b"servo\0"
    text += bytes(-len(text) % 4) + struct.pack("<I", 200) + bytes(200)
    return b"\0\1\0\0" + text


def as_ros_mcap(path: Path, ros: int) -> None:
    mcap = pytest.importorskip("mcap.writer")
    begin = 1_700_000_000_000_000_000
    encoding, definition, name = [("ros1", ROS1, "servo_msgs/Joint"), ("cdr", ROS2, "servo_msgs/msg/Joint")][ros - 1]
    message = [ros1_message, ros2_message][ros - 1]
    with path.open("wb") as stream:
        writer = mcap.Writer(stream)
        writer.start()
        schema = writer.register_schema(name, f"ros{ros}msg", definition.encode())
        state = writer.register_channel("/servo/state", encoding, schema)
        for t, x, late in zip(TIME, ANGLE, JITTER, strict=True):
            at = begin + round(1e9 * t)
            writer.add_message(state, at + int(late), message(at, x), at + int(late))
        writer.finish()


def as_bag(path: Path) -> Path:
    """A bag of ROS 1, or the directory of one of ROS 2."""
    rosbags = pytest.importorskip("rosbags")
    assert rosbags
    from rosbags import rosbag1, rosbag2
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    ros1 = path.suffix == ".bag"
    begin = 1_700_000_000_000_000_000
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(ROS1 if ros1 else ROS2, "servo_msgs/msg/Joint"))
    message = ros1_message if ros1 else ros2_message
    with rosbag1.Writer(path) if ros1 else rosbag2.Writer(path, version=9) as writer:
        state = writer.add_connection("/servo/state", "servo_msgs/msg/Joint", typestore=store)
        for t, x, late in zip(TIME, ANGLE, JITTER, strict=True):
            at = begin + round(1e9 * t)
            writer.write(state, at + int(late), message(at, x))
    return path if ros1 else next(path.glob("*.db3"))


@pytest.mark.parametrize("kind", ["ROS 1 in MCAP", "ROS 2 in MCAP", "bag of ROS 1", "bag of ROS 2"])
def test_messages_of_ros_are_channels(tmp_path: Path, kind: str) -> None:
    pytest.importorskip("rosbags")
    if "MCAP" in kind:
        path = tmp_path / "log.mcap"
        as_ros_mcap(path, int(kind[4]))
    else:
        path = as_bag(tmp_path / ("log.bag" if kind.endswith("1") else "log"))
    log = read_log(path)
    assert {"servo/state.position[0]", "servo/state.position[1]", "servo/state.enabled", "servo/state.header.stamp.sec"} <= set(
        log.channels
    )
    assert log.values("servo/state.position[1]").tolist() == (-ANGLE).tolist()
    assert log.time == pytest.approx(TIME + 1e-9 * (JITTER - JITTER[0]), abs=1e-9)
    assert read_log(path, time="/servo/state.header.stamp").time == pytest.approx(TIME, abs=1e-9)
    assert any("lists of more than 100 numbers are left out: servo/state.image" in note for note in log.notes)


def test_damaged_messages_of_ros_are_refused_in_one_line(tmp_path: Path) -> None:
    pytest.importorskip("rosbags")
    mcap = pytest.importorskip("mcap.writer")
    path = tmp_path / "log.mcap"
    for definition, data, said in (
        (ROS2, ros2_message(0, 1.0)[:40], "topic servo/state: a message cannot be read"),
        ("float64[ position", b"", "topic servo/state: the definition of servo_msgs/msg/Joint cannot be read"),
    ):
        with path.open("wb") as stream:
            writer = mcap.Writer(stream)
            writer.start()
            schema = writer.register_schema("servo_msgs/msg/Joint", "ros2msg", definition.encode())
            writer.add_message(writer.register_channel("/servo/state", "cdr", schema), 0, data, 0)
            writer.finish()
        refused(lambda: read_log(path), match=said)
    for name, content in (("log.bag", b"something else"), ("log.db3", b"something else"), ("log.bag", b"")):
        (tmp_path / name).write_bytes(content)
        refused(lambda name=name: read_log(tmp_path / name), reason="is not a bag that rosbags reads")


def test_fields_and_matrices_of_hdf5_are_channels(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    table = np.array([(t, x, b"run") for t, x in zip(TIME, ANGLE, strict=True)], dtype="f8,f8,S3")
    table.dtype.names = ("time", "position", "phase")
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["table"], file["pair"], file["short"] = table, np.stack([ANGLE, -ANGLE], axis=1), TIME[:5]
    log = read_log(tmp_path / "log.h5")
    assert set(log.channels) == {"table.position", "pair column 1", "pair column 2"}
    assert log.values("pair column 2").tolist() == (-ANGLE).tolist()
    assert any("left out: short (5)" in note for note in log.notes), log.notes


def test_columns_of_a_matrix_are_channels(tmp_path: Path) -> None:
    import scipy.io

    data = np.stack([TIME, ANGLE, -ANGLE], axis=1)
    scipy.io.savemat(tmp_path / "log.mat", {"data": data, "mass": 0.5})
    np.save(tmp_path / "log.npy", np.asfortranarray(data))
    for name, of in (("log.mat", "data "), ("log.npy", "")):
        log = read_log(tmp_path / name)
        assert log.time.tolist() == TIME.tolist()
        assert {n: c.values.tolist() for n, c in log.channels.items()} == {
            f"{of}column 2": ANGLE.tolist(),
            f"{of}column 3": (-ANGLE).tolist(),
        }
        assert log.notes == (f"has no vector of the time; {of}column 1 is taken for it",)
        assert read_log(tmp_path / name, time=f"{of}column 3").time.tolist() == (-ANGLE).tolist()
    scipy.io.savemat(tmp_path / "log.mat", {"t": TIME, "data": data.T})
    with_rows = read_log(tmp_path / "log.mat")
    assert with_rows.notes == ("arrays not of the length of t (200) are left out: data (3 x 200)",)


def test_time_stamps_of_numpy_are_seconds(tmp_path: Path) -> None:
    stamps = np.datetime64("2024-05-01T12:00:00.5", "ns") + np.round(1e9 * TIME).astype("m8[ns]")
    np.savez(tmp_path / "log.npz", time=stamps, position=ANGLE, names=np.array(["a", "b"]))
    log = read_log(tmp_path / "log.npz")
    assert log.time == pytest.approx(TIME, abs=1e-12)
    assert log.notes == ("arrays that are no numbers are left out: names",)


def columns(separator: str, number: Callable[[float], str], heading: str = "") -> str:
    rows = [separator.join(map(number, pair)) for pair in zip(TIME.tolist(), ANGLE.tolist(), strict=True)]
    return "\n".join([*([heading] if heading else []), *rows]) + "\n"


def comma(value: float) -> str:
    return f"{value!r}".replace(".", ",")


COMMAS = """its commas are read as decimal commas, such as '0,0' in line 2; logs.decimal = "," says so"""
UNNAMED = "has no heading; its columns are named column 1, column 2 and so on"
DIALECTS: dict[str, tuple[str, str, str]] = {
    "commas": (columns(",", repr, "time [s],position [rad]"), "position", ""),
    "spaces": (columns("  ", repr, "time [s]   position [rad]"), "position", ""),
    "tabs": (columns("\t", repr, "time\tposition"), "position", ""),
    "semicolons at the ends of lines too": (columns(";", lambda v: f"{v!r}", "time;position;").replace("\n", ";\n").replace(";;", ";"), "position", ""),
    "semicolons and decimal commas": (columns(";", comma, "time;position"), "position", COMMAS),
    "spaces and decimal commas": (columns(" ", comma, "time position"), "position", COMMAS),
    "tabs and decimal commas": (columns("\t", comma, "time\tposition"), "position", COMMAS),
    "no heading": (columns(",", repr), "column 2", UNNAMED),
    "no heading, spaces": (columns(" ", repr), "column 2", UNNAMED),
    "units in the line below": (columns(",", repr, "time,position\ns,rad"), "position", ""),
    "commas in the heading": (columns(";", repr, "time [s];position, left [rad]"), "position, left", ""),
}  # fmt: skip


@pytest.mark.parametrize("what", DIALECTS)
def test_text_is_read_however_its_columns_are_separated(tmp_path: Path, what: str) -> None:
    text, name, note = DIALECTS[what]
    (tmp_path / "log.txt").write_text(text)
    log = read_log(tmp_path / "log.txt")
    assert log.time.tolist() == TIME.tolist()
    assert {n: c.values.tolist() for n, c in log.channels.items()} == {name: ANGLE.tolist()}
    assert log.notes == ((note,) if note else ())


def test_the_heading_that_numpy_writes_is_read(tmp_path: Path) -> None:
    path = tmp_path / "log.dat"
    np.savetxt(path, np.stack([TIME, ANGLE], axis=1), header="mass = 0.5\ntime [s] position [rad]", fmt="%.17g")
    log = read_log(path)
    assert log.time.tolist() == TIME.tolist()
    assert log.values("position").tolist() == ANGLE.tolist()
    assert log.channels["position"].unit == "rad" and log.header == {"mass": 0.5}
    assert log.notes == ("its heading is the comment above the values: time, position",)


def test_a_comma_that_the_task_declares_needs_no_doubt(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("time;x\n0;1,500\n1;2,250\n")
    log = read_log(path, decimal=",")
    assert log.values("x").tolist() == [1.5, 2.25] and log.notes == ()
    assert "line 2: '1,500' in column x is not a number; write all numbers" in refused(lambda: read_log(path, decimal="."))
    path.write_text("time;x\n0;1,500\n1;0,5\n")  # no number has a nought before thousands
    assert read_log(path).values("x").tolist() == [1.5, 0.5]
    path.write_text("# mass = 0.5\n# kp: 8\n% rig name = left one\ntime,x\n0,1\n1,2\n")
    assert read_log(path).header == {"mass": 0.5, "kp": 8.0, "rig_name": "left one"}


@pytest.mark.parametrize("separator", [",", ";", " "])
@pytest.mark.parametrize("zone", ["Z", "+02:00", ""])
def test_time_stamps_are_seconds_from_the_first(tmp_path: Path, separator: str, zone: str) -> None:
    """To the nanosecond, beyond a midnight; with the sign of the day between date and time or a blank."""
    late = np.round(1e9 * TIME).astype("m8[ns]") + np.datetime64("2024-02-28T23:59:59.123456789")
    texts = [f"{str(t).replace('T', 'T' if zone else ' ')}{zone}" for t in late]
    rows = [f"{t}{separator}{x!r}" for t, x in zip(texts, ANGLE.tolist(), strict=True)]
    (tmp_path / "log.csv").write_text("\n".join([f"time{separator}position", *rows]))
    log = read_log(tmp_path / "log.csv")
    assert log.time == pytest.approx(TIME, abs=1e-12)
    assert log.values("position").tolist() == ANGLE.tolist()
    assert len(log.notes) == (0 if zone else 1) and all("have no zone" in note for note in log.notes)
    # A change of the zone is no step of the time.
    (tmp_path / "log.csv").write_text("time,x\n2024-10-27T02:59:59.5+02:00,1\n2024-10-27T02:00:00+01:00,2\n2024-10-27T01:00:00.5Z,3\n")
    assert read_log(tmp_path / "log.csv").time.tolist() == [0.0, 0.5, 1.0]


def test_dates_and_other_sheets_of_a_workbook(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    from datetime import datetime, timedelta

    book = openpyxl.Workbook()
    book.active.title = "empty"
    sheet, rest = book.create_sheet("run"), book.create_sheet("remarks")
    rest.append(["nothing"])
    for row in (["when", "position"], [], *([datetime(2024, 5, 1) + timedelta(seconds=k / 10), k] for k in range(20))):
        sheet.append(row)
    sheet["B7"] = None
    book.save(tmp_path / "log.xlsx")
    log = read_log(tmp_path / "log.xlsx")
    assert log.time == pytest.approx(np.arange(20) / 10, abs=1e-6)
    assert np.flatnonzero(np.isnan(log.values("position"))).tolist() == [4]
    assert log.notes[-1] == "sheet run is read; left out are empty, remarks"


@pytest.mark.parametrize(("heading", "channels"), [
    ("time [s],pos (5),pos (3)", {"pos (5)": "", "pos (3)": ""}),
    ("time [s],load (5),speed (rpm)", {"load (5)": "", "speed": "rpm"}),
    ("time (s),joint[0],joint[1]", {"joint[0]": "", "joint[1]": ""}),
    ("time (s),efficiency [1],pos (deg)", {"efficiency": "1", "pos": "deg"}),
    ("time [s],pos (left),pos (right)", {"pos (left)": "", "pos (right)": ""}),
    ("time [s],pos,pos (left)", {"pos": "", "pos (left)": ""}),
    ("t,cell (-2.5),raw (counts)", {"cell (-2.5)": "", "raw": "counts"}),
])  # fmt: skip
def test_a_number_in_brackets_belongs_to_the_name_of_a_column(tmp_path: Path, heading: str, channels: dict[str, str]) -> None:
    path = tmp_path / "log.csv"
    path.write_text(f"{heading}\n0,1,2\n1,3,4\n2,5,6\n")
    log = read_log(path)
    assert {name: c.unit for name, c in log.channels.items()} == channels
    assert [c.values.tolist() for c in log.channels.values()] == [[1.0, 3.0, 5.0], [2.0, 4.0, 6.0]]


def log_of(time: np.ndarray = TIME, header: dict[str, Any] | None = None, **channels: np.ndarray) -> Log:
    values = {"position": ANGLE, "goal": ANGLE} | channels
    return Log("log.json", time, {name: Channel(np.asarray(x, float)) for name, x in values.items()}, header or {})


def changed(values: np.ndarray, place: Any, to: Any) -> np.ndarray:
    out = values.copy()
    out[place] = to
    return out


SCREENED: dict[str, tuple[Log, str]] = {
    "glitch": (log_of(position=changed(ANGLE, 50, 9.0)), "residuals of 1 glitch of position, the first at 0.5 s"),
    "many glitches": (log_of(position=changed(ANGLE, slice(5, 195, 10), 9.0)), "residuals of 19 glitches of position, the first at 0.05 s"),
    "repeated time": (log_of(changed(TIME, 50, TIME[49])), "dropped 1 sample with the time stamp of the sample before"),
    "time goes back": (log_of(changed(TIME, 50, 0.2)), "dropped 1 sample whose time goes back"),
    "time is not a number": (log_of(changed(TIME, 50, np.nan)), "dropped 1 sample without a time"),
    "coarse clock": (log_of(np.floor(TIME / 0.04 + 1e-9) * 0.04), "the clock moves in steps of 0.04 s with 4.0 samples each"),
    "pause": (log_of(np.where(TIME > 1.0, TIME + 0.5, TIME)), "1 pause in the samples, the longest of 0.51 s"),
    "values missing": (
        log_of(position=changed(ANGLE, slice(20, 25), np.nan)),
        "the residuals of 5 samples in which position is not a number are left out; inputs keep these samples",
    ),
    "stall": (
        log_of(
            position=np.where((TIME > 0.5) & (TIME < 1.0), ANGLE[51], ANGLE), goal=np.where((TIME > 0.5) & (TIME < 1.0), ANGLE[51], ANGLE)
        ),
        "no channel changes",
    ),
    "saturation": (log_of(position=np.clip(np.sin(20 * TIME), -0.6, 0.6)), "it may saturate"),
    "contradiction": (log_of(header={"vin": 7.4}, volts=np.full(200, 6.1)), "the header says vin = 7.4, the channel volts is 6.1"),
    "slow channel": (log_of(position=np.floor(TIME / 0.15)), "position changes only"),
    "constant": (log_of(position=np.full(200, 0.3)), "position stays at 0.3 all through"),
    "constant with gaps": (log_of(position=changed(np.full(200, 0.3), slice(50, 55), np.nan)), "position stays at 0.3 all through"),
}


@pytest.mark.parametrize("what", SCREENED)
def test_what_is_wrong_with_a_log_is_listed(what: str) -> None:
    log, note = SCREENED[what]
    out = screened(log, ["position"], ["goal"], {"vin": "volts"})
    assert any(note in text for text in out.notes), out.notes
    assert np.all(np.diff(out.time) > 0.0)
    assert what != "coarse clock" or out.time == pytest.approx(TIME, abs=1e-9)  # its samples are spread evenly


def test_a_good_log_is_left_as_it_is() -> None:
    out = screened(log_of(header={"vin": 7.4}, volts=np.full(200, 7.4)), ["position"], ["goal"], {"vin": "volts"})
    assert out.notes == () and len(out.time) == 200
    refused(lambda: find_logs(["*.json"], Path()), "logs.files")


REFUSED: dict[str, tuple[Log, str]] = {
    "clock stands": (log_of(np.zeros(200)), "the clock stood still"),
    "no number at all": (log_of(position=np.full(200, np.nan)), "has no number in any sample"),
    "mostly missing": (log_of(position=changed(ANGLE, slice(0, 150), np.nan)), "no number in 75% of the samples"),
    "time in disorder": (log_of(np.random.default_rng(0).permutation(TIME)), "goes back at sample"),
    "too short": (log_of(TIME[:5], position=ANGLE[:5], goal=ANGLE[:5]), "5 samples; 10 at least"),
    "channel missing": (Log("log.json", TIME, {"positoin": Channel(ANGLE), "goal": Channel(ANGLE)}), "did you mean positoin"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_a_log_that_cannot_be_used_is_refused_in_one_line(what: str) -> None:
    log, text = REFUSED[what]
    assert refused(lambda: screened(log, ["position"], ["goal"]), match=text).startswith("log.json: ")


FILES: dict[str, tuple[str, bytes | str, str]] = {
    "cut off": ("a.json", '{"entries": [{"timestamp": 0.0, "posi', "is not JSON"),
    "no entries": ("b.json", "{}", "has no list of entries"),
    "empty entries": ("c.json", '{"entries": []}', "is empty"),
    "entry without a channel": ("d.json", '{"entries": [{"timestamp": 0, "x": 1}, {"timestamp": 1}]}', r"entries\[1\] lacks x"),
    "text for a number": ("e.json", '{"entries": [{"timestamp": 0, "x": 1}, {"timestamp": 1, "x": "fast"}]}', "is not a number"),
    "cut line": ("g.csv", "time,x\n0,1\n1\n", "line 3: has 1 values for 2 columns"),
    "word in a column": ("h.csv", "time,x\n0,1\n1,fast\n", "'fast' in column x is not a number"),
    "column twice": ("i.csv", "time,x,x\n0,1,1\n1,2,2\n", "twice"),
    "unit of the time": ("j.csv", "time [fortnight],x\n0,1\n1,2\n", "the unit 'fortnight' of the time"),
    "decimal commas and points": ("o.csv", "time;x\n0,1;1\n1.2;2\n", "line 3: '1.2' in column time is not a number; write all numbers with decimal points"),
    "commas between columns and before decimals": ("q.csv", "time,x\n0,1,1,5\n0,2,2,5\n", "line 2: has 4 values for 2 columns"),
    "one column": ("r.csv", "time\n0\n1\n", "has one column; a log needs the time and one channel at least"),
    "a comma that may be one between thousands": (
        "s.csv",
        "time;x\n0;1,500\n1;2,250\n",
        "line 2: '1,500' may have a decimal comma, or one between thousands; give logs.decimal = \",\"",
    ),
    "time stamps with and without a zone": (
        "t.csv",
        "time,x\n2024-05-01T12:00:00Z,1\n2024-05-01T12:00:01,2\n",
        "line 3: some time stamps have a zone and others have none",
    ),
    "time stamps and numbers": ("u.csv", "time,x\n2024-05-01T12:00:00Z,1\n1,2\n", "has time stamps and numbers"),
    "time stamps in a column that is not the time": (
        "v.csv",
        "x,when\n1,2024-05-01T12:00:00Z\n2,2024-05-01T12:00:01Z\n",
        "in column when is not a number; if it is the time, name the column with logs.time",
    ),
    "two columns of one quantity": ("x.csv", "time [s],pos (deg),pos (rad)\n0,1,2\n1,3,4\n2,5,6\n", "has the column 'pos' twice"),
    "no such date": ("w.csv", "time,x\n2024-02-30T12:00:00Z,1\n2024-05-01T12:00:01Z,2\n", "line 2: .* is not a number"),
    "too long a cell": ("p.csv", "time,x\n0,1\n1," + "1" * 200_000, r"line 3: cannot be read \(field larger"),
    "not text": ("k.csv", b"\xff\xfe\x00\x01", "is not UTF-8"),
    "not MATLAB": ("l.mat", b"something else", "is not a MATLAB file"),
    "not Parquet": ("m.parquet", b"something else", "is not a Parquet file"),
    "unknown ending": ("n.xyz", "", "logs end in"),
}  # fmt: skip


@pytest.mark.parametrize("what", FILES)
def test_a_file_that_cannot_be_read_is_refused_in_one_line(what: str, tmp_path: Path) -> None:
    name, content, text = FILES[what]
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    assert refused(lambda: read_log(path), match=text).startswith(str(path))

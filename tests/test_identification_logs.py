"""Logs of all formats read alike; what is wrong with one is dropped and listed, or refused in one line."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from lostmotion.identification.logs import Channel, Log
from lostmotion.identification.prepare import channel_factor
from lostmotion.identification.readers import find_logs, read_log
from lostmotion.identification.screening import screened

TIME = np.arange(200) * 0.01
ANGLE = np.sin(3.0 * TIME)


def entries(**changes: Any) -> list[dict[str, Any]]:
    return [{"timestamp": float(t), "position": float(x)} for t, x in zip(TIME, ANGLE, strict=True)]


def written(directory: Path, name: str, write: Callable[[Path], Any]) -> Path:
    write(directory / name)
    return directory / name


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
        "run",
        "position",
        np.degrees(ANGLE),
        properties={"unit_string": "deg", "wf_increment": 0.01, "wf_start_offset": 0.0},
    )
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.RootObject({"mass": 0.5}), channel])


def as_mdf(path: Path) -> None:
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(np.degrees(ANGLE), TIME, unit="deg", name="position")])
        file.save(path)


def as_json(path: Path) -> None:
    path.write_text(json.dumps({"mass": 0.5, "entries": entries()}))


@pytest.mark.parametrize(
    ("name", "write", "headed"),
    [
        ("log.csv", as_csv, True),
        ("log5.mat", as_mat5, True),
        ("log73.mat", as_mat73, True),
        ("log.parquet", as_parquet, True),
        ("log.tdms", as_tdms, True),
        ("log.mf4", as_mdf, False),
        ("log.json", as_json, True),
    ],
)
def test_every_format_gives_the_same_log(tmp_path: Path, name: str, write: Callable[[Path], Any], headed: bool) -> None:
    log = read_log(written(tmp_path, name, write))
    assert log.time == pytest.approx(TIME, abs=1e-9)
    channel = log.channels["position"]
    assert channel.values * channel_factor("", channel.unit, "rad", name) == pytest.approx(ANGLE, abs=1e-9)
    if headed:
        assert log.header["mass"] == 0.5


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
    assert set(log.channels) == {
        "servo/state.joint.position[0]",
        "servo/state.joint.position[1]",
        "servo/state.enabled",
        "servo/goal.position",
    }
    assert log.values("servo/state.joint.position[1]") == pytest.approx(-ANGLE)
    goal = log.values("servo/goal.position")
    assert goal[:197] == pytest.approx(2.0 * TIME[:197], abs=1e-9)  # straight lines up to the last message
    assert log.header == {"mass": 0.5, "unit": "left"}
    assert any("servo/goal" in note for note in log.notes)
    assert read_log(path, time="/servo/goal").time == pytest.approx(TIME[::4], abs=1e-9)
    with pytest.raises(lm.InputError, match="has no topic servo/stat; its topics are servo/state, servo/goal"):
        read_log(path, time="servo/stat")


def test_an_mcap_file_that_is_neither_in_json_nor_of_ros_is_refused_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    as_mcap(path, "protobuf")
    with pytest.raises(
        lm.InputError, match=r"has no topic in JSON or of ROS \(protobuf\); record in one of these"
    ) as refused:
        read_log(path)
    assert "\n" not in str(refused.value)
    as_mcap(path)
    for content in (path.read_bytes()[:-300], path.read_bytes()[:300], b"something else"):
        path.write_bytes(content)
        with pytest.raises(lm.InputError, match="is not an MCAP file that mcap reads") as refused:
            read_log(path)
        assert "\n" not in str(refused.value)


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
    encoding, definition, name = [
        ("ros1", ROS1, "servo_msgs/Joint"),
        ("cdr", ROS2, "servo_msgs/msg/Joint"),
    ][ros - 1]
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
    assert {
        "servo/state.position[0]",
        "servo/state.position[1]",
        "servo/state.enabled",
        "servo/state.header.stamp.sec",
    } <= set(log.channels)
    assert log.values("servo/state.position[1]").tolist() == (-ANGLE).tolist()
    assert log.time == pytest.approx(TIME + 1e-9 * (JITTER - JITTER[0]), abs=1e-9)
    assert read_log(path, time="/servo/state.header.stamp").time == pytest.approx(TIME, abs=1e-9)
    assert any("lists of more than 100 numbers are left out: servo/state.image" in note for note in log.notes)


@pytest.mark.parametrize(
    ("name", "content"), [("log.bag", b"something else"), ("log.db3", b"something else"), ("log.bag", b"")]
)
def test_a_file_that_is_no_bag_is_refused_in_one_line(tmp_path: Path, name: str, content: bytes) -> None:
    pytest.importorskip("rosbags")
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(lm.InputError, match="is not a bag that rosbags reads") as refused:
        read_log(path)
    assert "\n" not in str(refused.value)


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
        with pytest.raises(lm.InputError, match=said) as refused:
            read_log(path)
        assert "\n" not in str(refused.value)


def test_stamps_that_messages_do_not_carry_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    as_mcap(path)
    with pytest.raises(lm.InputError, match=r"message 1 has no header.stamp .* give logs.time = 'servo/goal'"):
        read_log(path, time="/servo/goal.header.stamp")


@pytest.mark.parametrize(
    ("heading", "channels"),
    [
        ("time [s],pos (5),pos (3)", {"pos (5)": "", "pos (3)": ""}),
        ("time [s],load (5),speed (rpm)", {"load (5)": "", "speed": "rpm"}),
        ("time (s),joint[0],joint[1]", {"joint[0]": "", "joint[1]": ""}),
        ("time (s),efficiency [1],pos (deg)", {"efficiency": "1", "pos": "deg"}),
        ("time [s],pos (left),pos (right)", {"pos (left)": "", "pos (right)": ""}),
        ("time [s],pos,pos (left)", {"pos": "", "pos (left)": ""}),
        ("t,cell (-2.5),raw (counts)", {"cell (-2.5)": "", "raw": "counts"}),
    ],
)
def test_a_number_in_brackets_belongs_to_the_name_of_a_column(
    tmp_path: Path, heading: str, channels: dict[str, str]
) -> None:
    path = tmp_path / "log.csv"
    path.write_text(f"{heading}\n0,1,2\n1,3,4\n2,5,6\n")
    log = read_log(path)
    assert {name: c.unit for name, c in log.channels.items()} == channels
    assert [c.values.tolist() for c in log.channels.values()] == [[1.0, 3.0, 5.0], [2.0, 4.0, 6.0]]


def test_two_columns_of_one_quantity_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("time [s],pos (deg),pos (rad)\n0,1,2\n1,3,4\n2,5,6\n")
    with pytest.raises(lm.InputError, match="has the column 'pos' twice"):
        read_log(path)


def test_a_pattern_that_names_no_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(lm.InputError, match="names no log"):
        find_logs(["*.json"], tmp_path)


def log_of(time: np.ndarray = TIME, header: dict[str, Any] | None = None, **channels: np.ndarray) -> Log:
    values = {"position": ANGLE, "goal": ANGLE} | channels
    return Log("log.json", time, {name: Channel(np.asarray(x, float)) for name, x in values.items()}, header or {})


def changed(values: np.ndarray, place: Any, to: Any) -> np.ndarray:
    out = values.copy()
    out[place] = to
    return out


SCREENED: dict[str, tuple[Log, str]] = {
    "glitch": (log_of(position=changed(ANGLE, 50, 9.0)), "dropped 1 glitch of position, the first at 0.5 s"),
    "many glitches": (
        log_of(position=changed(ANGLE, slice(5, 195, 10), 9.0)),
        "dropped 19 glitches of position, the first at 0.05 s",
    ),
    "repeated time": (
        log_of(changed(TIME, 50, TIME[49])),
        "dropped 1 samples with the time stamp of the sample before",
    ),
    "time goes back": (log_of(changed(TIME, 50, 0.2)), "dropped 1 samples whose time goes back"),
    "time is no number": (log_of(changed(TIME, 50, np.nan)), "dropped 1 samples without a time"),
    "coarse clock": (
        log_of(np.floor(TIME / 0.04 + 1e-9) * 0.04),
        "the clock moves in steps of 0.04 s with 4.0 samples each",
    ),
    "pause": (log_of(np.where(TIME > 1.0, TIME + 0.5, TIME)), "1 pauses in the samples, the longest of 0.51 s"),
    "values missing": (
        log_of(position=changed(ANGLE, slice(20, 25), np.nan)),
        "dropped 5 samples in which position is no number",
    ),
    "stall": (
        log_of(
            position=np.where((TIME > 0.5) & (TIME < 1.0), ANGLE[51], ANGLE),
            goal=np.where((TIME > 0.5) & (TIME < 1.0), ANGLE[51], ANGLE),
        ),
        "no channel changes",
    ),
    "saturation": (log_of(position=np.clip(np.sin(20 * TIME), -0.6, 0.6)), "it may saturate"),
    "contradiction": (
        log_of(header={"vin": 7.4}, volts=np.full(200, 6.1)),
        "the header says vin = 7.4, the channel volts is 6.1",
    ),
    "slow channel": (log_of(position=np.floor(TIME / 0.15)), "position changes only"),
    "constant": (log_of(position=np.full(200, 0.3)), "position stays at 0.3 all through"),
}


@pytest.mark.parametrize("what", SCREENED)
def test_what_is_wrong_with_a_log_is_listed(what: str) -> None:
    log, note = SCREENED[what]
    out = screened(log, ["position"], ["goal"], {"vin": "volts"})
    assert any(note in text for text in out.notes), out.notes
    assert np.all(np.diff(out.time) > 0.0)


def test_a_good_log_is_left_as_it_is() -> None:
    log = log_of(header={"vin": 7.4}, volts=np.full(200, 7.4))
    out = screened(log, ["position"], ["goal"], {"vin": "volts"})
    assert out.notes == () and len(out.time) == 200


def test_samples_of_a_coarse_clock_are_spread_evenly() -> None:
    out = screened(log_of(np.floor(TIME / 0.04 + 1e-9) * 0.04), ["position"], ["goal"])
    assert out.time == pytest.approx(TIME, abs=1e-9)


REFUSED: dict[str, tuple[Log, str]] = {
    "clock stands": (log_of(np.zeros(200)), "the clock stood still"),
    "no number at all": (log_of(position=np.full(200, np.nan)), "has no number in any sample"),
    "mostly missing": (log_of(position=changed(ANGLE, slice(0, 150), np.nan)), "no number in 75% of the samples"),
    "time in disorder": (log_of(np.random.default_rng(0).permutation(TIME)), "goes back at sample"),
    "too short": (log_of(TIME[:5], position=ANGLE[:5], goal=ANGLE[:5]), "5 samples; 10 at least"),
    "channel missing": (
        Log("log.json", TIME, {"positoin": Channel(ANGLE), "goal": Channel(ANGLE)}),
        "did you mean positoin",
    ),
}


@pytest.mark.parametrize("what", REFUSED)
def test_a_log_that_cannot_be_used_is_refused_in_one_line(what: str) -> None:
    log, text = REFUSED[what]
    with pytest.raises(lm.InputError, match=text) as refused:
        screened(log, ["position"], ["goal"])
    assert str(refused.value).startswith("log.json: ") and "\n" not in str(refused.value)


FILES: dict[str, tuple[str, bytes | str, str]] = {
    "cut off": ("a.json", '{"entries": [{"timestamp": 0.0, "posi', "is not JSON"),
    "no entries": ("b.json", "{}", "has no list entries"),
    "empty entries": ("c.json", '{"entries": []}', "is empty"),
    "entry without a channel": (
        "d.json",
        '{"entries": [{"timestamp": 0, "x": 1}, {"timestamp": 1}]}',
        r"entries\[1\] lacks x",
    ),
    "text for a number": (
        "e.json",
        '{"entries": [{"timestamp": 0, "x": 1}, {"timestamp": 1, "x": "fast"}]}',
        "is no number",
    ),
    "no heading": ("f.csv", "0,1\n1,2\n2,3\n", "has no heading"),
    "cut line": ("g.csv", "time,x\n0,1\n1\n", "line 3: has 1 values for 2 columns"),
    "word in a column": ("h.csv", "time,x\n0,1\n1,fast\n", "'fast' in column x is no number"),
    "column twice": ("i.csv", "time,x,x\n0,1,1\n1,2,2\n", "twice"),
    "unit of the time": ("j.csv", "time [fortnight],x\n0,1\n1,2\n", "the unit 'fortnight' of the time"),
    "decimal comma": (
        "o.csv",
        "time;x\n0,1;1\n1,2;2\n",
        "line 2: '0,1' in column time is no number; write decimal points",
    ),
    "too long a cell": ("p.csv", "time,x\n0,1\n1," + "1" * 200_000, r"line 3: cannot be read \(field larger"),
    "not text": ("k.csv", b"\xff\xfe\x00\x01", "is not UTF-8"),
    "not MATLAB": ("l.mat", b"something else", "is not a MATLAB file"),
    "not Parquet": ("m.parquet", b"something else", "is not a Parquet file"),
    "unknown ending": ("n.xyz", "", "logs end in"),
}


@pytest.mark.parametrize("what", FILES)
def test_a_file_that_cannot_be_read_is_refused_in_one_line(what: str, tmp_path: Path) -> None:
    name, content, text = FILES[what]
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(lm.InputError, match=text) as refused:
        read_log(path)
    assert str(refused.value).startswith(str(path)) and "\n" not in str(refused.value)

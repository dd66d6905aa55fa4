"""Files from somebody else: none runs code, reads other files, or takes more memory than the limit."""

import gc
import io
import json
import os
import pickle
import sqlite3
import struct
import subprocess
import sys
import tracemalloc
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import lostmotion as lm
import test_identification_logs as logs
from lostmotion.cli import app
from lostmotion.identification.readers import servo_json_logs, spreadsheet_logs, text_logs
from lostmotion.identification.readers.channel_conversions import conversion_of
from lostmotion.identification.readers.log_files import READERS, read_log
from lostmotion.inputs.memory_limits import memory_limit, size_of

TIME = np.arange(200) * 0.01


def refused(path: Path, match: str) -> None:
    with pytest.raises(lm.InputError, match=match) as caught:
        read_log(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.fixture
def small_limit(monkeypatch: pytest.MonkeyPatch) -> int:
    """A limit that files of a test can exceed quickly."""
    monkeypatch.setenv("LOSTMOTION_MEMORY", "2 MB")
    return 2_000_000


# --- no code ---
class Command:
    """Touches a file where it is unpickled."""

    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> Any:
        return os.mkdir, (str(self.mark),)


@pytest.mark.parametrize("ending", READERS)
def test_no_importer_unpickles(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"log{ending}"
    path.write_bytes(pickle.dumps(Command(tmp_path / "mark")))
    refused(path, "is not|has no")
    assert not (tmp_path / "mark").exists()


RAW = np.arange(200).astype("u2")


def as_mdf(path: Path, conversion: Any, *, master: Any = None, compression: int = 0) -> Path:
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(RAW, TIME, unit="rad", name="position", conversion=conversion)])
        if master is not None:
            file.groups[0].channels[0].conversion = asammdf.blocks.v4_blocks.ChannelConversion(conversion_type=3, formula=master)
        file.save(path, compression=compression)
    return path


@pytest.fixture
def no_evaluation(monkeypatch: pytest.MonkeyPatch) -> None:
    """The evaluators that asammdf would use."""
    blocks = pytest.importorskip("asammdf.blocks.v4_blocks")

    def evaluate(*_: Any, **__: Any) -> None:
        raise AssertionError("a formula of a file was evaluated")

    for name in ("evaluate", "lambdify", "symbols"):
        monkeypatch.setattr(blocks, name, evaluate)


@pytest.mark.usefixtures("no_evaluation")
@pytest.mark.parametrize(("formula", "values"), [
    ("2*X1 + 3", 2.0 * RAW + 3.0),
    ("X/4", RAW / 4.0),
    ("sqrt(X)/3 - pi", np.sqrt(np.arange(200.0)) / 3.0 - np.pi),
    ("pow(X, 2) - X**2 + 1e-3*X", 1e-3 * RAW),
    ("-log(X + 1) + 2*log10(X + 1)", (2.0 / np.log(10.0) - 1.0) * np.log1p(np.arange(200.0))),
    ("5", np.full(200, 5.0)),
])  # fmt: skip
def test_algebraic_conversions_are_read_by_a_grammar(tmp_path: Path, formula: str, values: np.ndarray) -> None:
    log = read_log(as_mdf(tmp_path / "log.mf4", {"formula": formula}))
    assert log.channels["position"].values == pytest.approx(values, rel=1e-12, abs=1e-12)
    assert log.channels["position"].unit == "rad"
    if formula == "X/4":  # a time is read by the same grammar
        assert read_log(as_mdf(tmp_path / "other.mf4", None, master=formula)).time == pytest.approx(TIME / 4.0, abs=1e-12)


OTHER = ["__import__('os').mkdir('mark')", "X.__class__", "(lambda: X)()", "[X for X in (1,)]", "X if X else 0", "X[0]", "'a'", "sin(X=1)"]
OTHER += ["sqrt(X, X)", "exec", "(Y := X)", "X; X", "", ")(", "X^2", "1e400*X + 1" + "0" * 400]
OTHER += ["(" * 90 + "X" + ")" * 90 + "+1" * 200, "-" * 150 + "X", "+".join(["X"] * 2000)]


@pytest.mark.usefixtures("no_evaluation")
def test_a_formula_with_anything_else_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    refused(as_mdf(tmp_path / "log.mf4", {"formula": OTHER[0]}), "channel position: its conversion")
    for formula in OTHER:
        with pytest.raises(ValueError):
            conversion_of(formula)
    assert not (tmp_path / "mark").exists()


def test_a_formula_inside_a_table_and_powers_without_end_are_refused(tmp_path: Path) -> None:
    blocks = pytest.importorskip("asammdf.blocks.v4_blocks")
    inner = blocks.ChannelConversion(conversion_type=3, formula="X*2")
    table = {"val_0": 1, "text_0": inner, "val_1": 2, "text_1": b"abc", "default_addr": b"x", "default": b""}
    refused(as_mdf(tmp_path / "log.mf4", table), "is a table with a formula in it")
    with pytest.raises(ValueError, match="has no value"):
        conversion_of("9**9**9**9")


ROS = "=" * 80 + "\nMSG: b_msgs/"
DEFINITIONS = {
    "code in a name": ('a"""\nimport os\nos.mkdir("mark")\n"""/msg/A', "ros2msg", "float64 x\n"),
    "code in a field": ("a_msgs/msg/A", "ros2msg", "float64 x; import os; os.mkdir('mark')\n"),
    "fixed list of words": ("a_msgs/msg/A", "ros2msg", "string[1000000000] x\n"),
    "list without data": ("a_msgs/A", "ros1msg", f"b_msgs/E[] x\nfloat64 y\n{ROS}E\n"),
    "list of lists without data": ("a_msgs/A", "ros1msg", f"b_msgs/F[] x\n{ROS}F\nb_msgs/E e\n{ROS}E\n"),
    "list of no entries": ("a_msgs/A", "ros1msg", f"b_msgs/F[] x\n{ROS}F\nfloat64[0] e\n"),
    "itself": ("a_msgs/msg/A", "ros2msg", "A x\nfloat64 y\n"),
    "shift": ("a_msgs/msg/A", "ros2idl", "module a_msgs { module msg { const long N = 1 << 9999999999; }; };"),
    "product": ("a_msgs/msg/A", "ros2idl", "module a_msgs { module msg { const long N = 100000*100000; struct A { string x[N]; }; }; };"),
    "length": ("a_msgs/msg/A", "ros2msg", "float64 x\n" + "# a\n" * 100_000),
}


def as_mcap(path: Path, messages: list[bytes], *, kind: tuple[str, str, str] | None = None, **options: Any) -> Path:
    mcap = pytest.importorskip("mcap.writer")
    name, encoding, text = kind or ("s", "jsonschema", "{}")
    with path.open("wb") as stream:
        writer = mcap.Writer(stream, **options)
        writer.start()
        schema = writer.register_schema(name, encoding, text.encode())
        topic = writer.register_channel("/a", {"ros1msg": "ros1", "jsonschema": "json"}.get(encoding, "cdr"), schema)
        for k, message in enumerate(messages):
            writer.add_message(topic, 1_000_000 * k, message, 1_000_000 * k)
        writer.finish()
    return path


@pytest.mark.parametrize("what", DEFINITIONS)
def test_definitions_of_messages_run_no_code_and_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, what: str) -> None:
    pytest.importorskip("rosbags")
    monkeypatch.chdir(tmp_path)
    message = b"\xff\xff\xff\xff" + bytes(64)
    refused(as_mcap(tmp_path / "log.mcap", [message], kind=DEFINITIONS[what]), "the definition of .* cannot be read")
    assert not (tmp_path / "mark").exists()


BAG = """
CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT);
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT, offered_qos_profiles TEXT,
                    type_description_hash TEXT);
"""
COMPUTED = {
    "view": "CREATE VIEW messages AS WITH RECURSIVE c(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM c) "
    "SELECT n AS id, 1 AS topic_id, n AS timestamp, zeroblob(100000000) AS data FROM c;",
    "column": "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, "
    "data BLOB GENERATED ALWAYS AS (zeroblob(1000000000)));",
}


@pytest.mark.parametrize("what", COMPUTED)
def test_a_bag_that_computes_its_rows_is_refused(tmp_path: Path, what: str) -> None:
    pytest.importorskip("rosbags")
    database = sqlite3.connect(tmp_path / "log.db3")
    database.executescript(BAG + COMPUTED[what])
    database.close()
    refused(tmp_path / "log.db3", "its database computes messages")


# --- no other files ---
def as_mat73(path: Path, what: str) -> Path:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w", userblock_size=512) as file:
        file["t"], file["position"] = TIME[None], TIME[None]
        fill(file, what)
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file")
    return path


def fill(file: Any, what: str) -> None:
    """A dataset x in an HDF5 file: data of other files, 149 GiB of which nothing is there, a chunk longer than it announces."""
    import h5py

    if what == "virtual":
        layout = h5py.VirtualLayout((200,), "f8")
        layout[:] = h5py.VirtualSource("/other.h5", "x", (200,))
        file.create_virtual_dataset("x", layout)
    elif what == "linked":
        file["x"] = h5py.ExternalLink("/other.h5", "/x")
    elif what == "external":
        file.create_dataset("x", (1, 20), "u1", external=[("/etc/hostname", 0, 20)])
    elif what == "announced":
        file.create_dataset("x", (20_000_000_000,), "f8", chunks=(1000,))
    elif what == "overlong":
        data = file.create_dataset("x", (1000,), "f8", chunks=(1000,), compression="gzip")
        data.id.write_direct_chunk((0,), zlib.compress(bytes(10_000_000)))


HARMFUL = {"virtual": ": x: refers to data", "linked": ": x: is a link", "external": ": x: refers to data"}
HARMFUL |= {"announced": "needs 160 GB", "overlong": "has a chunk that is longer than it announces"}


@pytest.mark.parametrize("what", HARMFUL)
def test_harmful_hdf5_files_are_refused_as_logs_and_as_files_of_matlab(tmp_path: Path, what: str) -> None:
    refused(as_mat73(tmp_path / "log.mat", what), HARMFUL[what])
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["t"] = TIME
        fill(file.create_group("run"), what)
    refused(tmp_path / "log.h5", HARMFUL[what].replace(": x", "x"))


# --- no more memory than the limit ---
def as_parquet(path: Path, groups: int) -> Path:
    """Two columns of a million zeros in each group."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pa.table({"time": np.zeros(1_000_000), "x": np.zeros(1_000_000)})
    with pq.ParquetWriter(path, table.schema) as writer:
        for _ in range(groups):
            writer.write_table(table)
    return path


READS = """
import resource, sys, time
import lostmotion as lm, h5py, pyarrow.parquet, numpy, xarray, h5netcdf
from lostmotion.identification.readers.log_files import read_log
def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
lm.load("paper-2dof-nl-small")
before = peak()
for read, path in zip((read_log, read_log, lm.open_result, lm.load, lm.studies.load_study), sys.argv[1:]):
    try:
        read(path)
    except lm.InputError as error:
        print(error)
print(peak() - before)
"""


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="needs a file without end")
def test_files_without_end_are_refused_before_they_take_memory(tmp_path: Path) -> None:
    huge = as_mat73(tmp_path / "huge.mat", "announced")
    parquet = as_parquet(tmp_path / "long.parquet", 50)
    result = tmp_path / "result.nc"
    result.write_bytes(huge.read_bytes()[512:])
    assert max(huge.stat().st_size, result.stat().st_size) < 10_000
    assert parquet.stat().st_size < 1_000_000  # and 800 MB once it is read
    done = subprocess.run(
        [sys.executable, "-c", READS, huge, parquet, result, "/dev/zero", "/dev/zero"], capture_output=True, text=True, check=True
    )
    *lines, peak = done.stdout.splitlines()
    assert [line.split(": ")[0] for line in lines] == [str(huge), str(parquet), str(result), "/dev/zero", "/dev/zero"]
    assert all("needs 160 GB of memory" in lines[k] for k in (0, 2))
    assert "needs 1.6 GB of memory" in lines[1]  # as stored, and as the channels of a log
    assert "does not end after" in lines[3]
    assert float(peak) < 200.0  # [MiB]


TAKE_A_FILE = ("drive check", "response", "rig", "servo", "track", "fmu -o x.fmu", "study", "study show", "select", "identify", "catalogue")
WITHOUT_END = ["run /dev/zero", "run based.toml", "run record.toml", "run series.toml", "study resume /dev/zero"]
WITHOUT_END += [f"{command} zero.toml" for command in TAKE_A_FILE]
CALLS = """
import resource, sys
import lostmotion.cli.entry as entry, lostmotion as lm, scipy, pyarrow.parquet, matplotlib.pyplot, jinja2
lm.load("paper-2dof-nl-small")
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
for words in sys.argv[1:]:
    sys.argv = ["lostmotion", *words.split()]
    try:
        entry.main()
    except SystemExit as end:
        print(end.code)
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024)
"""


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="needs a file without end")
def test_every_command_refuses_a_file_without_end(tmp_path: Path) -> None:
    (tmp_path / "zero.toml").symlink_to("/dev/zero")
    (tmp_path / "based.toml").write_text('base = "/dev/zero"')
    (tmp_path / "record.toml").write_text('base = "paper-2dof-nl-small"\n[gearbox]\nfrom = "zero.toml"')
    (tmp_path / "series.toml").write_text('base = "paper-2dof-nl-small"\n[command]\nsamples = { file = "/dev/zero" }')
    done = subprocess.run([sys.executable, "-c", CALLS, *WITHOUT_END], cwd=tmp_path, capture_output=True, text=True, check=True)
    *codes, peak = done.stdout.split()
    assert codes == ["1"] * len(WITHOUT_END)
    lines = done.stderr.splitlines()
    assert len(lines) == len(WITHOUT_END)
    for words, line in zip(WITHOUT_END, lines, strict=True):
        assert "zero" in line, (words, line)
    assert float(peak) < 300.0  # [MiB]


@pytest.mark.usefixtures("small_limit")
def test_compressed_elements_of_matlab_files_are_bounded(tmp_path: Path) -> None:
    import scipy.io

    scipy.io.savemat(tmp_path / "log.mat", {"t": np.zeros(1_000_000)}, do_compression=True)
    assert (tmp_path / "log.mat").stat().st_size < 20_000
    refused(tmp_path / "log.mat", "needs 2.* MB of memory or more, and the limit is 2 MB")


def patched(path: Path, old: bytes, new: bytes) -> Path:
    content = path.read_bytes()
    assert old in content
    path.write_bytes(content.replace(old, new, 1))
    return path


def test_announced_dimensions_of_matlab_files_are_bounded(tmp_path: Path) -> None:
    import scipy.io

    path = tmp_path / "log.mat"
    scipy.io.savemat(path, {"t": TIME, "position": TIME})
    refused(patched(path, struct.pack("<ii", 1, 200), struct.pack("<ii", 2_000_000_000, 200)), "needs 3.2 TB")
    cells = np.array([[1, 2, "three"]], dtype=object)
    scipy.io.savemat(path, {"t": TIME, "position": TIME, "cells": cells})
    log = read_log(patched(path, struct.pack("<ii", 1, 3), struct.pack("<ii", 2_000_000_000, 3)))
    assert set(log.channels) == {"position"}  # cells are not read


def block_links(content: bytes, at: int) -> tuple[int, ...]:
    return struct.unpack_from(f"<{struct.unpack_from('<Q', content, at + 16)[0]}Q", content, at + 24)


@pytest.mark.parametrize("level", [1, 2, 3])
def test_lists_of_an_mdf_file_that_lead_back_into_themselves_are_refused(tmp_path: Path, level: int) -> None:
    path = as_mdf(tmp_path / "log.mf4", None)
    content = bytearray(path.read_bytes())
    at = 64
    for place in (0, 1, 1)[:level]:  # header -> data group -> channel group -> channel
        at = block_links(content, at)[place]
    struct.pack_into("<Q", content, at + 24, at)
    path.write_bytes(content)
    refused(path, "a list of blocks leads back into itself")


def test_a_damaged_mdf_file_prints_nothing(tmp_path: Path) -> None:
    path = as_mdf(tmp_path / "log.mf4", None)
    path.write_bytes(path.read_bytes()[:64] + bytes(8) + path.read_bytes()[72:])  # the header block has no name
    with pytest.MonkeyPatch.context() as patch:
        seen: list[Any] = []
        patch.setattr(sys, "unraisablehook", seen.append)
        refused(path, "is not an MDF file")
        gc.collect()
    assert seen == []


def test_announced_lengths_of_mdf_files_are_bounded(tmp_path: Path) -> None:
    path = as_mdf(tmp_path / "log.mf4", None)
    content = bytearray(path.read_bytes())
    group = block_links(content, block_links(content, 64)[0])[1]
    struct.pack_into("<Q", content, group + 24 + 6 * 8 + 8, 20_000_000_000)  # cycles
    path.write_bytes(content)
    refused(path, "needs .* TB of memory")
    content = bytearray(as_mdf(path, None, compression=1).read_bytes()) if path.unlink() is None else bytearray()
    block = content.index(b"##DZ")
    length = block + 24 + 8 * struct.unpack_from("<Q", content, block + 16)[0] + 8
    for announced_length, match in ((10, "is longer than it announces"), (1 << 40, "needs 1.1 TB")):
        struct.pack_into("<Q", content, length, announced_length)
        path.write_bytes(content)
        refused(path, match)


@pytest.mark.usefixtures("small_limit")
@pytest.mark.parametrize("method", ["LZ4", "ZSTD"])
def test_chunks_of_mcap_files_are_bounded(tmp_path: Path, method: str) -> None:
    mcap = pytest.importorskip("mcap.writer")
    message = b'{"x":' + b" " * 3_000_000 + b"1}"
    path = as_mcap(tmp_path / "log.mcap", [message], compression=getattr(mcap.CompressionType, method), chunk_size=10**9)
    refused(path, "needs 3 MB of memory")
    size = next(
        n for n in range(3_000_000, 3_010_000) if struct.pack("<Q", n) in path.read_bytes()
    )  # of the chunk, beside which the file says little
    path.write_bytes(path.read_bytes().replace(struct.pack("<Q", size), struct.pack("<Q", 1000)))
    refused(path, "is not an MCAP file")


@pytest.mark.usefixtures("small_limit")
def test_messages_of_mcap_files_are_bounded(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    keys = [json.dumps({f"k{k}": 1}).encode() for k in range(1000)]  # each is a channel of all messages
    refused(as_mcap(path, keys), "channels: needs 2.* MB of memory")
    refused(as_mcap(path, [b"{}"] * 3000), "needs 2 MB of memory")
    refused(as_mcap(path, [b'{"a":' * 60 + b"1" + b"}" * 60]), "more than 50 lists and objects")
    refused(as_mcap(path, [b"[" * 100_000]), "a message cannot be read")


@pytest.mark.usefixtures("small_limit")
@pytest.mark.parametrize("method", ["BZ2", "LZ4"])
def test_chunks_of_bags_are_bounded(tmp_path: Path, method: str) -> None:
    pytest.importorskip("rosbags")
    from rosbags import rosbag1
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg("uint8[] x\n", "a_msgs/msg/A"))
    writer = rosbag1.Writer(tmp_path / "log.bag")
    writer.set_compression(getattr(rosbag1.Writer.CompressionFormat, method))
    with writer:
        topic = writer.add_connection("/a", "a_msgs/msg/A", typestore=store)
        writer.write(topic, 0, struct.pack("<I", 5_000_000) + bytes(5_000_000))
    refused(tmp_path / "log.bag", "needs 2 MB of memory or more")


@pytest.mark.usefixtures("small_limit")
@pytest.mark.parametrize("ending", [".csv", ".json", ".tdms"])
def test_logs_longer_than_the_limit_are_refused(tmp_path: Path, ending: str) -> None:
    (tmp_path / f"log{ending}").write_bytes(bytes(3_000_000))
    refused(tmp_path / f"log{ending}", "needs .* MB of memory")
    (tmp_path / "device.csv").symlink_to("/dev/zero")
    refused(tmp_path / "device.csv", "is a device or a pipe")


TEXTS = {
    "short lines": ("log.csv", "t,a\n", "1,2\n", ""),
    "empty values": ("log.csv", "t," + ",".join(f"c{k}" for k in range(100)) + "\n", "1" + "," * 100 + "\n", ""),
    "usual lines": ("log.csv", "t,a,b\n", "1.234567,12.345678,-0.123456\n", ""),
    "wide characters": ("log.csv", "# \U0001f600\nt,a\n", "1,2\n", ""),
    "entries": ("log.json", '{"entries": [{"timestamp": 0, "p": 1}', ', {"timestamp": 1.25, "p": 2.125}', "]}"),
    "empty lists": ("log.json", '{"x": [0', ",[]", '], "entries": [{"timestamp": 1, "p": 2}]}'),
    "empty objects": ("log.json", '{"x": [0', ",{}", '], "entries": [{"timestamp": 1, "p": 2}]}'),
    "objects": ("log.json", '{"x": [0', ',{"a": 1}', '], "entries": [{"timestamp": 1, "p": 2}]}'),
}


def memory_of(path: Path) -> tuple[float, float]:
    """Memory for a log: estimated before it is read, and taken."""
    estimates: list[float] = []
    with pytest.MonkeyPatch.context() as patch:
        for module in (text_logs, servo_json_logs, spreadsheet_logs):
            patch.setattr(module, "check_memory", lambda needed, *_: estimates.append(needed))
        read_log(path)
    gc.collect()
    tracemalloc.start(1)
    try:
        read_log(path)
        return max(estimates), tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("what", TEXTS)
def test_the_memory_of_logs_in_text_is_not_underestimated(tmp_path: Path, what: str) -> None:
    name, begin, line, end = TEXTS[what]
    path = tmp_path / name
    path.write_text(begin + line * (60_000 // len(line)) + end)
    read_log(path)  # what is imported and kept once
    estimated, taken = memory_of(path)
    assert 0.95 * taken < estimated < 4.0 * taken


def packed(path: Path, content: dict[str, bytes], method: int = zipfile.ZIP_DEFLATED) -> Path:
    with zipfile.ZipFile(path, "w", method) as archive:
        for name, data in content.items():
            archive.writestr(name, data)
    return path


def described(shape: tuple[int, ...], kind: Any = "<f8") -> bytes:
    """An NPY file that announces an array, without its values."""
    stream = io.BytesIO()
    about = {"descr": kind, "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(stream, about)
    return stream.getvalue()


def test_arrays_of_objects_are_not_unpickled(tmp_path: Path) -> None:
    command = np.array([Command(tmp_path / "mark"), 1.0], dtype=object)
    np.save(tmp_path / "log.npy", command, allow_pickle=True)
    np.savez(tmp_path / "log.npz", t=TIME, x=command)
    refused(tmp_path / "log.npy", "holds Python objects, which are not read; save arrays of numbers")
    refused(tmp_path / "log.npz", ": x: holds Python objects")
    assert not (tmp_path / "mark").exists()
    np.load(tmp_path / "log.npy", allow_pickle=True)
    assert (tmp_path / "mark").exists()  # so it would have been


def test_announced_sizes_of_numpy_files_are_bounded(tmp_path: Path, small_limit: int) -> None:
    (tmp_path / "log.npy").write_bytes(described((20_000_000_000,)))
    refused(tmp_path / "log.npy", "needs 160 GB of memory or more")
    (tmp_path / "log.npy").write_bytes(described((200,)) + bytes(800))
    refused(tmp_path / "log.npy", "announces 1600 bytes and holds 800; it may have been cut off")
    refused(packed(tmp_path / "log.npz", {"t.npy": described((20_000_000_000,))}), ": t: needs 160 GB")
    bomb = described((1_000_000,)) + bytes(8_000_000)
    assert packed(tmp_path / "log.npz", {"t.npy": bomb}).stat().st_size < 20_000
    refused(tmp_path / "log.npz", "needs 8 MB of memory or more, and the limit is 2 MB")
    refused(packed(tmp_path / "log.npz", {"t.npy": described((-1,))}), "is not a file of NumPy")
    (tmp_path / "log.npy").write_bytes(b"\x93NUMPY\x01\x00\xff\xff" + b"(" * 65535)
    refused(tmp_path / "log.npy", "is not a file of NumPy")


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
@pytest.mark.parametrize("ending", [".npz", ".xlsx"])
def test_members_that_are_decompressed_without_a_bound_are_refused(tmp_path: Path, ending: str, method: int) -> None:
    pytest.importorskip("openpyxl")
    refused(packed(tmp_path / f"log{ending}", {"t.npy": bytes(1000)}, method), "by a method other than deflate")


@pytest.mark.parametrize("ending", [".npz", ".xlsx", ".h5"])
def test_archives_that_are_cut_off_are_refused(tmp_path: Path, ending: str) -> None:
    write = {".npz": logs.as_npz, ".xlsx": logs.as_xlsx, ".h5": logs.as_hdf5}[ending]
    write(tmp_path / f"log{ending}")
    content = (tmp_path / f"log{ending}").read_bytes()
    for share in (0.3, 0.6, 0.95):
        (tmp_path / f"log{ending}").write_bytes(content[: round(share * len(content))])
        refused(tmp_path / f"log{ending}", "is not an? (file of NumPy|XLSX file|HDF5 file)")


def test_groups_of_hdf5_within_themselves_have_an_end(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["t"], file["x"] = TIME, TIME
        for k in range(300):
            file[f"again {k}"] = file["/"]
    assert set(read_log(tmp_path / "log.h5").channels) == {"x"}
    with h5py.File(tmp_path / "log.h5", "w") as file:
        file["a/b/c/d/e/f/g/t"] = TIME
    refused(tmp_path / "log.h5", "a/b/c/d/e/f: is a group within too many others")


SHEET = (
    b'<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>'
    b'<row r="1"><c r="A1" t="inlineStr"><is><t>time</t></is></c><c r="B1" t="inlineStr"><is><t>x</t></is></c></row>%s'
    b"</sheetData></worksheet>"
)
ENTITIES = b'<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>'


def as_workbook(path: Path, changes: dict[str, bytes]) -> Path:
    """A workbook of openpyxl with some of its parts in another way."""
    logs.as_xlsx(path)
    with zipfile.ZipFile(path) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()} | changes
    if "xl/sharedStrings.xml" in parts:
        kind = b"application/vnd.openxmlformats-officedocument.spreadsheetml.sharedStrings+xml"
        listed = b'<Override PartName="/xl/sharedStrings.xml" ContentType="%s"/></Types>' % kind
        types = parts["[Content_Types].xml"]
        parts["[Content_Types].xml"] = types if kind in types else types.replace(b"</Types>", listed)
    return packed(path, parts)


def row(number: int, cells: bytes) -> bytes:
    return b'<row r="%d">%s</row>' % (number, cells)


WORKBOOKS: dict[str, tuple[str, bytes, str]] = {
    "many rows": ("xl/worksheets/sheet1.xml", SHEET % (b"<row/>" * 100_000), "needs .* of memory"),
    "a row of many cells": ("xl/worksheets/sheet1.xml", SHEET % row(2, b"<c/>" * 10_000), "needs .* of memory"),
    "rows of far cells": ("xl/worksheets/sheet1.xml", SHEET % b"".join(row(k, b'<c r="XFD%d"/>' % k) for k in range(2, 100)), "needs .* of memory"),
    "elements outside of rows": ("xl/worksheets/sheet1.xml", SHEET % (b"<x/>" * 100_000), "needs .* of memory"),
    "styles": ("xl/styles.xml", b"<styleSheet>" + b"<xf/>" * 100_000 + b"</styleSheet>", "needs .* of memory"),
    "texts": ("xl/sharedStrings.xml", b"<sst>" + b"<si/>" * 100_000 + b"</sst>", "needs .* of memory"),
    "zeros": ("xl/media/picture.png", bytes(8_000_000), "needs 8.* MB of memory"),
    "entities": ("xl/worksheets/sheet1.xml", ENTITIES + SHEET % b"", "defines entities"),
    "entities of the workbook": ("xl/workbook.xml", ENTITIES + b"<workbook/>", "defines entities"),
    "a row far away": ("xl/worksheets/sheet1.xml", SHEET % row(10**12, b""), "row 1000000000000 comes after row 1"),
    "rows back": ("xl/worksheets/sheet1.xml", SHEET % (row(5, b"") + row(3, b"")), "row 3 comes after row 5"),
    "a column far away": ("xl/worksheets/sheet1.xml", SHEET % row(2, b'<c r="ZZZ2"/>'), "has a cell ZZZ"),
    "a formula": (
        "xl/worksheets/sheet1.xml",
        SHEET % row(2, b'<c r="A2"><v>1</v></c><c r="B2"><f>WEBSERVICE("http://x")</f><v/></c>'),
        "row 2 has a formula without its value; open the file in a spreadsheet program, and save it",
    ),
    "an error": (
        "xl/worksheets/sheet1.xml",
        SHEET % row(2, b'<c r="A2"><v>1</v></c><c r="B2" t="e"><f>1/0</f><v>#DIV/0!</v></c>'),
        "row 2: '#DIV/0!' in column x is not a number",
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", WORKBOOKS)
def test_workbooks_are_bounded_and_hold_values(tmp_path: Path, small_limit: int, what: str) -> None:
    pytest.importorskip("openpyxl")
    name, content, said = WORKBOOKS[what]
    refused(as_workbook(tmp_path / "log.xlsx", {name: content}), said)


def test_values_of_formulas_are_read(tmp_path: Path) -> None:
    pytest.importorskip("openpyxl")
    rows = b"".join(row(k, b'<c r="A%d"><v>%d</v></c><c r="B%d"><f>2*A%d</f><v>%d</v></c>' % (k, k, k, k, 2 * k)) for k in range(2, 9))
    log = read_log(as_workbook(tmp_path / "log.xlsx", {"xl/worksheets/sheet1.xml": SHEET % rows}))
    assert log.time.tolist() == list(range(2, 9)) and log.values("x").tolist() == list(range(4, 18, 2))


MAIN = b"http://schemas.openxmlformats.org/spreadsheetml/2006/main"
MEASURED: dict[str, tuple[str, bytes]] = {
    "cells": ("xl/worksheets/sheet1.xml", SHEET % b"".join(row(k, b'<c r="A%d"><v>%d</v></c><c r="B%d"><v>1.5</v></c>' % (k, k, k)) for k in range(2, 3_000))),
    "rows with a height": ("xl/worksheets/sheet1.xml", SHEET % b"".join(b'<row ht="15" r="%d"><c><v>%d</v></c><c><v>1</v></c></row>' % (k, k) for k in range(2, 6_000))),
    "styles": ("xl/styles.xml", b'<styleSheet xmlns="%s"><cellXfs>%s</cellXfs></styleSheet>' % (MAIN, b"<xf/>" * 4_000)),
    "texts": ("xl/sharedStrings.xml", b'<sst xmlns="%s">%s</sst>' % (MAIN, b"".join(b"<si><t>%d</t></si>" % k for k in range(10_000)))),
}  # fmt: skip


@pytest.mark.parametrize("what", MEASURED)
def test_the_memory_of_workbooks_is_not_underestimated(tmp_path: Path, what: str) -> None:
    pytest.importorskip("openpyxl")
    name, content = MEASURED[what]
    estimated, taken = memory_of(as_workbook(tmp_path / "log.xlsx", {name: content}))
    assert taken < estimated < 10.0 * taken


def test_a_log_that_is_cut_off_says_so(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    nptdms = pytest.importorskip("nptdms")
    path = tmp_path / "log.tdms"
    with nptdms.TdmsWriter(path) as writer:
        channel = nptdms.ChannelObject("run", "position", TIME, properties={"wf_increment": 0.01, "wf_start_offset": 0.0})
        writer.write_segment([channel])
    assert read_log(path).notes == ()
    path.write_bytes(path.read_bytes()[:-80])
    log = read_log(path)
    assert len(log.time) == len(TIME) - 10
    assert "may be cut off or damaged" in log.notes[0]
    assert capfd.readouterr() == ("", "")


def test_channels_of_tdms_files_are_bounded(tmp_path: Path, small_limit: int) -> None:
    nptdms = pytest.importorskip("nptdms")
    count = small_limit // 12
    with nptdms.TdmsWriter(tmp_path / "log.tdms") as writer:
        writer.write_segment([nptdms.ChannelObject("run", "position", np.zeros(count))])
    refused(tmp_path / "log.tdms", "needs 2.67 MB of memory")


def test_the_limit_is_an_option_and_a_variable(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert [size_of(text) for text in ("5", "2 GB", "1.5kB", "3 MiB", "2G")] == [5, 2 * 10**9, 1500, 3 * 2**20, 2 * 10**9]
    assert memory_limit() == 2**29
    monkeypatch.setenv("LOSTMOTION_MEMORY", "much")
    with pytest.raises(lm.InputError, match="LOSTMOTION_MEMORY: 'much' is no size of memory, such as 2 GB"):
        memory_limit()
    monkeypatch.setenv("LOSTMOTION_MEMORY", "")  # restored afterwards
    path = tmp_path / "s.toml"
    path.write_text("# " + "x" * 1000)
    called = CliRunner().invoke(app, ["--memory", "1 kB", "run", str(path)])
    assert isinstance(called.exception, lm.InputError)
    assert "needs 16 kB of memory or more, and the limit is 1 kB" in str(called.exception)
    assert CliRunner().invoke(app, ["--memory", "much", "scenarios"]).exit_code == 2

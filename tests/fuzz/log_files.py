"""Log files of all formats that identification reads, damaged."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import test_identification_logs as logs
from fuzz import mutation
from fuzz.verdict import Failure, refused
from lostmotion.identification.readers.log_files import read_log

WRITERS: dict[str, Callable[[Path], Any]] = {
    "log.csv": logs.as_csv,
    "log.txt": logs.as_csv,
    "five.mat": logs.as_mat5,
    "seven.mat": logs.as_mat73,
    "log.parquet": logs.as_parquet,
    "log.tdms": logs.as_tdms,
    "log.mf4": logs.as_mdf,
    "log.npz": logs.as_npz,
    "log.npy": logs.as_npy,
    "log.h5": logs.as_hdf5,
    "log.xlsx": logs.as_xlsx,
    "log.json": logs.as_json,
    "log.mcap": logs.as_mcap,
    "ros1.mcap": lambda path: logs.as_ros_mcap(path, 1),
    "ros2.mcap": lambda path: logs.as_ros_mcap(path, 2),
    "log.bag": logs.as_bag,
    "log.db3": lambda path: logs.as_bag(path.with_suffix("")).rename(path),
}


@cache
def whole(name: str) -> bytes:
    """A log as its writer makes it."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / name
        WRITERS[name](path)
        return path.read_bytes()


def case(random: Random, folder: Path) -> None:
    """Channels of one length, or a refusal that names the file."""
    name, other = random.choice(list(WRITERS)), random.choice(list(WRITERS))
    (folder / name).write_bytes(mutation.content(random, whole(name), whole(other), changes=6))
    time = random.choice(("", "", "", "time", "t", "/servo/state", "/servo/state.header.stamp", "none"))
    log = refused(lambda: read_log(name, time=time), [name])
    if log is None:
        return
    for channel, values in log.channels.items():
        if np.shape(values.values) != np.shape(log.time) or np.asarray(values.values).dtype.kind not in "biuf":
            raise Failure(f"channel {channel}: {np.shape(values.values)} values at {np.shape(log.time)} instants")

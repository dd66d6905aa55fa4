"""Logs in TDMS files, read by npTDMS."""

from pathlib import Path
from typing import Any

import numpy as np

from ...errors import need
from ...inputs.memory_limits import check_memory
from .log import Log, as_refusal, warnings_of
from .log_tables import TIME_NAMES
from .named_arrays import log_of_variables

WAVEFORM = {"wf_increment", "wf_start_offset"}  # properties of a TDMS channel that holds its time


def read_tdms_log(path: Path, time: str) -> Log:
    """Read a TDMS file by npTDMS: the channels of all groups; their time is a channel, or increments of the waveform.

    Channels without numbers are not read.
    """
    need("nptdms", "Reading TDMS files", "identify")
    import nptdms

    variables: dict[str, Any] = {}
    units = {}
    with (
        as_refusal("is not a TDMS file"),
        warnings_of("nptdms") as said,
        path.open("rb") as stream,
        nptdms.TdmsFile.open(stream) as file,
    ):
        channels = [c for group in file.groups() for c in group.channels() if c.dtype.kind in "biuf"]
        check_memory(sum(float(len(c)) * (c.dtype.itemsize + 8.0) for c in channels))
        for channel in channels:
            variables[channel.name] = np.asarray(channel[:])
            units[channel.name] = str(channel.properties.get("unit_string", ""))
            if channel.properties.keys() >= WAVEFORM and not any(name in variables for name in TIME_NAMES):
                variables["time"] = channel.time_track()
        properties = file.properties
    variables |= {name: value for name, value in properties.items() if isinstance(value, int | float | str)}
    log = log_of_variables(variables, units, time)
    return log.noted(f"may be cut off or damaged; npTDMS reports: {said[0]}") if said else log

"""Log files: which reader takes which, and the list of them that a pattern names."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from ...errors import InputError, prefixed
from ...inputs.argument_checks import checked
from ...inputs.memory_limits import check_memory
from .log import Log
from .matlab_and_hdf5_logs import read_hdf5_log, read_mat_log
from .mdf_logs import read_mdf_log
from .numpy_logs import read_numpy_log
from .parquet_logs import read_parquet_log
from .robot_logs import read_mcap_log, read_ros_bag
from .servo_json_logs import read_servo_json
from .spreadsheet_logs import read_xlsx_log
from .tdms_logs import read_tdms_log
from .text_logs import read_text_log

READERS: dict[str, Callable[..., Log]] = {
    ".json": read_servo_json,
    ".jsonl": read_servo_json,
    ".csv": read_text_log,
    ".txt": read_text_log,
    ".tsv": read_text_log,
    ".dat": read_text_log,
    ".xlsx": read_xlsx_log,
    ".npz": read_numpy_log,
    ".npy": read_numpy_log,
    ".mat": read_mat_log,
    ".h5": read_hdf5_log,
    ".hdf5": read_hdf5_log,
    ".parquet": read_parquet_log,
    ".mf4": read_mdf_log,
    ".tdms": read_tdms_log,
    ".mcap": read_mcap_log,
    ".bag": read_ros_bag,
    ".db3": read_ros_bag,
}


@checked
def read_log(path: str | Path, *, time: str = "", decimal: str = "") -> Log:
    """Read a log of any of the formats in ``docs/identification.md``, by the ending of its name.

    Parameters
    ----------
    path : str or Path
        File of the log.
    time : str
        Name of the channel of the time, if it is not found automatically. For an MCAP file or a bag: the topic, or
        ``TOPIC.header.stamp``.
    decimal : str
        Decimal separator in text, ``"."`` or ``","``. If empty, a comma is taken only if the text has no other reading, and the log
        has a note on it.

    Returns
    -------
    Log
        Channels with units, header and notes.

    Raises
    ------
    InputError
        The file cannot be read, or needs more memory than the limit. The message names the file and the remedy.
    MissingLibraryError
        The library of the format is not installed.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import lostmotion as lm
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder, "log.csv")
    ...     _ = path.write_text("time [s],angle [deg]\\n0.0,0\\n0.1,1\\n0.2,3\\n")
    ...     log = lm.identification.read_log(path)
    >>> [channel for channel in log.channels]
    ['angle']
    """
    path = Path(path)
    if decimal not in ("", ".", ","):
        raise InputError(f'argument decimal: {decimal!r} is neither "." nor ","; leave it out to have it found')
    reader = READERS.get(path.suffix.lower())
    with prefixed(path):
        if path.is_dir():
            raise InputError("is a directory; name the logs in it")
        if not path.exists():
            raise InputError("there is no such file; check the name")
        if not path.is_file():
            raise InputError("is a device or a pipe; name a file")
        check_memory(path.stat().st_size)
        if reader is None:
            raise InputError(f"is no log by its ending; logs end in {', '.join(READERS)}")
        try:
            log = reader(path, time, decimal) if reader is read_text_log else reader(path, time)
        except OSError as error:
            raise InputError(f"cannot be read: {error.strerror}") from None
    return replace(log, name=path.name)


def find_logs(patterns: Sequence[str], directory: Path, source: str = "") -> list[Path]:
    """Files by names or patterns (``*``, ``**``) relative to a directory; a directory stands for all logs in it.

    source: where they come from, for the error.
    """
    found: list[Path] = []
    for pattern in patterns:
        path = directory / pattern
        if not path.is_dir() and any(c in pattern for c in "*?["):
            anchor = Path(path.anchor) if Path(pattern).is_absolute() else directory
            try:
                matched = sorted(anchor.glob(str(path.relative_to(anchor)) if anchor == Path(path.anchor) else pattern))
            except (ValueError, NotImplementedError) as error:
                raise InputError(
                    f"{pattern!r} is no pattern ({error}); write one such as logs/**/*.json", "logs.files"
                ) from None
        else:
            matched = [path]
        named = [p for m in matched for p in (_within(m) if m.is_dir() else [m] if m.is_file() else [])]
        if not named:
            remedy = f"the logs are not shipped: {source}" if source else "check the name"
            raise InputError(f"{pattern!r} names no log in {directory.resolve()}; {remedy}", "logs.files")
        found += named
    return list(dict.fromkeys(found))


def _within(directory: Path) -> list[Path]:
    return sorted(p for p in directory.iterdir() if p.suffix.lower() in READERS and p.is_file())

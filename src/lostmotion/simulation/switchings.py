"""The switchings of a run: a dataset of their own, which travels with the result as one of its attributes."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..errors import InputError
from ..inputs.arguments import checked

if TYPE_CHECKING:
    import xarray

CAUSES = dict(_core.causes())
"""what ended a regime, by its number"""

ATTRIBUTE = "switchings"
NAMES = tuple(_core.switching_columns())


def packed(table: Any) -> str:
    """The core's table of switchings as text, as an attribute can hold it: all bits of its numbers."""
    return _text(np.asarray(table, dtype="<f8"))


def packed_again(columns: Mapping[str, Any]) -> str:
    """The same from the columns of `switchings_of`."""
    return _text(np.stack([np.asarray(columns[name], dtype="<f8") for name in NAMES], axis=1))


def _text(rows: np.ndarray) -> str:
    return base64.b64encode(rows.tobytes()).decode()


@checked
def switchings_of(result: xarray.Dataset) -> xarray.Dataset:
    """The switchings of a run, one entry each along the dimension ``switching``.

    Parameters
    ----------
    result
        From `simulate` or `open_result`.

    Returns
    -------
    xarray.Dataset
        ``instant`` [s]; ``cause``, what ended the regime (its attributes name the flags); for each contact its mode before and
        after (``input_contact_before``, ...; 2: there is none); ``output_torque_before`` and ``output_torque_after`` [N·m],
        the left and right limit. Of a long run the first 100,000; ``switching_count`` of the result counts all.

    Raises
    ------
    InputError
        The dataset is no result of `simulate`.
    """
    import xarray as xr

    if ATTRIBUTE not in result.attrs:
        raise InputError(
            "this dataset has no switchings; give a result of simulate or open_result, attributes included"
        )
    rows = np.frombuffer(base64.b64decode(result.attrs[ATTRIBUTE]), dtype="<f8").reshape(-1, len(NAMES))
    variables = {}
    for name, values in zip(NAMES, rows.T, strict=True):
        own = values.copy() if name.startswith(("instant", "output")) else values.astype(np.int8)
        variables[name] = ("switching", own, _about(name))
    return xr.Dataset(variables)


def _about(name: str) -> dict[str, Any]:
    if name == "instant":
        return {"units": "s", "long_name": "instant of switching"}
    if name == "cause":
        meanings = " ".join(cause.replace(" ", "_") for cause in CAUSES.values())
        return {"long_name": "what ended the regime", "flag_values": list(CAUSES), "flag_meanings": meanings}
    what, _, when = name.rpartition("_")
    if what == "output_torque":
        return {"units": "N*m", "long_name": f"output torque, {'left' if when == 'before' else 'right'} limit"}
    return {"long_name": f"mode of the {what.replace('_', ' ')} {when} the switching; 2: there is none"}

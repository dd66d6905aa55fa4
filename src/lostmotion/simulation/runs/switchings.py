"""The switchings of a run: a dataset of their own, which travels with the result as one of its attributes."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core
from ...errors import InputError
from ...inputs.argument_checks import checked

if TYPE_CHECKING:
    import xarray

CAUSES = dict(_core.causes())  # what ended a regime, by its number

MESH_STEP = next(number for number, cause in CAUSES.items() if cause == "step of the mesh stiffness")
"""number of that cause"""

ATTRIBUTE = "switchings"
COLUMNS = "switching_columns"  # attribute of a result: the names of its columns, apart by blanks
TORQUES = ("output_torque_before", "output_torque_after")


def names_in(attributes: Mapping[str, Any]) -> tuple[str, ...]:
    """Names of the columns of the switchings of a result with these attributes."""
    if COLUMNS not in attributes:
        raise InputError("this result does not name the columns of its switchings; run it again")
    return tuple(str(attributes[COLUMNS]).split())


def packed(table: Any) -> str:
    """The core's table of switchings as text, as an attribute can hold it: all bits of its numbers."""
    return base64.b64encode(np.ascontiguousarray(table, dtype="<f8").tobytes()).decode()


def unpacked(attributes: Mapping[str, Any]) -> np.ndarray:
    """The table again: a row for each switching, a column for each of `names_in`."""
    table = np.frombuffer(base64.b64decode(attributes[ATTRIBUTE]), dtype="<f8")
    return table.reshape(-1, len(names_in(attributes)))


def columns_of(attributes: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Its columns by name: instants and torques, and of contacts and causes whole numbers."""
    numbers = ("instant", *TORQUES)
    return {
        name: values.copy() if name in numbers else values.astype(np.int8)
        for name, values in zip(names_in(attributes), unpacked(attributes).T, strict=True)
    }


def packed_again(columns: Mapping[str, Any], attributes: Mapping[str, Any]) -> str:
    """The same from the columns of `switchings_of`."""
    return packed(np.stack([np.asarray(columns[name], dtype="<f8") for name in names_in(attributes)], axis=1))


@checked
def switchings_of(result: xarray.Dataset) -> xarray.Dataset:
    """Return the switchings of a run, one entry each along the dimension ``switching``.

    Parameters
    ----------
    result : xarray.Dataset
        Result of `simulate` or `open_result`.

    Returns
    -------
    xarray.Dataset
        ``instant`` [s]; ``cause`` of the end of the regime (its attributes name the flags); for each contact its mode before and
        after (``input_contact_before`` and so on; 2: there is none); for a drive ``output_torque_before`` and ``output_torque_after``
        [N·m], the left and right limit. A long run has the first 100,000; ``switching_count`` of the result counts all.

    Raises
    ------
    InputError
        The dataset is no result of `simulate`.

    Examples
    --------
    >>> import lostmotion as lm
    >>> switchings = lm.switchings_of(lm.simulate(lm.load("step-to-standstill")))
    >>> switchings.sizes["switching"]
    85
    """
    import xarray as xr

    if ATTRIBUTE not in result.attrs:
        raise InputError(
            "this dataset has no switchings; give a result of simulate or open_result, attributes included"
        )
    columns = columns_of(result.attrs).items()
    return xr.Dataset({name: ("switching", values, _about(name)) for name, values in columns})


def _about(name: str) -> dict[str, Any]:
    if name == "instant":
        return {"units": "s", "long_name": "instant of switching"}
    if name == "cause":
        meanings = " ".join(cause.replace(" ", "_") for cause in CAUSES.values())
        return {"long_name": "what ended the regime", "flag_values": list(CAUSES), "flag_meanings": meanings}
    what, _, when = name.rpartition("_")
    if name in TORQUES:
        return {"units": "N*m", "long_name": f"output torque, {'left' if when == 'before' else 'right'} limit"}
    return {"long_name": f"mode of the {what.replace('_', ' ')} {when} the switching; 2: there is none"}

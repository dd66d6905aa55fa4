"""Formulas that measurement files carry for their channels: by the grammar of identification files, with ufuncs of NumPy."""

from collections.abc import Callable

import numpy as np

from ..task.file_formulas import Formula

NAMES = ("X", "X1")  # of the raw value
FUNCTIONS: dict[str, np.ufunc] = {
    "sqrt": np.sqrt,
    "exp": np.exp,
    "log": np.log,
    "ln": np.log,
    "log10": np.log10,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "sinh": np.sinh,
    "cosh": np.cosh,
    "tanh": np.tanh,
    "abs": np.abs,
    "pow": np.power,
}


def conversion_of(text: str) -> Callable[[np.ndarray], np.ndarray]:
    """Physical values by raw ones, of a formula such as ``0.01*X + 3``.

    text: numbers, ``X`` or ``X1`` for the raw value, ``+ - * / **``, brackets, `FUNCTIONS` (``log`` and ``ln`` to the
        base e) and ``pi``.

    Returns callable: takes an array of raw values of any type of numbers, and computes in double precision.
    """
    formula = Formula(text, FUNCTIONS)
    if other := sorted(formula.names.difference(NAMES)):
        raise ValueError(f"{text[:40]!r} names {other[0]}; the raw value is X")

    def convert(raw: np.ndarray) -> np.ndarray:
        values = np.asarray(raw, dtype=float)
        with np.errstate(all="ignore"):
            found = formula.value(dict.fromkeys(NAMES, values))
        if isinstance(found, str):
            raise ValueError(f"{text[:40]!r} is a text, not a number")
        return np.broadcast_to(np.asarray(found, dtype=float), values.shape)

    convert(np.array([1.0, 2.0]))  # shows what is not of arrays of numbers
    return convert

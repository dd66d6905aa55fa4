"""Formulas that measurement files carry for their channels, read by a grammar of their own and never run as Python."""

from __future__ import annotations

import ast
from collections.abc import Callable

import numpy as np

from ..inputs.operators import ARITHMETIC, syntax_tree

NAMES = ("X", "X1")  # of the raw value
CONSTANTS = {"pi": np.pi}
FUNCTIONS: dict[str, tuple[int, Callable[..., np.ndarray]]] = {
    "sqrt": (1, np.sqrt),
    "exp": (1, np.exp),
    "log": (1, np.log),
    "ln": (1, np.log),
    "log10": (1, np.log10),
    "sin": (1, np.sin),
    "cos": (1, np.cos),
    "tan": (1, np.tan),
    "asin": (1, np.arcsin),
    "acos": (1, np.arccos),
    "atan": (1, np.arctan),
    "sinh": (1, np.sinh),
    "cosh": (1, np.cosh),
    "tanh": (1, np.tanh),
    "abs": (1, np.abs),
    "pow": (2, np.power),
}

Course = Callable[[np.ndarray], np.ndarray | float]


def conversion_of(text: str) -> Callable[[np.ndarray], np.ndarray]:
    """Physical values by raw ones, of a formula such as ``0.01*X + 3``.

    Parameters
    ----------
    text
        Numbers, ``X`` or ``X1`` for the raw value, ``+ - * / **``, brackets, `FUNCTIONS` (``log`` and ``ln`` to the base e) and ``pi``.

    Returns
    -------
    callable
        Takes an array of raw values of any type of numbers, and computes in double precision.

    Raises
    ------
    ValueError
        The formula has something else in it.
    """
    course = _read(syntax_tree(text, "a formula"), text)

    def convert(raw: np.ndarray) -> np.ndarray:
        values = np.asarray(raw, dtype=float)
        with np.errstate(all="ignore"):
            return np.broadcast_to(np.asarray(course(values), dtype=float), values.shape)

    return convert


def _read(node: ast.expr, text: str) -> Course:
    match node:
        case ast.Constant(bool() | str() | bytes() | complex() | None):
            pass
        case ast.Constant(int() | float() as number):
            try:
                value = np.float64(number)
            except OverflowError:
                raise ValueError(f"{text[:40]!r} has a number that is too large") from None
            return lambda _: value
        case ast.Name(name) if name in NAMES:
            return lambda x: x
        case ast.Name(name) if name in CONSTANTS:
            return lambda _: np.float64(CONSTANTS[name])
        case ast.UnaryOp(ast.USub() | ast.UAdd() as sign, operand):
            inner = _read(operand, text)
            return (lambda x: -inner(x)) if isinstance(sign, ast.USub) else inner
        case ast.BinOp(left, operation, right) if type(operation) in ARITHMETIC:
            how = ARITHMETIC[type(operation)]
            a, b = _read(left, text), _read(right, text)
            return lambda x: how(a(x), b(x))
        case ast.BinOp(op=ast.BitXor()):
            raise ValueError(f"{text[:40]!r} has ^, which is a power or a bitwise operator; write pow(a, b)")
        case ast.Call(ast.Name(name), args, []) if name in FUNCTIONS and len(args) == FUNCTIONS[name][0]:
            function = FUNCTIONS[name][1]
            given = [_read(arg, text) for arg in args]
            return lambda x: function(*(one(x) for one in given))
    raise ValueError(f"{text[:40]!r} has something else in it than X, numbers, + - * / ** and {', '.join(FUNCTIONS)}")

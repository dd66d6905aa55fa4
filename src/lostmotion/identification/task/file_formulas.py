"""Formulas of identification files: arithmetic of parameters and of what is known of a log, by a grammar of their own."""

import ast
import math
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

from ...errors import InputError
from ...inputs.expression_trees import ARITHMETIC, COMPARISONS, syntax_tree
from ...inputs.refusal_messages import MAX_LISTED, did_you_mean, shortened, shown

Functions = Mapping[str, Callable[..., Any]]
FUNCTIONS: Functions = {
    "sqrt": math.sqrt,
    "exp": math.exp,
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "abs": abs,
    "min": min,
    "max": max,
}
CONSTANTS = {"pi": math.pi}
PARTS = (ast.Name, ast.Load, ast.BinOp, ast.UnaryOp, ast.USub, ast.UAdd, ast.Not, ast.Compare, ast.BoolOp, ast.boolop)

Values = Mapping[str, Any]


class Formula:
    """Arithmetic of named values: ``+ - * / **``, comparisons, ``and or not``, `FUNCTIONS` and `CONSTANTS`.

    The text is never run as Python.

    text: as written; a number is a constant.
    functions: functions that it may call; a NumPy ufunc takes its number of arguments.
    """

    def __init__(self, text: str | float, functions: Functions = FUNCTIONS) -> None:
        self.text = str(text)
        self._functions = functions
        self._shown = shortened(self.text, MAX_LISTED)
        self._tree = syntax_tree(self.text, "a formula")
        self.names = frozenset(
            node.id
            for node in ast.walk(self._tree)
            if isinstance(node, ast.Name) and node.id not in CONSTANTS and node.id not in functions
        )
        """all that it names"""
        for node in ast.walk(self._tree):
            self._refuse(node)

    def value(self, values: Values) -> Any:
        """The value for given values of the names. Raises ValueError: a name has no value, or the result is no finite number."""
        for name in sorted(self.names):
            if name not in values:
                meant = did_you_mean(name, values, f"known are {', '.join(sorted(values)) or 'none'}")
                raise ValueError(f"{name!r} in {self._shown!r} has no value; {meant}")
        try:
            found = self._value(self._tree, values)
        except (ArithmeticError, ValueError, TypeError) as error:
            raise ValueError(f"{self._shown!r} has no value ({error})") from None
        if isinstance(found, complex) or (isinstance(found, float) and not math.isfinite(found)):
            raise ValueError(f"{self._shown!r} has the value {found}, which is no finite number")
        return found

    def _refuse(self, node: ast.AST) -> None:
        if isinstance(node, (*PARTS, *ARITHMETIC, *COMPARISONS)) or (
            isinstance(node, ast.Constant) and isinstance(node.value, int | float | str)
        ):
            return
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
            function = self._functions.get(node.func.id)
            if function is not None and len(node.args) == getattr(function, "nin", len(node.args)):
                return
        raise ValueError(
            f"{self._shown!r} has something else in it than + - * / **, comparisons, and {', '.join(self._functions)}"
        )

    def _value(self, node: ast.expr, values: Values) -> Any:
        match node:
            case ast.Constant(value):
                return value
            case ast.Name(name):
                return CONSTANTS[name] if name in CONSTANTS else values[name]
            case ast.UnaryOp(op, inner):
                found = self._value(inner, values)
                return not found if isinstance(op, ast.Not) else -found if isinstance(op, ast.USub) else found
            case ast.BinOp(left, op, right):
                return ARITHMETIC[type(op)](_plain(self._value(left, values)), _plain(self._value(right, values)))
            case ast.BoolOp(op, parts):
                together = all if isinstance(op, ast.And) else any
                return together(self._value(part, values) for part in parts)
            case ast.Compare(left, ops, rights):
                terms = [self._value(left, values), *(self._value(right, values) for right in rights)]
                return all(COMPARISONS[type(op)](a, b) for op, a, b in zip(ops, terms, terms[1:], strict=False))
            case ast.Call(ast.Name(name), inner):
                return self._functions[name](*(self._value(part, values) for part in inner))
        raise ValueError(f"{shown(ast.dump(node))} is not part of a formula")


@cache
def formula(text: str) -> Formula:
    """Read once. Raises ValueError."""
    return Formula(text)


def names_in(value: object) -> frozenset[str]:
    """Names in a formula, or in the formulas of a list or a table; numbers and texts that are not formulas have none."""
    if isinstance(value, str):
        try:
            return formula(value).names
        except ValueError:
            return frozenset()
    if isinstance(value, Formula):
        return value.names
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else ()
    return frozenset().union(*map(names_in, inner))


def number(text: str | float, known: Mapping[str, Any], key: str) -> float:
    """The value of a formula."""
    if isinstance(text, int | float):
        return float(text)
    try:
        return float(formula(text).value(known))
    except ValueError as problem:
        raise InputError(problem, key) from None


def _plain(value: Any) -> Any:
    """A number in double precision: whole numbers have powers, and texts multiples, that no memory holds."""
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value

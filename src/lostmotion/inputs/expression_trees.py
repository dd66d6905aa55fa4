"""Expressions and formulas in files: their syntax trees, and the operators that they may use."""

import ast
import operator
import warnings
from collections.abc import Callable
from typing import Any

from .refusal_messages import MAX_LISTED, shortened

ARITHMETIC: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
COMPARISONS: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}
MAX_LENGTH = 2000  # characters
MAX_DEPTH = 100  # parts inside of parts, which functions that call themselves can walk


def syntax_tree(text: str, kind: str, remedy: str = "") -> ast.expr:
    """The syntax tree of an expression, not too large to be walked. The text is never run.

    kind: what it is in messages, such as ``"a formula"``.
    remedy: clause on what to do with one that is too long or nested too deeply.
    """
    remedy = f"; {remedy}" if remedy else ""
    if len(text) > MAX_LENGTH:
        raise ValueError(f"{text[:40]!r}... is longer than {MAX_LENGTH} characters{remedy}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of the parser, about text that is refused anyway
            tree = ast.parse(" ".join(text.split()), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        why = f" ({error.msg})" if isinstance(error, SyntaxError) else ""
        raise ValueError(f"{shortened(text, MAX_LISTED)!r} cannot be read as {kind}{why}") from None
    level: list[ast.expr] = [tree]
    for _ in range(MAX_DEPTH):
        level = [child for node in level for child in ast.iter_child_nodes(node) if isinstance(child, ast.expr)]
        if not level:
            return tree
    raise ValueError(f"{text[:40]!r}... is nested too deeply{remedy}")

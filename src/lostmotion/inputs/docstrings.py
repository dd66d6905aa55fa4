"""The docstrings of fields: below them in the source, or behind ``#:`` on their line."""

import ast
import inspect
import itertools
import sys
from functools import cache


def docstring_of(cls: type, field: str) -> str | None:
    """Text on a field where it was last annotated, in the class or the first of its bases."""
    owner = next((c for c in cls.__mro__ if field in vars(c).get("__annotations__", {})), None)
    if owner is None:
        return None
    return _docstrings(owner.__module__).get((owner.__qualname__, field))


@cache
def _docstrings(module: str) -> dict[tuple[str, str], str]:
    found: dict[tuple[str, str], str] = {}

    def visit(body: list[ast.stmt], path: str) -> None:
        for statement in body:
            if isinstance(statement, ast.FunctionDef):
                visit(statement.body, f"{path}{statement.name}.<locals>.")
            if not isinstance(statement, ast.ClassDef):
                continue
            qualified = f"{path}{statement.name}"
            for field, below in itertools.pairwise([*statement.body, ast.Pass()]):
                if not (isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)):
                    continue
                if comment := lines[(field.end_lineno or 0) - 1].partition("  #: ")[2]:
                    found[qualified, field.target.id] = comment
                elif isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant):
                    found[qualified, field.target.id] = inspect.cleandoc(str(below.value.value))
            visit(statement.body, f"{qualified}.")

    try:
        source = inspect.getsource(sys.modules[module])
    except (OSError, TypeError):  # of a notebook, or without sources
        return found
    lines = source.splitlines()
    visit(ast.parse(source).body, "")
    return found

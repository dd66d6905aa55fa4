"""Public names of a package, imported when they are first used, so that `import lostmotion` stays quick.

The file `__init__.pyi` of a package states its public names, one import a line. Type checkers read it, and so does this module.
"""

from __future__ import annotations

import importlib
import importlib.util
import re
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

_TOP = "lostmotion"
_LINE = re.compile(r"from (\.[\w.]*) import (\w+) as \2\n")

when_taken: list[Callable[[ModuleType], None]] = []
"""functions to call with each module from which a public name is taken"""


def homes_of(package: str) -> dict[str, str]:
    """Public names of a package, each with the absolute name of the module that defines it."""
    stub = Path(str(importlib.import_module(package).__file__)).with_suffix(".pyi").read_text(encoding="utf-8")
    return {name: importlib.util.resolve_name(home, package) for home, name in _LINE.findall(stub)}


def namespace(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """`__getattr__` and `__dir__` of a package whose public names are listed in its stub."""
    homes: dict[str, str] = {}

    def known() -> dict[str, str]:
        if not homes:
            homes.update(homes_of(package))
        return homes

    def get(name: str) -> Any:
        if name == "__all__":
            return [*known()]
        if name not in known():
            raise AttributeError(f"module {package!r} has no attribute {name!r}{_hint(package, name)}")
        value = _public(known()[name], name)
        setattr(sys.modules[package], name, value)
        return value

    def names() -> list[str]:
        return [*known()]

    return get, names


def _public(home: str, name: str) -> Any:
    if home == _TOP:  # a namespace
        return importlib.import_module(f"{_TOP}.{name}")
    module = importlib.import_module(home)
    for taken in when_taken:
        taken(module)
    return getattr(module, name)


def _hint(package: str, name: str) -> str:
    """The namespace that has a name which `lostmotion` itself lacks, as the end of a message."""
    spaces = [space for space, home in homes_of(_TOP).items() if home == _TOP and package == _TOP and name[0] != "_"]
    return next((f"; it is {_TOP}.{space}.{name}" for space in spaces if name in homes_of(f"{_TOP}.{space}")), "")

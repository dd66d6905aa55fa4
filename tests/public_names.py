"""Public names of the package, with the dotted path below `lostmotion` at which each is found."""

from types import ModuleType
from typing import Any

import lostmotion as lm

NAMESPACES = [name for name in lm.__all__ if isinstance(getattr(lm, name), ModuleType)]
FLAT = [name for name in lm.__all__ if name not in NAMESPACES]
PATHS = {name: name for name in FLAT} | {name: f"{space}.{name}" for space in NAMESPACES for name in getattr(lm, space).__all__}


def public(name: str) -> Any:
    """The value of a public name, from `lostmotion` or the namespace that has it."""
    value: Any = lm
    for part in PATHS[name].split("."):
        value = getattr(value, part)
    return value

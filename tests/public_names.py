"""Public names of the package, with the dotted path below `lostmotion` at which each is found."""

from types import ModuleType
from typing import Any

import lostmotion as lm

NAMESPACES = [name for name in lm.__all__ if isinstance(getattr(lm, name), ModuleType)]
FLAT = [name for name in lm.__all__ if name not in NAMESPACES]
PATHS = {name: name for name in FLAT}
for _space in NAMESPACES:
    for _name in getattr(lm, _space).__all__:  # a name of several namespaces has its namespace from the second on
        PATHS[f"{_space}.{_name}" if _name in PATHS else _name] = f"{_space}.{_name}"


def public(name: str) -> Any:
    """The value of a public name, from `lostmotion` or the namespace that has it."""
    value: Any = lm
    for part in PATHS[name].split("."):
        value = getattr(value, part)
    return value

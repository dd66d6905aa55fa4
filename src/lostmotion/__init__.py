"""Dynamics of geared servo drives: lost motion, sticking and load-dependent losses, solved exactly.

>>> import lostmotion as lm
>>> scenario = lm.load("scenarios/paper-2dof-nl-large.toml")      # doctest: +SKIP
>>> result = lm.simulate(scenario)                                # doctest: +SKIP

The names that most programs use are in `lostmotion` itself, the others in namespaces such as `lostmotion.servo`.
"""

from __future__ import annotations

from typing import Any

from .namespace import moved, namespace

_get, __dir__ = namespace(__name__)


def __getattr__(name: str) -> Any:
    return _get(name) if name.startswith("_") or name in __dir__() else moved(name)

"""The compiled core, in the build for the widest vectors that this processor has. All builds give the same bits."""

import os
import sys
from importlib import import_module
from importlib.util import find_spec

from ._instruction_set import builds
from .errors import InputError


def _build() -> str:
    """The environment variable LOSTMOTION_CORE names a build to take (to compare them)."""
    usable = [name for name in builds() if find_spec(f"._core_{name}", __package__)]
    wanted = os.environ.get("LOSTMOTION_CORE") or usable[0]
    if wanted not in usable:
        raise InputError(
            f"environment: LOSTMOTION_CORE = '{wanted}' is no build of the core here; take {', '.join(usable)}"
        )
    return f"_core_{wanted}"


sys.modules[__name__] = import_module(f".{_build()}", __package__)

"""The compiled core, in the build for the widest vectors that this processor has. All builds give the same bits."""

import os
import sys
from importlib import import_module
from importlib.util import find_spec

from ._instruction_set import supports_avx2

BUILDS = ("_core_avx2", "_core_any")


def _build() -> str:
    """LOSTMOTION_CORE=any takes the build for any processor (to compare the two)."""
    wide = os.environ.get("LOSTMOTION_CORE") != "any" and supports_avx2()
    return BUILDS[0] if wide and find_spec(f".{BUILDS[0]}", __package__) else BUILDS[1]


sys.modules[__name__] = import_module(f".{_build()}", __package__)

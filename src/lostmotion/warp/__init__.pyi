"""Thousands of drives on a graphics processor. It needs the library `warp-lang`: ``pip install "lostmotion[warp]"``."""

from .drives import Drives as Drives
from .joints import Joints as Joints
from .joints import attach as attach

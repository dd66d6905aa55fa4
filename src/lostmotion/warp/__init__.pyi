"""Thousands of drives on a graphics processor. It needs the library `warp-lang`: ``pip install "lostmotion[warp]"``."""

from .drives import Drives as Drives
from .mujoco_warp_joints import Joints as Joints
from .mujoco_warp_joints import attach as attach

"""Exact drives as actuators of MuJoCo. It needs the library `mujoco`: ``pip install "lostmotion[mujoco]"``."""

from ..namespace import namespace

__getattr__, __dir__ = namespace(__name__)

"""Thousands of drives on a graphics processor. It needs the library `warp-lang`: ``pip install "lostmotion[warp]"``."""

from ..namespace import namespace

__getattr__, __dir__ = namespace(__name__)

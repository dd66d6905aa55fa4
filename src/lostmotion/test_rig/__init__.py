"""The virtual test rig."""

from ..namespace import namespace

__getattr__, __dir__ = namespace(__name__)

"""The parts of a drive, the signals that act on it and what is asked of it."""

from ..namespace import namespace

__getattr__, __dir__ = namespace(__name__)

"""The parts of a drive, the signals that act on it, and its task."""

from ..namespace import namespace

__getattr__, __dir__ = namespace(__name__)

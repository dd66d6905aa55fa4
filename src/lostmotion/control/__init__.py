"""Controllers of a drive, and references with their derivatives."""

from ..namespace import namespace

__getattr__, __dir__ = namespace(__name__)

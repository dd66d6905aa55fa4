"""Linear models, periodic motions and frequency responses."""

from ..namespace import namespace

__getattr__, __dir__ = namespace(__name__)

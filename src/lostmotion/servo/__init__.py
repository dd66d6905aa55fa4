"""Analysis of closed loops for servo engineers, and gains by rules, margins or a search."""

from ..namespace import namespace

__getattr__, __dir__ = namespace(__name__)

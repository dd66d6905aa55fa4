"""Scenarios for programs without Python: the description that the C interface reads, and what is built on it."""

from ..namespace import namespace

__getattr__, __dir__ = namespace(__name__)

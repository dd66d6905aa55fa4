"""Pointing errors of axes, and their causes."""

from ..namespace import namespace

__getattr__, __dir__ = namespace(__name__)

"""Identification: from measured logs to the values of a drive, their intervals, and unidentifiable parameters."""

from ..namespace import namespace

__getattr__, __dir__ = namespace(__name__)

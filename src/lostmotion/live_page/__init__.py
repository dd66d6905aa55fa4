"""The live page: a drive in the browser, solved there by the same core."""

from ..namespace import namespace

__getattr__, __dir__ = namespace(__name__)

"""Results as figures, tables, pages and text."""

from ..namespace import namespace

__getattr__, __dir__ = namespace(__name__)

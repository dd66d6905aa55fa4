"""What pointing axes miss, and what causes it."""

from ..namespace import namespace

__getattr__, __dir__ = namespace(__name__)

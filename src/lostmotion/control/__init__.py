"""What controls a drive: references, with their derivatives."""

from ..namespace import namespace

__getattr__, __dir__ = namespace(__name__)

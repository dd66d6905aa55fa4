"""Does a drive fit its task?"""

from ..namespace import namespace

__getattr__, __dir__ = namespace(__name__)

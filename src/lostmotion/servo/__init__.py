"""What a servo engineer reads off a closed loop, and the gains that rules, margins or a search give it."""

from ..namespace import namespace

__getattr__, __dir__ = namespace(__name__)

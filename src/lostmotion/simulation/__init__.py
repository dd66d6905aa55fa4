"""From a scenario to a labelled dataset."""

from ..namespace import namespace

__getattr__, __dir__ = namespace(__name__)

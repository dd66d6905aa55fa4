"""Data sheets of gearboxes and motors, the catalogue of them, and the parts made of them."""

from ..namespace import namespace

__getattr__, __dir__ = namespace(__name__)

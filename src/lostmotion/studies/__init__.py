"""Many runs: what is varied, what is kept, and what is selected."""

from ..namespace import namespace

__getattr__, __dir__ = namespace(__name__)

"""The published drive that the project starts from, and its reproduction."""

from .published_drive import AMPLITUDES as AMPLITUDES
from .published_drive import MODELS as MODELS
from .published_drive import constants as constants
from .published_drive import paper_scenario as paper_scenario

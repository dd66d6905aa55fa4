"""The published drive that the project starts from, and its reproduction."""

from .drive import AMPLITUDES as AMPLITUDES
from .drive import MODELS as MODELS
from .drive import constants as constants
from .drive import paper_scenario as paper_scenario

from .budget import PointingBudget as PointingBudget
from .budget import PointingError as PointingError
from .budget import View as View

from .comparison import Comparison as Comparison
from .loop import Loop as Loop
from .measurement import RigReport as RigReport
from .measurement import measure as measure
from .rig import TestRig as TestRig
from .screw_measurement import ScrewReport as ScrewReport
from .screw_measurement import measure_screw as measure_screw

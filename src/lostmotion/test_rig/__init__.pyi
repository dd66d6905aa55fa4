from .comparison import Comparison as Comparison
from .measurement import RigReport as RigReport
from .measurement import measure as measure
from .screw_measurement import ScrewReport as ScrewReport
from .screw_measurement import measure_screw as measure_screw
from .torsion_loop import Loop as Loop
from .virtual_rig import TestRig as TestRig

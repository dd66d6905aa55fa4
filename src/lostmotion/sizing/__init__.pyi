from ..model.self_locking import Overrunning as Overrunning
from ..model.self_locking import SelfLocking as SelfLocking
from ..model.self_locking import overrunning as overrunning
from ..model.self_locking import self_locking as self_locking
from .finding import Finding as Finding
from .finding import Findings as Findings
from .motor_run import motor_current as motor_current
from .motor_run import temperatures as temperatures

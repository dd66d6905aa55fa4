from .actuated import Actuated as Actuated
from .actuated import ActuatedSnapshot as ActuatedSnapshot
from .actuated import ActuatedState as ActuatedState
from .actuated import attach as attach
from .reduction import Reduction as Reduction
from .reduction import from_mjcf as from_mjcf
from .reduction import reduce as reduce

"""The driven body."""

from ..inputs import described


class Load(described.LoadFields):
    """Inertia, friction and torque at the output of the gearbox (3b).

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.Load(inertia="2 kg*m^2", friction_torque="0.5 N*m").friction_torque
    0.5
    """

    def __repr__(self) -> str:
        return f"Load({self.inertia:.4g} kg·m²)"

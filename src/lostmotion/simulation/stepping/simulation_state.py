"""The state of a simulation that is advanced step by step."""

from dataclasses import dataclass, field
from typing import Any

from ...control.continuous import ContinuousController
from ...control.controller import Controller
from ...model.drive import Drive
from ...model.mass_matrix import MassMatrix
from ...model.train import DriveTrain


@dataclass(frozen=True)
class SimulationState:
    """Everything that a simulation needs to continue bit for bit, contact modes and hysteresis memory included."""

    time: float
    """[s]"""
    values: dict[str, Any] = field(repr=False)
    drive: Drive | DriveTrain = field(repr=False)
    """drive of this state"""
    controllers: dict[str, Controller | ContinuousController] = field(default_factory=dict, repr=False)
    """controllers of its motors"""
    mass_matrices: dict[str, MassMatrix] = field(default_factory=dict, repr=False)
    """mass matrices in force at this instant"""
    bound: Any = field(default=None, repr=False)
    """state of the second simulation for an error bound"""

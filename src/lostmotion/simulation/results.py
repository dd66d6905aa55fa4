"""Result datasets."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..control.controller import Controller
from ..errors import InputError
from ..inputs.arguments import checked
from ..model.torsion import Rigid
from ..model.train import DriveTrain
from ..version import __version__
from .scenario import Scenario
from .switchings import ATTRIBUTE as SWITCHINGS
from .switchings import CONTACTS_OF_TRAIN, packed
from .train_scenario import TrainScenario, is_train
from .train_variables import angle_through, angles_through_gears, axis_variables, named_signals, train_variables
from .variables import VARIABLES, Variable
from .windings import set_torques

if TYPE_CHECKING:
    import xarray


ENERGY = tuple(_core.energy_entries())
MOST_RESIDUAL = 1e-6  # of the energy turned over, by which the balance of an accurate run fails at most
"""entries of the energy ledger"""


def installed_version() -> str:
    """Version of this package."""
    return __version__


@dataclass(frozen=True)
class RawResult:
    """A result as plain arrays. A dataset is made only where one is wanted: importing its library takes half a second."""

    time: np.ndarray
    values: dict[str, np.ndarray]
    """of the result variables"""
    attrs: dict[str, Any]
    variables: tuple[Variable, ...]
    """those that the scenario may have, for units and meanings"""

    def __getitem__(self, name: str) -> np.ndarray:
        return self.time if name == "time" else self.values[name]

    def __contains__(self, name: str) -> bool:
        return name == "time" or name in self.values

    def dataset(self) -> xarray.Dataset:
        """The labelled dataset."""
        return labelled(self.time, self.values, self.attrs, self.variables)


def raw_result(
    scenario: Scenario | TrainScenario, core: _core.Train, result: dict[str, Any], solver: str, *, ledger: bool
) -> RawResult:
    """What the solver returned, with all that belongs to it."""
    time = np.arange(scenario.simulation.samples) * scenario.simulation.sample_interval
    data = dict(zip((name for name, *_ in core.channels()), result["values"], strict=True))
    data |= named_signals(scenario.by_prefix(), result["control"])
    set_torques(scenario, data)
    add_derived(scenario, data, time)
    attributes = {
        "title": scenario.title,
        "scenario": scenario.to_json(),
        "solver": solver,
        "lostmotion_version": installed_version(),
        "switching_count": int(result["switching_count"]),
        "end_state": json.dumps(result["end_state"]),
        "steps": int(result["steps"]),
        "mode_trials": int(result["mode_trials"]),
        "mode_fallbacks": int(result["mode_fallbacks"]),
        SWITCHINGS: packed(result["switchings"]),
    }
    if not core.short_form:
        attributes[CONTACTS_OF_TRAIN] = " ".join(core.contact_names())
    warnings = []
    if np.isfinite(result["left_data_at"]):
        losses = "gearbox.losses" if core.short_form else "the losses of the gear"
        warnings.append(
            f"from t = {result['left_data_at']:.6g} s on a loss map is used outside its data; there it continues with the slope "
            f"of its edge. Extend {losses}."
        )
    if ledger:
        add_ledger(attributes, result["energy"], warnings)
    if warnings:
        attributes["warning"] = " ".join(warnings)
    if note := scenario.note():
        attributes["note"] = note
    return RawResult(time, data, attributes, variables_of(scenario))


def add_ledger(attributes: dict[str, Any], energy: dict[str, float], warnings: list[str]) -> None:
    """Add the energy ledger of a run to its attributes, and a warning if the ledger does not close."""
    attributes["energy"] = json.dumps(energy)
    share = abs(energy["residual"]) / energy["turned_over"] if energy["turned_over"] > 0.0 else 0.0
    attributes["energy_residual"] = share
    if not share <= MOST_RESIDUAL:
        warnings.append(
            f"the energy balance closes to no more than {share:.1e} of the energy turned over, so this run is inaccurate. "
            "Look for ratios, inertias or stiffnesses many orders of magnitude apart."
        )


def labelled(
    time: Any, data: dict[str, Any], attributes: dict[str, Any], variables: Iterable[Variable]
) -> xarray.Dataset:
    """Samples of the result variables as a dataset, with units and meanings."""
    import xarray as xr

    shown = {
        v.name: ("time", data[v.name], {"units": v.unit, "long_name": v.meaning, "symbol": v.symbol})
        for v in variables
        if v.name in data
    }
    coordinates = xr.Coordinates(
        {"time": ("time", time, {"units": "s", "long_name": "time"})},
        indexes={"time": xr.indexes.PandasIndex(time, "time")},
    )
    return xr.Dataset(shown, coords=coordinates, attrs=attributes)


def is_train_result(result: xarray.Dataset | RawResult) -> bool:
    """Whether it is the run of a drive train."""
    return is_train(json.loads(result.attrs.get("scenario", "{}")))


def variables_of(scenario: Scenario | TrainScenario) -> tuple[Variable, ...]:
    """The variables that a result of this scenario may have."""
    own = VARIABLES if isinstance(scenario, Scenario) else train_variables(scenario.train(), scenario.core())
    return (*own, *axis_variables(scenario.by_prefix(), scenario.sliding()))


def recorded_variables(attributes: Mapping[str, Any]) -> tuple[Variable, ...]:
    """The variables that a result with these attributes may have."""
    tables = json.loads(attributes.get("scenario", "{}"))
    if is_train(tables):
        return variables_of(TrainScenario(**tables))
    controller = tables.get("controller")
    axes = {} if controller is None else {"": Controller(**controller)}
    return (*VARIABLES, *axis_variables(axes))


def add_derived(scenario: Scenario | TrainScenario, data: dict[str, Any], time: Any) -> None:
    """Adds the variables that follow from those of the solver."""
    if isinstance(scenario, Scenario):
        add_efficiency(data, scenario.gearbox.ratio)
    else:
        add_angles(scenario.train(), data, time)


def add_efficiency(data: dict[str, Any], ratio: Any) -> None:
    """Adds the variables of a drive that follow from those of the solver."""
    data["efficiency"] = gear_efficiency(data, ratio)
    data["motor_power"] = data["motor_torque"] * data["motor_speed"]


def add_angles(train: DriveTrain, data: dict[str, Any], time: Any) -> None:
    """Adds what the solver does not integrate: twists of rigid gears, and the angles that follow through the gears."""
    for name, gear in train.gears.items():
        if isinstance(gear.stiffness, Rigid):
            data.setdefault(train.twist_of(name), np.zeros_like(time))
    known = [name for name in train.shafts if train.angle_of(name) in data]
    for shaft, source, name, forward in angles_through_gears(train, known):
        angle, twist = data[train.angle_of(source)], data[train.twist_of(name)]
        data[train.angle_of(shaft)] = angle_through(train.gears[name], angle, twist, forward=forward)


def gear_efficiency(data: dict[str, Any], ratio: Any) -> Any:
    """Useful torque / torque fed in [-], by the direction of the load; NaN where the input shaft is at rest.

    Driving (T_2 has the sign of w_M) it is T_2/(i T_1), overrunning i T_1/T_2; 0 where both sides feed the losses.
    """
    driving = data["output_torque"] * np.sign(data["motor_speed"])
    fed_in = ratio * data["input_torque"] * np.sign(data["motor_speed"])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        eta = np.where(driving >= 0.0, driving / fed_in, np.where(fed_in < 0.0, fed_in / driving, 0.0))
    return np.where(data["motor_speed"] == 0.0, np.nan, eta)


@checked
def scenario_of(dataset: xarray.Dataset) -> Scenario | TrainScenario:
    """The scenario that a result came from: of a drive a `Scenario`, of a drive train a `TrainScenario`.

    Raises
    ------
    InputError
        The dataset carries none.
    """
    if "scenario" not in dataset.attrs:
        raise InputError(
            "this dataset carries no scenario; give a result of simulate or open_result, attributes included"
        )
    text = dataset.attrs["scenario"]
    return TrainScenario.from_json(text) if is_train(json.loads(text)) else Scenario.from_json(text)


@checked
def energy_of(dataset: xarray.Dataset | RawResult) -> dict[str, float]:
    """Energy ledger of a run [J].

    `source` is what the motor gave to the shaft; `input_damper`, `motor_friction`, `gear_losses`, `hysteresis`,
    `load_damper` and `load_friction` is what became heat; `load_work` what went into the disturbance torque;
    `kinetic_change` and `elastic_change` what is stored; `residual` what the balance fails by, `turned_over` the sum
    of the magnitudes of all flows.

    Raises
    ------
    InputError
        The result has no energy ledger.
    """
    if "energy" not in dataset.attrs:
        raise InputError("this result has no energy ledger; simulate with the exact solver and energy=True")
    ledger: dict[str, float] = json.loads(dataset.attrs["energy"])
    return ledger

"""Result datasets."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from ... import _core
from ...errors import InputError
from ...inputs.argument_checks import checked
from ...inputs.cached_values import kept
from ...version import __version__
from ..scenario.field_oriented_motors import set_torques
from ..scenario.scenario import Scenario
from ..variables import VARIABLES, Variable
from ..variables_of_trains import axis_variables, named_signals
from .energy_ledger import largest_stored, ledger_of, with_energy
from .switchings import ATTRIBUTE as SWITCHINGS
from .switchings import COLUMNS, columns_of, packed

if TYPE_CHECKING:
    import xarray


ENERGY = tuple(_core.energy_entries())  # entries of the energy ledger
FRAME_SAMPLES = 100_000  # of a run whose dataset is made quickly; what is kept for that holds its time axis


def installed_version() -> str:
    """Version of this package."""
    return __version__


@dataclass(frozen=True, repr=False)
class RunArrays:
    """A run as plain arrays by name, as ``simulate(..., output="arrays")`` returns it.

    It is made in a small part of the time of a dataset, and does without the library that datasets need.

    Attributes
    ----------
    time
        Instants of the samples [s].
    values
        Arrays over time by the name of their variable; ``result["twist"]`` is short for ``result.values["twist"]``.
    attrs
        As of the dataset: the scenario, the end state, how many switchings there were.
    scenario
        The scenario that was run.

    Examples
    --------
    >>> import lostmotion as lm
    >>> result = lm.simulate(lm.load("paper-2dof-nl-small"), output="arrays")
    >>> result.names[:3]
    ('command', 'load_torque', 'motor_torque')
    >>> result.units["motor_torque"], result["motor_torque"].shape == result.time.shape
    ('N*m', True)
    >>> result.switchings["instant"].shape == (result.attrs["switching_count"],)
    True
    """

    time: np.ndarray
    values: Mapping[str, np.ndarray]
    attrs: Mapping[str, Any]
    scenario: Scenario

    def __getitem__(self, name: str) -> np.ndarray:
        return self.time if name == "time" else self.values[name]

    def __contains__(self, name: object) -> bool:
        return name == "time" or name in self.values

    def __repr__(self) -> str:
        return f"RunArrays({len(self.time)} samples of {', '.join(self.names)})"

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The variables, each with its unit and meaning."""
        return tuple(v for v in variables_of(self.scenario) if v.name in self.values)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the variables."""
        return tuple(v.name for v in self.variables)

    @property
    def units(self) -> dict[str, str]:
        """SI units of the variables, by name; ``1`` of pure numbers."""
        return {v.name: v.unit for v in self.variables}

    @property
    def switchings(self) -> dict[str, np.ndarray]:
        """The switchings as columns by name, as of `switchings_of`."""
        return columns_of(self.attrs)

    def frozen(self) -> RunArrays:
        """The same, its arrays read-only."""
        for array in (self.time, *self.values.values()):
            array.flags.writeable = False
        return replace(self, values=MappingProxyType(self.values), attrs=MappingProxyType(self.attrs))

    def __reduce__(self) -> tuple[Any, ...]:
        return _made_again, (self.time, dict(self.values), dict(self.attrs), self.scenario)

    def energy(self) -> dict[str, float]:
        """The energy ledger [J], as `energy_of` returns it."""
        return energy_of(self)

    def dataset(self) -> xarray.Dataset:
        """The labelled dataset, which shares the arrays."""
        if len(self.time) > FRAME_SAMPLES:
            return labelled(self.time, self.values, self.attrs, self.variables)
        found = _frame(self.scenario).copy(data=self.values)
        found.attrs = dict(self.attrs)
        return found


def _made_again(*fields: Any) -> RunArrays:
    return RunArrays(*fields).frozen()


def raw_result(
    scenario: Scenario, core: _core.Train, result: dict[str, Any], solver: str, *, ledger: bool
) -> RunArrays:
    """Result of the solver with all its parts."""
    time = scenario.simulation.instants()
    data = dict(zip(_channels(scenario), result["values"], strict=True))
    data |= named_signals(scenario.by_prefix(), result["control"])
    set_torques(scenario, data)
    scenario.derive(data, time)
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
        COLUMNS: " ".join(core.switching_columns()),
    }
    if np.isfinite(result["left_data_at"]):
        attributes["warning"] = (
            f"from t = {result['left_data_at']:.6g} s on a loss map is used outside its data; there it continues with the slope "
            "of its edge. Extend the losses of the gear."
        )
    if ledger:
        attributes = with_energy(attributes, result["energy"], largest_stored(data))
    if note := scenario.note():
        attributes["note"] = note
    order = (v.name for v in variables_of(scenario) if v.name in data)
    return RunArrays(time, {name: data[name] for name in order}, attributes, scenario)


@kept
def _frame(scenario: Scenario) -> xarray.Dataset:
    """The dataset of its runs without their samples and attributes: to put these in takes a tenth of the time of making one."""
    nothing = np.broadcast_to(np.nan, scenario.simulation.samples)
    variables = variables_of(scenario)
    return labelled(scenario.simulation.instants(), dict.fromkeys((v.name for v in variables), nothing), {}, variables)


@kept
def _channels(scenario: Scenario) -> tuple[str, ...]:
    """Names of what the solver samples."""
    return tuple(name for name, *_ in scenario.core().channels())


def labelled(
    time: Any, data: Mapping[str, Any], attributes: Mapping[str, Any], variables: tuple[Variable, ...]
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


@kept
def variables_of(scenario: Scenario) -> tuple[Variable, ...]:
    """The variables that a result of this scenario may have."""
    return (*scenario.variables(), *axis_variables(scenario.by_prefix(), scenario.sliding()))


def recorded_variables(attributes: Mapping[str, Any]) -> tuple[Variable, ...]:
    """The variables that a result with these attributes may have."""
    tables = json.loads(attributes.get("scenario", "{}"))
    return variables_of(Scenario(**tables)) if tables else VARIABLES


@checked
def scenario_of(dataset: xarray.Dataset) -> Scenario:
    """Return the scenario that a result came from.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of `simulate` or `open_result`.

    Returns
    -------
    Scenario
        The scenario; it can be run again.

    Raises
    ------
    InputError
        The dataset contains no scenario.

    Examples
    --------
    >>> import lostmotion as lm
    >>> result = lm.simulate(lm.load("step-to-standstill"))
    >>> lm.simulation.scenario_of(result) == lm.load("step-to-standstill")
    True
    """
    if "scenario" not in dataset.attrs:
        raise InputError(
            "this dataset carries no scenario; give a result of simulate or open_result, attributes included"
        )
    text = dataset.attrs["scenario"]
    return Scenario.from_json(text)


@checked
def energy_of(dataset: xarray.Dataset | RunArrays) -> dict[str, float]:
    """Return the energy ledger of a run.

    A result that was simulated without ``energy=True`` has no ledger; it is simulated a second time.

    Parameters
    ----------
    dataset : xarray.Dataset or RunArrays
        Result of `simulate` or `open_result`.

    Returns
    -------
    dict of str to float
        Energies [J]. `source` is the work of the motor on the shaft. `input_damper`, `motor_friction`, `gear_losses`, `hysteresis`,
        `load_damper` and `load_friction` became heat. `load_work` is the work against the load torque. `kinetic_change` and
        `elastic_change` are stored. `residual` is the error of the balance, and `turned_over` the sum of the magnitudes of all flows.

    Raises
    ------
    InputError
        The result has no energy ledger.

    Examples
    --------
    >>> import lostmotion as lm
    >>> ledger = lm.energy_of(lm.simulate(lm.load("paper-2dof-nl-small"), energy=True))
    >>> f"{ledger['gear_losses']:.4g} J"
    '0.02143 J'
    """
    attributes = attributes_with_energy(dataset)
    if "energy" not in attributes:
        raise InputError("this result has no energy ledger; simulate with the exact solver and energy=True")
    ledger: dict[str, float] = json.loads(attributes["energy"])
    return ledger


def attributes_with_energy(result: xarray.Dataset | RunArrays) -> Mapping[str, Any]:
    """The attributes of a result with its energy ledger: of another solver, and of a law that only its caller knows, without."""
    attributes = result.attrs
    if "energy" in attributes or attributes.get("solver") != "exact" or "steps" not in attributes:
        return attributes
    scenario = result.scenario if isinstance(result, RunArrays) else scenario_of(result)
    if any(controller.law for controller in scenario.axes().values()):
        return attributes
    data = result.values if isinstance(result, RunArrays) else result
    return with_energy(attributes, ledger_of(scenario), largest_stored(data))


def whole(result: xarray.Dataset) -> xarray.Dataset:
    """A result with its energy ledger, for files and reports."""
    attributes = attributes_with_energy(result)
    return result if attributes is result.attrs else result.assign_attrs(attributes)

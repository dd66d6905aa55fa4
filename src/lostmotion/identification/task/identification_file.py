"""Identification files: logs, the rig as a scenario, what is sought, what is compared."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from ...errors import prefixed
from ...inputs.argument_checks import checked
from ...inputs.named_elements import Elements, nothing
from ...inputs.part import Part, rule
from ...inputs.quantities import NotNegative, Number, Positive, Switch, Time, Whole
from ...inputs.refusal_messages import did_you_mean
from ...inputs.toml_files import read_toml
from .file_formulas import CONSTANTS, FUNCTIONS, Formula
from .free_parameters import FreeParameter, in_unit
from .monitor_table import Monitoring

FormulaText = str | float
# Keys of inputs and measured channels that are formulas.
CHANNEL_FORMULAS = ("scale", "offset", "delay", "rate_limit", "acceleration_limit", "filter_time", "resolution")


class LogFiles(Part):
    """Files of the logs, and the held-out ones."""

    files: tuple[str, ...] = Field(min_length=1)
    """names or patterns, relative to the identification file; a directory stands for all logs in it"""
    source: str = ""  #: where the files come from, which the error names if there are none
    time: str = ""  #: channel of the time, where it is not found by itself
    decimal: Literal["", ".", ","] = ""
    """decimal separator in text files; left out, a comma only if a file has no other reading, with a note"""
    held_out: FormulaText | None = None
    """condition on the header, such as ``kp == 8`` or ``folder == "long arm"``; logs that meet it are compared, not fitted"""
    header: Elements[Any] = Field(default_factory=nothing)
    """header values for logs that lack them, by key, such as ``arm_mass = 0``"""
    channels: Elements[str] = Field(default_factory=nothing)
    """further values of the header: 1 where a log has the channel, 0 where it has not"""
    stated: Elements[str] = Field(default_factory=nothing)
    """keys of the header, and the channels that ought to agree with them, such as ``vin = "input_volts"``"""
    first: Annotated[Time, NotNegative] = 0.0  #: left out at the beginning of each log
    last: Annotated[Time, Positive] | None = None  #: after which a log is not used; left out, to its end
    weight: FormulaText = 1.0
    """weight of samples, by the header or by channels that switch, such as ``1 + 9*(ramp < 100)``: their errors count as if they were larger
    by that factor"""


class InputChannel(Part):
    """A channel that acts on the rig."""

    channel: str
    default: Number | None = None  #: value in logs that lack the channel; left out, such logs are refused
    unit: str = ""  #: unit of the channel; default: the unit in its file, else SI
    scale: FormulaText = 1.0  #: factor on it
    offset: FormulaText = 0.0  #: added to it after the factor: what acts is scale*channel + offset
    delay: FormulaText = 0.0  #: by which it acts later: dead time [s]
    interpolation: Literal["hold", "linear"] | None = None
    """between samples; left out, held where the channel repeats its values or moves in steps, else the way that is nearer to the logs"""
    rate_limit: FormulaText | None = None
    """largest rate with which the rig follows the channel, such as a firmware's limit of the goal's speed; SI; left out, none"""
    acceleration_limit: FormulaText | None = None  #: largest rate of that rate, SI; left out, none
    filter_time: FormulaText = 0.0  #: time constant of a first-order filter of the channel, before the limits [s]
    smoothing: Annotated[Time, NotNegative] = 0.0
    """smoothing of a measured motion, ``SHAFT_given_speed``: length of the local cubics that smooth it, and differentiate a channel of an angle"""


class MeasuredChannel(Part):
    """A channel that is compared with a result variable: ``scale * variable(t - delay) + offset``, filtered."""

    channel: str
    variable: str  #: result variable of the rig
    unit: str = ""  #: unit of the channel; default: the unit in its file, else SI
    scale: FormulaText = 1.0
    offset: FormulaText = 0.0
    """reading of the channel where the variable is 0, SI: the channel is scale*variable + offset, as recorded"""
    delay: FormulaText = 0.0  #: from the quantity until its sample [s]
    filter_time: FormulaText = 0.0  #: time constant of the first-order filter of the channel [s]
    resolution: FormulaText = 0.0  #: step of its quantisation, SI
    deviation: float | str | None = None
    """standard deviation of its errors, SI or text with a unit: the weight against other channels; needed where there are several"""


class Phase(Part):
    """A part of a log in which the rig is another: motor off, brake on."""

    when: FormulaText  #: condition on the channels of a sample, such as `torque_enable == 0`
    set: dict[str, Any] = Field(default_factory=dict)  #: values of the scenario by dotted key


class Rung(Part):
    """One candidate model: the one before, with more free parameters."""

    name: str
    free: tuple[str, ...] = ()  #: parameters, beside those of the models before
    set: dict[str, Any] = Field(default_factory=dict)
    """values of the scenario by dotted key, beside the values of the models before"""
    multi_start: Elements[tuple[Number, ...]] = Field(default_factory=nothing)
    """values to try of parameters on which the motion does not depend smoothly, SI or text with a unit"""


class FitOptions(Part):
    """Options of the search."""

    loss: Literal["huber", "linear"] = "huber"
    """loss of a residual; huber: linear beyond `outlier` standard deviations"""
    outlier: Annotated[Number, Positive] = 1.345
    iterations: Annotated[Whole, Field(ge=1, le=500)] = 30
    first_logs: Annotated[Whole, Field(ge=1)] = 12  #: number of logs with which the search begins, before it takes all
    leave_out: tuple[str, ...] = ()
    """keys of the header, ``file`` or ``folder``: for each value of one, the model taken is fitted again without the logs that have it, and
    their error is reported"""
    first: FormulaText | None = None
    """condition on the header of the logs with which the search begins, in place of `first_logs`: those without impacts"""
    regression: Switch = True
    """start values by linear regression of inverse dynamics, where the rig allows it and its runs are nearer to the logs"""
    horizon: tuple[Annotated[Time, Positive], ...] = ()
    """lengths of windows, rising: the logs are fitted in windows of the first length, then of the next, and at last
    whole; each run begins at the angle and the speed measured there"""
    sample_interval: Annotated[Time, Positive] | None = None
    """sample interval of the runs behind a channel with a filter; default: the interval of the log, at most 2 ms"""

    @rule
    def _horizon_grows(self) -> Iterator[str]:
        for a, b in itertools.pairwise(self.horizon):
            if b <= a:
                yield f"has horizon with {b:g} s after {a:g} s; windows must become longer"


class Identification(Part):
    """Content of an identification file."""

    title: str = ""
    scenario: str  #: file or name of the rig, which the values below change
    logs: LogFiles
    inputs: Elements[InputChannel] = Field(default_factory=nothing)
    """by the result variable of what acts: ``servo_command``, ``arm_load_torque``, ``servo_reference``"""
    measured: Elements[MeasuredChannel] = Field(min_length=1)
    set: dict[str, Any] = Field(default_factory=dict)
    """formulas of parameters and of the header of a log, by dotted key of the scenario"""
    phases: tuple[Phase, ...] = ()
    parameters: Elements[FreeParameter] = Field(min_length=1)
    nuisance: Elements[FreeParameter] = Field(default_factory=nothing)
    """one value for each log, with a tolerance: initial state, offset, delay"""
    ladder: tuple[Rung, ...] = ()  #: candidate models, from few to many parameters; left out, one with all parameters
    fit: FitOptions = FitOptions()
    record: str = ""  #: ``gear.NAME`` of the rig, for which a data sheet is written
    monitor: Monitoring = Monitoring()  #: values that `lostmotion monitor` compares over the life of a drive

    @model_validator(mode="before")
    @classmethod
    def _read_multi_start(cls, data: Any) -> Any:
        """Texts of `multi_start` in the unit of their parameter, like the start value."""
        if not isinstance(data, Mapping):
            return data
        ladder, parameters = data.get("ladder"), data.get("parameters")
        if not isinstance(ladder, list | tuple) or not isinstance(parameters, Mapping):
            return data
        rungs = list(ladder)
        for k, rung in enumerate(ladder):
            tried = rung.get("multi_start") if isinstance(rung, Mapping) else None
            if isinstance(tried, Mapping):
                read = {name: _in_unit_of(parameters, name, values, k) for name, values in tried.items()}
                rungs[k] = {**rung, "multi_start": read}
        return {**data, "ladder": rungs}

    @model_validator(mode="after")
    def _hangs_together(self) -> Self:
        for where, formulas in self._formulas():
            for text in formulas:
                try:
                    Formula(text)
                except ValueError as problem:
                    raise ValueError(f"has {where}: {problem}") from None
        known = [name for name, p in self.parameters.items() if not p.fixed]
        for k, rung in enumerate(self.ladder):
            for name in (*rung.free, *rung.multi_start):
                if name not in known:
                    meant = did_you_mean(name, known, f"the parameters are {', '.join(known)}")
                    raise ValueError(f"has ladder[{k}] with {name!r}, which is no free parameter; {meant}")
        for k, rung in enumerate(self.ladder):
            free = {name for below in self.ladder[: k + 1] for name in below.free}
            for name, tried in rung.multi_start.items():
                p = self.parameters[name]
                if name not in free:
                    raise ValueError(f"has ladder[{k}].multi_start.{name}, which is not free there; add it to free")
                if not tried:
                    raise ValueError(f"has ladder[{k}].multi_start.{name} without values; give some, or leave it out")
                for value in tried:
                    if not p.min <= value <= p.max:
                        raise ValueError(
                            f"has ladder[{k}].multi_start.{name} with {value:g} outside of {p.min:g} to {p.max:g}; leave it out"
                        )
        self._refuse_unknown_watches(known)
        for name in (*self.parameters, *self.nuisance):
            if name in CONSTANTS or name in FUNCTIONS:
                raise ValueError(f"has a parameter {name}, which formulas know as something else; give it another name")
        for name in self.nuisance:
            if name in self.parameters:
                raise ValueError(f"has {name} as a parameter and as a nuisance; leave one of them out")
            if self.nuisance[name].tolerance is None:
                raise ValueError(f"has nuisance.{name} without a tolerance; a value for each log needs one")
        if len(self.measured) > 1 and (loose := [n for n, m in self.measured.items() if m.deviation is None]):
            raise ValueError(
                f"has several measured channels, and measured.{loose[0]} without deviation; give each one, they are the weights"
            )
        return self

    def _refuse_unknown_watches(self, known: list[str]) -> None:
        models = [rung.name for rung in self.ladder]
        if self.monitor.model and self.monitor.model not in models:
            meant = did_you_mean(self.monitor.model, models, f"the models are {', '.join(models) or 'none'}")
            raise ValueError(f"has monitor.model = {self.monitor.model!r}, which is no model of the ladder; {meant}")
        for key in ("watch", "constant"):
            for name in getattr(self.monitor, key):
                if name not in known:
                    meant = did_you_mean(name, known, f"the parameters are {', '.join(known)}")
                    raise ValueError(f"has monitor.{key} with {name!r}, which is no free parameter; {meant}")
        for name, watch in self.monitor.watch.items():
            low, high = (
                in_unit(getattr(watch, end), self.parameters[name].unit, f"monitor.watch.{name}.{end}")
                for end in ("min", "max")
            )
            if low is not None and high is not None and not low < high:
                raise ValueError(f"has monitor.watch.{name} with min = {low:g}, which is not below max = {high:g}")

    def _formulas(self) -> list[tuple[str, list[FormulaText]]]:
        found = [
            (f"{table}.{name}.{key}", [getattr(entry, key)])
            for table in ("inputs", "measured")
            for name, entry in getattr(self, table).items()
            for key in CHANNEL_FORMULAS
            if getattr(entry, key, None) is not None
        ]
        found += [(f"phases[{k}].when", [phase.when]) for k, phase in enumerate(self.phases)]
        found.append(("logs.weight", [self.logs.weight]))
        found.append(("monitor.conditions", list(self.monitor.conditions)))
        if self.monitor.order:
            found.append(("monitor.order", [self.monitor.order]))
        if self.fit.first is not None:
            found.append(("fit.first", [self.fit.first]))
        return found + ([("logs.held_out", [self.logs.held_out])] if self.logs.held_out is not None else [])

    def rungs(self) -> tuple[Rung, ...]:
        """Candidate models; if the file has none, one of all free parameters."""
        free = tuple(name for name, p in self.parameters.items() if not p.fixed)
        return self.ladder or (Rung(name="all parameters", free=free),)


def _in_unit_of(parameters: Mapping[str, Any], name: str, tried: Any, rung: int) -> Any:
    p = parameters.get(name)
    unit = str(p.get("unit", "")) if isinstance(p, Mapping) else p.unit if isinstance(p, FreeParameter) else ""
    if not isinstance(tried, list | tuple):
        return tried
    key = f"ladder[{rung}].multi_start.{name}"
    for value in tried:
        if isinstance(value, str) and not unit:
            raise ValueError(f"has {key} with {value!r}, but parameters.{name} has no unit; add one to it, or give SI")
    return [in_unit(value, unit, key) if isinstance(value, str) else value for value in tried]


@checked
def load_identification(path: str | Path) -> tuple[Identification, Path]:
    """Read an identification file.

    Parameters
    ----------
    path : str or Path
        The identification file (TOML).

    Returns
    -------
    task : Identification
        The content of the file.
    directory : Path
        The directory to which its names are relative.

    Raises
    ------
    InputError
        The file cannot be used. The message names the file, the key, the value and the remedy.

    Examples
    --------
    >>> import lostmotion as lm
    >>> task, directory = lm.identification.load_identification("examples/cycloidal/baseline.toml")
    >>> sorted(task.parameters)
    ['disc_friction', 'disc_stiffness', 'friction', 'half_play', 'load_friction', 'play_stiffness', 'stiffness']
    """
    path = Path(path)
    data = read_toml(path, "an identification")
    with prefixed(path):
        return Identification(**data), path.parent


def free_on(task: Identification, rung: int) -> dict[str, FreeParameter]:
    """Free parameters of a candidate model."""
    names = [name for entry in task.rungs()[: rung + 1] for name in entry.free]
    return {name: p for name, p in task.parameters.items() if name in names and not p.fixed}

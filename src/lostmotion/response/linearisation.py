"""Exact linearisation in any regime, and the closed forms (9) to (11) of the rigid drive."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..errors import InputError, need
from ..inputs.argument_checks import checked
from ..inputs.quantities import Number, Time, Torque, argument, arguments
from ..inputs.refusal_messages import did_you_mean, shown
from ..model.drive import Drive
from ..model.signals import core_signal
from ..model.torsion import Rigid
from ..model.train import DriveTrain
from ..simulation.forms.drive_tables import Initial
from ..simulation.forms.train_tables import TrainInitial
from ..simulation.runs.core_runs import core_case
from ..simulation.scenario.requirements import need_free_motion, need_open_loop
from ..simulation.scenario.scenario import Scenario
from ..simulation.stepping.simulation import Simulation
from ..simulation.stepping.solver_access import linear_regime
from ..simulation.variables import variables_of_core
from ..simulation.variables_of_trains import only_input

if TYPE_CHECKING:
    import control
    import scipy.signal


@dataclass(frozen=True)
class LinearModel:
    """One regime of a drive or a train, dx/dt = A x + B u + a, y = C x + D u + c. Exact as long as the regime lasts."""

    A: np.ndarray
    """over `states` (SI)"""
    B: np.ndarray
    """over `inputs`"""
    C: np.ndarray
    """`outputs` over `states`"""
    D: np.ndarray
    """`outputs` over `inputs`"""
    rate: np.ndarray
    """a, constant part of the rates"""
    offset: np.ndarray
    """c, constant part of the outputs"""
    contacts: dict[str, int]
    """modes of the contacts: -1, 0 stuck, +1"""
    point: dict[str, float]
    """operating point (SI): states, inputs and hysteresis capacities, by name"""
    units: dict[str, str]
    """units of states, inputs and outputs, by name"""
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    def __repr__(self) -> str:
        """Operating point and regime as text."""
        words = {-1: "slips in reverse", 0: "is stuck", 1: "slips forward"}
        modes = [f"{c.replace('_', ' ')} {words[m]}" for c, m in self.contacts.items() if m in words]
        moved = ", ".join(f"{name} {value:.6g}" for name, value in self.point.items() if value != 0.0)
        return f"linear model at {moved or 'rest, command 0'}: {', '.join(modes) or 'no contact'}"

    @checked
    def response(self, frequency: Any, output: str = "load_speed", source: str = "command") -> np.ndarray:
        """F(y)/F(u) at frequencies [Hz], complex."""
        b, c, d = self._pair(output, source)
        frequencies = arguments("frequency", frequency, "Hz")
        if 0.0 in frequencies:
            raise InputError(f"frequency {shown(frequency)} must not be 0 Hz, where the load angle grows without limit")
        s = 2j * np.pi * np.array(frequencies)
        eye = np.eye(len(self.A))
        return np.array([c @ np.linalg.solve(x * eye - self.A, b) + d for x in s])

    def resonances(self) -> list[tuple[float, float]]:
        """(frequency [Hz], damping ratio [-]) of each pair of complex eigenvalues, rising."""
        return _pairs(np.linalg.eigvals(self.A))

    @checked
    def antiresonances(self, output: str = "load_speed", source: str = "command") -> list[tuple[float, float]]:
        """(frequency [Hz], damping ratio [-]) of each pair of complex transmission zeros, rising."""
        need("scipy", "Finding transmission zeros", "control")
        import scipy.linalg

        b, c, d = self._pair(output, source)
        n = len(self.A)
        pencil = np.block([[self.A, b[:, None]], [c[None, :], np.array([[d]])]])
        mass = np.zeros((n + 1, n + 1))
        mass[:n, :n] = np.eye(n)
        values = scipy.linalg.eigvals(pencil, mass)
        return _pairs(values[np.isfinite(values)])

    def _pair(self, output: str, source: str) -> tuple[np.ndarray, np.ndarray, float]:
        if output not in self.outputs or source not in self.inputs:
            outputs, inputs = ", ".join(self.outputs), ", ".join(self.inputs)
            raise InputError(f"there is no {shown(output)} over {shown(source)}; outputs: {outputs}; inputs: {inputs}")
        i, o = self.inputs.index(source), self.outputs.index(output)
        return self.B[:, i], self.C[o], float(self.D[o, i])

    def to_control(self) -> control.StateSpace:
        """The same for python-control, with names.

        Raises
        ------
        MissingLibraryError
            python-control is not installed.
        """
        return python_control().ss(
            self.A,
            self.B,
            self.C,
            self.D,
            states=list(self.states),
            inputs=list(self.inputs),
            outputs=list(self.outputs),
        )

    def to_scipy(self) -> scipy.signal.StateSpace:
        """The same for scipy.signal.

        Raises
        ------
        MissingLibraryError
            scipy is not installed.
        """
        need("scipy", "This conversion", "control")
        import scipy.signal

        return scipy.signal.StateSpace(self.A, self.B, self.C, self.D)


def python_control() -> Any:
    """The library python-control, where it is installed."""
    need("control", "This conversion", "control")
    import control

    return control


def _pairs(values: np.ndarray) -> list[tuple[float, float]]:
    magnitude = np.abs(values)
    complex_ones = values[values.imag > 1e-9 * (magnitude + 1e-300)]
    found = [(abs(v) / (2.0 * np.pi), -v.real / abs(v)) for v in complex_ones]
    return sorted((float(f), float(xi)) for f, xi in found)


@checked
def linearize(
    drive: Drive | Scenario | DriveTrain | Simulation,
    state: Initial | TrainInitial | None = None,
    *,
    time: Time | None = None,
    command: Number = 0.0,
    load_torque: Torque = 0.0,
    command_rate: float = 0.0,
    load_torque_rate: float = 0.0,
    inputs: Mapping[str, float] | None = None,
    input_rates: Mapping[str, float] | None = None,
) -> LinearModel:
    """Return the linear model of the regime that a state is in, stuck contacts included.

    A regime is linear, and the model is exact. State and inputs decide the regime, as in a run. One quantity is approximated: the
    input torque of a gear whose input shaft is stuck is that without losses, since a share of a stuck torque is not linear.

    Parameters
    ----------
    drive : Drive, Scenario, DriveTrain or Simulation
        A drive or a train, a scenario with one, or a simulation in its present state.
    state : Initial or TrainInitial, optional
        The operating point in SI, such as ``Initial(motor_speed=100.0, load_speed=1.1, twist=2e-3)``, ``Initial()`` for rest, or
        the end of a run, ``Initial(**json.loads(result.attrs["end_state"]))``. A drive with a single regime needs none.
    time : float, optional
        Instant [s] in place of a state: the scenario is run until then with its own inputs.
    command, load_torque : float
        Inputs [-], [N·m] at this instant, where there is one of the kind.
    command_rate, load_torque_rate : float
        Their rates [1/s], [N·m/s].
    inputs, input_rates : mapping of str to float, optional
        The same by name, such as ``{"servo_command": 0.2, "table_load_torque": 5.0}``. Others are 0.

    Returns
    -------
    LinearModel
        Matrices ``A``, ``B``, ``C`` and ``D`` with names and units, the operating point, and the modes of the contacts.

    Raises
    ------
    InputError
        The state is missing and the drive has several regimes, or the arguments contradict each other.
    SolverError
        The state has no continuation.

    Examples
    --------
    >>> import lostmotion as lm
    >>> model = lm.linearize(lm.load("paper-2dof-nl-small"), lm.Initial(motor_speed=100.0, load_speed=1.1))
    >>> model.contacts
    {'input_contact': 1, 'twist_contact': 1}
    """
    rates = {
        "command_rate": argument("command_rate", command_rate, "1/s"),
        "load_torque_rate": argument("load_torque_rate", load_torque_rate, "N*m/s"),
    }
    given = {"state": state is not None, "command": command != 0.0, "load_torque": load_torque != 0.0}
    given |= {name: value != 0.0 for name, value in rates.items()}
    given |= {"inputs": inputs is not None, "input_rates": input_rates is not None}
    if isinstance(drive, Simulation):
        _refuse(given | {"time": time is not None}, "a simulation is linearised as it stands")
        return _model_now(drive)
    if time is not None:
        _refuse(given, "at a time of a run, state and inputs are its own")
        return _model_of_run(drive, time)
    scenario, core = _subject(drive)
    names = core.input_names()
    of_inputs, of_rates = dict(inputs or {}), dict(input_rates or {})
    for name, values, value in (
        ("command", of_inputs, command),
        ("load_torque", of_inputs, load_torque),
        ("command_rate", of_rates, rates["command_rate"]),
        ("load_torque_rate", of_rates, rates["load_torque_rate"]),
    ):
        if given[name]:
            word = name.removesuffix("_rate")
            values[only_input(scenario.train(), word, names, name)] = value
    return _model_at(scenario, core, None if state is None else state.of_train(), of_inputs, of_rates)


def _subject(what: Drive | DriveTrain | Scenario) -> tuple[Scenario, _core.Train]:
    """The scenario, and the solver's train; on a train alone a load torque may act everywhere."""
    scenario = Scenario.of_any(what)
    need_free_motion(scenario, "linearize")
    return scenario, scenario.core(sampled=False, loaded=list(what.shafts) if isinstance(what, DriveTrain) else None)


def _refuse(given: dict[str, bool], why: str) -> None:
    if names := [name for name, is_given in given.items() if is_given]:
        raise InputError(f"{', '.join(names)}: {why}; leave {'it' if len(names) == 1 else 'them'} out")


def _ramp(value: float, rate: float) -> _core.Signal:
    return core_signal([(0.0, value, rate)])


def _model_now(simulation: Simulation) -> LinearModel:
    train, core, regime = linear_regime(simulation)
    return _model(train, core, regime)


def _model_of_run(what: Any, time: float) -> LinearModel:
    if not isinstance(what, Scenario):
        raise InputError("time: a drive alone has no run; give a scenario, or a state")
    if not 0.0 <= time <= what.simulation.duration:
        raise InputError(f"time {time} s must lie between 0 and the duration, {what.simulation.duration} s")
    need_open_loop(what, "linearize at a time")
    need_free_motion(what, "linearize")
    return _model(what.train(), what.core(), _core.linearize_at(core_case(what), time))


def _model_at(
    scenario: Scenario,
    core: _core.Train,
    state: TrainInitial | None,
    inputs: Mapping[str, float],
    rates: Mapping[str, float],
) -> LinearModel:
    """The linear model at a state; without one it must be the same at all states."""
    train, names = scenario.train(), core.input_names()
    for which, values in (("inputs", inputs), ("input_rates", rates)):
        for name in values:
            if name not in names:
                meant = did_you_mean(name, names, f"the inputs are {', '.join(names)}")
                raise InputError(f"{which}: {shown(name)} is no input of this train; {meant}")
    unit = {v.name: v.unit.replace("1", "") for v in variables_of_core(core.variables())}
    ramps = [
        _ramp(
            argument(f"inputs.{name}", inputs.get(name, 0.0), unit[name]),
            argument(f"input_rates.{name}", rates.get(name, 0.0), f"{unit[name] or '1'}/s"),
        )
        for name in names
    ]
    if state is None and (regimes := _why_several_regimes(train, core)):
        raise InputError(
            f"linearize: the linear model of this drive depends on the operating point ({regimes}); give one, such as "
            "TrainInitial() for the drive at rest"
        )
    state = state or TrainInitial()
    case = _core.Case(core, inputs=ramps, start=scenario.start(state), hysteresis_capacities=scenario.capacities(state))
    return _model(train, core, _core.linearize_at(case, 0.0))


def _model(train: DriveTrain, core: _core.Train, regime: Mapping[str, Any]) -> LinearModel:
    """The linear model, from what the solver says of one of its regimes."""
    return train_model(train, core, **regime)


def train_model(
    train: DriveTrain,
    core: _core.Train,
    states: dict[str, float],
    capacities: dict[str, float],
    inputs: dict[str, float],
    rates: np.ndarray,
    outputs: list[str],
    values: np.ndarray,
    contacts: dict[str, int],
) -> LinearModel:
    """The linear model of a train, from what the solver says of one of its regimes."""
    n, m = len(states), len(inputs)
    rows = dict(zip(outputs, values, strict=True))
    nothing = np.zeros(n + m + 1)
    variables = variables_of_core(core.variables())
    if all(gear.transmission_error is None for gear in train.gears.values()):  # else the angles are not linear
        known = np.array([rows.get(name, nothing) for name, *_ in core.channels()])
        angles = {train.variable(name, "angle") for name in train.shafts}
        following = zip((v.name for v in variables if v.derived), core.derive(known), strict=True)
        rows |= {name: row for name, row in following if name in angles}
    whole = np.array(list(rows.values()))
    units = {v.name: v.unit for v in variables if v.name in {*states, *inputs, *rows}}
    return LinearModel(
        A=rates[:, :n],
        B=rates[:, n : n + m],
        C=whole[:, :n],
        D=whole[:, n : n + m],
        rate=rates[:, -1],
        offset=whole[:, -1],
        contacts=contacts,
        point=states | capacities | inputs,
        units=units,
        states=tuple(states),
        inputs=tuple(inputs),
        outputs=tuple(rows),
    )


def _why_several_regimes(train: DriveTrain, core: _core.Train) -> str:
    """Reason for more than one regime of a train; empty if it has one."""
    gears, motors, shafts = train.gears.values(), train.motors.values(), train.shafts.values()
    rigid = {train.variable(name, "twist_contact") for name, g in train.gears.items() if isinstance(g.stiffness, Rigid)}
    dry = [name for name in core.contact_names() if name not in rigid]
    limits = any(m.command_limit is not None or m.torque_limit is not None for m in motors)
    curves = any(not isinstance(g.stiffness, Rigid) and not g.stiffness.is_linear for g in gears)
    reasons = {
        f"dry contacts: {', '.join(dry)}": bool(dry),
        "a torsion curve of several pieces": curves,
        "a limit of a motor": limits,
        "drag over speed": any(s.drag is not None for s in shafts)
        or any(d.drag is not None for d in train.dampers.values()),
        "a torque over an angle": bool(train.gravity or train.angle_torques),
        "end stops": any(s.end_stops is not None for s in shafts),
        "a spring of several pieces": any(not s.stiffness.is_linear for s in train.springs.values()),
        "a transmission error": any(g.transmission_error is not None for g in gears),
        "a mesh stiffness over the angle": any(g.mesh_stiffness is not None for g in gears),
    }
    return ", ".join(reason for reason, holds in reasons.items() if holds)

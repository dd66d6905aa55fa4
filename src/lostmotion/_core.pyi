from collections.abc import Callable, Mapping, Sequence
import enum
from typing import Annotated, Any, overload

import numpy
import numpy.typing
from numpy.typing import NDArray


class SolverError(RuntimeError):
    """The motion has no continuation; the message names time and contact."""

class Stop:
    def __init__(self) -> None: ...

    def request(self) -> None: ...

    def watch(self) -> None: ...

def aliases_of_drive() -> list[tuple[str, str]]:
    """
    What the results of a motor, a gearbox and a load are called: name in the long form and name that is shown.
    """

def result_name(element: str, what: str, slide: bool) -> str:
    """
    Name of a result variable: NAME_WHAT, of a slide with position, deflection and force.
    """

def variables() -> list[tuple[str, str, str, str, bool]]:
    """Of a drive: name, symbol, unit, meaning, whether it is derived."""

def states() -> list[str]: ...

def energy_entries() -> list[str]: ...

def switching_columns() -> list[str]: ...

def causes() -> list[tuple[int, str]]:
    """Of switchings: number and name."""

def parameters() -> list[tuple[str, str]]:
    """Of a drive: key and unit."""

def batch_fields() -> list[str]: ...

def reductions() -> list[str]: ...

def sine(x: numpy.typing.NDArray[numpy.float64]) -> numpy.typing.NDArray[numpy.float64]: ...

def cosine(x: numpy.typing.NDArray[numpy.float64]) -> numpy.typing.NDArray[numpy.float64]: ...

def exponential(x: numpy.typing.NDArray[numpy.float64]) -> numpy.typing.NDArray[numpy.float64]: ...

def exponential_minus_one(x: numpy.typing.NDArray[numpy.float64]) -> numpy.typing.NDArray[numpy.float64]: ...

def logarithm(x: numpy.typing.NDArray[numpy.float64]) -> numpy.typing.NDArray[numpy.float64]: ...

def cube_root(x: numpy.typing.NDArray[numpy.float64]) -> numpy.typing.NDArray[numpy.float64]: ...

def arctangent(a: numpy.typing.NDArray[numpy.float64], b: numpy.typing.NDArray[numpy.float64]) -> numpy.typing.NDArray[numpy.float64]: ...

def power(a: numpy.typing.NDArray[numpy.float64], b: numpy.typing.NDArray[numpy.float64]) -> numpy.typing.NDArray[numpy.float64]: ...

class TorsionCurve:
    @overload
    def __init__(self, breaks: Sequence[float], slopes: Sequence[float]) -> None: ...

    @overload
    def __init__(self, stiffness: dict[str, Any]) -> None: ...

    @property
    def odd(self) -> bool: ...

    @property
    def pieces(self) -> int: ...

    def side(self, forward: bool) -> tuple[list[float], list[float]]:
        """
        Twists [rad] > 0 at which the slope changes, and the slopes [N m/rad], outwards.
        """

    def torque(self, twist: float) -> float: ...

    def twist(self, torque: float) -> float: ...

    def energy(self, twist: float) -> float: ...

class LossMap:
    def __init__(self, speeds: Sequence[float], loads: Sequence[float], values: Sequence[float]) -> None: ...

    def __call__(self, load: float, speed: float) -> float: ...

    def least_slope_over_load(self) -> float: ...

class Signal:
    def __init__(self, fields: dict[str, Any]) -> None: ...

def described_tables(of_core: bool) -> dict[str, list[tuple[str, str, str, str, str, tuple[float | None, float | None, float | None], bool, Any, tuple[Any, ...]]]]:
    """
    Of each part that the core takes by these keys, or of those of which it makes curves and filters, its parameters: key, kind, symbol, unit, meaning, range (above, from on, up to), whether it is needed, default, and more: of a list the fewest and the most entries, of a table the part.
    """

def reference_blocks() -> list[tuple[str, str, str]]:
    """
    Of each block that shapes the reference: its table in a controller, its class, and what the table is.
    """

def encoder_step(fields: dict[str, Any]) -> float: ...

def tracker_gains(fields: dict[str, Any]) -> tuple[float, float, float]: ...

def discrete_filter(fields: dict[str, Any], sample_time: float) -> tuple[list[float], list[float], dict[str, Any]]:
    """
    Numerator and denominator in z, the highest power first, and the system of a controller.
    """

class GearLosses:
    def __init__(self, fields: dict[str, Any]) -> None: ...

    def __call__(self, output_torque: float, direction: float, speed: float) -> float: ...

    def output_torque(self, input_torque: float, direction: float, speed: float, factor: float) -> float: ...

class Axis:
    @overload
    def __init__(self) -> None: ...

    @overload
    def __init__(self, other: Axis) -> None:
        """A copy, which may be changed."""

    def set(self, fields: dict[str, Any]) -> None:
        """
        Parameters by the keys of scenario files, tables as dicts; what is left out stays as it is.
        """

    def slots(self) -> tuple[int, list[int]]:
        """How many numbers it remembers, and which of them go on with time."""

    @property
    def position_phase(self) -> int: ...

    @property
    def commutates_by_encoder(self) -> bool: ...

    @property
    def is_oriented(self) -> bool: ...

    @property
    def motor(self) -> int: ...

    @property
    def position_shaft(self) -> int: ...

    @property
    def speed_shaft(self) -> int: ...

    @property
    def reference_shaft(self) -> int: ...

    def least_current(self, torque: float) -> tuple[float, float]:
        """
        (i_d, i_q) [A] of the least current for a torque [N m], under field-oriented control.
        """

    def raise_again(self) -> None: ...

    def set_python_law(self, function: Callable[..., float], states: int) -> None: ...

    def set_compiled_law(self, function: int, data: int, states: int) -> None: ...

class Loop(enum.Enum):
    current = 1

    speed = 2

    position = 3

class CurrentAxis(enum.Enum):
    none = 0

    direct = 1

    quadrature = 2

def linear_step(axis: Axis, *, outermost: Loop, cut: bool, sample: int, sample_time: float) -> NDArray[numpy.float64]:
    """
    Slots after a sample step, over the slots before it and (angle of the position's encoder, angle and speed of the speed's, torque of the motor, value, rate and acceleration of the reference, measured value of a loop that is cut).
    """

def linear_orientation(axis: Axis, *, speed: float, lag: float, torque: float, weakening: float, current: tuple[float, float], voltage: tuple[float, float], outermost: CurrentAxis, cut: bool, every: int, since: int, sample_time: float) -> NDArray[numpy.float64]:
    """
    Slots of the field orientation after a sample step, the voltage (u_d, u_q) that acts and the measured currents, over the slots before it and (torque that is asked for; speed, angle as it is read and angle of the rotor; i_d, i_q; reference and measured value of the current that is looked at).
    """

COMMAND_SLOT: int = 14

SPEED_ANGLE_SLOT: int = 10

def axis_signals(motor_slides: bool = False, position_slides: bool = False) -> list[tuple[str, str, str]]:
    """
    Name, unit, meaning of what each axis shows, where the motor moves a slide, or the position is that of one.
    """

def winding_signals() -> list[tuple[str, str, str]]:
    """The same of what one with a winding shows beside it."""

class PeriodicCurve:
    def __init__(self, period: float, angles: Sequence[float], values: Sequence[float]) -> None: ...

    def pieces(self) -> int: ...

    def __call__(self, angle: float) -> float: ...

def worm_efficiencies(lead_angle: float, friction_angle: float) -> tuple[float, float]: ...

USUAL_ERROR: float = 0.001

def harmonic(fields: dict[str, Any]) -> PeriodicCurve: ...

def quadratic_drag(fields: dict[str, Any]) -> TorsionCurve: ...

def dry_friction(fields: dict[str, Any]) -> dict[str, Any]:
    """
    By its fields in the core; the lists are empty where there is no curve.
    """

class Train:
    def __init__(self) -> None: ...

    def add_shaft(self, fields: dict[str, Any]) -> None: ...

    def add_motor(self, name: str, *, shaft: str, fields: dict[str, Any]) -> None: ...

    def add_gear(self, name: str, *, input: str, output: str, fields: dict[str, Any]) -> None: ...

    def add_mass_matrix(self, name: str, shafts: Sequence[str], matrix: Sequence[Sequence[float]]) -> None:
        """Inertias [kg m2] of several shafts, in place of their own."""

    def with_mass_matrix(self, name: str, matrix: Sequence[Sequence[float]]) -> Train:
        """The same train with other numbers in one of its mass matrices."""

    def set_housing(self, gear: str, shaft: str) -> None: ...

    def add(self, table: str, name: str, *, shaft: str, fields: dict[str, Any]) -> None:
        """
        What acts on one shaft: the table of its kind, and its fields in SI units.
        """

    def add_coupling(self, table: str, name: str, *, input: str, output: str, fields: dict[str, Any]) -> None:
        """What joins two shafts and is no gear, in the same way."""

    def add_controller(self, motor: str, fields: dict[str, Any]) -> None: ...

    def check(self) -> tuple[str, str, str] | None: ...

    def name_as(self, aliases: Sequence[tuple[str, str]]) -> None:
        """What entries of results are called."""

    def kernel(self) -> str: ...

    def guards(self) -> int:
        """How many guards its kernel has room for."""

    def massless_shafts(self) -> list[str]: ...

    def moving_states(self) -> list[str]:
        """States that are not constant by the equations."""

    def check_start(self, speeds: Sequence[float]) -> str: ...

    def channels(self) -> list[tuple[str, str, str, str]]:
        """Name, symbol, unit, meaning."""

    def variables(self) -> list[tuple[str, str, str, str, bool]]:
        """Name, symbol, unit, meaning, whether it is derived."""

    def derive(self, channels: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> NDArray[numpy.float64]:
        """The variables that follow, from the channels, row by row."""

    def ledger_names(self) -> list[str]: ...

    def input_names(self) -> list[str]: ...

    def switching_columns(self) -> list[str]: ...

    def shafts(self) -> list[tuple[float, float]]:
        """Inertia [kg m2] and friction that holds at rest [N m] of each shaft."""

    def mesh_loss(self, gear: int, driven: float, speed: float) -> tuple[float, float]: ...

    def steady_regime(self, speeds: Sequence[float], torques: Sequence[float]) -> tuple[list[str], NDArray[numpy.float64], bool]: ...

    def contact_names(self) -> list[str]: ...

    def shown_contacts(self) -> list[str]:
        """Also those that have an alias although the train has none of them."""

class Case:
    def __init__(self, train: Train, *, inputs: Sequence[Signal], start: Mapping[str, float] = {}, hysteresis_capacities: Mapping[str, float] = {}) -> None:
        """
        What a run begins with: a train, its inputs, and by name its states and the hysteresis of its gears; what is left out is 0.
        """

    @property
    def inputs(self) -> list[Signal]: ...

def run(case: Case, *, duration: float, sample_interval: float, samples: int, energy: bool = False, tolerance: float = 0.0, max_switchings: int = 0, control: tuple[float, Sequence[Axis]] = (1.0, [])) -> dict[str, Any]: ...

def run_into(case: Case, out: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')], *, duration: float, sample_interval: float, control: tuple[float, Sequence[Axis]], channels: Sequence[int], pause: int, enough: Callable[[], bool]) -> int: ...

def run_batch(cases: Sequence[Case], *, fields: Sequence[int], values: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], duration: float, sample_interval: float, samples: int, energies: Sequence[str], channels: Sequence[str], kept: Sequence[tuple[int, int]], threads: int, progress: object | None = None) -> dict[str, Any]: ...

def reduce_rows(how: int, values: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], last: float = 1.0) -> NDArray[numpy.float64]: ...

def sample_count(duration: float, interval: float) -> int: ...

def sample_times(duration: float, interval: float) -> NDArray[numpy.float64]: ...

class SensitiveRun:
    def __init__(self, case: Case, *, variations: Sequence[tuple[str, Sequence[dict[str, Any]]]], control: tuple[float, Sequence[Axis]], duration: float, sample_interval: float, samples: int = 0, instants: Sequence[float] = []) -> None: ...

def run_sensitive_trains(cases: Sequence[SensitiveRun], channels: Sequence[str], *, signals: bool, threads: int) -> list[dict[str, Any]]: ...

def explain_at(case: Case, time: float) -> dict[str, Any]: ...

def linearize_at(case: Case, time: float) -> dict[str, Any]: ...

class SimulationSnapshot:
    pass

class Simulation:
    def __init__(self, train: Train, *, step: float, control: tuple[float, Sequence[Axis]], sines: Mapping[int, tuple[float, float]]) -> None: ...

    def advance(self, interval: float, begin: Sequence[float], end: Sequence[float]) -> None: ...

    def answer(self, interval: float, begin: Sequence[float], end: Sequence[float], *, shaft: int) -> tuple[float, float, float]:
        """
        Advances; returns inertia and mean acceleration of a shaft, and -da/dM of its load torque M.
        """

    def answers(self, shaft: int) -> bool:
        """Whether a shaft is one of answer()."""

    def snapshot(self) -> SimulationSnapshot: ...

    def restore(self, snapshot: SimulationSnapshot) -> None: ...

    def read(self) -> list[float]: ...

    def explain(self) -> dict[str, Any]: ...

    def linearize(self) -> dict[str, Any]: ...

    def reset(self, start: Mapping[str, float], hysteresis_capacities: Mapping[str, float]) -> None: ...

    def get_state(self) -> dict[str, Any]: ...

    def set_state(self, state: dict[str, Any]) -> None: ...

    def control_signals(self) -> list[float]:
        """
        Of each controller what axis_signals() and winding_signals() name, one controller after the other.
        """

    def time(self) -> float: ...

class MotionCourse:
    def __init__(self, *, to_angle: float | None, to_speed: float, to_acceleration: float | None, angle: float, speed: float, acceleration: float, interval: float) -> None: ...

    def times(self) -> list[float]: ...

    def speed(self, time: float) -> float: ...

    def acceleration(self, time: float) -> float: ...

class JointSnapshot:
    pass

def joint_rows() -> list[str]: ...

def turns_joint(train: Simulation, shaft: int) -> bool:
    """
    Whether the angle of a shaft follows from the states, and no mass matrix joins it to others.
    """

class JointTrains:
    def __init__(self, trains: Sequence[Simulation], *, shafts: Sequence[int], commands: Sequence[int], scales: Sequence[float]) -> None:
        """
        commands: the place of each among the inputs; -1: a controller has a reference in its place.
        """

    def set_commands(self, values: Sequence[float]) -> None: ...

    def guesses(self) -> list[tuple[float, float]]: ...

    def set_guesses(self, guesses: Sequence[tuple[float, float]]) -> None:
        """Load torque [N m] and mean acceleration [rad/s^2] of each joint."""

    def snapshot(self) -> JointSnapshot: ...

    def restore(self, snapshot: JointSnapshot) -> None: ...

    def go_back(self) -> None: ...

    def read(self, out: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')]) -> None: ...

    @property
    def evaluations(self) -> int: ...

    @property
    def unsettled(self) -> int: ...

class RobotStep:
    def __init__(self, trains: JointTrains, *, position: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], speed: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], acceleration: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], warmstart: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], force: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], matrix: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu')], row_length: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], row_begin: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], column: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], damping: Sequence[float], trained: Sequence[int], others: Sequence[int], place: Sequence[int], place_of_speed: Sequence[int]) -> None:
        """
        Of the arrays of an engine; see core/lostmotion/simulation/robot_step.hpp.
        """

    def begin(self, interval: float) -> int:
        """
        The first joint that is not where its train is, or -1: then positions are at the middle.
        """

    def predict_speed(self, interval: float) -> None: ...

    def take(self, interval: float, acceleration: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None: ...

    def advance(self, trains: JointTrains, *, interval: float, substeps: int, out: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')]) -> None: ...

    def advance_under(self, trains: JointTrains, *, interval: float, substeps: int, force: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], out: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu')]) -> None: ...

    def restore(self) -> None: ...

    def integrate(self, interval: float, acceleration: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None: ...

    def finish(self, acceleration: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None: ...

    @property
    def course(self) -> dict[str, Any]:
        """What the next step predicts from."""

    @course.setter
    def course(self, arg: dict[str, Any], /) -> None: ...

    @property
    def motion(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def acceleration(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def force(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def mass(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]: ...

class ExactBatchSnapshot:
    pass

class ExactBatch:
    def __init__(self, trains: Sequence[Train], *, controls: Sequence[tuple[float, Sequence[Axis]]], kind_of: Sequence[int], step: float) -> None: ...

    @property
    def variables(self) -> list[str]: ...

    def snapshot(self) -> ExactBatchSnapshot: ...

    def restore(self, snapshot: ExactBatchSnapshot) -> None: ...

    @property
    def memory(self) -> int:
        """Bytes, without what the solvers keep of the regimes."""

    def step(self, inputs: Sequence[Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]], *, speed: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)] | None = None, angle: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)] | None = None, acceleration: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)] | None = None, threads: int) -> None: ...

    def answer(self, inputs: Sequence[Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]], *, shaft: int, load: int, threads: int) -> NDArray[numpy.float64]:
        """
        A step, with how a shaft answers its load torque: rows of torque, derivative and acceleration.
        """

    def replace(self, k: int, train: Train, control: tuple[float, Sequence[Axis]]) -> bool:
        """Gives a drive other parameters; false: it has other states then."""

    def reset(self, which: Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C', device='cpu', writable=False)] | None, start: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> None: ...

    @property
    def inputs(self) -> list[str]: ...

    @property
    def states(self) -> list[str]: ...

    @property
    def values(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
        """The values of all drives, by variable; each step writes them anew."""

class BatchSnapshot:
    pass

class DriveBatch:
    def __init__(self, trains: Sequence[Train], *, controls: Sequence[tuple[float, Sequence[Axis]]], kind_of: Sequence[int], step: float) -> None: ...

    @property
    def variables(self) -> list[str]: ...

    def snapshot(self) -> BatchSnapshot: ...

    def restore(self, snapshot: BatchSnapshot) -> None: ...

    @property
    def memory(self) -> int:
        """Bytes of states and parameters."""

    def set(self, key: str, values: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None:
        """Sets a parameter of all drives, by its key in the short form."""

    def replace(self, k: int, train: Train) -> None:
        """Gives a drive a train of its own."""

    @staticmethod
    def error(train: Train, control: tuple[float, Sequence[Axis]]) -> str:
        """
        What keeps a train and its controllers from being stepped in a batch, or nothing.
        """

    @staticmethod
    def laws(train: Train) -> dict[str, Any]:
        """Laws and data sheet of a drive, by the names of the walk."""

    def step(self, command: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], load_torque: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], threads: int) -> None: ...

    def answer(self, command: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], load_torque: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], threads: int) -> NDArray[numpy.float64]:
        """
        A step, with how the load answers its load torque: rows of torque, derivative and acceleration.
        """

    def reset(self, which: Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C', device='cpu', writable=False)] | None, start: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)] | None) -> None: ...

    @property
    def states(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
        """The values of all drives, by state; each step writes them anew."""

    def output_torque(self) -> NDArray[numpy.float64]: ...

    def motor_torque(self) -> NDArray[numpy.float64]: ...

    def input_contact(self) -> NDArray[numpy.float64]: ...

    def twist_contact(self) -> NDArray[numpy.float64]: ...

    @property
    def inputs(self) -> list[str]: ...

    def read(self, variable: int) -> NDArray[numpy.float64]:
        """The values of a variable, by its number among the names."""

    def carry_tangents(self, keys: Sequence[str]) -> None:
        """Carries along the derivatives of the states by parameters."""

    def tangent(self, parameter: int, state: int) -> NDArray[numpy.float64]: ...

    @property
    def counts(self) -> tuple[int, int, int, int]: ...

def respond(train: Train, points: Sequence[tuple[Sequence[Signal], float, Mapping[str, float]]], *, samples: int, harmonics: int, max_periods: int, tolerance: float, keep_table: bool, limit_cycle: bool, threads: int, progress: object | None = None) -> dict[str, Any]: ...

def describe(case: Case, *, title: str, duration: float, sample_interval: float, control: tuple[float, Sequence[Axis]]) -> list[float]: ...

def write_description(scenario: Sequence[float], parameters: Sequence[dict[str, Any]], derivation: dict[str, Any]) -> list[float]: ...

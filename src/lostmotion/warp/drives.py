"""Many drives of one kind on a graphics processor or on the CPU, by the walk of the core as a kernel of Warp."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from .. import _core
from ..control.axis import OPEN_LOOP
from ..errors import InputError, need
from ..inputs.argument_checks import checked
from ..inputs.quantities import Count, Time
from ..inputs.refusal_messages import listed, shown
from ..model.drive import Drive
from ..model.train import DriveTrain
from ..simulation.batches.batch_parameters import mask_of_drives, numbers_of_drives, varied_columns
from ..simulation.forms.set_by_dotted_key import renamed
from ..simulation.scenario.one_gear import drive_keys
from ..simulation.scenario.scenario import Scenario


class Drives:
    """Drives of one kind, advanced together by a kernel of Warp: a motor, a gear and a load each.

    Parameters
    ----------
    drive
        A drive, or a scenario or a train with one motor, one gear and one load.
    count
        Number of drives.
    vary
        Parameters that differ from drive to drive, by their keys in a scenario file: arrays in SI units, or functions
        ``f(generator, count)`` that draw them.
    dtype
        ``"float32"`` or ``"float64"``.
    device
        Device of Warp, such as ``"cuda:0"`` or ``"cpu"``; default: Warp's.
    seed
        Seed of the generator that the functions in `vary` get.

    Raises
    ------
    InputError
        The drive has more than the walk takes, or a key is none of a parameter.
    MissingLibraryError
        Warp is not installed.

    Examples
    --------
    >>> import lostmotion as lm
    >>> import warp
    >>> warp.config.log_level = warp.LOG_WARNING  # else it tells what it compiles
    >>> drives = lm.warp.Drives(lm.load("paper-2dof-nl-small").drive(), count=8, device="cpu")
    >>> drives.parameters["load.inertia"].fill_(1.5)
    >>> drives.step(0.1, 0.0, "1 ms")
    >>> drives["load_angle"].numpy().shape
    (8,)

    Notes
    -----
    There is no other solver on the device: a step in which something was not certain is made all the same, and said in `doubts`.
    """

    @checked
    def __init__(
        self,
        drive: Drive | Scenario | DriveTrain,
        count: Count,
        *,
        vary: Mapping[str, Any] | None = None,
        dtype: str = "float32",
        device: str | None = None,
        seed: int = 0,
    ) -> None:
        need("warp", "lm.warp.Drives", "warp")
        import warp as wp

        from . import kernel

        if dtype not in kernel.DEGREE:
            raise InputError(f'dtype: {shown(dtype)} must be "float32" or "float64"')

        if seed < 0:
            raise InputError(f"seed: {seed} must be 0 or above")
        scenario = Scenario.of_any(drive)
        core = scenario.core(loaded=list(scenario.train().shafts)[-1:], given=())
        if scenario.axes() or scenario.continuous():
            raise InputError("drive: a controller turns the motor; give the drive alone, scenario.drive()")
        if error := _core.DriveBatch.error(core, OPEN_LOOP):
            raise InputError(f"drive: {error}")
        laws = _core.DriveBatch.laws(core)
        try:
            self._device = wp.get_device(device)
        except ValueError as problem:
            raise InputError(f"device: {problem}; give such as 'cuda:0' or 'cpu'") from None
        self._count, self._dtype = count, np.dtype(dtype)
        self._wp, self._number = wp, kernel.NUMBER[dtype]
        self._arrays = kernel.drive_arrays(dtype)()
        self._arrays.count = count
        for name, part in zip(("tables", "offsets", "shape"), kernel.packed(laws, dtype), strict=True):
            setattr(self._arrays, name, self._on_device(part))
        sheets = np.repeat(np.clip(laws["sheet"], -kernel.LIMIT, kernel.LIMIT)[:, None], count, axis=1)
        self._keys = {key: k for k, key in enumerate(kernel.SHEET.values()) if key and _has(laws, key)}
        self._numbers = drive_keys(scenario)
        generator = np.random.default_rng(seed)
        places = {key: self._place(key) for key in vary or {}}
        for key, column in varied_columns(scenario, vary or {}, count, generator).items():
            sheets[places[key]] = column
        self._arrays.sheets = self._on_device(sheets.reshape(-1).astype(dtype))
        for name, rows in (("states", len(kernel.STATES)), ("shown", 6)):
            setattr(self._arrays, name, self._new(rows))
        self._arrays.angles = wp.zeros(count, dtype=wp.float64, device=self._device)
        self._arrays.modes = wp.zeros(len(kernel.MODES) * count, dtype=wp.int32, device=self._device)
        for name in ("doubts", "switchings", "doubtful"):
            setattr(self._arrays, name, wp.zeros(count, dtype=wp.int32, device=self._device))
        self._commands, self._loads = self._new(1), self._new(1)
        self._steps = 0
        self._kernel = kernel.advance_kernel(dtype)

    def __len__(self) -> int:
        return self._count

    @property
    def doubts(self) -> Any:
        """Uncertainties in the last step of each drive, as bits; 0: all was certain."""
        return self._arrays.doubts

    @property
    def parameters(self) -> Mapping[str, Any]:
        """Parameters by their keys in the short form, as arrays on the device; what is written there acts in the next step."""
        return _Rows(self)

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of steps since the beginning: ``steps``, ``switchings``, and ``doubtful``, those with something that was not certain."""
        sums = {name: int(getattr(self._arrays, name).numpy().sum()) for name in ("switchings", "doubtful")}
        return {"steps": self._steps} | sums

    def __getitem__(self, name: str) -> Any:
        """Values of a variable, on the device: ``motor_speed``, ``load_speed``, ``twist``, ``output_torque`` or ``load_angle``."""
        if name == "load_angle":
            return self._arrays.angles
        names = ("motor_speed", "load_speed", "twist", "output_torque")
        if name not in names:
            raise InputError(f"{shown(name)} is no variable; the variables are {listed((*names, 'load_angle'))}")
        k = names.index(name)
        return self._arrays.shown[k * self._count : (k + 1) * self._count]

    @checked
    def step(self, command: Any, load_torque: Any = 0.0, step: Time = 1e-3) -> None:
        """Advance all drives by one step, with constant inputs.

        Parameters
        ----------
        command
            A number, an array of NumPy, or an array of Warp on the device with one for each drive, which is read as it is.
        load_torque
            Load torques [N·m], in the same way.
        step
            [s]
        """
        self._advance(command, load_torque, step, answers=False)

    @checked
    def answer(self, command: Any, load_torque: Any = 0.0, step: Time = 1e-3) -> tuple[Any, Any]:
        """Advance as `step` does, and return how the drives answer their load torques.

        Parameters
        ----------
        command, load_torque, step
            As of `step`.

        Returns
        -------
        tuple
            Mean torque of each drive on its load [N·m], and its derivative by the mean acceleration [kg·m²], -1e30
            where dry friction holds the load. Arrays of Warp, which the next answer writes anew.
        """
        self._advance(command, load_torque, step, answers=True)
        first, second = (self._arrays.shown[k * self._count : (k + 1) * self._count] for k in (4, 5))
        return first, second

    def _advance(self, command: Any, load_torque: Any, step: float, *, answers: bool) -> None:
        given = self._input("command", command, self._commands), self._input("load_torque", load_torque, self._loads)
        self._wp.launch(
            self._kernel, dim=self._count, inputs=[self._arrays, *given, step, int(answers)], device=self._device
        )
        self._steps += self._count

    @checked
    def reset(self, which: Any = None) -> None:
        """Take drives back to rest at t = 0.

        Parameters
        ----------
        which
            Array of Booleans with the drives that are meant; default all.
        """
        keep = np.zeros(self._count, dtype=bool) if which is None else ~mask_of_drives(which, self._count)
        a = self._arrays
        for each in (a.states, a.shown, a.modes, a.angles, a.doubts):
            rows = each.numpy().reshape(-1, self._count)
            each.assign(np.where(keep, rows, 0).reshape(-1).astype(rows.dtype))

    def _new(self, rows: int) -> Any:
        return self._wp.zeros(rows * self._count, dtype=self._number, device=self._device)

    def _on_device(self, values: np.ndarray) -> Any:
        return self._wp.array(values, device=self._device)

    def _place(self, key: str) -> int:
        number = renamed(key, self._numbers)
        if number not in self._keys:
            raise InputError(f"{key}: is no parameter of these drives; the parameters are {listed(tuple(self._keys))}")
        return self._keys[number]

    def _input(self, what: str, value: Any, kept: Any, each: str = "drive") -> Any:
        """Input of a kernel: an array of Warp as it is, or else an array of the same shape, with the given numbers."""
        if isinstance(value, self._wp.array):
            if value.shape != kept.shape or value.dtype != self._number:
                raise InputError(f"{what}: must have {len(kept)} numbers of type {self._dtype}")
            return value
        numbers = numbers_of_drives(what, value, len(kept), each).astype(self._dtype)
        if len(numbers) == 1:
            kept.fill_(numbers[0])
        else:
            kept.assign(numbers)
        return kept


class _Rows(Mapping[str, Any]):
    """Rows of the data sheets, by key."""

    def __init__(self, drives: Drives) -> None:
        self._drives = drives

    def __getitem__(self, key: str) -> Any:
        n, k = len(self._drives), self._drives._place(key)
        return self._drives._arrays.sheets[k * n : (k + 1) * n]

    def __iter__(self) -> Iterator[str]:
        return iter(self._drives._keys)

    def __len__(self) -> int:
        return len(self._drives._keys)


def _has(laws: Mapping[str, Any], key: str) -> bool:
    """Whether the drives have such a number; what a kind lacks, none of its drives can get."""
    if key == "gearbox.stiffness.backlash":
        return bool(laws["has_gap"])
    if key == "gearbox.losses.efficiency":
        return bool(laws["losses"] == 0)
    return bool(key != "motor.electrical_time_constant" or laws["delays_torque"])

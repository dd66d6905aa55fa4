"""Controllers of your own: a Python function, or a compiled one at full speed."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from .. import _core
from ..errors import InputError
from ..inputs.argument_checks import checked
from ..inputs.refusal_messages import shown

C_FUNCTION: Any = ctypes.CFUNCTYPE(None).__mro__[1]  # the class of all function pointers
SIGNATURE = (
    "int (double time, const double *measured, const double *reference, double *state, double *command, void *data)"
)


@dataclass(frozen=True)
class Law:
    """A function that is called at each sample time in place of the loops.

    In Python ``function(time, measured, reference, state) -> command``. Compiled, it is a numba cfunc or a ctypes
    function pointer of the C type `SIGNATURE`. It writes the command and returns 0; any other value ends the run.

    ``measured`` is (position of the reference's shaft [rad], speed of the motor [rad/s], torque of the motor [N·m]),
    ``reference`` is (value, first, second, third derivative). ``command`` is in the unit of `[command]`: 1 is rated
    torque, or with ``current.kind = "voltage"`` rated voltage. With ``current.kind = "field_oriented"`` ``measured``
    also has i_d and i_q [A]. The command is the pair u_d, u_q [V] in coordinates of the rotor as it is read now. The
    inverter advances its angle to the rotor's angle in the middle of the time that the voltage acts, and holds the
    voltage in the stator.
    """

    function: Any
    states: int = 0
    """number of values that it keeps from call to call; they begin at 0, and belong to the state of the run"""
    data: Any = None
    """data of a compiled function: a ctypes object or a contiguous numpy array, whose address the function gets"""
    repeatable: bool = False
    """whether a run may be made again with it, as the error bound of field-oriented control needs: it then keeps nothing from call to
    call but its `states`"""

    def set(self, axis: _core.Axis) -> None:
        """Makes it the law of an axis of the solver.

        Raises
        ------
        InputError
            It is no function.
        """
        if isinstance(self.states, bool) or not isinstance(self.states, int) or not 0 <= self.states <= 10_000:
            raise InputError(f"law.states: {shown(self.states)} must be a whole number from 0 to 10000")
        address = self._address()
        if address is not None:
            axis.set_compiled_law(address, _address_of(self.data), self.states)
        elif callable(self.function):
            if self.data is not None:
                raise InputError("law.data: is for compiled functions; keep what a Python function needs in itself")
            axis.set_python_law(self.function, self.states)
        else:
            raise InputError(
                f"law: {shown(self.function)} must be a function (time, measured, reference, state) -> command"
            )

    def _address(self) -> int | None:
        if isinstance(self.function, C_FUNCTION):
            return ctypes.cast(self.function, ctypes.c_void_p).value
        address = getattr(self.function, "address", None)
        return address if isinstance(address, int) and not isinstance(address, bool) else None


Law.__init__ = checked(Law.__init__)  # type: ignore[method-assign]


def _address_of(data: Any) -> int:
    if data is None:
        return 0
    if hasattr(data, "ctypes"):  # a numpy array
        if not data.flags["C_CONTIGUOUS"]:
            raise InputError("law.data: the array must be contiguous; give numpy.ascontiguousarray(...)")
        return int(data.ctypes.data)
    return ctypes.addressof(data)


def as_laws(law: Any, axes: Mapping[str, Any]) -> dict[str, Law]:
    """Laws by the name of the controller: a single law belongs to the only controller.

    Raises InputError: a controller with ``law = true`` has none, or one without has one.
    """
    wanted = [name for name, controller in axes.items() if controller.law]
    given = law if isinstance(law, Mapping) else {} if law is None else dict.fromkeys(wanted[:1] or [""], law)
    laws = {name: one if isinstance(one, Law) else Law(one) for name, one in given.items()}
    if not isinstance(law, Mapping) and len(wanted) > 1:
        raise InputError(f"law: must be given by name for {', '.join(wanted)}, such as law={{{wanted[0]!r}: function}}")
    if missing := [name for name in wanted if name not in laws]:
        raise InputError(f"law: the controller {missing[0]} has law = true; give simulate(..., law=function)")
    if extra := [name for name in laws if name not in wanted]:
        raise InputError(
            f"law: {extra[0] or 'the scenario'} has no controller with law = true; set it, or leave law out"
        )
    return laws

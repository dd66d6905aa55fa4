"""Numbers that record how they are computed of others.

The core derives a scenario anew from changed values without Python: it has the formulas that Python computes the numbers of the
core by. They are recorded while Python does so once. `Recorded` is a float that records on a tape what is computed from it.
Where such a number is passed on as a plain float, as to the core, it is known again by its last bits, which are its own: its
`mark`. A comparison is recorded too. The formulas hold as long as it turns out as it did.
"""

from __future__ import annotations

import math
import operator
import struct
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

MARKED_BITS = 0xFFFF
TINIEST = 2.0**-200  # of the marks of 0
FUNCTIONS = ("root", "sine", "cosine", "arctangent", "cube_root", "worm_driving", "worm_overrunning")
"""that the core has for formulas"""

Condition = tuple[str, int, int]  # comparison, and the numbers of two formulas


class Tape:
    """Formulas in the order in which they were computed.

    Each is (law, formula, other formula, value), as `Derivation` in core/lostmotion/scenario/description.hpp has them.
    """

    def __init__(self) -> None:
        self.formulas: list[tuple[str, int, int, float]] = []
        self.conditions: dict[Condition, bool] = {}
        self.marked: dict[float, Recorded] = {}
        self._known: dict[tuple[str | float, ...], int] = {}
        self._numbers: dict[int, Recorded] = {}

    def parameter(self, number: int, value: float) -> Recorded:
        """The value of a parameter of this number."""
        return self._number(self._formula("parameter", number, number), value)

    def apply(self, law: str, function: Callable[..., float], *operands: float) -> float:
        """The value of a function, recorded. What is not finite is none."""
        value = function(*map(value_of, operands))
        if not math.isfinite(value):
            return value
        one, *other = map(self.formula_of, operands)
        return self._number(self._formula(law, one, *(other or (one,))), value)

    def compare(self, comparison: str, one: float, other: float, *, holds: bool) -> bool:
        """The outcome of a comparison, recorded."""
        if math.isfinite(other):
            self.conditions[comparison, self.formula_of(one), self.formula_of(other)] = holds
        return holds

    def formula_of(self, x: float) -> int:
        """The formula of a number: its own, its mark's, or a constant."""
        known = x if isinstance(x, Recorded) else self.marked.get(float(x))
        return self._formula("constant", 0, 0, float(x)) if known is None else known.formula

    def _formula(self, law: str, one: int, other: int = 0, value: float = 0.0) -> int:
        # Not even 0 and -0 are the same.
        key = law, one, other, math.copysign(1.0, value), value
        if key not in self._known:
            self._known[key] = len(self.formulas)
            self.formulas.append((law, one, other, value))
        return self._known[key]

    def _number(self, formula: int, value: float) -> Recorded:
        if formula not in self._numbers:
            number = Recorded(self._mark(value))
            number.tape, number.formula, number.value = self, formula, value
            self._numbers[formula] = self.marked[float(number)] = number
        return self._numbers[formula]

    def _mark(self, value: float) -> float:
        """A number near a value, as no other has it."""
        (bits,) = struct.unpack("<q", struct.pack("<d", value or TINIEST))
        for own in range(len(self.marked) + 1, len(self.marked) + MARKED_BITS):
            (mark,) = struct.unpack("<d", struct.pack("<q", (bits & ~MARKED_BITS) | (own & MARKED_BITS)))
            if mark != value and mark not in self.marked:
                return float(mark)
        raise ValueError("too many numbers are the same")


def of_function(law: str, function: Callable[..., float], *operands: float) -> float:
    """A function of numbers; of recorded ones it is recorded where the core has it, as one of `FUNCTIONS`."""
    tape = next((x.tape for x in operands if isinstance(x, Recorded)), None)
    return (
        function(*map(float, operands))
        if tape is None or law not in FUNCTIONS
        else tape.apply(law, function, *operands)
    )


def may_differ(x: float) -> bool:
    """Whether a number is not 0, or may become so."""
    return isinstance(x, Recorded) or x != 0.0


def may_be_left_out(x: float) -> bool:
    """Whether a number is 0 only as long as nothing else is said."""
    return isinstance(x, Recorded) and x.value == 0.0


def real(x: Any) -> float:
    """A number as a float, recorded as before."""
    return x if isinstance(x, Recorded) else float(x)


def numbers(values: Sequence[Any]) -> np.ndarray:
    """An array of numbers, recorded as before."""
    found = np.array(values, dtype=object)
    return found if any(isinstance(x, Recorded) for x in found.flat) else found.astype(float)


def value_of(x: float) -> float:
    """The number itself, not recorded."""
    return x.value if isinstance(x, Recorded) else x


def _is_number(x: object) -> bool:
    return isinstance(x, int | float) and not isinstance(x, bool)


def _within(whole: int, _recorded: bool) -> int:
    """A whole number, for the bounds within which it is that one."""
    return whole


class Recorded(float):
    """A number of a tape; as a float it is its mark."""

    __slots__ = ("formula", "tape", "value")

    tape: Tape
    formula: int
    value: float

    # What keeps values of equal arguments must not mistake a recorded number for a plain one.
    __hash__ = object.__hash__

    def __neg__(self) -> float:
        return -1.0 * self

    def __pos__(self) -> float:
        return self

    def __abs__(self) -> float:
        return -self if self < 0.0 else self

    def __bool__(self) -> bool:
        return self != 0.0

    def __round__(self, digits: Any = None) -> Any:
        k = round(self.value, digits)
        return k if digits is not None else _within(k, k - 0.5 <= self <= k + 0.5)

    def __floor__(self) -> int:
        k = math.floor(self.value)
        return _within(k, k <= self < k + 1)

    def __ceil__(self) -> int:
        k = math.ceil(self.value)
        return _within(k, k - 1 < self <= k)

    def __trunc__(self) -> int:
        return math.floor(self) if self >= 0.0 else math.ceil(self)

    __int__ = __trunc__

    def __eq__(self, other: object) -> bool:
        if not _is_number(other):
            return NotImplemented
        return self.tape.compare("equal", self, other, holds=self.value == value_of(other))  # type: ignore[arg-type]

    def __ne__(self, other: object) -> bool:
        return NotImplemented if not _is_number(other) else not self == other


def _operator(law: str, function: Callable[[Any, Any], Any]) -> tuple[Any, Any]:
    def forward(self: Recorded, other: Any) -> Any:
        return self.tape.apply(law, function, self, other) if _is_number(other) else NotImplemented

    def backward(self: Recorded, other: Any) -> Any:
        return self.tape.apply(law, function, other, self) if _is_number(other) else NotImplemented

    return forward, backward


def _comparison(law: str, function: Callable[[Any, Any], bool], *, exchanged: bool) -> Any:
    def compare(self: Recorded, other: Any) -> Any:
        if not _is_number(other):
            return NotImplemented
        one, two = (other, self) if exchanged else (self, other)
        return self.tape.compare(law, one, two, holds=function(self.value, value_of(other)))

    return compare


for _name, _law in {"add": "sum", "sub": "difference", "mul": "product", "truediv": "quotient"}.items():
    _forward, _backward = _operator(_law, getattr(operator, _name))
    setattr(Recorded, f"__{_name}__", _forward)
    setattr(Recorded, f"__r{_name}__", _backward)
for _name, _law in {"lt": "less", "le": "at_most", "gt": "less", "ge": "at_most"}.items():
    setattr(Recorded, f"__{_name}__", _comparison(_law, getattr(operator, _name), exchanged=_name[0] == "g"))

"""Elements by name, as the tables of a file have them: in the order given, and immutable."""

import re
from collections.abc import Mapping
from typing import Annotated, Any, NoReturn, TypeVar

from pydantic import AfterValidator

from ..errors import InputError
from .refusal_messages import shown

V = TypeVar("V")

NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


class Named(dict[str, V]):
    """A read-only mapping of names to elements; result variables are called after the names."""

    def __init__(self, elements: Mapping[str, V]) -> None:
        for name in elements:
            if not NAME.fullmatch(name):
                raise ValueError(
                    f"must not have the name {shown(name)}; a name is made of letters, digits and _, and begins with a letter"
                )
        super().__init__(elements)

    def __hash__(self) -> int:  # type: ignore[override]
        return hash(tuple(self.items()))

    def __eq__(self, other: object) -> bool:
        """Compares the order, too: it is the order of the equations."""
        return isinstance(other, dict) and list(self.items()) == list(other.items())

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (dict(self),)

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        raise InputError("the elements of a drive train are frozen; make a changed train instead")

    __setitem__ = __delitem__ = __ior__ = _refuse
    clear = pop = popitem = setdefault = update = _refuse


Elements = Annotated[dict[str, V], AfterValidator(Named)]  # by name, in the order of the equations


def nothing() -> Named[Any]:
    """No elements."""
    return Named({})

"""Values derived from an immutable part, made once and kept with the part."""

from collections.abc import Callable
from functools import wraps
from typing import Any, Protocol, TypeVar
from weakref import ref


class Keeper(Protocol):
    """An immutable object that keeps values, such as a part."""

    def kept_values(self) -> dict[Any, Any]: ...


P = TypeVar("P", bound=Keeper)
R = TypeVar("R")


def kept(function: Callable[[P], R]) -> Callable[[P], R]:
    """The function of a part or scenario alone, or method of one, whose value is made once for each part and kept with it.

    The value belongs to the object: copies, pickles, comparisons and files are without it. It must not be changed.
    """

    @wraps(function)
    def call(part: P) -> R:
        values = part.kept_values()
        try:
            value: R = values[function]
        except KeyError:
            value = values[function] = function(part)
        return value

    return call


def kept_while_used(method: Callable[[P], R]) -> Callable[[P], R]:
    """Keep a large value as `kept` does, but only while something else holds it."""

    @wraps(method)
    def call(part: P) -> R:
        values = part.kept_values()
        value: R | None = values[method]() if method in values else None
        if value is None:
            value = method(part)
            values[method] = ref(value)
        return value

    return call


def keep(part: Keeper, function: Any, value: Any) -> None:
    """Store the value of a `kept` function with a part."""
    part.kept_values()[function.__wrapped__] = value

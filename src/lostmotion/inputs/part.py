"""The base of all parts, tables and records that are given: immutable, and refused in one line."""

import inspect
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache, wraps
from typing import Any, Self

from pydantic import BaseModel, ConfigDict, GetJsonSchemaHandler, ValidationError, model_validator
from pydantic_core import CoreSchema

from ..errors import InputError
from ..units.scalars import plain
from .docstrings import docstring_of
from .parameter_help import PartType, written_docstring
from .part_display import abridged
from .refusal_messages import refusal, shown


class Part(BaseModel, metaclass=PartType):
    """Immutable; unknown keys, NaN and infinity are refused, with an `InputError` that says what would be right."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)

    # Neither a field nor a private attribute: pydantic copies, compares and pickles both, and what is kept belongs to one object.
    __slots__ = ("_made",)

    # Pydantic would read them from the source of every class on import, which took half of the time of a command.
    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """The JSON Schema, with the docstrings of the fields as their descriptions."""
        described = handler(schema)
        table = handler.resolve_ref_schema(described)
        if "description" in table and (text := written_docstring(cls)) is not None:
            table["description"] = inspect.cleandoc(text)  # without the parameters, which are the properties
        for name, node in table.get("properties", {}).items():
            if "description" not in node and (text := docstring_of(cls, name)) is not None:
                node["description"] = text
        return described

    def __repr_args__(self) -> Iterator[tuple[str, Any]]:
        """Values that differ from their defaults; the ends of long lists."""
        for name, field in type(self).model_fields.items():
            value = getattr(self, name)
            if value != field.default:
                yield name, abridged(value)

    def _repr_html_(self) -> str:
        """All values with their units, for notebooks."""
        from .part_display import table

        return table(self)

    def __init__(self, /, *nameless: Any, **values: Any) -> None:
        if nameless:
            first = next(iter(type(self).model_fields))
            raise InputError(
                f"{self._subject()} takes its values by name, such as {first}=...; not {shown(nameless[0])}"
            )
        with self._one_error(values):
            super().__init__(**plain(values))

    # Parts within parts are made by pydantic itself, so that it knows where in the whole a value stands.
    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]

    @classmethod
    def model_validate(cls, obj: Any, **options: Any) -> Self:
        """Make the part from a mapping, as the constructor does."""
        with cls._one_error(obj):
            return super().model_validate(plain(obj), **options)

    @classmethod
    def like(cls, part: "Part", **others: Any) -> Self:
        """Make the part with the values that another one has under the same names. They are not checked again."""
        same = {name: getattr(part, name) for name in cls.model_fields if name in type(part).model_fields}
        return cls.model_construct(None, **same | others)

    @classmethod
    def of_parts(cls, **parts: Any) -> Self:
        """Make the part of parts that are not checked again. It is only checked whether they fit together."""
        made = cls.model_construct(None, **parts)
        try:
            for rule in cls.__pydantic_decorators__.model_validators.values():
                if rule.info.mode == "after":
                    rule.func(made)
        except InputError:
            raise
        except ValueError as problem:
            raise InputError(f"{cls._subject()} {problem}") from None
        return made

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy with changes, which are checked as in the constructor."""
        if not update:
            return super().model_copy(deep=deep)
        return type(self)(**({name: getattr(self, name) for name in self.model_fields_set} | dict(update)))

    def unchecked(self, **changes: Any) -> Self:
        """A copy with changes that are known to be valid, in a small part of the time of `model_copy`."""
        return super().model_copy(update=changes)

    @classmethod
    def model_validate_json(cls, json_data: str | bytes | bytearray, **options: Any) -> Self:
        """Make the part from JSON, as the constructor does."""
        with cls._one_error():
            return super().model_validate_json(json_data, **options)

    def kept_values(self) -> dict[Any, Any]:
        """Values that `inputs.cached_values.kept` keeps with this object."""
        try:
            values: dict[Any, Any] = object.__getattribute__(self, "_made")
        except AttributeError:
            values = {}
            object.__setattr__(self, "_made", values)
        return values

    def __setattr__(self, name: str, value: Any) -> None:
        if name.startswith("_"):  # of the object alone, such as what it keeps for later
            super().__setattr__(name, value)
            return
        raise InputError(f"{self._subject()} is frozen; make a changed one instead of setting {name}")

    @classmethod
    @contextmanager
    def _one_error(cls, given: Any = None) -> Iterator[None]:
        try:
            yield
        except RecursionError:
            raise InputError(
                f"{cls._subject()} is nested too deeply; write it with fewer levels of tables and lists"
            ) from None
        except ValidationError as error:
            raise refusal(error, _description(cls), cls._subject(), given) from None

    @classmethod
    def _described_by(cls) -> dict[str, Any]:
        """The JSON Schema with all keys that may be written."""
        return cls.model_json_schema()

    @classmethod
    def _subject(cls) -> str:
        """Name of the part in messages: the torsion curve."""
        name = cls.model_config.get("title") or cls.__name__.split("[")[0]
        return "the " + " ".join(re.findall("[A-Z]+(?![a-z])|[A-Z][a-z]*", name)).lower()


def rule(problems: Callable[[Any], Iterator[str]]) -> Any:
    """Rule of a part: a method that yields what is wrong with values that do not fit together. The first is reported."""

    @wraps(problems)
    def check(part: Part) -> Part:
        if problem := next(problems(part), ""):
            raise ValueError(problem)
        return part

    return model_validator(mode="after")(check)


@cache  # it takes longer than all the rest of a refusal
def _description(part: type[Part]) -> dict[str, Any]:
    return part._described_by()

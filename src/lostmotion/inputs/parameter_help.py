"""Text that `help` shows of a part: its parameters with units, ranges and defaults, in place of the internals of pydantic."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, dataclass_transform, get_args

from pydantic import BaseModel, Field
from pydantic.fields import FieldInfo

from ..units.conversion import Unit
from ..units.practical import printed
from .docstrings import docstring_of

if TYPE_CHECKING:
    from pydantic._internal._model_construction import ModelMetaclass as _Model
else:
    _Model = type(BaseModel)

_LIMITS = {"gt": "> ", "ge": "≥ ", "lt": "< ", "le": "≤ "}


@dataclass_transform(kw_only_default=True, field_specifiers=(Field,))
class PartType(_Model):
    """Type of parts. Their docstrings list their parameters, which the core describes or their fields state."""

    @property
    def __doc__(self) -> str | None:  # type: ignore[override]
        return documented(self)

    @property
    def __signature__(self) -> inspect.Signature:
        fields = vars(self).get("__pydantic_fields__", {}).items()
        defaults = {
            name: inspect.Parameter.empty if f.is_required() else f.get_default(call_default_factory=True)
            for name, f in fields
        }
        kind = inspect.Parameter.KEYWORD_ONLY
        return inspect.Signature([inspect.Parameter(name, kind, default=value) for name, value in defaults.items()])

    @__signature__.setter
    def __signature__(self, annotated: object) -> None:
        """Pydantic's own, whose annotations take a page, is left out."""

    def __dir__(self) -> list[str]:
        """Public names of the part itself, which pydantic's are not."""
        own = (base for base in self.__mro__ if base.__module__.startswith("lostmotion") and base.__name__ != "Part")
        names = {name for base in own for name, value in vars(base).items() if name[0] != "_" and callable(value)}
        return sorted((names - set(vars(BaseModel)) - {"core_fields", "fields_of"}) | {"model_copy"})


def written_docstring(cls: type) -> str | None:
    """Docstring of a class as it is in the source."""
    return vars(cls).get("__doc__")


def documented(cls: type) -> str | None:
    """Docstring of a part with the section of its parameters, unless it states one itself."""
    text = written_docstring(cls)
    fields = vars(cls).get("__pydantic_fields__")
    if not text or not fields or "Parameters\n---" in text:
        return text
    text = inspect.cleandoc(text)
    lines = [line for name, field in fields.items() for line in _lines(cls, name, field)]
    section = "\n".join(["Parameters", "----------", *lines])
    before, heading, after = text.partition("\n\nExamples\n---")
    return f"{before}\n\n{section}{heading}{after}"


def _lines(cls: type, name: str, field: FieldInfo) -> list[str]:
    notes = [*field.metadata, *_notes(field.annotation)]
    unit = next((note.unit for note in notes if isinstance(note, Unit)), None)
    limits = [
        sign + f"{v:g}" for key, sign in _LIMITS.items() for note in notes if (v := _number(note, key)) is not None
    ]
    tables = dict.fromkeys(_types(field.annotation))
    kind = [printed(unit) or "number"] if unit is not None else [_name(table) for table in tables]
    shown = isinstance(field.default, str | float) or (isinstance(field.default, bool | int) and unit is None)
    default = ["needed"] if field.is_required() else [f"default {field.default!r}"] * shown
    meaning = field.description or docstring_of(cls, name) or " ".join(filter(None, map(_purpose, tables)))
    parts = ", ".join(filter(None, dict.fromkeys([*kind, *limits, *default])))
    return [f"{name} : {parts}" if parts else name, *(f"    {line}" for line in meaning.splitlines())]


def _notes(annotation: Any) -> Iterator[Any]:
    """Annotations of a type and of the types within it."""
    yield from getattr(annotation, "__metadata__", ())
    for inner in get_args(annotation):
        yield from _notes(inner)


def _number(note: Any, key: str) -> float | None:
    value = getattr(note, key, None)
    return value if isinstance(value, int | float) else None


def _types(annotation: Any) -> Iterator[Any]:
    """Classes and values that an annotation allows."""
    inner = get_args(annotation)
    if annotation is not type(None) and not inner:
        yield annotation
    for one in inner[:1] if hasattr(annotation, "__metadata__") else inner:
        yield from [] if one is None else _types(one) if not isinstance(one, str) else [one]


def _name(one: Any) -> str:
    return re.sub(r"\[.*", "", one.__name__) if inspect.isclass(one) else repr(one) if isinstance(one, str) else ""


def _purpose(one: Any) -> str:
    text = written_docstring(one) if isinstance(one, PartType) else None
    return inspect.cleandoc(text).split("\n\n")[0].replace("\n", " ") if text else ""

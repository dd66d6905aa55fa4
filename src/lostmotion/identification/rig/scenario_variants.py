"""Scenarios that differ in a few numbers, made without checking again what does not differ."""

from collections.abc import Mapping
from functools import cache
from typing import Any, get_args, get_origin

from pydantic import TypeAdapter, ValidationError

from ...errors import InputError
from ...inputs.cached_values import keep
from ...inputs.named_elements import Named
from ...model.shaft import Shaft
from ...model.train import DriveTrain
from ...simulation.forms.set_by_dotted_key import set_values
from ...simulation.forms.train_tables import TrainTables
from ...simulation.scenario.scenario import Scenario


class Variants:
    """Scenarios like another one.

    Conditions between parts of a train are checked once for each set of changed keys. From then on only the elements
    that differ are checked.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._like = scenario
        self._data = scenario.model_dump()
        self._shafts = scenario.own_shafts() | {name: slide.shaft() for name, slide in scenario.slides.items()}
        self._checked: set[Any] = set()

    def __call__(self, changes: Mapping[str, Any]) -> Scenario:
        """The scenario with values by dotted key."""
        data = dict(self._data)
        set_values(data, changes.items())
        shape = tuple((key, _shape(value)) for key, value in changes.items())
        if shape in self._checked and (found := self._quickly(data)) is not None:
            return found
        scenario = Scenario(**data)
        self._checked.add(shape)
        return scenario

    def _quickly(self, data: Mapping[str, Any]) -> Scenario | None:
        """Nothing where the constructor has to say what is wrong, or where slides make shafts of several tables."""
        if self._like.slides:
            return None
        fields = {name: getattr(self._like, name) for name in TrainTables.model_fields}
        for table, elements in data.items():
            before = self._data[table]
            if elements is before:
                continue
            if (adapter := _element(table)) is None or elements.keys() != before.keys():
                return None
            try:
                fields[table] = Named(
                    {
                        name: fields[table][name] if element is before[name] else adapter.validate_python(element)
                        for name, element in elements.items()
                    }
                )
            except (ValidationError, InputError):
                return None
        found = TrainTables.model_construct(set(data), **fields)
        shafts = {
            name: self._shafts[name] if shaft is self._like.shafts[name] else Shaft.like(shaft)
            for name, shaft in found.shafts.items()
        }
        shafts = found.with_drag(shafts)
        for name, slide in found.slides.items():
            shafts[name] = self._shafts[name] if slide is self._like.slides[name] else slide.shaft()
        keep(found, TrainTables.train, DriveTrain.model_construct(None, shafts=Named(shafts), **found.elements()))
        return Scenario.of(found, checked=False)


@cache
def _element(table: str) -> TypeAdapter[Any] | None:
    """Reader of one element of a table of elements by name."""
    kind = TrainTables.model_fields[table].annotation
    return TypeAdapter(get_args(kind)[1]) if get_origin(kind) is dict else None


def _shape(value: Any) -> Any:
    """Shape of a value without its numbers."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float
    if isinstance(value, list | tuple):
        return tuple(map(_shape, value))
    if isinstance(value, Mapping):
        return tuple((key, _shape(inner)) for key, inner in value.items())
    return value

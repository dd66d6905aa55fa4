"""The table ``monitor`` of an identification file: what is watched over the life of a drive, and when it is an alarm."""

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from ...inputs.named_elements import Elements, nothing
from ...inputs.part import Part, rule
from ...inputs.quantities import Number, Whole

Limit = float | str | None


class Watch(Part):
    """A parameter that is watched."""

    direction: Literal["up", "down", "both"] = "both"  #: direction of the changes that are of interest
    min: Limit = None  #: least value without an alarm, SI or text with the unit of the parameter
    max: Limit = None  #: largest value without an alarm, SI or text with the unit of the parameter


class Monitoring(Part):
    """Settings for comparing the logs of a drive over its life."""

    watch: Elements[Watch] = Field(default_factory=nothing)
    """parameters that are watched, by name; left out, all that are free"""
    constant: tuple[str, ...] = ()
    """parameters that wear does not change, such as an inertia: they stay at their start values"""
    baseline: Annotated[Whole, Field(ge=5, le=1000)] = 20
    """number of logs at the beginning, in which the drive is as it should be"""
    model: str = ""  #: name of the model of the ladder; left out, the last
    order: str = ""
    """formula of the header by which logs are in order, such as ``hours``; left out, the order of their names"""
    conditions: tuple[str, ...] = ()
    """formulas of the header on which the values depend, such as ``mean_temperature``: their effect is estimated and taken away"""
    false_alarms: Annotated[Number, Field(gt=0.0, le=0.5)] = 0.01
    """largest probability of a false alarm within as many logs as `within`, all watched values together"""
    within: Annotated[Whole, Field(ge=10, le=100_000)] = 1000  #: logs behind the baseline

    @rule
    def _watches_what_changes(self) -> Iterator[str]:
        for name in self.constant:
            if name in self.watch:
                yield f"has {name} in watch and in constant; leave it out of one of them"
        if self.baseline < len(self.conditions) + 5:
            least = len(self.conditions) + 5
            yield f"has baseline = {self.baseline} with {len(self.conditions)} conditions; give it {least} or more"

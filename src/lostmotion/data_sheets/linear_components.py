"""The values of screws, racks, belts and linear motors in a scenario, from records with changes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

from ..errors import InputError, inside
from ..inputs.part import Part
from ..inputs.quantities import Force, Positive
from ..inputs.refusal_messages import shortened, shown, unknown_key
from ..model.notes import Noted
from ..reproducible import cbrt

if TYPE_CHECKING:
    from .linear_sheets import LinearSheet, ScrewSheet


class ScrewConditions(Part):
    """Conditions of use of the record of a screw: keys of `[screws.NAME]` beside `from`."""

    nut_preload: Annotated[Force, Positive] | None = None
    """preload of the nut; stiffness and drag of the record are scaled to it. Default: the preload of the record"""


def linear_table(kind: str, reference: str, changes: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Values of the table `where` for a record with `changes`. Each change replaces the keys that give the same quantity.

    kind: ``"screw"``, ``"rack"``, ``"belt"`` or ``"linear_motor"``.
    """
    from .linear_sheets import LinearSheet, ScrewSheet
    from .records import find

    record = find(reference, kind)
    assert isinstance(record, LinearSheet)
    conditions = ScrewConditions.model_fields if isinstance(record, ScrewSheet) else {}
    known = {*type(record).PART.model_fields, *conditions}
    for key in changes:
        if key not in known:
            raise InputError(unknown_key(key, known), f"{where}.{shortened(key)}")
    values = record.values()
    noted = Noted(values)
    own = {key: value for key, value in changes.items() if key not in conditions}
    values = _without_replaced(record, values, own) | own
    _need_all(record, reference, values, where)
    for key, partners in record.PARTNERS.items():
        if key not in own and not any(partner in values for partner in partners):
            values.pop(key, None)
    if isinstance(record, ScrewSheet) and "nut_preload" in changes:
        values |= {
            key: x for key, x in _at_preload(record, changes["nut_preload"], values, where).items() if key not in own
        }
    if "rated_force" in values and "rated_current" not in changes:
        values.pop("rated_current", None)
    if "peak_force" in values and "peak_current" not in changes:
        values.pop("peak_current", None)
    noted.keep_true(values)
    return values


def _without_replaced(record: LinearSheet, values: dict[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """The values of a record without the keys that a change replaces in another way."""
    replaced: set[str] = set()
    for ways in record.ALTERNATIVES:
        for way in ways:
            if any(key in changes for key in way):
                replaced |= {key for other in ways if other is not way for key in other}
    return {key: value for key, value in values.items() if key not in replaced}


def _need_all(record: LinearSheet, reference: str, values: Mapping[str, Any], where: str) -> None:
    for need, keys in record.NEEDS.items():
        if not any(key in values for key in keys):
            lacks = f"the record lacks {need}, see {record.where(need)}; give {where}.{need} beside `from`"
            raise InputError(lacks, table=where, record=shown(reference))
    open_choices = record.open_choices(values)
    if open_choices:
        what = " and ".join(f"{where}.{key} ({text})" for key, text in open_choices.items())
        raise InputError(f"give {what} beside `from`; no record says it", table=where, record=shown(reference))


def _at_preload(record: ScrewSheet, preload: Any, values: Mapping[str, Any], where: str) -> dict[str, float]:
    """Stiffness and drag of a nut at another preload: the stiffness of its Hertzian contacts grows as the cube root.

    If no drag is printed, it is computed for two halves of the nut that the preload presses against each other. One
    half drives while the other is driven back: (1/eta - eta_b) F p/(2 pi).
    """
    from ..model.screw import RatedScrew

    with inside(where):
        force = ScrewConditions(nut_preload=preload).nut_preload
        assert force is not None
        if record.nut_preload is None or record.nut_stiffness is None:
            raise InputError(
                f"scales the stiffness that a record has at another preload, and {record.name} has none; leave it out, and give "
                "nut_stiffness",
                "nut_preload",
            )
        share = force / record.nut_preload
        found = {"drag_torque": record.drag_torque * share}
        if "nut_stiffness" in values:
            found["nut_stiffness"] = record.nut_stiffness * cbrt(share)
        screw = RatedScrew(**values)
        if not record.drag_torque and (both := screw.efficiencies()) is not None:
            found["drag_torque"] = (1.0 / both[0] - both[1]) * force / screw.ratio()
    return found

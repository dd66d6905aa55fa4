"""The core's tables of names and parameters, from which Python and the binding are made."""

import typing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import BaseModel

import lostmotion as lm
from conftest import ROOT
from lostmotion import _core
from lostmotion.model.drive import Drive
from lostmotion.studies.runs.read_table import read_table
from lostmotion.studies.runs.runs_in_core import core_can
from lostmotion.units.conversion import Unit

# What the core has no use for as it stands in a file: ratings, texts, the two voltages of which it takes the ratio, and what
# makes a synchronous motor a DC motor.
# The line of a motor becomes its rated point.
LINE = {"motor.stall_torque", "motor.no_load_speed", "motor.stall_current", "motor.no_load_current"}
NOT_OF_THE_CORE = {"motor.rated_voltage", "motor.voltage_limit", "motor.dc_voltage"} | LINE
# A stiffness of the kind rigid has the flanks of a gear.
OF_THE_CORE_ALONE = {"motor.command_limit", "gearbox.flanks.backlash", "gearbox.flanks.restitution"}


def plain_numbers(part: Any, prefix: str) -> dict[str, str]:
    """Units of all fields of a part that are single numbers, by dotted key, laws of compliance and losses included."""
    found = {}
    for name, field in part.model_fields.items():
        if name in ("limits", "winding"):
            continue
        key = f"{prefix}{name}"
        units = [m.unit for m in (*field.metadata, *annotations_in(field.annotation)) if isinstance(m, Unit)]
        models = [a for a in (field.annotation, *typing.get_args(field.annotation)) if is_model(a)]
        if units and not models and "tuple" not in str(field.annotation):
            found[key] = units[0]
        for model in models:
            found |= plain_numbers(model, f"{key}.")
    return found


def is_model(annotation: Any) -> bool:
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def annotations_in(annotation: Any) -> list[Any]:
    nested = [annotations_in(a) for a in typing.get_args(annotation)]
    return [*getattr(annotation, "__metadata__", ()), *(m for each in nested for m in each)]


def test_every_number_of_a_drive_is_a_parameter_of_the_core_with_the_same_unit() -> None:
    ours = plain_numbers(Drive, "")
    curves = ("gearbox.stiffness.", "gearbox.mesh_stiffness.")  # become the curves of the core
    ours = {key: unit for key, unit in ours.items() if not key.startswith(curves)}
    assert ours.keys() >= {"motor.rotor_inertia", "gearbox.hysteresis.efficiency", "load.friction_torque"}
    core = dict(_core.parameters())
    assert core.keys() - OF_THE_CORE_ALONE == ours.keys() - NOT_OF_THE_CORE
    assert {key: core[key] for key in core.keys() & ours} == {key: ours[key] for key in core.keys() & ours}


def test_a_drive_of_the_core_refuses_a_parameter_that_it_does_not_know() -> None:
    with pytest.raises(ValueError, match=r"unknown keys among .*mass"):
        _core.Train().add_motor("m", shaft="motor", fields={"mass": 1.0})


def test_the_states_are_variables_and_what_a_run_can_start_from() -> None:
    names = _core.states()
    assert names == [n for n in lm.Initial.model_fields if n not in ("hysteresis_capacity", "on_reference")]
    assert set(names) <= {v.name for v in lm.simulation.VARIABLES}


def test_a_constant_efficiency_varies_in_the_core_as_in_single_runs(tmp_path: Path) -> None:
    base = lm.load(ROOT / "scenarios" / "paper-2dof-l-large.toml", ["simulation.duration=0.2"])
    study = lm.studies.Study(
        scenario=base, vary=[{"key": "gearbox.losses.efficiency", "values": [0.6, 0.7]}], keep={"end": "final(load_angle)"}
    )
    assert core_can(study)
    rows = read_table(lm.study(study, tmp_path / "s")).to_pydict()
    for value, end in zip((0.6, 0.7), rows["end"], strict=True):
        single = lm.simulate(base.replace(**{"gearbox.losses.efficiency": value}))
        assert end == float(single["load_angle"][-1])
    assert len(set(rows["end"])) == 2


def test_names_of_the_ledger_add_up_to_the_balance() -> None:
    result = lm.simulate(lm.load(ROOT / "scenarios" / "paper-2dof-nl-small.toml", ["simulation.duration=0.5"]))
    e = lm.energy_of(result)
    lost = sum(e[n] for n in _core.energy_entries()[1:8])
    assert e["source"] - lost - e["kinetic_change"] - e["elastic_change"] == pytest.approx(e["residual"], abs=1e-12 * e["turned_over"])


def test_a_cause_s_number_goes_with_what_the_contacts_do() -> None:
    result = lm.simulate(lm.load(ROOT / "scenarios" / "paper-2dof-nl-small.toml"))
    s = lm.switchings_of(result)
    flags, meanings = s["cause"].attrs["flag_values"], s["cause"].attrs["flag_meanings"].split()
    assert len(flags) == len(meanings)
    of = dict(zip(meanings, flags, strict=False))
    rest = s["cause"].values == of["came_to_rest"]
    contacts = [name.removesuffix("_before") for name in s if str(name).endswith("contact_before")]
    before = np.stack([s[f"{c}_before"].values for c in contacts])
    after = np.stack([s[f"{c}_after"].values for c in contacts])
    # Where a contact has come to rest one was slipping before; where one has broken away one was stuck.
    assert rest.any() and (np.abs(before[:, rest]) == 1).any(axis=0).all()
    free = s["cause"].values == of["broke_away"]
    assert free.any() and ((before[:, free] == 0) & (np.abs(after[:, free]) == 1)).any(axis=0).all()

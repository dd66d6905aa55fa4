"""Data sheets and records that several tests use."""

import math
from pathlib import Path

import lostmotion as lm
from conftest import ROOT
from lostmotion.data_sheets.gearbox_sheet import GearboxSheet
from lostmotion.data_sheets.loss_map_from_data_sheet import build_loss_map
from lostmotion.data_sheets.motor_sheet import MotorSheet
from lostmotion.data_sheets.records import catalogue

RPM = math.pi / 30.0
ARCMIN = math.pi / 10800.0
GEARBOXES = [r for r in catalogue() if isinstance(r, GearboxSheet)]
COMPLETE = [r for r in GEARBOXES if not r.missing()]
MOTORS = [r for r in catalogue() if isinstance(r, MotorSheet)]


def sheet(**changes) -> GearboxSheet:
    values = {
        "name": "sheet",
        "kind": "strain_wave",
        "ratio": 100,
        "rated_output_torque": "52 N*m",
        "rated_input_speed": "2000 rpm",
        "inertia": "0.193 kg*cm^2",
        "stiffness": {"slopes": [1.6e4, 2.5e4, 2.9e4], "torques": [7, 25]},
        "losses": {
            "efficiency": [{"input_speed": "2000 rpm", "efficiency": 0.77}],
            "no_load_torque": [{"input_speed": "2000 rpm", "torque": 0.105}],
            "starting_torque": 0.037,
            "backdriving_torque": 3.89,
        },
    }
    return GearboxSheet(**(values | changes))


def gearbox_of(record: GearboxSheet) -> lm.Gearbox:
    built = build_loss_map(record)
    curve = record.torsion()
    return lm.Gearbox(**record.scalars(), stiffness=curve, hysteresis=record.hysteresis(curve), losses=built.losses)


def scenario_with(tmp_path: Path, gearbox: str) -> Path:
    """The shipped scenario with another gearbox: a line of the top level, or a table."""
    text = (ROOT / "scenarios" / "catalogue-robot-joint.toml").read_text()
    start, end = text.index("[gearbox]"), text.index("[command]")
    path = tmp_path / "s.toml"
    if gearbox.startswith("["):
        path.write_text(text[:start] + gearbox + "\n" + text[end:])
    else:
        path.write_text(gearbox + "\n" + text[:start] + text[end:])
    return path

"""Changes to motor, gearbox and load: each key is felt, or refused in one line."""

import time
from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest

import lostmotion as lm
from lostmotion.data_sheets.components import Conditions
from lostmotion.model.gearbox import GearboxLimits
from lostmotion.model.losses import LossMap
from lostmotion.model.motor import MotorLimits
from lostmotion.model.torsion import Hysteresis, TorsionCurve
from lostmotion.simulation.forms.dotted_keys import set_values
from lostmotion.simulation.forms.drive_tables import LoadTable
from refusals import refused, refuses

# A catalogue motor and gearbox near their limits, so that every limit is judged.
BASE = {"load.torque": "2 Nm", "gearbox.limits.peak_output_torque": "1 Nm", "motor.limits.max_current": "10 A"}

# For each key another value. Refused are those that have no meaning here.
OF_STEPPERS = {
    "motor.steps_per_revolution": 400,
    "motor.holding_torque": "0.4 Nm",
    "motor.detent_torque": "10 mNm",
    "motor.torque_error": "1 mNm",
    "motor.standstill_current": 0.5,
    "motor.rated_current": "1 A",
    "motor.resistance_phase": "1 ohm",
    "motor.inductance_phase": "1 mH",
    "motor.supply_voltage": "24 V",
}
OTHER = OF_STEPPERS | {
    "motor.kind": "torque_source",
    "motor.rotor_inertia": "500 gcm2",
    "motor.friction_torque": "0.1 Nm",
    "motor.rated_torque": "0.5 Nm",
    "motor.rated_speed": "2500 rpm",
    "motor.rated_voltage": "48 V",
    "motor.electrical_time_constant": "5 ms",
    "motor.armature_voltage_constant": 10,
    "motor.voltage_limit": "12 V",
    "motor.stall_torque": "4 Nm",
    "motor.no_load_speed": "5000 rpm",
    "motor.stall_current": "30 A",
    "motor.no_load_current": "1 A",
    "motor.limits.continuous_torque": "0.1 Nm",
    "motor.limits.peak_torque": "0.2 Nm",
    "motor.note": "another one",
    "motor.limits.max_speed": "100 rpm",
    "motor.limits.resistance": "1 ohm",
    "motor.limits.torque_constant": "50 mNm/A",
    "motor.limits.thermal_resistance": "9 K/W",
    "motor.limits.thermal_resistance_winding_case": "2 K/W",
    "motor.limits.thermal_resistance_case_ambient": "2 K/W",
    "motor.limits.thermal_time_constant_winding": "20 ms",
    "motor.limits.thermal_time_constant_motor": "10 ms",
    "motor.winding": {"pole_pairs": 4},
    "motor.dc_voltage": "12 V",
    "motor.limits.max_winding_temperature": "90 degC",
    "motor.limits.max_inertia_ratio": 5,
    "motor.limits.max_voltage": "10 V",
    "motor.limits.max_current": "1 A",
    "gearbox.ratio": 80,
    "gearbox.inertia": "1e-4 kg*m^2",
    "gearbox.viscous_friction": 1e-4,
    "gearbox.rated_input_speed": "1000 rpm",
    "gearbox.rated_output_torque": "20 Nm",
    "gearbox.stiffness.kind": "rigid",
    "gearbox.stiffness.slopes": [1e4, 2e4, 3e4],
    "gearbox.stiffness.breaks": ["0.3 mrad", "2 mrad"],
    "gearbox.stiffness.backlash": "1 arcmin",
    "gearbox.stiffness.preload": "1 Nm",
    "gearbox.stiffness.backward": 1.5,
    "gearbox.hysteresis.efficiency": 0.8,
    "gearbox.losses.kind": "constant_efficiency",
    "gearbox.losses.speeds": [0, 1],
    "gearbox.losses.loads": [0, 1],
    "gearbox.losses.values": [[0, 1], [1, 2]],
    "gearbox.losses.mirrored": True,
    "gearbox.limits.average_output_torque": "1 Nm",
    "gearbox.limits.peak_output_torque": "2 Nm",
    "gearbox.limits.momentary_output_torque": "3 Nm",
    "gearbox.limits.average_input_speed": "100 rpm",
    "gearbox.limits.max_input_speed": "100 rpm",
    "gearbox.mesh_damping": "20 N*m*s/rad",
    "gearbox.mesh_stiffness": {"teeth": 30, "contact_ratio": 1.6, "fewer_pairs": 0.7},
    "gearbox.damping_limited": True,
    "gearbox.note": "worn",
    "gearbox.loss_range": [0.5, 2.0],
    "gearbox.temperature": "60 degC",
    "gearbox.added_backlash": "1 arcmin",
    "gearbox.loss_factor": 1.5,
    "load.inertia": "2 kg*m^2",
    "load.viscous_friction": 0.1,
    "load.friction_torque": "1 Nm",
    "load.torque": "3 Nm",
}
# Judged where a task asks for it: test_axis_tasks.py.
OF_TASKS = {f"gearbox.limits.{key}" for key in ("rated_life", "life_exponent", "max_radial_force", "max_axial_force")}
REFUSED = {
    **dict.fromkeys(OF_STEPPERS, 'kind "stepper"'),
    **{f"motor.{key}": "give both" for key in ("stall_torque", "no_load_speed", "stall_current", "no_load_current")},
    "motor.limits.thermal_resistance": "say the same",  # as both of its parts
    "motor.winding": "resistance_phase",
    "motor.dc_voltage": "winding",
    "gearbox.stiffness.kind": "gearbox.hysteresis",  # rigid, with hysteresis
    "gearbox.losses.kind": "gearbox.losses.efficiency",
    "gearbox.losses.speeds": "has a hole",
    "gearbox.losses.loads": "rows of values",
    "gearbox.losses.values": "rows of values",
    "gearbox.losses.mirrored": "must begin at 0",
    "gearbox.damping_limited": "needs mesh_damping",
}


def keys() -> set[str]:
    """All keys of motor, gearbox and load, with those of the tables that the record's parts have."""
    inner = {"motor.limits": MotorLimits, "gearbox.limits": GearboxLimits, "gearbox.stiffness": TorsionCurve}
    inner |= {"gearbox.hysteresis": Hysteresis, "gearbox.losses": LossMap}
    whole = {"motor": lm.Motor, "gearbox": lm.Gearbox, "load": LoadTable} | inner
    found = {f"{table}.{key}" for table, part in whole.items() for key in part.model_fields}
    return (found | {f"gearbox.{key}" for key in Conditions.model_fields}) - inner.keys()


def what_is_seen(scenario: lm.Scenario) -> tuple[object, ...]:
    result = lm.simulate(scenario)
    motion = [result[name].values.tobytes() for name in result.data_vars]
    try:
        heat = lm.sizing.temperatures(result)["case_temperature"].values.tobytes()
    except lm.InputError as lacking:  # such as the resistance of a torque source
        heat = str(lacking).encode()
    return (*motion, heat, result.attrs.get("note"), *map(str, lm.check_drive(scenario)))


def test_every_key_is_tried() -> None:
    assert keys() == OTHER.keys() | OF_TASKS


@pytest.mark.parametrize("key", OTHER)
def test_a_change_to_a_catalogue_part_is_felt_or_refused(key: str) -> None:
    before = what_is_seen(lm.load("catalogue-robot-joint", BASE))
    changes = BASE | {key: OTHER[key]}
    if key in REFUSED or key == "gearbox.temperature":
        assert REFUSED.get(key, "lubricant").split(".")[-1] in refused(lambda: lm.load("catalogue-robot-joint", changes))
        return
    assert what_is_seen(lm.load("catalogue-robot-joint", changes)) != before


@pytest.mark.parametrize("name", ["catalogue-robot-joint", "paper-2dof-nl-large"])
@pytest.mark.parametrize("how", ["set", "replace", "base", "saved"])
def test_half_the_command_at_twice_the_rated_voltage_is_the_same_motion(name: str, how: str, tmp_path: Path) -> None:
    """Volts turn a motor, whatever is called 1."""
    scenario = lm.load(name)
    voltage, amplitude = scenario.motor.rated_voltage, scenario.command.amplitude
    assert voltage is not None
    assert amplitude is not None
    changes = {"motor.rated_voltage": 2.0 * voltage, "command.amplitude": 0.5 * amplitude}
    if how == "set":
        changed = lm.load(name, [f"{key}={value}" for key, value in changes.items()])
    elif how == "replace":
        changed = scenario.replace(**changes)
    elif how == "base":
        text = f'base = "{name}"\nmotor.rated_voltage = "{2.0 * voltage} V"\ncommand.amplitude = {0.5 * amplitude}\n'
        (tmp_path / "other.toml").write_text(text)
        changed = lm.load(tmp_path / "other.toml")
    else:
        lm.save(lm.simulate(scenario), tmp_path / "result.csv")
        changed = lm.load(tmp_path / "result.csv", changes)
    assert changed.motor.rated_voltage == 2.0 * voltage
    first, second = lm.simulate(scenario), lm.simulate(changed)
    for variable in ("motor_torque", "motor_speed", "load_speed", "twist"):
        size = float(abs(first[variable]).max())
        # The parameters differ by rounding, which breaking away at standstill amplifies somewhat.
        np.testing.assert_allclose(second[variable], first[variable], rtol=0.0, atol=1e-9 * size)
    assert float(abs(lm.simulate(scenario.replace(**{"motor.rated_voltage": 2.0 * voltage}))["load_speed"]).max()) > 1.5 * float(
        abs(first["load_speed"]).max()
    )


def test_the_time_for_overrides_is_linear() -> None:
    tables = {"load": {"inertia": 2.0}, "shared": {"list": [1.0, {"x": 1.0}]}}
    before = deepcopy(tables)
    data = dict(tables)
    begin = time.process_time()
    set_values(data, ((f"load.k{k}", k) for k in range(200_000)))
    assert time.process_time() - begin < 10.0  # 1 s; copying the table for each took 100 s
    assert len(data["load"]) == 200_001
    set_values(data, [("shared.list.1.x", 2.0), ("shared.list.0", 3.0), ("shared.list.1.y", 4.0)])
    assert data["shared"] == {"list": [3.0, {"x": 2.0, "y": 4.0}]}
    assert tables == before


def test_what_is_given_beside_a_rated_voltage_does_not_follow_it() -> None:
    motor = lm.load("paper-2dof-nl-large").motor
    own = {"motor.rated_voltage": 48, "motor.rated_speed": 300, "motor.armature_voltage_constant": 3}
    for order in (own, dict(reversed(own.items()))):
        changed = lm.load("paper-2dof-nl-large", order).motor
        assert (changed.rated_voltage, changed.rated_speed, changed.armature_voltage_constant) == (48, 300, 3)
        assert changed.rated_torque == motor.rated_torque


def test_a_rated_voltage_that_does_not_reach_the_rated_torque_is_refused() -> None:
    with refuses("motor.rated_voltage"):
        lm.load("paper-2dof-nl-large", {"motor.rated_voltage": 7})


def test_a_torque_source_refuses_what_it_has_no_use_for() -> None:
    for name in ("catalogue-robot-joint", "paper-2dof-nl-large"):
        assert lm.load(name, {"motor.kind": "torque_source"}).motor.rated_speed is None
        for key, value in (("rated_speed", 300), ("rated_voltage", 24), ("armature_voltage_constant", 3)):
            with pytest.raises(lm.InputError, match=f"has {key}, of no use to a torque_source"):
                lm.load(name, {f"motor.{key}": value, "motor.kind": "torque_source"})


def test_two_limits_of_one_voltage_are_refused() -> None:
    refused(lambda: lm.load("catalogue-robot-joint", {"motor.voltage_limit": 24, "motor.limits.max_voltage": 24}), "motor")

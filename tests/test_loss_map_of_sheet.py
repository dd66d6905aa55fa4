"""Loss maps from data sheets."""

import math

import pytest

import lostmotion as lm
from lostmotion.data_sheets.loss_data import Lubricant
from lostmotion.data_sheets.loss_map_builder import build_loss_map
from lostmotion.data_sheets.records import find
from lostmotion.test_rig.virtual_rig import TestRig
from refusals import refused
from sheets import RPM, gearbox_of, sheet


def test_measured_nodes_carry_their_figure_and_their_origin():
    built = build_loss_map(sheet())
    speeds, loads, values = built.losses.whole()
    at = {(round(mu, 4), round(v, 4)): (values[j][k], built.origin[j][k]) for j, mu in enumerate(loads) for k, v in enumerate(speeds)}
    assert at[1.0, 1.0] == (pytest.approx(1 / 0.77 - 1), "efficiency (area 1)")
    assert at[0.0, 1.0] == (pytest.approx(100 * 0.105 / 52), "no-load torque (area 2)")
    assert at[0.0, 0.0] == (pytest.approx(100 * 0.037 / 52), "starting torque (area 3)")
    mu = round(-3.89 / 52, 4)
    assert at[mu, 0.0] == (pytest.approx(3.89 / 52), "back-driving torque (area 4)")
    assert all(o.startswith("filled in") or "(area" in o for row in built.origin for o in row)
    assert built.notes == ()


def test_the_efficiency_is_not_used_towards_zero_load():
    built = build_loss_map(sheet())
    core = built.losses.core()
    # Along mu (1/eta - 1) the loss would vanish with mu; here what turns the unloaded gearbox remains.
    assert core(1e-6, 1.0) == pytest.approx(100 * 0.105 / 52, rel=1e-4)


def test_a_contradiction_is_reported_with_both_figures():
    record = find("wittenstein-tp010-mf-10", "gearbox")
    built = build_loss_map(record)
    assert len(built.notes) == 1
    assert "0.64 N·m, 0.079 of rated torque" in built.notes[0]
    assert "efficiency 0.97 at load 1 leaves no more than 0.0309" in built.notes[0]
    gearbox = lm.gearbox(record.name)
    assert built.notes[0] in gearbox.note["losses"]  # and so in every result
    # The documented choice: no-load torque kept, the efficiency for what the load adds.
    eta = TestRig(gearbox).efficiency(record.rated_input_speed, 1.0)
    # The flywheel slows down by parts in a billion while the load settles.
    assert eta == pytest.approx(1 / (1 + 0.64 * 10 / 81 + 1 / 0.97 - 1), rel=1e-7)


def test_load_correction_gives_more_efficiencies():
    losses = sheet().losses.model_dump(exclude_none=True) | {"load_correction": [(0.25, 0.6), (0.5, 0.85), (1.0, 1.0)]}
    rig = TestRig(gearbox_of(sheet(losses=losses)))
    for load, factor in ((0.25, 0.6), (0.5, 0.85), (1.0, 1.0)):
        assert rig.efficiency(2000 * RPM, load) == pytest.approx(0.77 * factor, rel=1e-8)


def test_drive_and_backdrive_efficiency_hold_each_on_its_side():
    losses = {
        "efficiency": [{"input_speed": "1400 rpm", "efficiency": 0.8}],
        "backdrive_efficiency": [{"input_speed": "1400 rpm", "efficiency": 0.7}],
        "no_load_torque": [{"input_speed": "1400 rpm", "torque": 0.02}],
    }
    rig = TestRig(gearbox_of(sheet(losses=losses)))
    assert rig.efficiency(1400 * RPM, 1.0) == pytest.approx(0.8, rel=1e-8)
    assert rig.efficiency(1400 * RPM, -1.0) == pytest.approx(0.7, rel=1e-8)


def test_viscosity_follows_walther_and_scales_the_no_load_part():
    oil = Lubricant(viscosity_40="220 mm^2/s", viscosity_100="18.7 mm^2/s")
    assert oil.viscosity(40.0) == pytest.approx(220e-6, rel=1e-12)
    assert oil.viscosity(100.0) == pytest.approx(18.7e-6, rel=1e-12)
    # In the chart of ASTM D341, log log (nu + 0.7) over log T, an oil is a straight line.
    middle = math.sqrt(313.15 * 373.15) - 273.15
    chart = [math.log10(math.log10(oil.viscosity(t) * 1e6 + 0.7)) for t in (40.0, middle, 100.0)]
    assert chart[1] == pytest.approx(0.5 * (chart[0] + chart[2]), rel=1e-12)
    losses = sheet().losses.model_dump(exclude_none=True) | {"lubricant": oil.model_dump()}
    record = sheet(losses=losses)
    cold, warm = build_loss_map(record, temperature=0.0), build_loss_map(record, temperature=60.0)
    factor = (oil.viscosity(60.0) / oil.viscosity(0.0)) ** (2 / 3)
    ratio = warm.losses.core()(0.0, 1.0) / cold.losses.core()(0.0, 1.0)
    assert ratio == pytest.approx(factor, rel=1e-12)
    assert "60 °C" in warm.notes[0]


def test_no_load_torque_at_two_temperatures_is_used_between_and_refused_outside():
    points = [
        {"input_speed": "2000 rpm", "torque": 0.105, "temperature": "20 degC"},
        {"input_speed": "2000 rpm", "torque": 0.065, "temperature": "60 degC"},
    ]
    losses = sheet().losses.model_dump(exclude_none=True) | {"no_load_torque": points}
    record = sheet(losses=losses)
    at_40 = build_loss_map(record, temperature=40.0).losses.core()(0.0, 1.0)
    assert at_40 == pytest.approx(100 * 0.085 / 52)
    assert "from 20 to 60 °C, not at 80 °C" in refused(lambda: build_loss_map(record, temperature=80.0))


def test_figures_of_different_temperatures_are_each_taken_at_their_own():
    # No-load torque at 20 and 60 °C; starting torque measured cold, efficiency warm. At each figure's temperature the map
    # gives that figure back.
    losses = {
        "no_load_torque": [
            {"input_speed": "2000 rpm", "torque": 0.105, "temperature": "20 degC"},
            {"input_speed": "2000 rpm", "torque": 0.065, "temperature": "60 degC"},
        ],
        "efficiency": [{"input_speed": "2000 rpm", "efficiency": 0.8, "temperature": "60 degC"}],
        "starting_torque": 0.037,
        "starting_temperature": "20 degC",
        "backdriving_torque": 3.0,
        "backdriving_temperature": "60 degC",
    }
    record = sheet(losses=losses)
    cold, warm = (build_loss_map(record, temperature=t).losses.core() for t in (20.0, 60.0))
    assert cold(0.0, 0.0) == pytest.approx(100 * 0.037 / 52)
    assert warm(0.0, 0.0) == pytest.approx(100 * 0.037 / 52 * 65 / 105)
    assert warm(1.0, 1.0) == pytest.approx(1 / 0.8 - 1)
    assert cold(1.0, 1.0) == pytest.approx(1 / 0.8 - 1 + 100 * (0.105 - 0.065) / 52)
    assert warm(-3.0 / 52, 0.0) == pytest.approx(3.0 / 52)


def test_wear_adds_backlash_and_multiplies_losses():
    new, worn = (lm.gearbox("bonfiglioli-tr080-3-90"), lm.gearbox("bonfiglioli-tr080-3-90", added_backlash=2e-3, loss_factor=1.5))
    assert worn.stiffness.backlash - new.stiffness.backlash == pytest.approx(2e-3)
    assert worn.losses.core()(1.0, 1.0) == pytest.approx(1.5 * new.losses.core()(1.0, 1.0))

"""The virtual test rig."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import lostmotion as lm
from lostmotion.data_sheets.components import gearbox_table
from lostmotion.data_sheets.loss_map_builder import build_loss_map
from lostmotion.data_sheets.records import find
from lostmotion.model.losses import efficiency_map
from lostmotion.test_rig.comparison import compare
from lostmotion.test_rig.virtual_rig import TestRig
from refusals import refused
from sheets import ARCMIN, COMPLETE, RPM, gearbox_of, sheet


@pytest.mark.parametrize("family", ["schaeffler", "wittenstein", "bonfiglioli-tr", "bonfiglioli-tq", "paper"])
def test_the_rig_returns_the_figures_of_every_complete_record(family: str):
    records = [r for r in COMPLETE if r.name.startswith(family)]
    assert records
    for record in records:
        table, built = gearbox_table(record.name, {})
        for c in compare(TestRig(lm.Gearbox(**table)), record, built.notes):
            # Printed with two to four digits; a thousandth is finer than half a unit of any of their last ones.
            if c.remark:
                assert c.quantity.startswith("efficiency")
                assert any("Contradiction" in n for n in built.notes)
            else:
                assert abs(c.difference) < 1e-3, (record.name, c)


def test_stiffness_from_a_data_book():
    # A strain-wave gear of size 32, ratio 100: 60 N·m give 7.15e-4 rad (2.46 arcmin).
    record = sheet(stiffness={"slopes": [6.7e4, 1.1e5], "torques": [29]})
    twist, torque = TestRig(gearbox_of(record)).initial_loading_curve(60.0)
    assert float(np.interp(60.0, torque, twist)) == pytest.approx(7.15e-4, abs=0.5e-6)
    assert float(np.interp(60.0, torque, twist)) / ARCMIN == pytest.approx(2.46, abs=5e-3)


def test_hysteresis_loss_comes_back_as_the_width_of_the_loop_and_the_loop_has_the_energy_of_16():
    record = sheet(hysteresis_loss="0.6 arcmin")
    rig = TestRig(gearbox_of(record))
    loop = rig.loop(52.0)
    # A slow ramp is not infinitely slow: the load lags by parts in ten thousand.
    assert loop.width / ARCMIN == pytest.approx(0.6, rel=1e-4)
    # Both branches run between the same turning points, 2h apart: area 2h x twist, less the two corners where the
    # twist stands, which have no width.
    h = record.torsion_curve().torque(0.3 * ARCMIN)
    assert loop.area == pytest.approx(2.0 * h * np.ptp(loop.twist), rel=1e-3)


def test_a_rigid_gearbox_is_measured_but_for_its_torsion():
    """In a steady state it loses what the same gearbox with a torsion does, and breaks loose at the torques of its sheet."""
    compliant = TestRig(gearbox_of(sheet()))
    rig = TestRig(gearbox_of(sheet(stiffness=None, rigid=True)))
    for load in (1.0, 0.3, -1.0):
        assert rig.efficiency(200.0, load) == pytest.approx(compliant.efficiency(200.0, load), rel=1e-6)
    assert rig.no_load_torque(2000 * RPM) == pytest.approx(0.105, rel=1e-6)
    assert rig.starting_torque() == pytest.approx(0.037, rel=1e-6)
    assert rig.backdriving_torque() == pytest.approx(3.89, rel=1e-6)
    assert rig.lost_motion() == 0.0
    assert "a rigid gearbox has no torsion to measure" in refused(lambda: rig.loop(52.0))


def test_a_rigid_sheet_has_no_twist():
    assert "is rigid and has backlash" in refused(lambda: sheet(stiffness=None, rigid=True, backlash="1 arcmin"))


@pytest.mark.parametrize("stiffness", [{"kind": "rigid"}, {"kind": "linear", "stiffness": 100.0}])
def test_what_nothing_holds_starts_at_once(stiffness: dict):
    """Losses in proportion to the load alone: no torque is needed to start; driven backwards it holds only if it is self-locking."""
    for eta_b, torque in ((0.7, 0.0), (-0.2, None)):
        losses = efficiency_map(0.8, eta_b)
        rig = TestRig(lm.Gearbox(ratio=2, rated_input_speed=1, rated_output_torque=1, stiffness=stiffness, losses=losses))
        assert rig.starting_torque() == 0.0 and rig.backdriving_torque() == torque


@pytest.mark.parametrize("name", ["paper-1dof-l-large", "paper-2dof-l-large", "hunting-with-static-friction"])
def test_a_gear_without_friction_at_rest_starts_at_once(name: str):
    (gear,) = lm.load(name).train().gears.values()
    rig = TestRig(gear)
    assert rig.starting_torque() == 0.0 and rig.backdriving_torque() == 0.0


def test_inner_loops_remember_their_own_turning_point():
    rig = TestRig(gearbox_of(sheet(hysteresis_efficiency=0.9)))
    outer, inner = rig.loop(50.0), rig.loop(20.0)
    assert inner.width < 0.6 * outer.width
    assert outer.twist[0] == pytest.approx(outer.twist[-1], rel=1e-4)  # closed


def test_backlash_is_measured_as_printed_with_hysteresis_present():
    rig = TestRig(gearbox_of(sheet(backlash="4 arcmin", hysteresis_efficiency=0.95)))
    assert rig.backlash(7.0) / ARCMIN == pytest.approx(4.0, rel=1e-6)


def worm(name: str) -> lm.Gearbox:
    """A worm record with the figures it lacks."""
    changes = {"inertia": 1e-4, "stiffness": {"kind": "linear", "stiffness": 2e4}, "rated_output_torque": 70.0}
    table, _ = gearbox_table(name, changes)
    return lm.Gearbox(**(table | changes))


@pytest.mark.parametrize(
    ("name", "holds"), [("nord-sk1si50-60", True), ("motovario-sw050-60", True), ("motovario-sw050-10", False), ("nord-sk1si50-5", False)]
)
def test_a_worm_holds_its_load_without_power_if_its_static_efficiency_is_below_one_half(name: str, holds: bool):
    gearbox = worm(name)
    assert (find(name, "gearbox").losses.static_efficiency < 0.5) is holds
    drive = lm.Drive(
        motor=lm.Motor(kind="torque_source", rotor_inertia=1e-4), gearbox=gearbox, load=lm.Load(inertia=0.5, viscous_friction=20.0)
    )
    result = lm.simulate(drive, load_torque=-70.0, duration=2.0, sample_interval=0.01)
    turned = abs(float(result["motor_speed"][-1]))
    assert (turned == 0.0) is holds
    assert (TestRig(gearbox).backdriving_torque() is None) is holds


def test_static_efficiency_is_what_starting_under_load_shows():
    rig = TestRig(worm("motovario-sw050-60"))
    eta = 70.0 / (60 * rig.starting_torque(1.0))
    assert eta == pytest.approx(0.32, rel=1e-9)


plausible = st.fixed_dictionaries(
    {
        "eta": st.floats(0.2, 0.99),
        "no_load": st.none() | st.floats(1e-3, 0.5),
        "start": st.none() | st.floats(1e-3, 0.5),
        "back": st.none() | st.floats(1e-3, 1.2),
        "static": st.none() | st.floats(0.1, 0.95),
        "backdrive": st.none() | st.floats(0.05, 1.0),
        "low": st.none() | st.tuples(st.floats(0.1, 0.9), st.floats(0.1, 0.98)),
        "ratio": st.floats(3.0, 200.0),
    }
)


@settings(max_examples=60, deadline=None)
@given(figures=plausible, mu=st.floats(-1.4, 1.4), v=st.floats(0.05, 1.1))
def test_any_plausible_sheet_gives_a_passive_map(figures: dict, mu: float, v: float):
    ratio = figures["ratio"]
    at_input = 52.0 / ratio
    losses: dict = {"efficiency": [{"input_speed": "2000 rpm", "efficiency": figures["eta"]}]}
    if figures["low"]:
        load, eta = figures["low"]
        losses["efficiency"].append({"input_speed": "2000 rpm", "load": load, "efficiency": eta})
    if figures["no_load"]:
        losses["no_load_torque"] = [{"input_speed": "2000 rpm", "torque": figures["no_load"] * at_input}]
    if figures["start"]:
        losses["starting_torque"] = figures["start"] * at_input
    if figures["back"]:
        losses["backdriving_torque"] = figures["back"] * 52.0
    if figures["static"]:
        losses["static_efficiency"] = figures["static"]
    if figures["backdrive"]:
        losses["backdrive_efficiency"] = [{"input_speed": "2000 rpm", "efficiency": figures["backdrive"]}]
    record = sheet(ratio=ratio, losses=losses)
    built = build_loss_map(record)
    values = np.array(built.losses.values)
    assert np.all(np.isfinite(values))
    assert np.all(values >= 0.0)
    core = built.losses.core()
    # Continuous: across every grid line and diagonal the value changes by no more than a step is long.
    step = 1e-9
    slope = np.max(np.abs(values)) / min(np.min(np.diff(built.losses.speeds)), np.min(np.diff(built.losses.loads)))
    for x in built.losses.loads[1:-1]:
        assert abs(core(x - step, v) - core(x + step, v)) <= 4.0 * slope * step + 1e-12
    # Passive: the rig, with the motor driving, never finds an efficiency above 1, nor a loss that gives power.
    gearbox = gearbox_of(record)
    T_1, T_2 = TestRig(gearbox).steady(v * 2000 * RPM, mu)
    assert (T_1 - T_2 / ratio) >= -1e-9 * at_input
    contradictory = (figures["no_load"] or 0) > 1 / figures["eta"] - 1
    assert not contradictory or any("Contradiction" in n for n in built.notes)

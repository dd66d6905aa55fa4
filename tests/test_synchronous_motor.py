"""The synchronous motor with ideal field orientation: what data sheets print, the law of (2), and the equations in d and q."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import lostmotion as lm
from conftest import ROOT
from lostmotion.model.synchronous_motor import Winding
from lostmotion.studies.runs.read_table import read_table
from refusals import refusals_of, refused
from tables import rated_gearbox, run_of

RPM = math.pi / 30.0

WINDING = {
    "pole_pairs": 4,
    "resistance_line_to_line": "2 ohm",
    "inductance_d": "6 mH",
    "inductance_q": "9 mH",
    "voltage_constant_line_to_line_rms": "60 V/krpm",
}
MOTOR = {"kind": "synchronous", "rotor_inertia": "8 kgcm2", "rated_torque": 4.0, "dc_voltage": "560 V", "winding": WINDING}


def motor(**changes) -> lm.Motor:
    return lm.Motor(**{**MOTOR, **changes})


def axis(m: lm.Motor, command, load_inertia: float = 0.5, torque=0.0, duration: float = 0.1) -> lm.Scenario:
    return lm.Scenario(
        command=command,
        motor=m,
        gearbox=rated_gearbox(20.0, "3000 rpm", 80.0, {"kind": "rigid"}, 1.0),
        load={"inertia": load_inertia, "torque": torque},
        simulation=run_of(duration, duration / 200.0),
    )


# --- what data sheets print ---
def test_constants_of_one_motor_printed_in_all_ways_are_one_flux_linkage() -> None:
    """p psi = 0.6 V·s/rad, from the definitions: the induced voltage of a phase is p psi w cos(p w t)."""
    p_psi, p = 0.6, 5
    t = np.linspace(0.0, 2.0 * math.pi / p, 20_001)[:-1]  # one electrical turn at 1 rad/s
    a, b, c = (p_psi * np.cos(p * t - k * 2.0 * math.pi / 3.0) for k in range(3))
    rms = lambda u: float(np.sqrt(np.mean(u**2)))  # noqa: E731
    # Power u·i of the three phases with a current of amplitude 1 in phase with the voltage, at 1 rad/s, is the torque.
    per_peak = float(np.mean((a * a + b * b + c * c) / p_psi))
    # With block commutation the current of the supply flows through the two phases whose voltage is largest.
    block = float(np.mean(np.max([a - b, b - c, c - a, b - a, c - b, a - c], axis=0)))
    printed = {
        "flux_linkage": p_psi / p,
        "voltage_constant_line_to_line_rms": rms(a - b),
        "voltage_constant_line_to_line_peak": float((a - b).max()),
        "voltage_constant_phase_rms": rms(a),
        "voltage_constant_phase_peak": float(a.max()),
        "torque_constant_rms": per_peak * math.sqrt(2.0),
        "torque_constant_peak": per_peak,
        "torque_constant_block": block,
    }
    for key, value in printed.items():
        w = Winding(pole_pairs=p, resistance_phase=1.0, inductance_phase=1e-3, **{key: value})
        assert w.phase_values().flux_linkage == pytest.approx(p_psi / p, rel=1e-7), key  # of 20,000 points to a turn
    assert Winding(poles=10, resistance_phase=1.0, inductance_phase=1e-3, **printed).phase_values().pole_pairs == p


def test_resistance_and_inductance_of_a_phase_are_half_of_those_between_two_terminals() -> None:
    """Two phases in series; over the angle x of a salient rotor the inductance between two terminals is
    (L_d + L_q) + (L_q - L_d) cos(2 x)."""
    lines = {"resistance_line_to_line": 3.0, "flux_linkage": 0.1, "pole_pairs": 3}
    round_rotor = Winding(**lines, inductance_line_to_line=8e-3).phase_values()
    assert (round_rotor.resistance, round_rotor.inductance_d, round_rotor.inductance_q) == (1.5, 4e-3, 4e-3)
    L_d, L_q = 5e-3, 7e-3
    over_angle = (L_d + L_q) + (L_q - L_d) * np.cos(2.0 * np.linspace(0.0, math.pi, 101))
    salient = Winding(
        **lines, inductance_line_to_line_min=float(over_angle.min()), inductance_line_to_line_max=float(over_angle.max())
    ).phase_values()
    assert (salient.inductance_d, salient.inductance_q) == pytest.approx((L_d, L_q), rel=1e-15)


def test_the_printed_constants_of_1ft7042_agree() -> None:
    """87 V/krpm, line to line, rms, make 1.439 N·m to one ampere rms; 1.43 is printed."""
    w = Winding(
        poles=6,
        resistance_phase=1.0,
        inductance_phase=0.02,
        voltage_constant_line_to_line_rms="87 V/krpm",
        torque_constant_rms="1.43 N*m/A",
    )
    assert math.sqrt(2.0) * w.phase_values().torque_constant == pytest.approx(1.439, abs=5e-4)
    assert pytest.approx(1.439, abs=5e-4) == 0.01654 * 87.0


test_what_may_be_misread_is_refused_with_both_readings = refusals_of(
    lambda changes: motor(winding={key: value for key, value in {**WINDING, **changes}.items() if value is not None}),
    ({"resistance": "2 ohm"}, "winding: between two terminals or of one phase? "),
    ({"inductance": 0.01}, "winding: inductance_line_to_line"),
    ({"voltage_constant": "87 V/krpm"}, "winding: line to line or phase, rms or peak? Write voltage_constant_line_to_line_rms"),
    ({"torque_constant": "1.43 N*m/A"}, "winding: to one ampere rms, to one ampere peak, or with block commutation?"),
    ({"max_current": "10 A"}, "winding: rms or peak? Write max_current_rms (10 A rms) or max_current_peak (7.071 A rms)"),
    ({"peak_current": "ten"}, "winding: rms or peak? Write max_current_rms or max_current_peak"),
    ({"pole_pairs": None, "poles": 7}, "winding: poles come in pairs; if pairs are meant, write pole_pairs = 7, which are 14 poles"),
    ({"poles": 4}, "winding: give one: pole_pairs = 4, or poles = 4, which are 2 pairs"),
    ({"pole_pairs": None}, "winding: needs pole_pairs, or poles, which are twice as many"),
    ({"pole_pairs": 2.5}, "winding.pole_pairs: 2.5 must be a whole number"),
    ({"resistance_phase": 1.0}, "winding: needs one of resistance_phase, resistance_line_to_line"),
    ({"inductance_q": None}, "winding: has inductance_d and lacks inductance_q; give both, or inductance_phase"),
    ({"inductance_phase": 0.01}, "winding: needs its inductance in one way"),
    ({"voltage_constant_line_to_line_rms": None}, "winding: needs the strength of the magnets, one of flux_linkage"),
    ({"voltage_constant_line_to_line_rms": "0.8 Vs"}, "winding.voltage_constant_line_to_line_rms: lacks the angle"),
    ({"torque_constant_rms": 0.93}, "winding: make 0.93 and 0.9924 N·m to one ampere rms: 6.7 % apart, more than 5 %. If both"),
    ({"torque_constant_peak": 0.9924}, "winding: They differ by 1.414, as between rms and peak"),
    ({"torque_constant_rms": 1.7189}, "winding: They differ by 1.732, as between line to line and phase"),
    ({"torque_constant_rms": 0.7738}, "winding: They differ by 1.283, as between one ampere rms and block commutation"),
)  # fmt: skip


test_keys_that_do_not_go_together_are_refused = refusals_of(
    lambda changes: lm.Motor(**{key: value for key, value in {**MOTOR, **changes}.items() if value is not None or key == "winding"}),
    ({"rated_speed": "3000 rpm"}, ": has rated_speed, of no use to a synchronous motor; leave it out"),
    ({"winding": None}, ': lacks winding, which a motor of kind "synchronous" needs'),
    ({"dc_voltage": None}, ": lacks dc_voltage"),
    ({"dc_voltage": "9 V"}, ": stalls under its rated torque: that takes 9.873 V of dc_voltage, and 9 V are given"),
    ({"kind": "dc", "rated_speed": 300.0, "electrical_time_constant": 1e-3, "armature_voltage_constant": 3.0}, ": has a winding, which only"),
    ({"kind": "torque_source", "winding": None}, ": has a dc_voltage, which only a winding needs"),
    ({"limits": {"torque_constant": 1.0}}, ": has limits.torque_constant, which the winding says"),
    ({"limits": {"max_voltage": 300.0}}, ": has limits.max_voltage, which dc_voltage says"),
    ({"rated_torque": None}, ": lacks rated_torque"),
)  # fmt: skip


# --- the law ---
def test_stall_torque_no_load_speed_and_time_constant() -> None:
    """With full voltage, 560/sqrt(3) V: u = R i at rest, u = p psi w without load; the current rises with L_q/R."""
    m, u = motor(), 560.0 / math.sqrt(3.0)
    phase = m.winding.phase_values()
    dc = m.as_dc()
    assert dc.armature_voltage_constant * m.rated_torque == pytest.approx(1.5 * 4 * phase.flux_linkage * u / 1.0, rel=1e-15)
    assert m.unloaded_speed == pytest.approx(u / (4 * phase.flux_linkage), rel=1e-14)
    assert m.unloaded_speed == pytest.approx(560.0 / math.sqrt(2.0) / 60.0 * 1000.0 * RPM, rel=1e-14)  # line to line, rms
    # The rotor is as good as locked: 1e12 kg·m².
    result = lm.simulate(axis(m, 0.3, load_inertia=1e12, duration=0.05))
    expected = 1.5 * 4 * phase.flux_linkage * 0.3 * u * (1.0 - np.exp(-result["time"].values / 9e-3))
    assert result["motor_torque"].values == pytest.approx(expected, rel=1e-9, abs=1e-9)
    # Without load it ends at no-load speed, after 40 time constants of R J/(1.5 (p psi)²) and of L_q/R.
    ends = lm.simulate(axis(m, 1.0, duration=2.0))["motor_speed"][-1]
    assert float(ends) == pytest.approx(m.unloaded_speed, rel=1e-9)


def test_it_follows_the_equations_in_d_and_q_with_ideal_decoupling() -> None:
    """The full equations of a salient rotor, integrated by another solver: i_d stays 0, torque and speed agree to 1e-9."""
    m, u = motor(), 560.0 / math.sqrt(3.0)
    R, L_d, L_q, p = 1.0, 6e-3, 9e-3, 4
    psi = math.sqrt(2.0 / 3.0) * 60.0 / (1000.0 * RPM) / p
    J = 8e-4 + 0.5 / 20.0**2

    def rates(t: float, x: np.ndarray) -> list[float]:
        i_d, i_q, w = x
        w_e = p * w
        u_d = R * i_d - w_e * L_q * i_q  # decoupling, and nothing that drives i_d
        u_q = 0.7 * u * math.sin(2.0 * math.pi * 8.0 * t)
        torque = 1.5 * p * (psi * i_q + (L_d - L_q) * i_d * i_q)
        return [(u_d - R * i_d + w_e * L_q * i_q) / L_d, (u_q - R * i_q - w_e * (L_d * i_d + psi)) / L_q, (torque - 30.0 / 20.0) / J]

    scenario = axis(m, {"amplitude": 0.7, "frequency": 8.0}, torque=30.0, duration=0.3)
    result = lm.simulate(scenario)
    t = result["time"].values
    full = solve_ivp(rates, (0.0, t[-1]), [0.0, 0.0, 0.0], "DOP853", t, rtol=1e-13, atol=1e-12)
    i_d, i_q, w = full.y
    assert abs(i_d).max() == 0.0
    scale = abs(i_q).max()
    assert abs(result["motor_torque"].values - 1.5 * p * psi * i_q).max() < 1e-9 * 1.5 * p * psi * scale
    assert abs(result["motor_speed"].values - w).max() < 1e-9 * abs(w).max()
    second = lm.simulate(scenario, solver="dormand-prince", relative_tolerance=1e-12, energy=False)
    assert abs(second["motor_torque"].values - result["motor_torque"].values).max() < 1e-8 * 1.5 * p * psi * scale


def test_the_core_gets_the_numbers_of_the_dc_motor_that_it_equals() -> None:
    m = motor(friction_torque=0.05)
    for command in (0.4, 1.5):  # the second beyond what the amplifier can give: it stays at dc_voltage/sqrt(3)
        a, b = (lm.simulate(axis(x, command)) for x in (m, m.as_dc()))
        for name in a:
            assert np.array_equal(a[name].values, b[name].values, equal_nan=True), name
    limited = lm.simulate(axis(m, 1.0))
    assert np.array_equal(a["motor_torque"].values, limited["motor_torque"].values)


# --- all that takes a motor ---
def test_a_train_a_linear_model_and_an_explanation_take_it() -> None:
    scenario = axis(motor(), 0.4)
    of_dc = axis(motor().as_dc(), 0.4)
    train = lm.Scenario(
        shafts={"a": {}, "b": {"inertia": 0.5}},
        motors={"m": {"shaft": "a", **MOTOR}},
        gears={"g": {"input": "a", "output": "b", **scenario.gearbox.model_dump(exclude={"limits"})}},
        command={"m": 0.4},
        initial={"motor_torques": {"m": 1.0}},
        simulation={"duration": 0.1, "sample_interval": 1e-3},
    )
    start = scenario.replace(**{"initial.motor_torque": 1.0, "simulation.sample_interval": 1e-3})
    speeds = [lm.simulate(s)[v].values for s, v in ((train, "a_speed"), (start, "motor_speed"))]
    assert speeds[0] == pytest.approx(speeds[1], rel=1e-12, abs=1e-12)
    assert np.array_equal(*(lm.linearize(s, lm.Initial()).A for s in (scenario, of_dc)))
    assert lm.response.rigid_constants(scenario).bandwidth == lm.response.rigid_constants(of_dc).bandwidth
    assert lm.explain(scenario, 0.01).command_limit == 1.0
    assert lm.explain(train, 0.01).motors[0].command_limit == 1.0
    again = lm.Scenario.from_json(scenario.to_json())
    assert again == scenario
    assert "synchronous, 4 N·m" in repr(scenario)


def test_its_voltage_is_changed_by_dc_voltage_and_by_nothing_else(tmp_path) -> None:
    m, scenario = motor(), axis(motor(), 0.4)
    half = scenario.replace(**{"motor.dc_voltage": "280 V"})
    assert half.motor.unloaded_speed == pytest.approx(m.unloaded_speed / 2.0, rel=1e-15)
    assert "has its voltage from dc_voltage" in refused(lambda: m.at_voltage(300.0))
    refused(lambda: scenario.replace(**{"motor.rated_voltage": 300.0}), "motor")
    source = scenario.replace(**{"motor.kind": "torque_source"})
    assert source.motor.winding == m.winding
    with pytest.raises(lm.InputError, match="torque source has no speed"):
        _ = source.motor.unloaded_speed


@pytest.mark.parametrize(
    ("key", "values"),
    [("motor.rated_torque", [3.0, 5.0]), ("motor.dc_voltage", [300.0, 560.0]), ("motor.winding.resistance_line_to_line", [1.5, 2.5])],
)
def test_a_study_varies_it_as_single_runs_do(tmp_path, key, values) -> None:
    """The numbers of the core follow from these keys, so none is written into it by itself."""
    base = axis(motor(), 0.4)
    study = lm.studies.Study(scenario=base, vary=[{"key": key, "values": values}], keep={"end": "final(motor_speed)"})
    ends = read_table(lm.study(study, tmp_path / "s")).to_pydict()["end"]
    single = [float(lm.simulate(base.replace(**{key: v}))["motor_speed"][-1]) for v in values]
    assert ends == single
    if key == "motor.rated_torque":
        assert single[0] == pytest.approx(single[1], rel=1e-12)  # a mere scale


def test_a_current_loop_takes_it_as_the_dc_motor_that_it_equals() -> None:
    base = lm.load(ROOT / "scenarios" / "position-axis.toml", {"controller.current": {"kind": "pi"}})
    ends = []
    for m in (motor(rated_torque=0.5, rotor_inertia=8e-6), motor(rated_torque=0.5, rotor_inertia=8e-6).as_dc()):
        result = lm.simulate(lm.Scenario(**{**base.model_dump(), "motor": m.model_dump()}), duration=0.05)
        ends.append(result["motor_torque"].values)
    assert abs(ends[0]).max() > 0.0
    assert np.array_equal(*ends)

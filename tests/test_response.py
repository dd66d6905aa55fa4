"""Periodic motion, frequency response and linear models."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import lostmotion as lm
from conftest import ROOT, lostmotion
from html_pages import charts
from lostmotion import _core
from lostmotion.cli import app
from lostmotion.cli.grids import parse_grid
from lostmotion.paper import paper_scenario
from lostmotion.response.rigid import rigid_constants
from lostmotion.response.shooting import PERIODICITY
from refusals import refused

NONLINEAR = paper_scenario("2-DOF-NL", "large").drive()


def frictionless(model: str) -> lm.Drive:
    """The analysis (9) to (11) drops the dry friction of the motor."""
    drive = paper_scenario(model, "large").drive()
    motor = drive.motor.model_copy(update={"friction_torque": 0.0})
    return lm.Drive(motor=motor, gearbox=drive.gearbox, load=drive.load)


def two_inertias(rotor=1e12, inertia=0.01, damping=0.0, friction=0.0, **stiffness) -> lm.Drive:
    """A rotor, at rest where its inertia is 1e12, and a load on a spring of slope 4 N·m/rad or another."""
    laws = {"stiffness": lm.model.TorsionCurve(**({"slopes": (4.0,)} | stiffness)), "losses": lm.model.ConstantEfficiency(efficiency=1.0)}
    return lm.Drive(
        motor=lm.Motor(kind="torque_source", rotor_inertia=rotor),
        gearbox=lm.Gearbox(ratio=1.0, rated_input_speed=100.0, rated_output_torque=10.0, **laws),
        load=lm.Load(inertia=inertia, viscous_friction=damping, friction_torque=friction),
    )


def load_response(response, amplitude: float) -> np.ndarray:
    return response["response"].sel(output="load_speed", amplitude=amplitude).values


# --- linear ---
def test_rigid_drive_follows_the_closed_form_over_four_decades():
    drive = frictionless("1-DOF-L")
    frequencies = np.geomspace(0.1, 1000.0, 9)
    found = lm.frequency_response(drive, frequencies, 0.5)
    closed = rigid_constants(drive).response(frequencies, 90.0)
    assert np.max(np.abs(load_response(found, 0.5) / closed - 1.0)) < 1e-10
    # The linear presets also follow python-control.
    for linear, nonlinear in ((drive, found), (two := frictionless("2-DOF-L"), lm.frequency_response(two, frequencies, 0.5))):
        system = lm.linearize(linear).to_control()
        for output in ("load_speed", "motor_speed", "output_torque"):
            own = nonlinear["response"].sel(output=output, amplitude=0.5).values
            assert np.max(np.abs(own / system[output, "command"](2j * np.pi * frequencies) - 1.0)) < 1e-10, output


def test_rigid_trains_follow_the_closed_form_too():
    """Two gears in line and a branch: J = J_M + J_1 + (J_2 + J_4/(25 0.7))/(4 0.95) + J_3/(4 900 0.95 0.8), and b alike."""
    lossy = {"stiffness": {"kind": "rigid"}}
    scenario = lm.Scenario(
        shafts={
            "rotor": {"inertia": 1e-6},
            "middle": {"inertia": 3e-5, "viscous_friction": 1e-4},
            "arm": {"inertia": 0.4, "viscous_friction": 0.2},
            "fan": {"inertia": 2e-5},
        },
        motors={"m": {"shaft": "rotor", **frictionless("1-DOF-L").motor.model_dump(exclude_none=True)}},
        gears={
            "belt": lossy | {"input": "rotor", "output": "middle", "ratio": 2.0, "losses": {"kind": "constant_efficiency", "efficiency": 0.95}},
            "box": lossy | {"input": "middle", "output": "arm", "ratio": -30.0, "losses": {"kind": "constant_efficiency", "efficiency": 0.8}},
            "side": lossy | {"input": "middle", "output": "fan", "ratio": 5.0, "losses": {"kind": "constant_efficiency", "efficiency": 0.7}},
        },
        command={"m": {"amplitude": 0.1, "frequency": 1.0}},
        simulation={"duration": 0.1, "sample_interval": 0.01},
    )  # fmt: skip
    closed = rigid_constants(scenario)
    rotor = scenario.train().motors["m"].rotor_inertia
    wanted = rotor + 1e-6 + (3e-5 + 2e-5 / (25 * 0.7)) / (4 * 0.95) + 0.4 / (4 * 900 * 0.95 * 0.8)
    assert closed.inertia == pytest.approx(wanted, rel=1e-12)
    assert closed.viscous_friction == pytest.approx(1e-4 / (4 * 0.95) + 0.2 / (3600 * 0.95 * 0.8), rel=1e-12)
    frequencies = np.geomspace(0.1, 1000.0, 9)
    response = lm.frequency_response(scenario, frequencies, 0.5)["response"].sel(output="arm_speed", amplitude=0.5)
    assert np.max(np.abs(response.values / closed.response(frequencies, -60.0) - 1.0)) < 1e-10


def test_two_mass_resonance_and_antiresonance():
    # 700 N·m/rad between two inertias of 0.005 kg m2: 84.217 and 59.550 Hz.
    model = lm.linearize(two_inertias(rotor=0.005, inertia=0.005, slopes=(700.0,)))
    ((resonance, damping),) = model.resonances()
    assert resonance == pytest.approx(84.217, abs=5e-4)
    assert damping == pytest.approx(0.0, abs=1e-12)
    ((antiresonance, _),) = model.antiresonances("motor_speed")
    assert antiresonance == pytest.approx(59.550, abs=5e-4)


def test_linearisation_holds_where_the_input_sticks():
    model = lm.linearize(NONLINEAR, lm.Initial())  # at rest, command 0
    assert model.contacts["input_contact"] == 0
    assert np.all(model.A[1] == 0.0)  # the rotor does not move
    moving = lm.linearize(NONLINEAR, lm.Initial(motor_speed=100.0, load_speed=100.0 / 90.0, twist=2e-3), command=0.4)
    assert moving.contacts["input_contact"] == 1
    # Exact: a run that stays in the regime follows the matrix exponential.
    import scipy.linalg

    start = lm.Initial(motor_speed=100.0, load_speed=1.2, twist=2e-3, hysteresis_capacity=1.0)
    model = lm.linearize(NONLINEAR, start, command=0.4)
    run = lm.simulate(NONLINEAR, command=0.4, initial=start, duration=2e-4, sample_interval=2e-4)
    assert lm.switchings_of(run).sizes["switching"] == 0
    n = len(_core.states())
    whole = np.zeros((n + 1, n + 1))
    whole[:n, :n] = model.A
    whole[:n, n] = model.B[:, 0] * 0.4 + model.rate
    x0 = np.array([getattr(start, s) for s in _core.states()] + [1.0])
    end = scipy.linalg.expm(whole * 2e-4) @ x0
    for k, name in enumerate(_core.states()):
        assert float(run[name][-1]) == pytest.approx(end[k], rel=1e-11, abs=1e-14)


def test_without_an_operating_point_only_a_drive_of_one_regime_is_linearized():
    refused(lambda: lm.linearize(NONLINEAR), match=r"\(dry contacts: input_contact, twist_contact, a torsion curve of .*give one")
    assert "depends on the operating point" in refused(lambda: lm.linearize(NONLINEAR, command=0.4))
    linear = frictionless("2-DOF-L")
    moving = lm.Initial(motor_speed=-70.0, load_speed=2.0, twist=-3e-3)
    assert np.array_equal(lm.linearize(linear).A, lm.linearize(linear, moving, command=0.4).A)
    # Each of these alone makes the model depend on the operating point: here, and there, it is another.
    for key, value in {
        "motor.friction_torque": 0.1,
        "load.friction_torque": 0.1,
        "gearbox.stiffness": {"kind": "curve", "slopes": [2e4], "backlash": 1e-3},
        "gearbox.hysteresis": {"efficiency": 0.9},
        "motor.voltage_limit": 90.0,
    }.items():
        drive = lm.Scenario.of_any(linear).replace(**{"motor.rated_voltage": 90.0, key: value}).drive()
        refused(lambda drive=drive: lm.linearize(drive), match="depends on the operating point")
        here = lm.linearize(drive, lm.Initial())
        there = lm.linearize(drive, moving, command=2.0)
        assert not (np.array_equal(here.A, there.A) and np.array_equal(here.B, there.B)), key
    assert "twist contact is stuck" in str(lm.linearize(NONLINEAR, lm.Initial()))
    assert "motor_speed -70" in str(lm.linearize(linear, moving))


def test_scipy_and_control_get_the_same_model():
    model = lm.linearize(frictionless("2-DOF-L"))
    theirs, own = model.to_scipy(), model.to_control()
    for name in ("A", "B", "C", "D"):
        assert np.array_equal(getattr(theirs, name), getattr(model, name))
        assert np.array_equal(getattr(own, name), getattr(model, name))
    assert own.input_labels == ["command", "load_torque"]
    assert own.output_labels[2] == "load_speed"
    assert 'there is no "load_sped"' in refused(lambda: model.response(1.0, "load_sped"))


# --- periodic motion ---
def test_shooting_agrees_with_long_transients():
    for amplitude, frequency in ((1.0275, 3.0), (0.025, 5.0), (0.1, 20.0)):
        command = lm.CommandSignal(amplitude=amplitude, frequency=frequency)
        motion = lm.periodic_motion(NONLINEAR, command)
        assert motion.attrs["residual"] < 1e-12
        periods = 200
        run = lm.simulate(NONLINEAR, command=command, duration=periods / frequency, sample_interval=1.0 / (64 * frequency))
        for name in ("motor_torque", "motor_speed", "load_speed", "twist"):
            last, own = run[name].values[-65:-1], motion[name].values[::32]
            assert np.max(np.abs(last - own)) < 1e-9 * np.max(np.abs(own)), (amplitude, name)


@pytest.mark.parametrize(("amplitude", "frequency"), [(0.3, 40.0), (1.0, 60.0), (0.06, 25.0), (0.025, 15.0)])
def test_the_jacobian_agrees_with_finite_differences_of_the_return_map(amplitude: float, frequency: float):
    command = lm.CommandSignal(amplitude=amplitude, frequency=frequency)
    motion = lm.periodic_motion(NONLINEAR, command)
    assert motion.attrs["smooth"]
    names = [*_core.states()[:4], "hysteresis_capacity"]
    start = {name: motion.attrs[f"start_{name}"] for name in (*_core.states(), "hysteresis_capacity")}

    def after_one_period(changed: dict[str, float]) -> np.ndarray:
        run = lm.simulate(
            NONLINEAR,
            command=command,
            duration=1.0 / frequency,
            sample_interval=1.0 / frequency,
            initial=lm.Initial(**(start | changed)),
            energy=False,
        )
        end = json.loads(run.attrs["end_state"])
        return np.array([end[name] for name in names])

    assert np.allclose(after_one_period({}), [start[n] for n in names], rtol=1e-9, atol=1e-13)
    sizes = {name: float(abs(motion[name]).max()) for name in _core.states()[:4]} | {"hysteresis_capacity": 1.0}
    scale = np.array([sizes[n] for n in names])
    for name in names:
        if name == "motor_speed" and start[name] == 0.0:
            continue  # a standing shaft has no neighbours to both sides of it
        # Central difference with a step of 1e-6: error 1e-12 of the curvature, and 1e-9 from rounding.
        step = 1e-6 * sizes[name]
        forward, backward = (after_one_period({name: start[name] + s * step}) for s in (1, -1))
        numeric = (forward - backward) / (2.0 * step)
        exact = motion["jacobian"].sel(by=name, to=names).values
        assert np.max(np.abs(exact - numeric) / scale) * sizes[name] < 1e-5, name


def test_floquet_multipliers_tell_decay():
    # Damped oscillator: multipliers exp((-xi +- i sqrt(1 - xi^2)) omega T).
    k, J, xi, f = 4.0, 0.01, 0.1, 5.0
    omega = math.sqrt(k / J)
    motion = lm.periodic_motion(two_inertias(damping=2.0 * xi * omega * J), load_torque=lm.TorqueSignal(amplitude=0.1, frequency=f))
    size = math.exp(-xi * omega / f)
    found = np.hypot(motion.attrs["multipliers_real"], motion.attrs["multipliers_imag"])
    # motor speed stays what it is (1), twist and load speed decay; twist and angle of the flywheel are tied.
    assert np.sum(np.abs(found - size) < 1e-9) == 2
    assert motion.attrs["stable"]


def test_coexisting_motions_and_subharmonics_of_a_load_in_backlash():
    # A load that rattles through its backlash at three times its period, beside one that swings inside the gap.
    k, J = 39.478, 0.01
    drive = two_inertias(slopes=(k,), inertia=J, damping=2 * 0.02 * math.sqrt(k * J), backlash=2e-3)
    torque = lm.TorqueSignal(amplitude=1e-3 * k, frequency=20.0)
    starts = [lm.Initial(), lm.Initial(twist=5e-3), lm.Initial(twist=5e-3, load_speed=0.3)]
    found = lm.response.periodic_motions(drive, load_torque=torque, starts=starts, multiples=(1, 3))
    tall = [m for m in found if float(np.ptp(m["twist"].values)) > 2e-3]
    assert {round(m.attrs["period"] * 20.0) for m in tall} == {3}
    assert all(m.attrs["stable"] and m.attrs["residual"] < PERIODICITY for m in tall)
    assert any(round(m.attrs["period"] * 20.0) == 1 for m in found)
    # The transient from a tall motion stays with it.
    m = tall[0]
    start = {name: m.attrs[f"start_{name}"] for name in _core.states()}
    run = lm.simulate(
        drive, load_torque=torque, duration=30 * m.attrs["period"], sample_interval=m.attrs["period"] / 64, initial=lm.Initial(**start)
    )
    assert np.max(np.abs(run["twist"].values[-65:-1] - m["twist"].values[::32])) < 1e-6 * 4e-3


# --- Coulomb friction, closed forms ---
@pytest.mark.parametrize("r", [0.5, 0.8, 1.3, 2.0])
def test_den_hartogs_oscillator_with_dry_friction(r: float):
    """J. P. Den Hartog, Forced vibrations with combined Coulomb and viscous friction, Trans. ASME 53 (1931) APM-53-9.

    Without a stop: amplitude x0 = (P/k) sqrt(V^2 - (F/P)^2 U^2) with V = 1/(1 - r^2), U = sin(pi/r)/(r (1 + cos(pi/r))).
    """
    k, J, P, F = 4.0, 0.01, 1.0, 0.15
    omega = math.sqrt(k / J)
    drive = two_inertias(inertia=J, friction=F)
    torque = lm.TorqueSignal(amplitude=P, frequency=r * omega / (2.0 * math.pi))
    motion = lm.periodic_motion(drive, load_torque=torque)
    V, U = 1.0 / (1.0 - r * r), math.sin(math.pi / r) / (r * (1.0 + math.cos(math.pi / r)))
    amplitude = P / k * math.sqrt(V * V - (F / P) ** 2 * U * U)
    assert not np.any(motion["load_contact"].values[motion["load_speed"].values != 0.0] == 0)
    # The highest of 2048 samples lies below the crest by (pi/2048)^2/2.
    assert 0.5 * float(np.ptp(motion["twist"].values)) == pytest.approx(amplitude, rel=3e-6)


def stops(share: float) -> tuple[int, object]:
    """Number of stretches in which a free mass under P sin(wt) is at rest, with friction F = share P, and the motion."""
    motion = lm.periodic_motion(two_inertias(slopes=(1e-9,), friction=share), load_torque=lm.TorqueSignal(amplitude=1.0, frequency=1.0))
    stuck = motion["load_contact"].values == 0
    return int(np.sum(stuck & ~np.roll(stuck, 1))), motion


def test_stick_slip_boundary_and_two_stops_of_a_mass_with_dry_friction():
    # Without stops the friction is a square wave in step with the speed; it may be up to P/sqrt(1 + (pi/2)^2).
    boundary = 1.0 / math.sqrt(1.0 + (math.pi / 2.0) ** 2)
    assert stops(0.98 * boundary)[0] == 0
    assert stops(1.02 * boundary)[0] == 2
    # With stops: it starts where P sin = F, and stops where the impulse since then is zero.
    F = 0.75
    count, motion = stops(F)
    assert count == 2
    begin = math.asin(F)
    from scipy.optimize import brentq

    end = brentq(lambda x: math.cos(begin) - math.cos(x) - F * (x - begin), begin + 0.5, begin + math.pi)
    moving = np.flatnonzero(motion["load_contact"].values != 0)
    moves = (end - begin) / math.pi * len(motion["time"])  # twice a period
    assert len(moving) == pytest.approx(moves, abs=2)


# --- the response ---
def test_the_result_does_not_depend_on_the_number_of_threads():
    frequencies, amplitudes = np.geomspace(0.3, 30.0, 7), [0.02, 0.3]
    one, two, five = (lm.frequency_response(NONLINEAR, frequencies, amplitudes, threads=n) for n in (1, 2, 5))
    assert one.identical(two)
    assert one.identical(five)


def test_motions_of_the_response_repeat_to_rounding():
    response = lm.frequency_response(NONLINEAR, np.geomspace(0.1, 100.0, 16), [0.025, 0.2, 1.0275])
    assert np.all(response["reason"].values == "")
    assert float(response["residual"].max()) < 1e-12
    assert np.all(response["stable"].values)
    assert np.all(np.abs(response["angle_advance"].values) < 1e-9)
    frequency = response["frequency"].values[5]
    data = lm.response.to_control(response, 0.2).frequency_response(2 * np.pi * np.array([frequency]))
    assert np.allclose(data.frdata.ravel(), load_response(response, 0.2)[5])
    # Friction holds whatever a command of 0.01 gives: stuck all the period is a solution with no response.
    stuck = lm.frequency_response(NONLINEAR, [0.5, 5.0], [0.01])
    assert np.all(stuck["reason"].values == "") and np.all(load_response(stuck, 0.01) == 0.0)
    assert lm.response.characteristics(stuck, NONLINEAR).attrs["dead_zone_forward"] > 0.01
    # A load that advances each period is periodic all the same.
    motion = lm.periodic_motion(NONLINEAR, lm.CommandSignal(mean=0.5, amplitude=0.1, frequency=2.0))
    assert motion.attrs["residual"] < 1e-12
    assert 0.1 < motion.attrs["angle_advance"] == pytest.approx(float(motion["load_speed"].mean()) * 0.5, rel=1e-9)


def test_response_depends_on_amplitude_as_in_the_paper():
    response = lm.frequency_response(NONLINEAR, np.geomspace(0.1, 20.0, 20), [0.025, 1.0275])
    gain = np.abs(response["response"].sel(output="load_speed").values)
    assert gain[0, 0] < 0.5 * gain[1, 0]
    band = lm.response.characteristics(response, NONLINEAR)
    assert float(band["bandwidth"].sel(amplitude=1.0275)) == pytest.approx(2.45, rel=0.15)
    # Mean power: what the motor gives goes into gear, dampers and friction; the gear loses some of it.
    assert np.all(response["gear_loss"].values > 0.0)
    assert np.all(response["motor_power"].values > response["gear_loss"].values)


def test_load_torque_as_the_source_gives_compliance():
    # A linear oscillator: F(twist)/F(M_Z) = 1/(k - J w^2 + i b w), with the sign of a torque that pulls back.
    k, J, b = 4.0, 0.01, 0.02
    frequencies = np.array([0.5, 2.0, 6.0])
    response = lm.frequency_response(two_inertias(inertia=J, damping=b), frequencies, [0.1], source="load_torque")
    w = 2.0 * np.pi * frequencies
    own = response["response"].sel(output="twist", amplitude=0.1).values
    assert np.max(np.abs(own * (k - J * w**2 + 1j * b * w) - 1.0)) < 1e-9


def test_frequencies_are_added_where_the_curve_bends():
    drive = frictionless("2-DOF-L")
    coarse = np.geomspace(10.0, 300.0, 8)
    response = lm.frequency_response(drive, coarse, [0.1], refine=0.5)
    added = sorted(set(response["frequency"].values.tolist()) - set(coarse.tolist()))
    assert len(added) >= 8
    # Most of them about the anti-resonance-resonance pair, which is all there is to see.
    (f_r, _) = lm.linearize(drive).resonances()[-1]
    near = [f for f in added if f_r / 3.0 < f < f_r * 3.0]
    assert len(near) > 0.6 * len(added)
    exact = lm.linearize(drive).response(response["frequency"].values)
    assert np.max(np.abs(load_response(response, 0.1) / exact - 1.0)) < 1e-9


def test_bandwidth_is_where_the_gain_has_fallen_by_three_decibels():
    linear = frictionless("2-DOF-L")
    found = lm.response.bandwidth(linear, 0.5)
    gain = np.abs(lm.linearize(linear).response(np.array([0.1, found])))
    assert gain[1] / gain[0] == pytest.approx(math.sqrt(0.5), rel=1e-7)
    # Of the drive with friction it depends on the amplitude, and agrees with the curve it is read from otherwise.
    near = np.geomspace(0.1, 20.0, 60)
    for amplitude in (0.1, 1.0):
        curve = lm.response.characteristics(lm.frequency_response(NONLINEAR, near, amplitude), NONLINEAR)
        assert lm.response.bandwidth(NONLINEAR, amplitude) == pytest.approx(float(curve["bandwidth"][0]), rel=2e-3)
    assert math.isnan(lm.response.bandwidth(linear, 0.5, highest=1.0))
    with pytest.raises(RuntimeError, match="does not move"):
        lm.response.bandwidth(NONLINEAR, 1e-3)
    assert "must be positive" in refused(lambda: lm.response.bandwidth(linear, 0.0))


@pytest.mark.parametrize(("call", "match"), [
    (lambda: lm.frequency_response(NONLINEAR, [], [1.0]), "at least one"),
    (lambda: lm.frequency_response(NONLINEAR, [-1.0], [1.0]), "positive"),
    (lambda: lm.frequency_response(NONLINEAR, [1.0], [0.0]), "positive"),
    (lambda: lm.frequency_response(NONLINEAR, [1.0], [0.1], source="reference"), "must be command or load_torque"),
    (lambda: lm.periodic_motion(NONLINEAR, 0.3), "at least one sine"),
    (lambda: lm.periodic_motion(NONLINEAR, lm.CommandSignal(steps=[{"height": 1.0}])), "mean and sines only"),
    (lambda: lm.periodic_motion(NONLINEAR, lm.CommandSignal(amplitude=1.0, frequency=1.0), multiple=0), "must be a whole number above 0"),
    (lambda: lm.periodic_motion(NONLINEAR, lm.CommandSignal(sines=[{"amplitude": 1, "frequency": 1}, {"amplitude": 1, "frequency": math.pi}])), "no common period"),
])  # fmt: skip
def test_bad_questions_get_one_clear_answer(call, match: str):
    with pytest.raises(ValueError, match=match):
        call()


def test_a_motion_that_does_not_settle_is_reported_and_not_made_up():
    motion = "no periodic motion was found: not periodic after"
    with pytest.raises(RuntimeError, match=motion):
        # An undamped oscillator keeps its free swing for ever, and Newton has none to choose.
        lm.periodic_motion(
            two_inertias(backlash=1e-3),
            load_torque=lm.TorqueSignal(amplitude=0.5, frequency=3.183098861837907),
            start=lm.Initial(twist=0.02),
            max_periods=6,
        )


# --- the command ---
def test_the_command_writes_figures_and_tables(tmp_path: Path):
    linear = ROOT / "scenarios" / "paper-2dof-l-large.toml"
    words = ["--amplitudes", "0.01,0.1,1", "--frequencies", "0.5..20:6", "--compare", str(linear), "-o", str(tmp_path / "out")]
    done = CliRunner().invoke(app, ["response", str(ROOT / "scenarios" / "paper-2dof-nl-large.toml"), *words])
    assert done.exit_code == 0, done.output
    assert "18 of 18 motions found" in done.output
    assert "dead zone" in done.output
    names = {p.name for p in (tmp_path / "out").iterdir()}
    assert names == {"response.html", "bode.csv", "response.csv", "response.nc", "characteristics.csv"}
    gain, _, *maps = charts((tmp_path / "out" / "response.html").read_text())
    assert len(maps) == 4
    import xarray as xr

    with xr.open_dataset(tmp_path / "out" / "response.nc") as opened:
        stored = opened.load()
    own = lm.frequency_response(NONLINEAR, np.geomspace(0.5, 20.0, 6), [0.01, 0.1, 1.0])
    assert np.array_equal(stored["response_real"].values, own["response"].values.real)
    table = np.genfromtxt(tmp_path / "out" / "response.csv", delimiter=",", skip_header=1, usecols=range(4))
    values = own["response"].sel(output="load_speed").values.ravel()
    assert np.allclose(table[:, 2], np.abs(values), rtol=1e-12)
    for line, row in zip(gain["lines"][:3], own["response"].sel(output="load_speed").values, strict=True):
        assert np.array_equal(np.nan_to_num(line["y"]), np.abs(row))  # no motion has no place on a logarithmic axis


def test_scenarios_of_one_name_are_compared_and_not_taken_for_each_other(tmp_path: Path) -> None:
    """A changed scenario beside itself, and a file of the same name from another directory."""
    scenario, other = "paper-2dof-l-large", tmp_path / "other" / "paper-2dof-l-large.toml"
    other.parent.mkdir()
    other.write_text('base = "paper-2dof-l-large"\nload.inertia = 4.0\n')
    words = ["--amplitudes", "1.0", "--frequencies", "0.5,2.0", "--set", "load.inertia=3.0", "-o", str(tmp_path / "o")]
    done = CliRunner().invoke(app, ["response", scenario, *words, "--compare", scenario, "--compare", str(other)])
    assert done.exit_code == 0, done.output
    gain, *_ = charts((tmp_path / "o" / "response.html").read_text())
    for inertia, line in zip((3.0, lm.load(scenario).load.inertia, 4.0), gain["lines"], strict=True):
        changed = lm.load(scenario, {"load.inertia": inertia})
        found = lm.frequency_response(changed, [0.5, 2.0], [1.0])["response"].sel(output="load_speed")
        assert line["y"].tolist() == np.abs(found.values[0]).tolist()
    done = CliRunner().invoke(app, ["response", scenario, *words, *["--compare", scenario] * 2])
    assert str(done.exception) == f"--compare {scenario}: is given twice; leave one out"
    done = CliRunner().invoke(app, ["response", scenario, "--compare", "given-motion"])
    assert str(done.exception).startswith("given-motion: response: key shafts.crank.speed gives the motion")
    still = ["--amplitudes", "0.001,0.002", "--frequencies", "1.0,5.0", "-o", str(tmp_path / "still"), "--figures", "png"]
    done = CliRunner().invoke(app, ["response", "paper-2dof-nl-large", *still])  # a drive that never moves still gets its figures
    assert done.exit_code == 0, done.output
    assert (tmp_path / "still" / "bode.png").exists() and "no values" in (tmp_path / "still" / "response.html").read_text()


def test_lists_of_values_are_read_alike() -> None:
    for text, values in (
        ("0.025,0.1,1", [0.025, 0.1, 1.0]),
        ("1,2,5", [1.0, 2.0, 5.0]),  # three cannot be one number
        ("1.0,5.0", [1.0, 5.0]),
        ("0.5", [0.5]),
        ("10 %, 50 %", [0.1, 0.5]),
        ("0.01..1:3", [0.01, 0.1, 1.0]),
    ):
        assert parse_grid(text, "amplitudes") == pytest.approx(values)
    assert parse_grid("2 Hz,1 kHz", "frequencies", "Hz") == [2.0, 1000.0]
    for text in ("0,5", "1,5,025", "1,000", "", ",", "1..2", "1..2:0", "0..1:3", "nan", "1,-2.0", "1e400"):
        refused(lambda text=text: parse_grid(text, "amplitudes"), match=f"^--amplitudes {re.escape(text)}: ")


@pytest.mark.parametrize(("words", "match"), [
    (["--amplitudes", "a"], "--amplitudes a: must be numbers"),
    (["--amplitudes", "0.0,1.0"], "above 0"),
    (["--amplitudes", "1,5"], "may be a list or a decimal comma; write 1.0,5.0 or 1.5"),
    (["--amplitudes", "0,025"], "has a decimal comma in 0,025; write 0.025"),
    (["--frequencies", "1,5 Hz..10 Hz:3"], "has a decimal comma"),
    (["--frequencies", "60 rpm"], "is a speed of rotation, not a frequency"),
    (["--frequencies", "1..x:3"], "--frequencies 1..x:3"),
    (["--input", "reference"], "--input reference"),
    (["--variable", "speed"], "--variable speed"),
    (["--compare", "none.toml"], "no such file"),
])  # fmt: skip
def test_the_command_refuses_bad_options_in_one_line(tmp_path: Path, words: list[str], match: str):
    done = lostmotion("response", "paper-1dof-l-large", *words, "-o", "o", cwd=tmp_path)
    assert done.returncode == 1
    assert match in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "o").exists()

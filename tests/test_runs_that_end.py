"""Every run ends: by itself, as its adaptive solution says, or within a second of an interruption."""

import random
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from conftest import ALL_SCENARIOS, some
from lostmotion.studies.study.study_definition import Study
from tables import constant_efficiency, direct_current, gear_between, linear, linked, run_of

NAMED = {path.stem: path for path in ALL_SCENARIOS}
FOR_EVER = {"simulation.duration": 1e7, "simulation.sample_interval": 1e4}


class AlarmError(Exception):
    """An alarm has ended the run, by the way of Ctrl-C."""


@contextmanager
def interrupted_after(seconds: float, timer: int = signal.ITIMER_REAL) -> Iterator[None]:
    def interrupt(_: int, __: FrameType | None) -> None:
        raise AlarmError

    number = {signal.ITIMER_REAL: signal.SIGALRM, signal.ITIMER_PROF: signal.SIGPROF}[timer]
    before = signal.signal(number, interrupt)
    signal.setitimer(timer, seconds)
    try:
        yield
    finally:
        signal.setitimer(timer, 0.0)
        signal.signal(number, before)


def latched_clutch(duration: float) -> lm.Scenario:
    """A shaft that slips but is kept at rest by a clutch, whose torque follows a damper and a motor."""
    return lm.Scenario(
        shafts={
            "s0": {},
            "s1": {"inertia": 0.03, "friction_torque": 0.02, "torque": {}},
            "s2": {"inertia": 0.005441417539413996, "friction_torque": 0.1427285220148735},
        },
        motors={"m0": direct_current(0.008, 5.998570434619682, 265.3055293370166, 0.00014890440350378697, 12.6, "s0", friction_torque=0.3)},
        command={"m0": {"amplitude": 0.02, "frequency": 0.7, "phase": 2.0}},
        clutches={"x2": linked("s1", "s2", torque=20.0, kind="safety")},
        dampers={"x1": linked("s0", "s1", viscous_friction=1.0421993803316991)},
        simulation=run_of(duration, 0.00625),
    )


@pytest.mark.parametrize("duration", [0.0245, 0.0246479, 0.025, 0.028, 0.1])
def test_a_torque_that_turns_back_within_the_rounding_of_the_state_ends_its_regime(duration: float) -> None:
    with interrupted_after(10.0, signal.ITIMER_PROF):
        exact = lm.simulate(latched_clutch(duration))
    adaptive = lm.simulate(latched_clutch(duration), solver="dormand-prince", relative_tolerance=1e-10)
    for name in ("s0_speed", "s1_speed", "s2_speed", "m0_torque"):
        expected = adaptive[name].values
        assert exact[name].values == pytest.approx(expected, rel=1e-6, abs=1e-7 * float(abs(expected).max() + 1e-9))


def two_shafts_at_their_limits() -> lm.Scenario:
    """Behind two clutches on a shaft that a brake holds, two shafts come to the limits of their friction, one beside a torque of 600 N·m
    at the edge of a backlash."""
    return lm.Scenario(
        shafts={
            "s0": {"inertia": 0.8845454326082097},
            "s1": {"inertia": 0.0017414033422975003},
            "s2": {"inertia": 0.009987781234138227, "friction_torque": 0.005660826554047997, "viscous_friction": 0.0001450462366078829},
            "s3": {"inertia": 0.3585288458220457, "friction_torque": 0.020276980299298555},
        },
        motors={"m0": direct_current(0.019782303163847964, 0.21280182267098696, 284.0122006182779, 0.0002811748193650458, 12.6, "s2")},
        command={
            "x2": 0.7,
            "b": 0.5,
            "m0": {
                "mean": 0.43082696518702446,
                "amplitude": 0.4505326361981701,
                "frequency": 8.655970457941477,
                "phase": -0.6898421198385254,
            },
        },
        gears={
            "x1": gear_between(
                "s0",
                "s1",
                8.072003981777065,
                {"kind": "curve", "backlash": 0.008992098938129366, "slopes": [139325.03751347077]},
                mesh_damping=0.27580166128814276,
                damping_limited=True,
                losses=constant_efficiency(0.6266484683685396),
            ),
            "closing": gear_between("s0", "s3", 2.3867100993418626, 576864.6066618726, losses=constant_efficiency(0.5068261413307877)),
        },
        clutches={
            "x2": linked("s1", "s2", torque=2.2120610224504884, kind="friction"),
            "x3": linked("s1", "s3", torque=0.43279117781608384, kind="safety"),
        },
        brakes={"b": {"shaft": "s1", "torque": 2.0694700035197005}},
        springs={"k": {"shaft": "s3", "stiffness": linear(50.607799342222435)}},
        angle_torques={
            "c": {"shaft": "s3", "kind": "sine", "amplitude": 0.05839213500333903, "order": 1, "phase": 0.5078347527358091, "error": 1e-8}
        },
        simulation=run_of(0.3, 3e-3),
    )


def test_two_shafts_that_come_to_their_limits_one_after_the_other_stay_there_both() -> None:
    """Each seems to have a margin of 1e-12 N·m as the other one comes to its limit, which an elimination leaves of 600 N·m."""
    with interrupted_after(20.0):
        exact = lm.simulate(two_shafts_at_their_limits())
    assert exact.attrs["switching_count"] < 300
    adaptive = lm.simulate(two_shafts_at_their_limits(), solver="dormand-prince", relative_tolerance=1e-11)
    for name in ("s0_speed", "s1_speed", "s2_speed", "s3_speed", "x1_twist", "closing_twist"):
        assert float(np.abs(exact[name] - adaptive[name]).max()) < 1e-6 * float(np.abs(exact[name]).max()), name
    energy = lm.energy_of(exact)
    assert abs(energy["residual"]) < 1e-11 * energy["turned_over"]


def test_a_turn_is_not_looked_for_beyond_the_end_of_a_motion_that_grows() -> None:
    """Friction that falls makes a tiny inertia faster until a guard ends that; 1 ms on, its speed would be beyond all numbers.

    Beside it a clutch holds a shaft whose friction is at its limit, so that the instant is wanted at which the torque turns.
    """
    falling = {"speeds": [0.0, 2.0, 70.0, 110.0], "torques": [0.17, 0.007, 0.23, 0.002]}
    scenario = lm.Scenario(
        shafts={
            "s0": {"inertia": 2e-7, "friction_curve": falling, "torque": {"mean": -0.23}},
            "s1": {"inertia": 7e-5, "friction_torque": 0.8},
            "s2": {"friction_torque": 0.002},
            "s4": {"friction_torque": 0.018, "viscous_friction": 0.06, "torque": {"mean": -2.8}},
        },
        motors={"m": direct_current(0.007, 0.72, 60.0, 1.2e-4, 12.6, "s4")},
        command={"m": {"mean": -0.18}},
        gears={"x1": gear_between("s0", "s1", 20.0, {"kind": "curve", "backlash": 2.4e-4, "slopes": [200.0]})},
        clutches={"x2": linked("s1", "s2", torque=6.0, kind="safety")},
        mass_matrices={"j": {"shafts": ["s2", "s4"], "matrix": [[500.0, 0.002], [0.002, 1.3e-8]]}},
        simulation=run_of(2e-3, 1e-4),
    )
    with interrupted_after(10.0, signal.ITIMER_PROF):
        exact = lm.simulate(scenario)
    adaptive = lm.simulate(scenario, solver="dormand-prince", relative_tolerance=1e-10)
    for name in ("s0_speed", "s4_speed", "x1_twist"):
        expected = adaptive[name].values
        assert exact[name].values == pytest.approx(expected, rel=1e-6, abs=1e-7 * float(abs(expected).max() + 1e-9))


def test_energies_of_a_motion_through_a_wall_of_losses_are_integrated_in_long_panels() -> None:
    """The losses fall by 1e7 of their rated value over the load: terms of powers cancel to 1e-9 of themselves."""
    scenario = lm.load(NAMED["step-to-standstill"], {"gearbox.losses.values.0.1": 1e6})
    with interrupted_after(10.0, signal.ITIMER_PROF):
        run = lm.simulate(scenario)
    energy = lm.energy_of(run)
    assert abs(energy["residual"]) <= 1e-6 * energy["turned_over"]
    # What the motor gave, by another rule: the mean of power over many samples.
    fine = lm.simulate(lm.load(NAMED["step-to-standstill"], {"gearbox.losses.values.0.1": 1e6}), sample_interval=1e-4, energy=False)
    power = fine["motor_torque"].values * fine["motor_speed"].values
    assert energy["source"] == pytest.approx(float(np.trapezoid(power, fine["time"].values)), rel=2e-3)


def random_train(rng: random.Random) -> lm.Scenario:
    """Shafts in a row with friction, joined by safety clutches and dampers, behind a motor with a tiny time constant."""

    def log(low: float, high: float) -> float:
        return 10.0 ** rng.uniform(low, high)

    n = rng.choice([2, 3, 3, 4])
    shafts: dict[str, Any] = {"s0": {}}
    tables: dict[str, Any] = {"clutches": {}, "dampers": {}}
    for k in range(1, n):
        shafts[f"s{k}"] = {"inertia": log(-4.0, -1.0), "friction_torque": log(-3.0, 0.0), "torque": {}}
        ends = {"input": f"s{k - 1}", "output": f"s{k}"}
        kind = rng.choice(["clutches", "dampers", "both"])
        if kind != "dampers":
            tables["clutches"][f"c{k}"] = ends | {"torque": log(-2.0, 1.5), "kind": "safety"}
        if kind != "clutches":
            tables["dampers"][f"d{k}"] = ends | {"viscous_friction": log(-4.0, 1.0)}
    motor = direct_current(
        log(-5.0, -2.0), log(-1.0, 1.0), log(1.5, 2.7), log(-7.0, -2.5), log(0.3, 1.3), "s0", friction_torque=log(-3.0, 0.0)
    )
    command = {"amplitude": log(-3.0, 0.0), "frequency": log(-1.0, 1.5), "phase": rng.uniform(0.0, 6.3)}
    duration = rng.choice([0.02, 0.1]) * rng.uniform(0.5, 1.5)
    interval = duration / rng.choice([1, 2, 4, 7, 33.3])
    return lm.Scenario(
        shafts=shafts,
        motors={"m0": motor},
        command={"m0": command},
        simulation={"duration": duration, "sample_interval": interval},
        **{name: table for name, table in tables.items() if table},
    )


@pytest.mark.parametrize("first", range(0, some(200, 60), 20))
def test_random_trains_of_clutches_and_dampers_end(first: int) -> None:
    for seed in range(first, first + 20):
        scenario = random_train(random.Random(seed))
        with interrupted_after(5.0, signal.ITIMER_PROF):
            lm.simulate(scenario)


def sinusoidal() -> lm.Scenario:
    return lm.load(NAMED["paper-2dof-nl-small"], FOR_EVER)


LONG: dict[str, Callable[[], Any]] = {
    "drive": lambda: lm.simulate(sinusoidal()),
    "drive, no energies": lambda: lm.simulate(sinusoidal(), energy=False),
    "drive, adaptive": lambda: lm.simulate(sinusoidal(), solver="dormand-prince"),
    "train": lambda: lm.simulate(lm.load(NAMED["two-motors-one-ring"], FOR_EVER)),
    "sampled controllers": lambda: lm.simulate(lm.load(NAMED["field-weakening"], FOR_EVER)),
}


def a_study(directory: Path) -> None:
    vary = [{"key": "load.inertia", "uniform": [1.0, 3.0]}]
    study = Study(scenario=sinusoidal(), design="sobol", runs=4, vary=vary, keep={"peak": "peak(load_speed)"})
    lm.study(study, directory / "study")


def a_study_row_by_row(directory: Path) -> None:
    scenario = lm.load(NAMED["field-weakening"], FOR_EVER)
    motor, shaft = next(iter(scenario.motors)), next(iter(scenario.shafts))
    vary = [{"key": f"motors.{motor}.rotor_inertia", "uniform": [1e-3, 2e-3]}]
    study = Study(scenario=scenario, design="sobol", runs=4, vary=vary, keep={"peak": f"peak({shaft}_speed)"})
    lm.study(study, directory / "study")


def a_hunting_map(_: Path) -> None:
    inertias = [0.5 + 1e-3 * k for k in range(10_000)]
    lm.servo.hunting_map(lm.load(NAMED["hunting-with-backlash"]), {"load.inertia": inertias}, threads=2)


def a_pointing_budget(_: Path) -> None:
    lm.pointing_budget(lm.load(NAMED["direction-finder"], {"simulation.duration": 1e4}), after=1.0)


@pytest.mark.parametrize("in_threads", [a_study, a_study_row_by_row, a_hunting_map, a_pointing_budget])
def test_an_interruption_ends_runs_in_threads_within_a_second(in_threads: Callable[[Path], None], tmp_path: Path) -> None:
    begin = time.perf_counter()
    with interrupted_after(1.0), pytest.raises(AlarmError):
        in_threads(tmp_path)
    assert time.perf_counter() - begin < 2.0


@pytest.mark.parametrize("name", LONG)
def test_an_interruption_ends_any_run_within_a_second(name: str) -> None:
    begin = time.perf_counter()
    with interrupted_after(1.0), pytest.raises(AlarmError):
        LONG[name]()
    assert time.perf_counter() - begin < 2.0


@pytest.mark.parametrize("inertia", [0.0, 1e-10, 1e-18, 1e-20, 1e-30])
@pytest.mark.parametrize("brake", [0.0, 1.0])
def test_a_shaft_of_almost_no_inertia_costs_no_steps(inertia: float, brake: float) -> None:
    """Sun and carrier at a ratio of 2.5, three more shafts behind them, one of them light: 20 N·m on the inertia of them all."""
    scenario = lm.Scenario(
        shafts={
            "sun": {"inertia": 1.0},
            "ring": {"inertia": 1.0},
            "carrier": {"inertia": 10.0},
            "light": {"inertia": inertia},
            "tail": {"inertia": 3.0},
        },
        motors={"m": {"shaft": "sun", "kind": "torque_source", "rotor_inertia": 0.0}},
        gears={
            "p": {"input": "sun", "output": "carrier", "housing": "ring", "ratio": 2.5},
            "g": {"input": "carrier", "output": "light", "ratio": 3.0},
            "h": {"input": "light", "output": "tail", "ratio": -0.5},
        },
        brakes={"b": {"shaft": "ring", "torque": 1000.0}, "s": {"shaft": "tail", "torque": 1.0}},
        command={"m": 20.0, "b": 1.0, "s": brake},
        simulation={"duration": 1.0, "sample_interval": 0.5},
    )
    result = lm.simulate(scenario)
    # The tail turns at -2/3 of the carrier, against its brake.
    on_sun = 1.0 + (10.0 + inertia / 3.0**2 + 3.0 * (2.0 / 3.0) ** 2) / 2.5**2
    torque = 20.0 - brake * (2.0 / 3.0) / 2.5
    assert float(result["sun_speed"][-1]) == pytest.approx(torque / on_sun, rel=1e-13)
    assert result.attrs["steps"] < 100
    assert abs(lm.energy_of(result)["residual"]) < 1e-10

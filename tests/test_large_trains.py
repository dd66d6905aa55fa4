"""Trains of 24 to 64 masses: the shipped ones and chains, against eigenvalues, dynamic stiffness, and integration segment by segment."""

import json
import math
import re
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eigh

import lostmotion as lm
from chains import chain
from conftest import ROOT
from lostmotion.cli.terminal import announce_response
from lostmotion.live_page.description import describe
from lostmotion.model import LinearStiffness, Rigid, TorsionCurve
from lostmotion.reports.run import summary
from lostmotion.simulation.runs.sensitivities import run_sensitivities

# Of the first three modes of the thruster [Hz], with rigid bevel gears: openTorsion 0.3.2, Assembly.modal_analysis().
PEER = (29.6247, 39.6475, 77.6104)


def undamped(name: str, tmp_path: Path) -> lm.Scenario:
    """A shipped scenario without damping and losses."""
    text = (ROOT / "scenarios" / f"{name}.toml").read_text(encoding="utf-8")
    text = re.sub(r', mesh_damping = "[^"]*"', "", text)
    text = re.sub(
        r'^(mesh_damping|damping|viscous_friction|losses|efficiency|drag_torque) = .*\n|, viscous_friction = "[^"]*"', "", text, flags=re.M
    )
    text = text.replace('{ viscous_friction = "3 mN*m*s/rad" }', "{}")
    (tmp_path / f"{name}.toml").write_text(text, encoding="utf-8")
    return lm.load(tmp_path / f"{name}.toml")


def inertias(train: lm.DriveTrain) -> np.ndarray:
    """Of each shaft with the rotors and gears on it, or the mass matrix of all."""
    found = {name: shaft.inertia for name, shaft in train.shafts.items()}
    for motor in train.motors.values():
        found[motor.shaft] += motor.rotor_inertia
    for gear in train.gears.values():
        found[gear.input] += gear.inertia
    matrix = np.diag(list(found.values()))
    names = list(found)
    for element in train.mass_matrices.values():
        at = [names.index(s) for s in element.shafts]
        matrix[np.ix_(at, at)] += np.array(element.matrix)
    return matrix


def stiffness(train: lm.DriveTrain, open_gaps: tuple[str, ...] = (), what: str = "stiffness") -> np.ndarray:
    """Matrix of stiffnesses, or of mesh dampings, with all other gears on a flank."""
    names = list(train.shafts)
    matrix = np.zeros((len(names), len(names)))
    for name, gear in train.gears.items():
        law = gear.stiffness
        k = law.stiffness if isinstance(law, LinearStiffness) else law.slopes[-1]  # type: ignore[union-attr]
        if what == "damping":
            k = gear.mesh_damping
        if name in open_gaps:
            continue
        way = np.zeros(len(names))
        way[names.index(gear.input)], way[names.index(gear.output)] = 1.0 / gear.ratio, -1.0
        matrix += k * np.outer(way, way)
    return matrix


def on_flanks(train: lm.DriveTrain, open_gaps: tuple[str, ...] = ()) -> lm.TrainInitial:
    """All shafts turn forward, all gears press."""
    twists = {
        name: 0.0 if name in open_gaps else 0.6 * gear.stiffness.backlash
        for name, gear in train.gears.items()
        if isinstance(gear.stiffness, TorsionCurve)
    }
    return lm.TrainInitial(speeds=dict.fromkeys(train.shafts, 1.0), twists=twists)


@pytest.mark.parametrize("name", ["thruster-in-ice", "conveyor-start", "gantry-two-screws"])
def test_natural_frequencies_are_those_of_masses_and_stiffnesses(name: str, tmp_path: Path) -> None:
    train = undamped(name, tmp_path).train()
    gaps = [n for n, g in train.gears.items() if isinstance(g.stiffness, TorsionCurve)]
    for parted in ((), *((gap,) for gap in gaps)):
        model = lm.linearize(train, on_flanks(train, parted))
        wanted = np.sqrt(np.maximum(eigh(stiffness(train, parted), inertias(train), eigvals_only=True), 0.0))
        wanted = wanted[wanted > 1e-3 * wanted[-1] if name == "gantry-two-screws" else wanted > 0.1]
        found = np.sort(np.linalg.eigvals(model.A).imag)[-len(wanted) :]
        np.testing.assert_allclose(found, wanted, rtol=1e-9)


def test_the_thruster_has_the_frequencies_of_opentorsion(tmp_path: Path) -> None:
    train = undamped("thruster-in-ice", tmp_path).train()
    gears = {n: g.model_copy(update={"stiffness": Rigid()}) if "bevel" in n else g for n, g in train.gears.items()}
    model = lm.linearize(train.model_copy(update={"gears": type(train.gears)(gears)}), lm.TrainInitial())
    found = np.sort(np.linalg.eigvals(model.A).imag) / (2.0 * math.pi)
    np.testing.assert_allclose(found[found > 1.0][:3], PEER, atol=6e-5)


def test_the_conveyor_has_the_first_frequency_of_a_distributed_belt(tmp_path: Path) -> None:
    model = lm.linearize(undamped("conveyor-start", tmp_path), time=25.0)
    held = [k for k, name in enumerate(model.states) if name not in ("motor_speed", "drum_speed", "gearbox_twist")]
    found = np.linalg.eigvals(model.A[np.ix_(held, held)]).imag
    # k1 = w/816 m/s, k2 = w/1861 m/s: tan(1 km k1) tan(1 km k2) = sqrt(135/26), first root
    assert found[found > 1e-3].min() / (2.0 * math.pi) == pytest.approx(0.168549977, rel=1e-4)


@pytest.mark.parametrize("frequency", [29.54, 39.64, 77.09])
def test_the_response_at_resonance_is_that_of_the_dynamic_stiffness(frequency: float) -> None:
    scenario = lm.load("thruster-in-ice").replace(command={"drive": {"mean": 0.4}}, **{"shafts.propeller.torque": 10.0})
    response = lm.frequency_response(scenario, [frequency], [0.01], source="drive_command")
    found = complex(response["response"].sel(output="propeller_speed").values.ravel()[0])
    train, w = scenario.train(), 2.0 * math.pi * frequency
    damping = stiffness(train, what="damping") + np.diag([s.viscous_friction for s in train.shafts.values()])
    dynamic = stiffness(train) / (1j * w) + damping + 1j * w * inertias(train)
    force = np.zeros(len(dynamic))
    force[0] = 5.0
    assert abs(found / np.linalg.solve(dynamic, force)[-1] - 1.0) < 1e-9


LOOSE, RUBBING = chain(24, gaps=(11,)), chain(40, friction=0.05)


def integrated(scenario: lm.Scenario, forces: Any, guards: Any, modes: Any, change: Any, end: float) -> tuple[np.ndarray, int]:
    """States (speeds, twists) at the end by DOP853 from event to event, and how many events."""
    n = len(scenario.train().shafts)
    state, t, count = np.zeros(2 * n - 1), 0.0, 0
    while t < end:
        events = guards(modes)
        for guard in events:
            guard.terminal = True  # attributes of functions, as SciPy asks for
        law: dict[str, Any] = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-14}
        run: Any = solve_ivp(partial(forces, mode=modes), (t, end), state, events=events, **law)
        t, state = float(run.t[-1]), run.y[:, -1]
        if run.status == 1:
            which = next(k for k, at in enumerate(run.t_events) if len(at))
            modes, state = change(modes, which, state)
            count += 1
    return state, count


def test_a_chain_with_a_gap_moves_as_integrated_from_flank_to_flank() -> None:
    n, gap = 24, 11
    masses = inertias(LOOSE.train()).diagonal()

    def forces(t: float, y: np.ndarray, mode: int) -> np.ndarray:
        speeds, twists = y[:n], y[n:]
        torque = 800.0 * twists + 0.02 * (speeds[:-1] - speeds[1:])
        torque[gap] = 800.0 * (twists[gap] - 1e-3 * mode) if mode else 0.0
        drive = np.zeros(n)
        drive[0] = 0.1 + 3.0 * math.sin(40.0 * math.pi * t)
        rate = (drive - 1e-3 * speeds - np.append(torque, 0.0) + np.insert(torque, 0, 0.0)) / masses
        return np.concatenate([rate, speeds[:-1] - speeds[1:]])

    def guards(flank: int) -> list[Any]:
        if flank:
            found = [lambda t, y: flank * y[n + gap] - 1e-3]
            found[0].direction = -1.0  # type: ignore[attr-defined]
            return found
        both: list[Any] = [lambda t, y: y[n + gap] - 1e-3, lambda t, y: -y[n + gap] - 1e-3]
        for guard in both:
            guard.direction = 1.0
        return both

    def change(flank: int, which: int, y: np.ndarray) -> tuple[int, np.ndarray]:
        return (0, y) if flank else (1 - 2 * which, y)

    wanted, count = integrated(LOOSE, forces, guards, 0, change, 0.1)
    result = lm.simulate(LOOSE)
    end = json.loads(result.attrs["end_state"])
    found = np.array([end[f"m{k}_speed"] for k in range(n)] + [end[f"g{k}_twist"] for k in range(n - 1)])
    assert result.attrs["switching_count"] == count > 3
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9 * np.max(np.abs(wanted[:n])))


def test_masses_break_away_one_after_the_other_as_integrated() -> None:
    """A torque that rises slowly: the first `moving` masses slide, until the torque of the next spring exceeds the friction."""
    n, slope = 40, 40.0
    scenario = chain(n, friction=0.05, ramps=[{"rise": slope, "duration": 1.0}])
    masses = inertias(scenario.train()).diagonal()

    def forces(t: float, y: np.ndarray, mode: int) -> np.ndarray:
        speeds, twists = y[:n], y[n:]
        torque = 800.0 * twists + 0.02 * (speeds[:-1] - speeds[1:])
        drive = np.zeros(n)
        drive[0] = slope * t
        rate = (drive - 0.05 - 1e-3 * speeds - np.append(torque, 0.0) + np.insert(torque, 0, 0.0)) / masses
        rate[mode:] = 0.0
        return np.concatenate([rate, speeds[:-1] - speeds[1:]])

    def guards(moving: int) -> list[Any]:
        if moving == n:
            return []
        if moving == 0:
            return [lambda t, y: slope * t - 0.05]
        k = moving - 1
        return [lambda t, y: 800.0 * y[n + k] + 0.02 * y[k] - 0.05]

    wanted, count = integrated(scenario, forces, guards, 0, lambda m, _, y: (m + 1, y), 0.1)
    result = lm.simulate(scenario)
    end = json.loads(result.attrs["end_state"])
    found = np.array([end[f"m{k}_speed"] for k in range(n)] + [end[f"g{k}_twist"] for k in range(n - 1)])
    assert count == result.attrs["switching_count"] > 20
    assert wanted[:n].min() > -1e-12  # none of them has stopped, as the reference takes for granted
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-9 * np.max(np.abs(wanted[:n])))


@pytest.mark.parametrize("scenario", [LOOSE, RUBBING], ids=["24 masses", "40 masses with friction"])
def test_all_that_takes_a_train_takes_a_large_one(scenario: lm.Scenario) -> None:
    last = list(scenario.shafts)[-1]
    result = lm.simulate(scenario)
    energy = lm.energy_of(result)
    assert abs(energy["residual"]) < 1e-9 * energy["turned_over"]
    assert last in str(lm.explain(scenario, 0.05)) or "contact" in str(lm.explain(scenario, 0.05))
    assert len(lm.linearize(scenario, time=0.05).resonances()) > 0
    if scenario is LOOSE:  # of 40 masses it takes a quarter of a minute
        assert describe(scenario, "chain")["name"] == "chain"
    simulation, batch = lm.Simulation(scenario), lm.SimulationBatch(scenario, step=0.02, count=2)
    simulation.advance(0.02, drive_command=2.0)
    batch.step(2.0)
    assert batch[f"{last}_speed"][1] == pytest.approx(simulation[f"{last}_speed"], rel=1e-12)
    before = simulation.snapshot()
    simulation.advance(0.02, drive_command=(2.0, -1.0))
    there = simulation[f"{last}_speed"]
    simulation.restore(before)
    simulation.advance(0.02, drive_command=(2.0, -1.0))
    assert simulation[f"{last}_speed"] == there


def test_what_takes_long_says_so_before_it_starts(capsys: pytest.CaptureFixture[str]) -> None:
    announce_response(chain(24).train(), 60)
    assert capsys.readouterr().err == ""
    announce_response(RUBBING.train(), 60)
    announce_response(LOOSE.train(), 60)
    said = capsys.readouterr().err.splitlines()
    assert [line.partition(":")[0] for line in said] == ["Response", "Response"]


@pytest.mark.parametrize("count", [12, 64])
def test_the_summary_of_a_large_train_has_what_moves_most_and_counts_the_others(count: int) -> None:
    result = lm.simulate(chain(count, friction=0.05))
    lines = summary(result).splitlines()
    assert len(lines) < 40 and max(map(len, lines)) < 400
    peaks = {f"m{k}": float(np.abs(result[f"m{k}_speed"]).max()) for k in range(count)}
    named = [match[1] for line in lines if (match := re.match(r"  shaft (m\d+): .* rad/s, peak", line))]
    if count == 12:
        assert named == list(peaks)
        return
    assert sorted(named) == sorted(sorted(peaks, key=peaks.__getitem__)[-6:])
    seventh = sorted(peaks.values())[-7]
    assert f"  58 other shafts: peaks up to {seventh:.4g} rad/s" in lines


@pytest.mark.parametrize("scenario", [LOOSE, RUBBING], ids=["24 masses", "40 masses with friction"])
def test_derivatives_of_large_trains_are_those_of_differences(scenario: lm.Scenario) -> None:
    key, h = "gears.g3.stiffness.stiffness", 2.0**-14
    found = run_sensitivities(scenario, [key]).values["m0_speed"][0, -1]

    def end(k: float) -> float:
        return float(lm.simulate(scenario.replace(**{key: k}))["m0_speed"][-1])

    wanted = (end(800.0 * (1 + h)) - end(800.0 * (1 - h))) / (1600.0 * h)
    assert found == pytest.approx(wanted, rel=1e-5, abs=1e-9)

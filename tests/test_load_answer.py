"""The answer of a drive to its load over a step, and snapshots: closed forms, differences, and the same bits again."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from conftest import ALL_SCENARIOS
from refusals import refused

RATIO, ROTOR, LOAD = 80.0, 2e-5, 0.4


def drive(stiffness: lm.model.TorsionCurve | lm.model.Rigid, friction: float = 0.0, efficiency: float = 1.0) -> lm.Drive:
    return lm.Drive(
        motor=lm.Motor(kind="torque_source", rotor_inertia=ROTOR, friction_torque=friction),
        gearbox=lm.Gearbox(
            ratio=RATIO,
            stiffness=stiffness,
            losses=lm.model.ConstantEfficiency(efficiency=efficiency),
            rated_input_speed=400.0,
            rated_output_torque=50.0,
        ),
        load=lm.Load(inertia=LOAD),
    )


@pytest.mark.parametrize("load_torque", [0.0, 3.0, (0.0, 6.0)])
def test_a_rigid_gear_answers_with_the_rotor(load_torque: float | tuple[float, float]) -> None:
    simulation = lm.Simulation(drive(lm.model.Rigid()))
    found = simulation.answer(1e-3, 0.2, load_torque)
    reflected, mean = RATIO * RATIO * ROTOR, float(np.mean(load_torque))
    acceleration = (RATIO * 0.2 - mean) / (LOAD + reflected)
    assert found.acceleration == pytest.approx(acceleration, rel=1e-12)
    assert found.torque == pytest.approx(RATIO * 0.2 - reflected * acceleration, rel=1e-12)
    assert found.derivative == pytest.approx(-reflected, rel=1e-9)
    assert simulation["load_speed"] == pytest.approx(1e-3 * acceleration, rel=1e-12)


@pytest.mark.parametrize("interval", [1e-4, 2e-3, 3e-2])
def test_two_masses_on_a_spring_answer_as_in_closed_form(interval: float) -> None:
    stiffness, inner = 1e4, RATIO * RATIO * ROTOR
    simulation = lm.Simulation(drive(lm.model.TorsionCurve(slopes=[stiffness])), step=interval)
    found = simulation.answer(interval, 0.0, 2.0)
    turn = math.sqrt(stiffness * (1.0 / inner + 1.0 / LOAD)) * interval
    compliance = (1.0 + inner / LOAD * math.sin(turn) / turn) / (inner + LOAD)
    assert found.acceleration == pytest.approx(-2.0 * compliance, rel=1e-10)
    assert found.derivative == pytest.approx(LOAD - 1.0 / compliance, rel=1e-8, abs=1e-9)
    assert found.torque == pytest.approx(2.0 - 2.0 * LOAD * compliance, rel=1e-9, abs=1e-9)


def test_after_restore_answers_have_the_same_bits() -> None:
    """All of them, whatever steps were kept before: a state is what determines all that follows."""
    simulation = lm.Simulation(drive(lm.model.TorsionCurve(slopes=[2e4]), friction=0.02), step=2e-3)

    def answers() -> list[tuple[float, ...]]:
        return [
            (found.acceleration, found.torque, found.derivative, simulation["load_speed"])
            for k in range(40)
            for found in (simulation.answer(2e-3, 0.2 * math.sin(0.05 * k), 10.0 * math.cos(0.07 * k)),)
        ]

    begin = simulation.snapshot()
    first = answers()
    simulation.restore(begin)
    assert answers() == first
    simulation.answer(7e-4, 0.1, 1.0)
    simulation.restore(begin)
    assert answers() == first
    assert [a for _, _, a, _ in first[:2]] != [0.0, 0.0]


def test_a_load_that_friction_holds_takes_any_torque() -> None:
    held = drive(lm.model.Rigid(), friction=0.1)
    found = lm.Simulation(held).answer(1e-3, 0.0, 2.0)
    assert found == (type(found))(2.0, -math.inf, 0.0)


def switched(simulation: lm.Simulation) -> tuple[float, float]:
    return simulation["input_contact"], simulation["twist_contact"]


@pytest.mark.parametrize("seed", range(3))
def test_the_derivative_is_that_of_differences_through_switchings(seed: int) -> None:
    generator = np.random.default_rng(seed)
    curve = lm.model.TorsionCurve(slopes=[4e3, 1.5e4], breaks=[1e-3], backlash=1e-3)
    simulation = lm.Simulation(drive(curve, friction=0.02, efficiency=0.8), step=2e-3)
    compared = through = 0
    for k in range(300):
        command, load = 0.4 * math.sin(0.13 * k) + generator.normal(0.0, 0.05), generator.normal(0.0, 2.0)
        before, mode = simulation.snapshot(), switched(simulation)
        found = simulation.answer(2e-3, command, load)
        after, end = simulation.snapshot(), switched(simulation)
        ends, beside = [], []
        for shift in (-1e-4, 1e-4):
            simulation.restore(before)
            beside.append(simulation.answer(2e-3, command, load + shift))
            ends.append(switched(simulation))
        simulation.restore(after)
        low, high = beside
        if ends != [end, end] or math.isinf(found.derivative) or high.acceleration == low.acceleration:
            continue
        # Without other switchings between them, the differences on both sides agree.
        if not math.isclose(low.derivative, high.derivative, rel_tol=1e-3):
            continue
        difference = (high.torque - low.torque) / (high.acceleration - low.acceleration)
        assert found.derivative == pytest.approx(difference, rel=2e-3, abs=1e-6)
        compared += 1
        through += mode != end
    assert compared > 150
    assert through > 10


def test_a_train_answers_on_the_shaft_that_is_named() -> None:
    train = drive(lm.model.TorsionCurve(slopes=[1e4])).train()
    alone, whole = lm.Simulation(train), lm.Simulation(drive(lm.model.TorsionCurve(slopes=[1e4])))
    found = alone.answer(1e-3, shaft="load", motor_command=0.3, load_load_torque=1.0)
    expected = whole.answer(1e-3, 0.3, 1.0)
    for name in ("torque", "derivative", "acceleration"):
        assert getattr(found, name) == pytest.approx(getattr(expected, name), rel=1e-12)


def test_a_controller_turns_the_motor_within_an_answer() -> None:
    scenario = lm.load("position-axis")
    one, other = lm.Simulation(scenario), lm.Simulation(scenario)
    for _ in range(20):
        one.advance(1e-3)
        other.answer(1e-3)
    assert one.state.values == other.state.values


@pytest.mark.parametrize(
    ("shaft", "message"),
    [("lod", 'shaft "lod": is none; did you mean load'), ("motor", "shaft 'motor': has no load torque"), (5, "shaft 5: is none")],
)
def test_wrong_use_of_an_answer_is_one_line(shaft: str, message: str) -> None:
    simulation = lm.Simulation(drive(lm.model.Rigid()))
    refused(lambda: simulation.answer(1e-3, 0.1, shaft=shaft), match=message)
    assert simulation.time == 0.0


# --- snapshots ---
@pytest.mark.parametrize("path", ALL_SCENARIOS, ids=lambda p: p.stem)
def test_a_snapshot_brings_back_every_bit(path: Path) -> None:
    simulation = lm.Simulation(lm.load(path))
    motion = {shaft: {"speed": 0.1} for shaft in simulation.given}
    inputs = {name: 0.1 for name in simulation.inputs if not name.endswith("load_torque")}

    def go_on(steps: int) -> tuple[Any, ...]:
        for _ in range(steps):
            simulation.advance(1e-3, motion=motion, **inputs)
        return simulation.state.values

    begin = simulation.snapshot()
    go_on(5)
    middle = simulation.snapshot()
    end = go_on(15)
    for snapshot, steps in ((middle, 15), (begin, 20), (middle, 15)):
        simulation.restore(snapshot)
        assert simulation.time == snapshot.time
        assert go_on(steps) == end


def test_a_snapshot_keeps_the_error_bound() -> None:
    simulation = lm.Simulation(lm.load("field-weakening"), error_bound=True)
    bounds, snapshots = [], []
    for _ in range(2):
        for _ in range(40):
            simulation.advance(1e-3)
        bounds.append(simulation.error_bound)
        snapshots.append(simulation.snapshot())
    assert bounds[0] != bounds[1]
    for bound, snapshot in zip(bounds, snapshots, strict=True):
        simulation.restore(snapshot)
        assert simulation.error_bound == bound


def test_a_snapshot_keeps_the_mass_matrix() -> None:
    scenario = lm.load("two-link-arm-frozen")
    simulation = lm.Simulation(scenario)
    (name,) = simulation._train.mass_matrices
    rows = np.array(simulation._train.mass_matrices[name].matrix)
    inputs = {name: 0.1 for name in simulation.inputs if name.endswith("command")}
    ends = []
    begin = simulation.snapshot()
    simulation.advance(1e-3, mass_matrix={name: (2.0 * rows).tolist()}, **inputs)
    heavy = simulation.snapshot()
    for snapshot in (begin, heavy, begin, heavy):
        simulation.restore(snapshot)
        for _ in range(20):
            simulation.advance(1e-3, **inputs)
        ends.append(simulation.state.values)
    assert ends[:2] == ends[2:]
    assert ends[0] != ends[1]
    light = lm.Simulation(scenario)
    for _ in range(20):
        light.advance(1e-3, **inputs)
    assert light.state.values["state"] == ends[0]["state"]


def test_a_snapshot_of_another_simulation_is_refused() -> None:
    one, other = (lm.Simulation(drive(lm.model.Rigid())) for _ in range(2))
    for wrong in (other.snapshot(), one.state, None):
        with pytest.raises(lm.InputError, match="between simulations, use state"):
            one.restore(wrong)  # type: ignore[arg-type]

"""Drives as a kernel of Warp, on its CPU device: against the solver that steps one drive, in both precisions."""

import numpy as np
import pytest

import lostmotion as lm
from refusals import refusals

wp = pytest.importorskip("warp")
pytestmark = pytest.mark.usefixtures("fast_compiles")

COUNT = 64


def geared(gap: float) -> lm.Drive:
    """A drive with two pieces of stiffness, friction and an efficiency, with a gap or none."""
    return lm.Drive(
        motor=lm.Motor(kind="torque_source", rotor_inertia=1e-4, friction_torque=0.02),
        gearbox=lm.Gearbox(
            ratio=50,
            stiffness=lm.model.TorsionCurve(slopes=[5e3, 1e4], breaks=[1e-3], backlash=gap),
            losses=lm.model.ConstantEfficiency(efficiency=0.8),
            rated_input_speed=400.0,
            rated_output_torque=50.0,
        ),
        load=lm.Load(inertia=1.0),
    )


def commands(steps: int, count: int, step: float, noise: float) -> np.ndarray:
    generator = np.random.default_rng(1)
    t = step * np.arange(steps)[:, None]
    amplitude, frequency, phase = (generator.uniform(low, high, count) for low, high in ((0.1, 0.4), (0.5, 3.0), (0.0, 6.0)))
    return amplitude * np.sin(2 * np.pi * frequency * t + phase) + generator.normal(0.0, noise, (steps, count))


def exact(drive: lm.Drive, inertias: np.ndarray, given: np.ndarray, step: float) -> np.ndarray:
    batch = lm.SimulationBatch(drive, step, vary={"load.inertia": inertias})
    for row in given:
        batch.step(row)
    return batch["load_angle"].copy()


@pytest.mark.parametrize(("step", "steps"), [(1e-3, 400), (5e-3, 80)])
@pytest.mark.parametrize("noise", [0.0, 0.05])
@pytest.mark.parametrize(("dtype", "median", "most"), [("float64", 1e-13, 1e-9), ("float32", 1e-6, 3e-3)])
def test_drives_move_as_in_the_core(step: float, steps: int, noise: float, dtype: str, median: float, most: float) -> None:
    inertias = np.random.default_rng(2).uniform(0.5, 2.0, COUNT)
    given = commands(steps, COUNT, step, noise)
    drives = lm.warp.Drives(geared(2e-3), count=COUNT, vary={"load.inertia": inertias}, dtype=dtype, device="cpu")
    for row in given:
        drives.step(row, 0.0, step)
    error = np.abs(drives["load_angle"].numpy() - exact(geared(2e-3), inertias, given, step))
    assert np.median(error) < median
    assert error.max() < most
    assert drives.counts["switchings"] > COUNT
    assert drives.counts["doubtful"] <= 0.001 * drives.counts["steps"]


@pytest.mark.parametrize("name", ["catalogue-robot-joint", "paper-2dof-nl-small"])
def test_a_loss_map_and_hysteresis_move_as_in_the_core(name: str) -> None:
    drive = lm.load(name).drive()
    given = commands(200, COUNT, 1e-3, 0.05)
    drives = lm.warp.Drives(drive, count=COUNT, dtype="float64", device="cpu")
    inertias = np.full(COUNT, drive.load.inertia)
    for row in given:
        drives.step(row)
    error = np.abs(drives["load_angle"].numpy() - exact(drive, inertias, given, 1e-3))
    certain = drives._arrays.doubtful.numpy() == 0
    assert certain.sum() > 0.5 * COUNT
    assert error[certain].max() < 1e-10


@pytest.mark.parametrize(("dtype", "error"), [("float64", 1e-9), ("float32", 1e-3)])
def test_an_answer_is_that_of_the_core(dtype: str, error: float) -> None:
    given = commands(60, COUNT, 1e-3, 0.05)
    drives, batch = (
        lm.warp.Drives(geared(2e-3), count=COUNT, dtype=dtype, device="cpu"),
        lm.SimulationBatch(geared(2e-3), 1e-3, count=COUNT),
    )
    for row in given:
        torque, derivative = (array.numpy() for array in drives.answer(row, 0.5))
        want = batch.answer(row, 0.5)
        # By how much a torque accelerates the load of 1 kg m2; rounding may put a switching into another step.
        alike = np.abs(1.0 / (1.0 - derivative) - 1.0 / (1.0 - want.derivative)) < error
        assert alike.mean() > (0.999 if dtype == "float64" else 0.95)
        assert np.median(np.abs(torque - want.torque)) < 0.1 * error


def test_written_parameters_act_in_the_next_step_and_a_reset_takes_back_those_that_are_meant() -> None:
    drives = lm.warp.Drives(geared(2e-3), count=4, dtype="float64", device="cpu")
    changed = drives.parameters["load.inertia"].numpy()
    changed[1] = 3.0
    drives.parameters["load.inertia"].assign(changed)
    for _ in range(100):
        drives.step(0.2)
    angles = drives["load_angle"].numpy()
    assert angles[0] == angles[2] == angles[3] != angles[1]
    drives.reset(np.array([True, False, False, False]))
    assert drives["load_angle"].numpy()[0] == 0.0
    for _ in range(100):
        drives.step(0.2)
    assert drives["load_angle"].numpy()[0] == angles[0]


def test_the_same_bits_for_any_number_of_drives() -> None:
    given = commands(100, COUNT, 1e-3, 0.05)
    many, few = (lm.warp.Drives(geared(0.0), count=n, device="cpu") for n in (COUNT, 5))
    for row in given:
        many.step(row)
        few.step(row[7:12])
    assert np.array_equal(few["load_angle"].numpy(), many["load_angle"].numpy()[7:12])


test_what_the_kernel_does_not_take_is_refused = refusals(
    (lambda: lm.warp.Drives(lm.load("two-motors-one-ring"), count=2), ": drive: "),
    (lambda: lm.warp.Drives(lm.load("position-axis"), count=2), ": a controller"),
    (lambda: lm.warp.Drives(geared(1e-3), count=2, vary={"load.mass": 1.0}), ": load.mass"),
    (lambda: lm.warp.Drives(geared(0.0), count=2, vary={"gearbox.stiffness.backlash": 1e-3}), ": backlash"),
    (lambda: lm.warp.Drives(geared(1e-3), count=2)["angle"], ": angle"),
    (lambda: lm.warp.Drives(geared(1e-3), count=2, vary={"load.inertia": [1.0, -1.0]}), "load.inertia"),
    (lambda: lm.warp.Drives(geared(1e-3), count=2, vary={"load.inertia": [1.0, 2.0, 3.0]}), ": 2 numbers"),
    (lambda: lm.warp.Drives(geared(1e-3), count=2, device="cpu").step(np.zeros(3)), ": 2 numbers, one for each drive"),
    (lambda: lm.warp.Drives(geared(1e-3), count=2, device="cpu").step(0.1, np.nan), ": not finite"),
    (lambda: lm.warp.Drives(geared(1e-3), count=2, device="cpu").reset([1, 0]), ": 2 Booleans"),
)  # fmt: skip

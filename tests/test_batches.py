"""Many drives at once: against the solver that steps one drive, a closed form, and independence of order and threads."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from lostmotion import _core
from lostmotion.simulation.batches.walked_batches import WalkedBatch
from refusals import refusals_of, refused

STEP = 1e-3


def random_drive(generator: np.random.Generator) -> lm.Drive:
    """A drive with a random structure and random parameters."""

    def between(low: float, high: float) -> float:
        return float(generator.uniform(low, high))

    def likely(share: float) -> bool:
        return bool(generator.random() < share)

    published = lm.load("paper-2dof-nl-small")
    losses = published.gearbox.losses if likely(0.3) else lm.model.ConstantEfficiency(efficiency=between(0.6, 1.0))
    slopes, breaks = (2e3, 2e4, 3e4), (0.6e-3, 3e-3)
    pieces = int(generator.integers(1, 4))
    hysteresis = lm.model.Hysteresis(efficiency=between(0.8, 0.99)) if likely(0.3) else None
    backlash = 0.0 if hysteresis is not None else between(0.3e-3, 3e-3)
    stiffness = lm.model.TorsionCurve(slopes=slopes[:pieces], breaks=breaks[: pieces - 1], backlash=backlash)
    common = {"rotor_inertia": between(5e-6, 3e-5), "friction_torque": between(0.0, 0.03) if likely(0.8) else 0.0}
    if likely(0.5):
        motor = lm.Motor(kind="torque_source", rated_torque=0.521, **common)
    else:
        motor = lm.Motor(
            rated_torque=0.521,
            rated_speed=345.6,
            electrical_time_constant=between(1e-4, 2e-3) if likely(0.8) else 0.0,
            armature_voltage_constant=3.1169,
            **common,
        )
    gearbox = lm.Gearbox(
        ratio=90.0 if likely(0.7) else -50.0,
        inertia=67e-7,
        stiffness=stiffness,
        losses=losses,
        hysteresis=hysteresis,
        rated_input_speed=380.0,
        rated_output_torque=51.6,
    )
    friction = between(0.1, 2.0) if likely(0.3) else 0.0
    load = lm.Load(inertia=between(0.2, 3.0), viscous_friction=between(0.0, 5.0), friction_torque=friction)
    return lm.Drive(motor=motor, gearbox=gearbox, load=load)


def random_commands(generator: np.random.Generator, steps: int, count: int) -> np.ndarray:
    t = np.arange(steps)[:, None] * STEP
    frequency, amplitude, phase = (generator.uniform(a, b, count) for a, b in ((1, 6), (0.05, 0.6), (0, 6)))
    return amplitude * np.sin(2 * np.pi * frequency * t + phase) + generator.normal(0.0, 0.02, (steps, count))


def run(batch: lm.SimulationBatch, commands: np.ndarray, loads: np.ndarray | None = None) -> np.ndarray:
    """States after each step: steps x states x drives."""
    out = np.empty((len(commands), len(_core.states()), len(batch)))
    for k, command in enumerate(commands):
        batch.step(command, 0.0 if loads is None else loads[k])
        out[k] = [batch[name] for name in _core.states()]
    return out


@pytest.mark.parametrize("seed", range(3))
def test_a_batch_moves_as_its_drives_alone(seed: int) -> None:
    generator = np.random.default_rng(seed)
    drives = [random_drive(generator) for _ in range(24)]
    commands = random_commands(generator, 400, len(drives))
    loads = generator.uniform(-3.0, 3.0, (400, len(drives)))
    batch = lm.SimulationBatch(drives, STEP)
    states = run(batch, commands, loads)
    assert batch.counts["switchings"] > 20 * len(drives)
    for k, drive in enumerate(drives):
        alone = lm.Simulation(drive, step=STEP)
        alone.reset()
        for n in range(400):
            alone.advance(STEP, command=float(commands[n, k]), load_torque=float(loads[n, k]))
            if n % 40 == 39:
                for name in ("motor_speed", "load_speed", "twist", "load_angle"):
                    # Rounding grows where flanks bounce; the figures of the benchmark are smaller by far.
                    scale = {"motor_speed": 1e-5, "load_speed": 1e-6, "twist": 1e-9, "load_angle": 1e-8}[name]
                    assert states[n, _core.states().index(name), k] == pytest.approx(alone[name], abs=scale, rel=0.0)
        # Between two modes an event at the end of a step may fall on either side of it.
        assert batch["output_torque"][k] == pytest.approx(alone["output_torque"], abs=1e-4)
        assert batch["motor_torque"][k] == pytest.approx(alone["motor_torque"], abs=1e-6)


def simple_drive(gearbox: dict[str, Any] | None = None, motor: dict[str, Any] | None = None, **load: float) -> lm.Drive:
    laws = {"stiffness": lm.model.TorsionCurve(slopes=[1e4], backlash=2e-3), "losses": lm.model.ConstantEfficiency(efficiency=0.8)}
    rated = {"ratio": 50, "rated_input_speed": 400.0, "rated_output_torque": 50.0}
    return lm.Drive(
        motor=lm.Motor(kind="torque_source", **({"rotor_inertia": 1e-4, "friction_torque": 0.02} if motor is None else motor)),
        gearbox=lm.Gearbox(**rated | laws | (gearbox or {})),
        load=lm.Load(**({"inertia": 1.0} | load)),
    )


RIGID = {"stiffness": lm.model.Rigid(), "losses": lm.model.ConstantEfficiency(efficiency=1.0)}


def test_a_rotor_crosses_the_gap_in_the_time_of_a_free_flight() -> None:
    # 1 mrad at the output are 50 mrad of the rotor; under M - T = J a that takes sqrt(2 phi J/(M - T)).
    torque = 0.1
    flight = np.sqrt(2 * 0.05 * 1e-4 / (torque - 0.02))
    step = 1e-3
    batch = lm.SimulationBatch(simple_drive(), step, count=1)
    steps = int(flight / step)
    for _ in range(steps):
        batch.step(torque)
    assert batch["twist"][0] == pytest.approx(0.5 * (torque - 0.02) / 1e-4 / 50 * (steps * step) ** 2, rel=1e-13)
    assert batch["output_torque"][0] == 0.0
    batch.step(torque)
    assert batch["output_torque"][0] > 0.0


def test_a_stuck_drive_stays_to_the_last_bit() -> None:
    batch = lm.SimulationBatch(simple_drive(), STEP, count=3)
    for _ in range(1000):
        batch.step([0.0199, 0.0, -0.0199])
    assert all(np.all(batch[name] == 0.0) for name in ("motor_speed", "load_speed", "twist", "load_angle"))
    assert np.all(batch["input_contact"] == 0.0)
    batch.step([0.0201, 0.0, -0.0201])
    assert batch["input_contact"].tolist() == [1.0, 0.0, -1.0]


def test_a_command_limit_is_kept() -> None:
    rated = {"rotor_inertia": 1e-5, "rated_torque": 0.5, "rated_speed": 300.0, "rated_voltage": 24.0}
    motor = lm.Motor(**rated, electrical_time_constant=1e-3, armature_voltage_constant=3.0, voltage_limit=12.0)
    drive = simple_drive().model_copy(update={"motor": motor})
    batch = lm.SimulationBatch([drive, drive], STEP)
    for k in range(300):
        batch.step([0.9, 0.5] if k % 100 < 50 else [-0.7, -0.5])
        limited, at_limit = batch["motor_speed"]
        assert limited == pytest.approx(at_limit, rel=1e-10, abs=1e-10)


@pytest.mark.parametrize("threads", [1, 2, 3])
@pytest.mark.parametrize("controlled", [False, True])
def test_neither_threads_nor_order_nor_a_snapshot_change_a_bit(controlled: bool, threads: int) -> None:
    generator = np.random.default_rng(5)
    drives = [positioned(generator) for _ in range(4)] * 40 if controlled else [random_drive(generator) for _ in range(20)] * 10
    commands = generator.uniform(-0.02, 0.02, (40, len(drives))) if controlled else random_commands(generator, 150, len(drives))
    controllers = lm.load("position-axis").controller if controlled else None
    one = run(lm.SimulationBatch(drives, STEP, controllers=controllers, threads=1), commands)
    order = generator.permutation(len(drives))
    shuffled = lm.SimulationBatch([drives[k] for k in order], STEP, controllers=controllers, threads=threads)
    before = shuffled.snapshot()
    for _ in range(2):
        assert np.array_equal(run(shuffled, commands[:, order]), one[:, :, order])
        shuffled.restore(before)
    alone = lm.SimulationBatch(drives[7], STEP, controllers=controllers, count=1)
    assert np.array_equal(run(alone, commands[:, 7:8]), one[:, :, 7:8])


def test_a_snapshot_brings_back_every_bit() -> None:
    generator = np.random.default_rng(6)
    drives = [random_drive(generator) for _ in range(30)]
    commands = random_commands(generator, 200, len(drives))
    batch = lm.SimulationBatch(drives, STEP)
    run(batch, commands[:100])
    before = batch.snapshot()
    first = run(batch, commands[100:])
    batch.restore(before)
    assert batch.time == pytest.approx(0.1)
    assert np.array_equal(run(batch, commands[100:]), first)
    assert "another batch" in refused(lambda: lm.SimulationBatch(drives, STEP).restore(before))


def test_reset_takes_back_those_that_are_meant() -> None:
    generator = np.random.default_rng(7)
    drives = [random_drive(generator) for _ in range(12)]
    commands = random_commands(generator, 100, len(drives))
    batch = lm.SimulationBatch(drives, STEP)
    first = run(batch, commands)
    which = np.arange(12) % 3 == 0
    batch.reset(which)
    assert np.array_equal(batch.time, np.where(which, 0.0, batch.time.max()))
    assert np.array_equal(batch["load_angle"], np.where(which, 0.0, first[-1, _core.states().index("load_angle")]))
    again = run(batch, commands)
    assert np.array_equal(again[:, :, which], first[:, :, which])
    batch.reset(initial={"load_angle": 0.3, "motor_speed": np.full(12, 2.0)})
    assert np.all(batch["load_angle"] == 0.3)
    alone = lm.Simulation(drives[0], step=STEP, initial=lm.Initial(load_angle=0.3, motor_speed=2.0))
    batch.step(0.1)
    alone.advance(STEP, command=0.1)
    assert batch["motor_speed"][0] == pytest.approx(alone["motor_speed"], rel=1e-12)


def test_what_varies_is_what_a_list_of_drives_has() -> None:
    gaps, inertias = np.array([1e-3, 2e-3, 1e-3]), np.array([0.5, 1.0, 0.5])
    varied = lm.SimulationBatch(simple_drive(), STEP, vary={"gearbox.stiffness.backlash": gaps, "load.inertia": inertias})
    drives = []
    for gap, inertia in zip(gaps, inertias, strict=True):
        drives.append(simple_drive({"stiffness": lm.model.TorsionCurve(slopes=[1e4], backlash=gap)}, inertia=inertia))
    commands = random_commands(np.random.default_rng(8), 300, 3)
    assert np.array_equal(run(varied, commands), run(lm.SimulationBatch(drives, STEP), commands))


def test_a_seed_draws_the_same_drives() -> None:
    def batch(seed: int) -> lm.SimulationBatch:
        return lm.SimulationBatch(simple_drive(), STEP, count=5, seed=seed, vary={"load.inertia": lambda g, n: g.uniform(0.5, 2.0, n)})

    commands = np.full((50, 5), 0.2)
    first = run(batch(1), commands)
    assert np.array_equal(run(batch(1), commands), first)
    assert len(np.unique(first[-1, _core.states().index("load_angle")])) == 5
    assert not np.array_equal(run(batch(2), commands), first)


def test_a_drive_of_its_own_takes_less_than_400_bytes_and_a_controlled_one_less_than_800_however_long_it_moves() -> None:
    generator, count = np.random.default_rng(9), 400
    vary = {"motor.friction_torque": generator.uniform(0.005, 0.03, count), "load.inertia": generator.uniform(0.3, 2.0, count)}
    batch = lm.SimulationBatch(lm.load("catalogue-robot-joint").drive(), STEP, vary=vary)
    run(batch, random_commands(generator, 200, count))
    assert batch.memory / count < 400.0
    batch = lm.SimulationBatch(lm.load("position-axis"), STEP, vary={"load.inertia": np.linspace(1.0, 2.0, 50)})
    batch.step(0.01)
    assert batch.memory < 800 * 50


def test_outputs_are_not_copied() -> None:
    batch = lm.SimulationBatch(simple_drive(), STEP, count=4)
    angle = batch["load_angle"]
    for _ in range(100):
        batch.step(0.3)
    assert np.shares_memory(angle, batch["load_angle"])
    assert np.all(angle > 0.0)
    assert np.shares_memory(np.from_dlpack(angle), angle)


def odd_drive(generator: np.random.Generator) -> lm.Scenario:
    """A drive with what random_drive leaves out: worms, mesh damping, no compliance, friction that is greater at rest."""
    tables = lm.Scenario.of_any(random_drive(generator)).long().model_dump(exclude_none=True)
    gear = tables["gears"]["gearbox"]
    gear.pop("hysteresis", None)
    kind, worm = int(generator.integers(5)), float(generator.uniform(-0.3, 0.8))
    if kind != 1:
        gear["losses"] = {"kind": "mesh_efficiency", "drive_efficiency": 0.6, "backdrive_efficiency": worm}
    if kind == 1:
        backlash, limited = float(generator.uniform(0.3e-3, 2e-3)), bool(generator.random() < 0.5)
        gear |= {"mesh_damping": 20.0, "damping_limited": limited}
        gear["stiffness"] = {"kind": "curve", "slopes": [2e4], "backlash": backlash}
    elif kind == 2:
        gear["stiffness"] = {"kind": "curve", "slopes": [5e3, 2e4], "breaks": [1e-3]}
    elif kind == 3:
        gear |= {"mesh_damping": 10.0, "stiffness": {"kind": "curve", "slopes": [1e4]}}
    elif kind == 4:
        tables["shafts"]["load"] |= {"friction_torque": 0.5, "breakaway_torque": 1.0}
    return lm.Scenario(**tables)


def test_a_step_that_is_not_left_to_the_general_solver_is_one_of_its() -> None:
    # Each step begins at what the batch has, so that no rounding is carried along: 100 drives, 1,000 of 10,000 steps.
    generator = np.random.default_rng(12)
    drives = [odd_drive(generator) for _ in range(100)]
    commands = random_commands(generator, 100, len(drives))
    batch = lm.SimulationBatch(drives, STEP)
    alone = [lm.Simulation(drive, step=STEP) for drive in drives]
    delayed = [bool(drive.train().motors["motor"].electrical_time_constant) for drive in drives]
    for n in range(100):
        before = {name: batch[name].copy() for name in batch._core.states}
        batch.step(commands[n], 0.0)
        for k in range(len(drives)):
            if (n + k) % 10 != 9:
                continue
            at = {name: float(values[k]) for name, values in before.items()}
            alone[k].reset(
                lm.TrainInitial(
                    speeds={"motor": at["motor_speed"], "load": at["load_speed"]},
                    angles={"load": at["load_angle"]},
                    twists={"gearbox": at["gearbox_twist"]},
                    motor_torques={"motor": at["motor_torque"]} if delayed[k] else {},
                )
            )
            alone[k].advance(STEP, motor_command=float(commands[n, k]), load_load_torque=0.0)
            for name, scale in {"motor_speed": 1e-8, "load_speed": 1e-9, "gearbox_twist": 1e-12, "load_angle": 1e-12}.items():
                assert batch[name][k] == pytest.approx(alone[k][name], abs=scale, rel=1e-11), (k, n, name)
    assert batch.counts["switchings"] > 500
    assert batch.counts["general"] < 0.02 * batch.counts["steps"]


@pytest.mark.parametrize("make", [random_drive, odd_drive])
def test_a_batch_answers_a_load_torque_as_its_drives_alone(make: Callable[[np.random.Generator], Any]) -> None:
    generator = np.random.default_rng(8)
    drives = [make(generator) for _ in range(40)]
    commands, loads = random_commands(generator, 40, len(drives)), generator.uniform(-2.0, 2.0, (40, len(drives)))
    batch, alone = lm.SimulationBatch(drives, STEP), [lm.Simulation(drive, step=STEP) for drive in drives]
    short = isinstance(drives[0], lm.Drive)
    names = ("command", "load_torque") if short else ("motor_command", "load_load_torque")
    found = [batch.answer(commands[n], loads[n]) for n in range(40)]
    assert batch.counts["switchings"] > 200
    assert batch.counts["general"] < 0.05 * batch.counts["steps"]
    for k, drive in enumerate(drives):
        inertia = lm.Scenario.of_any(drive).train().shafts["load"].inertia
        for n in range(40):
            want = alone[k].answer(STEP, **dict(zip(names, (float(commands[n, k]), float(loads[n, k])), strict=True)))
            assert found[n].torque[k] == pytest.approx(want.torque, abs=1e-6)
            # By how much a torque changes the mean acceleration, as the derivative is the difference of two inertias.
            compliance, wanted = (1.0 / (inertia - d) for d in (found[n].derivative[k], want.derivative))
            assert compliance == pytest.approx(wanted, rel=1e-8, abs=1e-12)


def test_a_batch_of_any_train_answers_a_load_torque() -> None:
    scenario = lm.load("two-motors-one-ring")
    batch, alone = lm.SimulationBatch(scenario, STEP, count=2), lm.Simulation(scenario, step=STEP)
    given = {"first_motor_command": 0.3, "second_motor_command": 0.2}
    for _ in range(5):
        found, want = batch.answer(**given, shaft="ring"), alone.answer(STEP, **given, shaft="ring")
        assert found.torque.tolist() == [want.torque] * 2
        assert found.derivative.tolist() == [want.derivative] * 2
    assert "shaft" in refused(lambda: batch.answer(**given, shaft="crown"))


@pytest.mark.parametrize("key", ["load.inertia", "gearbox.stiffness.backlash", "gearbox.losses.efficiency", "gearbox.ratio"])
def test_what_is_written_acts_from_the_next_step_on(key: str) -> None:
    value = {"load.inertia": 3.0, "gearbox.stiffness.backlash": 5e-3, "gearbox.losses.efficiency": 0.6, "gearbox.ratio": 60.0}
    batch = lm.SimulationBatch(simple_drive(), STEP, count=3)
    for _ in range(150):
        batch.step(0.2)
    start = {name: float(batch[name][1]) for name in ("motor_speed", "load_speed", "twist", "load_angle")}
    batch.parameters[key][1] = value[key]
    changed = lm.Scenario.of_any(simple_drive()).replace(**{key: value[key]})
    alone = lm.Simulation(changed, step=STEP, initial=lm.Initial(**start))
    for _ in range(100):
        batch.step(-0.1)
        alone.advance(STEP, command=-0.1)
    for name in start:
        assert batch[name][1] == pytest.approx(alone[name], rel=1e-10, abs=1e-12)
    assert np.array_equal(batch["load_angle"][[0]], batch["load_angle"][[2]])
    assert batch["load_angle"][0] != batch["load_angle"][1]


def test_a_gap_may_close_and_open_again() -> None:
    batch, closed = (lm.SimulationBatch(simple_drive(), STEP, count=2) for _ in range(2))
    closed.parameters["gearbox.stiffness.backlash"][:] = 0.0
    batch.parameters["gearbox.stiffness.backlash"][0] = 0.0
    for _ in range(100):
        batch.step(0.1)
        closed.step(0.1)
    assert batch["twist"][0] == closed["twist"][0] < batch["twist"][1]
    batch.parameters["gearbox.stiffness.backlash"][0] = 2e-3
    batch.reset()
    for _ in range(100):
        batch.step(0.1)
    assert batch["twist"][0] == batch["twist"][1]


def test_parameters_of_any_train_are_written_between_steps() -> None:
    scenario = lm.load("two-motors-one-ring")
    key = "shafts.ring.inertia"
    batch = lm.SimulationBatch(scenario, STEP, count=2)
    given = dict.fromkeys(batch.inputs, 0.1)
    for _ in range(20):
        batch.step(**given)
    batch.parameters[key][1] *= 2.0
    for _ in range(20):
        batch.step(**given)
    assert batch["ring_speed"][1] != batch["ring_speed"][0]
    heavy = lm.SimulationBatch(scenario, STEP, vary={key: batch.parameters[key]})
    heavy.reset()
    assert heavy.parameters[key].tolist() == batch.parameters[key].tolist()


def two(drive: Any, **options: Any) -> lm.SimulationBatch:
    return lm.SimulationBatch(lm.load(drive) if isinstance(drive, str) else drive, STEP, count=2, **options)


REFUSED: list[tuple[Callable[[lm.Drive], Any], str]] = [
    (lambda d: lm.SimulationBatch(d, STEP), ": count: give the number of drives"),
    (lambda d: lm.SimulationBatch([], STEP), ": drives: there is none"),
    (lambda d: lm.SimulationBatch(d, 0.0, count=2), ": step 0.0 s must lie between"),
    (lambda d: lm.SimulationBatch([d, d], STEP, count=2), ": are for one drive"),
    (lambda d: lm.SimulationBatch([lm.load("worm-lowering"), lm.load("speed-axis")], STEP), ": different inputs"),
    (lambda d: two(d, vary={"load.inertia": [1, 2, 3]}), ": 3 values for 2 drives"),
    (lambda d: two(d, vary={"load.inertja": np.ones(2)}), ": did you mean load.inertia"),
    (lambda d: two(d, vary={"load.inertia": np.array([1.0, -1.0])}), "load.inertia"),
    (lambda d: two(d, vary={"motor.rated_speed": np.ones(2)}), ": motor.rated_speed: the scenario has nothing of that name"),
    (lambda d: two(d).step([1.0, 2.0, 3.0]), ": an array of 2 numbers"),
    (lambda d: two(d).step([1.0, np.nan]), ": command: has numbers that are not"),
    (lambda d: two(d).step(0.1, motion={"speed": 1.0}), ": motion: is for a batch"),
    (lambda d: two(d)["angle"], ": is no variable of a batch"),
    (lambda d: two(d).reset([1, 0]), ": array of 2 Booleans"),
    (lambda d: two(d).reset(initial={"angle": 1.0}), ": initial.angle: is no state"),
    (lambda d: two("given-motion"), ": gives the motion of a shaft"),
    (lambda d: two("worm-lowering", given_motion="lod"), ": is no shaft or slide"),
    (lambda d: two("two-motors-one-ring").step(0.1), ": command: there are several"),
    (lambda d: two("two-motors-one-ring").step(first_motor_command=0.1), ": second_motor_command: missing"),
    (lambda d: two("two-motors-one-ring", controllers=lm.load("speed-axis").controller), ": one motor"),
    (lambda d: two("paper-2dof-nl-small", sensitivities=["gearbox.stiffness.backlash"]), "sensitivities.gearbox.stiffness.backlash: is 0 for drive 0"),
    (lambda d: two("paper-2dof-nl-small", sensitivities=["simulation.duration"]), "sensitivities.simulation.duration: no number that a batch differentiates by"),
    (lambda d: two("paper-2dof-nl-small", sensitivities=["load.inertias"]), ": did you mean load.inertia"),
    (lambda d: two("position-axis", sensitivities=["load.inertia"]), ": a controller turns the motor"),
    (lambda d: two("two-motors-one-ring", sensitivities=["shafts.ring.inertia"]), ": lm.simulate takes all trains"),
    (lambda d: two(d, controllers="position"), ": must be a Controller, or a list"),
    (lambda d: two(d, controllers=[lm.load("position-axis").controller]), ": controllers: there are 1 for 2 drives"),
    (lambda d: two(d, controllers=[1, 2]), ": controllers: 1 must be a Controller"),
    (lambda d: two(d, controllers=lm.load("speed-axis", LAW).controller), ": a law of your own is for"),
]  # fmt: skip
LAW = {"controller.law": True, "controller.speed": None}


test_bad_use_is_refused = refusals_of(lambda use: use(simple_drive()), *REFUSED)


def test_what_is_no_parameter_is_refused_and_nothing_moves() -> None:
    for key, value, at in (("load.inertia", -1.0, ""), ("load.inertias", 1.0, ""), ("gearbox.losses.efficiency", 0.0, "losses.efficiency")):
        batch = two(simple_drive())
        with pytest.raises(lm.InputError, match=at or key):
            batch.parameters[key][1] = value
            batch.step(0.1)
        assert not batch["motor_speed"].any()


AXIS = {
    "axis": {
        "motor": {"kind": "torque_source", "rotor_inertia": 1e-4, "rated_torque": 2.0},
        "screw": {"lead": 0.01, "efficiency": 0.9, "stiffness": 5e7, "backlash": 1e-5},
        "slide": {"mass": 20.0, "friction_force": 30.0},
        "brake": {"torque": 3.0, "command": 0.0},
    },
    "simulation": {"duration": 0.1, "sample_interval": 0.01},
}


@pytest.mark.parametrize(("scenario", "key"), [
    (lm.load("two-motors-one-ring"), "shafts.ring.inertia"),
    (lm.load("worm-lowering"), "shafts.drum.inertia"),
    (lm.load("two-link-arm-frozen"), "mass_matrices.arm.matrix.0.0"),
    (lm.load("direction-finder"), "shafts.traverse.inertia"),
    (lm.load("hunting-with-static-friction"), "shafts.table.inertia"),
    (lm.Scenario(**AXIS), "axis.slide.mass"),
    (lm.load("lossy-rigid-gear").replace(**{"gearbox.mesh_damping": 0.0}), "gearbox.ratio"),
])  # fmt: skip
def test_trains_of_any_kind_move_as_alone(scenario: lm.Scenario, key: str) -> None:
    value = lm.simulation.runs.sensitivities.value_at(scenario, key)
    values = np.array([1.0, 1.2]) * value
    batch = lm.SimulationBatch(scenario, STEP, vary={key: values})
    given = {name: 0.4 for name in batch.inputs if not name.endswith(("_load_torque", "_load_force"))}
    for _ in range(20):
        batch.step(**given)
    for k, x in enumerate(values[: 1 if scenario.axes() else 2].tolist()):  # controllers are tuned to the first
        changed = scenario.replace(**{key: x})
        if scenario.axes():
            held = {m: c.model_copy(update={"reference": type(c.reference)(mean=0.4)}) for m, c in scenario.axes().items()}
            changed = changed.with_axes(held)
        alone = lm.Simulation(changed, step=STEP, initial=scenario.begin())
        for _ in range(20):
            alone.advance(STEP, **{name: u for name, u in given.items() if name in alone.inputs})
        for name in (changed.train().variable(shaft, "speed") for shaft in changed.train().shafts):
            assert batch[name][k] == pytest.approx(alone[name], rel=1e-9, abs=1e-9), name
    assert batch.counts["steps"] == 40


def test_a_train_of_one_gear_is_walked_under_its_own_names() -> None:
    scenario = lm.load("catalogue-robot-joint")
    tables = scenario.long().model_dump(exclude_none=True)
    renamed = {"motor": "rotor", "load": "arm"}
    tables["shafts"] = {renamed[name]: shaft for name, shaft in tables["shafts"].items()}
    tables["motors"]["motor"]["shaft"] = "rotor"
    tables["gears"]["gearbox"] |= {"input": "rotor", "output": "arm"}
    short, long = (lm.SimulationBatch(one, STEP, count=2) for one in (scenario, lm.Scenario(**tables)))
    for batch in (short, long):
        for k in range(100):
            batch.step([0.3, -0.1] if k < 50 else 0.0)
    for name, own in (("load_angle", "arm_angle"), ("motor_speed", "rotor_speed"), ("twist", "gearbox_twist")):
        assert np.array_equal(short[name], long[own])
    assert np.array_equal(short["input_contact"], long["rotor_contact"])
    assert short.counts == long.counts
    assert long.counts["general"] < long.counts["steps"]


@pytest.mark.parametrize("backdrive", [0.8, -0.2])
def test_flanks_that_part_where_losses_change_their_side_need_no_other_solver(backdrive: float) -> None:
    """The torque of a mesh ends at the edge of its gap, which is also that between losses of driving and of overrunning."""
    generator = np.random.default_rng(5)
    losses = {"kind": "mesh_efficiency", "drive_efficiency": 0.7, "backdrive_efficiency": backdrive}
    trains = [
        lm.DriveTrain(
            shafts={"m": {"inertia": 0.0}, "l": {"inertia": inertia, "viscous_friction": 2.0}},
            motors={"motor": {"shaft": "m", "kind": "torque_source", "rotor_inertia": 1e-4, "friction_torque": 0.02}},
            gears={"g": {"input": "m", "output": "l", "ratio": 50.0, "stiffness": {"kind": "curve", "slopes": [1e4], "backlash": 2e-3},
                         "losses": losses, "rated_input_speed": 400.0, "rated_output_torque": 50.0}},
        )
        for inertia in generator.uniform(0.3, 2.0, 6).tolist()
    ]  # fmt: skip
    batch, alone = lm.SimulationBatch(trains, STEP), [lm.Simulation(lm.Scenario.of_any(t), step=STEP) for t in trains]
    for row in generator.uniform(-0.5, 0.5, (300, 6)):
        batch.step(row)
        for one, torque in zip(alone, row.tolist(), strict=True):
            one.advance(STEP, command=torque)
    for name in ("l_angle", "l_speed", "m_speed"):
        np.testing.assert_allclose(batch[name], [one[name] for one in alone], rtol=1e-9, atol=1e-12)
    assert batch.counts["general"] == 0
    assert batch.counts["with_events"] > 300


def test_a_drive_that_cannot_go_on_stays_and_is_named() -> None:
    # A loss map ends far outside its data: a load torque that no gear carries.
    drive = random_drive(np.random.default_rng(0)).model_copy(update={"gearbox": lm.load("paper-2dof-nl-small").gearbox})
    batch = lm.SimulationBatch([drive, drive, drive], STEP)
    batch.step(0.0)
    with pytest.raises(lm.SolverError, match="drive 1 of the batch"):
        for _ in range(100):
            batch.step(0.0, [0.0, 1e12, 0.0])
    assert np.isfinite(batch["twist"]).all()
    batch.reset(np.array([False, True, False]))
    batch.step(0.1)


# --- sensitivities ---
MOVED = ("motor_speed", "load_speed", "twist", "load_angle")


@pytest.mark.parametrize(("name", "keys"), [
    ("paper-2dof-nl-small", ["load.inertia", "gearbox.ratio", "motor.friction_torque", "gearbox.hysteresis.efficiency"]),
    ("catalogue-robot-joint", ["load.inertia", "load.friction_torque", "gearbox.ratio", "motor.rated_torque"]),
    ("backlash-reversing-load", ["gearbox.stiffness.backlash", "load.inertia", "motor.rotor_inertia"]),
    ("step-to-standstill", ["load.friction_torque", "motor.rated_speed", "gearbox.rated_output_torque"]),
])  # fmt: skip
def test_sensitivities_are_those_of_a_run(name: str, keys: list[str]) -> None:
    """The run integrates the variational equations of the train, with the derivative of the reset at each switching."""
    drive, pause, count = lm.load(name).drive(), 5e-3, 20
    commands = np.random.default_rng(3).uniform(-0.3, 0.3, count)
    batch = lm.SimulationBatch(drive, pause, count=1, sensitivities=keys)
    for command in commands:
        batch.step(command)
    heights = np.diff(commands, prepend=0.0)
    steps = [{"time": pause * k, "height": float(height)} for k, height in enumerate(heights)]
    run = lm.Scenario.of_any(drive).replace(
        **{"command": {"steps": steps}, "simulation.duration": pause * count, "simulation.sample_interval": pause}
    )
    right = lm.simulate(run, sensitivities=keys)
    for variable in MOVED:
        expected = right[f"{variable}_sensitivity"].values[:, -1]
        assert batch[f"{variable}_sensitivity"][:, 0] == pytest.approx(expected, rel=1e-8), variable


def test_a_sensitivity_has_a_closed_form_and_follows_what_is_written() -> None:
    """A rigid gear without losses: (J + i² J_M) w' = i M; a snapshot takes the derivatives along."""
    drive = simple_drive(RIGID | {"ratio": 10}, {"rotor_inertia": 1e-3, "rated_torque": 2.0})
    keys = ["load.inertia", "gearbox.ratio", "motor.rated_torque"]
    batch = lm.SimulationBatch(drive, 0.1, count=2, sensitivities=keys)
    assert not batch["load_speed_sensitivity"].any()
    batch.parameters["load.inertia"][1] = 4.0
    batch.step(0.5)
    J, i, J_M, M, t = np.array([1.0, 4.0]), 10.0, 1e-3, 1.0, 0.1
    total = J + i**2 * J_M
    right = np.array([-i * M / total**2, M / total - i * M * 2 * i * J_M / total**2, i * 0.5 / total]) * t
    assert batch["load_speed_sensitivity"] == pytest.approx(right, rel=1e-12)
    assert batch["load_angle_sensitivity"] == pytest.approx(right * t / 2, rel=1e-12)
    before = batch.snapshot()
    batch.step(0.5)
    assert batch["load_speed_sensitivity"] == pytest.approx(2 * right, rel=1e-12)
    batch.restore(before)
    assert batch["load_speed_sensitivity"] == pytest.approx(right, rel=1e-12)
    batch.reset(np.array([True, False]))
    assert not batch["load_speed_sensitivity"][:, 0].any() and batch["load_speed_sensitivity"][:, 1].any()


# --- controllers and given motions ---
def positioned(generator: np.random.Generator) -> lm.Drive:
    """A drive of random parameters that the controller of a shipped scenario can hold."""
    drive = lm.load("position-axis").drive()
    backlash = float(generator.uniform(0.2e-3, 1e-3))
    stiffness = lm.model.TorsionCurve(slopes=[float(generator.uniform(2e4, 5e4))], backlash=backlash)
    load = lm.Load(inertia=drive.load.inertia * float(generator.uniform(0.6, 1.4)), friction_torque=0.2)
    return drive.model_copy(update={"load": load, "gearbox": drive.gearbox.model_copy(update={"stiffness": stiffness, "hysteresis": None})})


def test_controllers_act_at_their_instants_as_on_a_drive_alone() -> None:
    generator = np.random.default_rng(11)
    drives = [positioned(generator) for _ in range(12)]
    controller = lm.load("position-axis").controller
    assert controller is not None
    targets = generator.uniform(-0.02, 0.02, 12)
    batch = lm.SimulationBatch(drives, STEP, controllers=controller)
    for _ in range(1000):
        batch.step(targets)
    for k, drive in enumerate(drives):
        hold = controller.model_copy(update={"reference": lm.PositionReference(mean=float(targets[k]))})
        alone = lm.Simulation(lm.Scenario.of_any(drive).with_axes({"motor": hold}), step=STEP)
        for _ in range(1000):
            alone.advance(STEP)
        assert batch["load_angle"][k] == pytest.approx(alone["load_angle"], abs=1e-6)
        assert batch["load_speed"][k] == pytest.approx(alone["load_speed"], abs=1e-5)
        assert batch["torque_reference"][k] == pytest.approx(alone["torque_reference"], abs=1e-6)
    assert np.abs(batch["load_angle"] - targets).max() < 2e-3
    assert batch.counts["general"] < batch.counts["steps"] == 12000


CONTROLLED = [
    ("position-axis", 0.02),
    ("position-axis-load-encoder", 0.02),
    ("speed-axis", 20.0),
    ("tracking-adaptive", 0.01),
    ("tracking-camera", 0.01),
]


@pytest.mark.parametrize(("name", "move"), CONTROLLED)
@pytest.mark.parametrize("step", [0.37e-3, 5e-3])
def test_a_walk_from_sample_to_sample_is_the_motion_of_the_general_solver(
    name: str, move: float, step: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All variables, with moving references, a reset, a written parameter and a snapshot on the way."""
    scenario, count = lm.load(name), 8
    options = {"step": step, "vary": {"load.inertia": scenario.load.inertia * np.linspace(1.0, 1.5, count)}}
    walked = lm.SimulationBatch(scenario, **options)
    monkeypatch.setattr(WalkedBatch, "takes", staticmethod(lambda scenarios: False))
    general = lm.SimulationBatch(scenario, **options)
    generator, reference = np.random.default_rng(5), np.zeros(count)
    for k in range(60):
        reference = reference + move * generator.normal(size=count)
        load = generator.normal(size=count) * (k % 3)
        for batch in (walked, general):
            if k == 30:
                batch.parameters["load.inertia"][3] *= 1.2
            if k == 40:
                batch.reset(np.arange(count) % 3 == 0)
            batch.step(reference, load)
        if k == 50:
            before = walked.snapshot()
            walked.step(0.0)
            walked.restore(before)
    assert general.counts["general"] == 60 * count and walked.counts["general"] < 6 * count
    for variable in general.variables:
        right = general[variable]
        np.testing.assert_allclose(walked[variable], right, 1e-9, 1e-12 + 1e-9 * np.nanmax(np.abs(right)), err_msg=variable)


def test_a_written_inertia_acts_with_the_whole_of_the_next_step() -> None:
    """Newton's law; a third shaft leaves the train to the general solver."""
    shafts = {"rotor": {"inertia": 1e-3}, "wheel": {"inertia": 2.0}, "free": {"inertia": 1.0}}
    motor = {"shaft": "rotor", "kind": "torque_source", "rated_torque": 1.0, "rotor_inertia": 1e-3}
    train = lm.DriveTrain(shafts=shafts, motors={"motor": motor}, gears={"mesh": {"input": "rotor", "output": "wheel", "ratio": 2.0}})
    batch = lm.SimulationBatch(train, STEP, count=2)
    batch.step(motor_command=0.0, free_load_torque=3.0)
    before = batch["free_speed"].copy()
    batch.parameters["shafts.free.inertia"][1] = 4.0
    batch.step(motor_command=0.0, free_load_torque=3.0)
    assert batch["free_speed"] - before == pytest.approx([-3.0 * STEP, -0.75 * STEP], rel=1e-12)


def test_what_varies_leaves_the_controller_as_it_was_tuned() -> None:
    drive, controller = lm.load("position-axis").drive(), lm.load("position-axis").controller
    assert controller is not None
    inertias = drive.load.inertia * np.array([0.5, 1.0])
    batch = lm.SimulationBatch(drive, STEP, vary={"load.inertia": inertias}, controllers=controller)
    tuned = lm.SimulationBatch(drive, STEP, count=1, controllers=[controller])
    for _ in range(50):
        batch.step(0.01)
        tuned.step(0.01)
    assert batch["load_angle"][1] == tuned["load_angle"][0]
    assert batch["load_angle"][0] != tuned["load_angle"][0]


def test_a_given_motion_takes_the_torque_of_newtons_law() -> None:
    batch = lm.SimulationBatch(simple_drive(RIGID, {"rotor_inertia": 1e-4}), STEP, count=3, given_motion=True)
    acceleration = np.array([0.0, 2.0, -5.0])
    for k in range(1, 11):
        batch.step(0.1, motion={"speed": acceleration * k * STEP})
    # (J + i^2 J_M) a = i M + drive torque
    assert batch["load_drive_torque"] == pytest.approx((1.0 + 2500 * 1e-4) * acceleration - 50 * 0.1, rel=1e-12)
    assert batch["load_angle"] == pytest.approx(0.5 * acceleration * 0.01**2, rel=1e-12, abs=1e-18)
    assert "load_torque: does not act on load, whose motion is given" in refused(lambda: batch.step(0.1, 1.0, motion={"speed": 0.0}))
    assert "motion.speed: is missing" in refused(lambda: batch.step(0.1, motion={"angle": 0.0}))
    assert "motion.sped: is not known; did you mean speed" in refused(lambda: batch.step(0.1, motion={"sped": 0.0}))
    assert "motion: is missing" in refused(lambda: batch.step(0.1))


def test_a_given_motion_moves_each_drive_as_alone() -> None:
    generator = np.random.default_rng(13)
    drives = [random_drive(generator) for _ in range(8)]
    batch = lm.SimulationBatch(drives, STEP, given_motion=True)
    batch.reset(initial={"load_speed": 0.2, "load_angle": 0.1})
    alone = [
        lm.Simulation(
            drive.train(), step=STEP, loaded=[], given=["load"], initial=lm.TrainInitial(speeds={"load": 0.2}, angles={"load": 0.1})
        )
        for drive in drives
    ]
    for k in range(1, 201):
        speed, angle = 0.2 * np.cos(9 * k * STEP), 0.1 + 0.2 / 9 * np.sin(9 * k * STEP)
        batch.step(0.1, motion={"speed": speed, "angle": angle})
        for one in alone:
            one.advance(STEP, motor_command=0.1, motion={"load": {"speed": speed, "angle": angle}})
    for k, one in enumerate(alone):
        for name in ("motor_speed", "load_angle", "load_drive_torque"):
            assert batch[name][k] == one[name], name
        assert batch["twist"][k] == one["gearbox_twist"]


def test_any_shaft_or_slide_may_have_a_given_motion() -> None:
    """One behind a worm, one before it, a slide behind a screw: each as in a simulation alone."""
    for name, shaft in (("worm-lowering", "worm"), ("two-motors-one-ring", "ring"), ("ball-screw-axis", "slide")):
        scenario = lm.load(name).without_controllers()
        batch = lm.SimulationBatch(scenario, STEP, count=2, given_motion=shaft)
        alone = lm.Simulation(scenario, step=STEP, loaded=[], given=[shaft])
        commands = {n: 0.1 for n in batch.inputs if n.endswith("command")}
        for k in range(1, 51):
            motion = {"speed": 0.01 * np.sin(20 * k * STEP)}
            batch.step(**commands, motion=motion)
            alone.advance(STEP, **commands, motion={shaft: motion})
        variable = f"{shaft}_drive_{'force' if shaft == 'slide' else 'torque'}"
        assert batch[variable][1] == alone[variable] != 0.0

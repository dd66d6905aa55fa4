"""Drive trains step by step, as linear models, explained: against runs, textbook matrices and capacities by hand."""

import math
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg

import lostmotion as lm
from conftest import CONTROLLED, SCENARIOS, TRAINS
from refusals import refused

WORM = lm.load("worm-lowering")
RING = lm.load("two-motors-one-ring")
BELT = lm.load("belt-before-gearbox")
ROTOR = 0.25  # kg·m²
HOLDING = {"motor_command": 0.0, "drum_load_torque": 20.0}


def chain(inertias: list[float], stiffnesses: list[float], damping: float = 0.0) -> lm.DriveTrain:
    """Masses joined by springs, turned by a torque source on the first."""
    names = [f"s{k}" for k in range(len(inertias))]
    return lm.DriveTrain(
        shafts={name: lm.Shaft(inertia=J - (ROTOR if name == "s0" else 0.0)) for name, J in zip(names, inertias, strict=True)},
        motors={"m": lm.ShaftMotor(shaft="s0", kind="torque_source", rotor_inertia=ROTOR)},
        gears={
            f"g{k}": lm.Gear(
                input=names[k], output=names[k + 1], ratio=1.0, stiffness=lm.model.LinearStiffness(stiffness=c), mesh_damping=damping
            )
            for k, c in enumerate(stiffnesses)
        },
    )


# --- step by step ---
@pytest.mark.parametrize("path", TRAINS, ids=lambda p: p.stem)
def test_a_train_stepped_follows_its_run(path: Path) -> None:
    scenario = lm.load(path)
    if path.stem == "field-weakening":  # its encoder's steps make 1e-8 of what the last bits differ by
        scenario = scenario.replace(**{"controllers.m.encoder": {"ideal": True}})
    if any(brake.engagement_delay or brake.release_delay for brake in scenario.brakes.values()):
        pytest.skip("a delay needs a command that is made of steps")
    h, n = 0.0020013, 150  # so that no tick of a controller falls on the end
    names = lm.Simulation(scenario).inputs
    signals = scenario.signals()
    # Commands and loads as straight lines over the steps, in both.
    levels = {name: np.array([_value(signals[name], h * k) for k in range(n + 1)]) for name in names}
    simulation = lm.Simulation(scenario, step=h)
    speeds = {name: np.array([_value(scenario.shafts[name].speed, h * k) for k in range(n + 1)]) for name in simulation.given}
    for k in range(n):
        motion = {name: {"speed": w[k + 1]} for name, w in speeds.items()}
        simulation.advance(h, motion=motion, **{name: (u[k], u[k + 1]) for name, u in levels.items()})
    changes: dict[str, Any] = {"simulation.duration": h * n, "simulation.sample_interval": h}
    for name, u in levels.items():
        key = f"command.{name.removesuffix('_command')}"
        for ending, of_element in (("_load_torque", "shafts.{}.torque"), ("_load_force", "slides.{}.force")):
            if name.endswith(ending):
                key = of_element.format(name.removesuffix(ending))
        changes[key] = {"samples": {"times": [h * k for k in range(n + 1)], "values": u.tolist()}}
        if name.endswith("_reference"):
            controller = f"controllers.{name.removesuffix('_reference')}.reference"
            changes[controller] = changes.pop(key) | {"kind": scenario.controllers["servo"].reference.kind}
    for name, w in speeds.items():  # with the last line going on, since a run has the right limits of accelerations
        points = {"times": [h * k for k in range(n + 2)], "values": [*w.tolist(), 2.0 * w[-1] - w[-2]]}
        changes[f"shafts.{name}.speed"] = {"samples": points}
    run = lm.simulate(scenario.replace(**changes))
    assert set(simulation.read()) == {str(name) for name in run}
    for name in run:
        size = float(abs(run[name]).max())
        assert simulation[str(name)] == pytest.approx(float(run[name][-1]), rel=1e-9, abs=1e-9 * size), name


def test_an_angle_that_no_gear_hands_on_is_no_variable_of_stepping_either() -> None:
    """Behind a clutch the angle is not recorded; runs and steps have the same variables."""
    scenario = lm.Scenario(
        shafts={"engine": {"inertia": 0.01}, "wheel": {"inertia": 0.1, "torque": 0.0}},
        motors={"motor": {"shaft": "engine", "kind": "torque_source", "rated_torque": 2.0, "rotor_inertia": 0.01}},
        clutches={"clutch": {"input": "engine", "output": "wheel", "torque": 1.0}},
        command={"motor": {"mean": 0.8}, "clutch": {"mean": 1.0}},
        simulation={"duration": 0.1, "sample_interval": 0.01},
    )
    simulation, run = lm.Simulation(scenario, step=0.01), lm.simulate(scenario)
    assert set(simulation.read()) == {str(name) for name in run}
    for _ in range(10):
        simulation.advance(0.01, motor_command=0.8, clutch_command=1.0)
    assert simulation["wheel_speed"] == pytest.approx(float(run["wheel_speed"][-1]), rel=1e-12)


def _value(signal: Any, t: float) -> float:
    """Of a signal at an instant: mean, sine, steps, ramps and nothing else."""
    sine = signal.amplitude * math.sin(2.0 * math.pi * signal.frequency * t + signal.phase) if signal.amplitude else 0.0
    ramps = sum(r.rise * min(1.0, max(0.0, (t - r.begin) / r.duration)) for r in signal.ramps)
    return float(signal.mean + sine + sum(s.height for s in signal.steps if s.time <= t) + ramps)


@pytest.mark.parametrize("path", [p for p in SCENARIOS if p not in CONTROLLED], ids=lambda p: p.stem)
def test_the_short_and_the_long_form_step_with_the_same_bits(path: Path) -> None:
    scenario = lm.load(path)
    drive, train = lm.Simulation(scenario, step=1e-3), lm.Simulation(scenario.long(), step=1e-3)
    pairs = {"motor_torque": "motor_torque", "motor_speed": "motor_speed", "load_speed": "load_speed"}
    pairs |= {"load_angle": "load_angle", "twist": "gearbox_twist", "output_torque": "gearbox_output_torque"}
    rated = scenario.gearbox.rated_output_torque
    for k in range(200):
        command, torque = 0.3 * math.sin(0.05 * k), 0.2 * rated * math.sin(0.031 * (k // 20))
        drive.advance(1e-3, (command, 0.9 * command), torque)
        train.advance(1e-3, motor_command=(command, 0.9 * command), load_load_torque=torque)
        assert drive[list(pairs)].tolist() == train[list(pairs.values())].tolist()


def test_a_state_of_a_train_is_restored_bit_for_bit_also_from_a_file() -> None:
    simulation, other = lm.Simulation(WORM), lm.Simulation(WORM.train(), loaded=["drum"])

    def forward(sim: lm.Simulation) -> list[dict[str, float]]:
        out = []
        for k in range(200):
            sim.advance(1e-3, motor_command=-0.15, drum_load_torque=(20.0, 20.0 + 0.01 * (k % 3)))
            out.append(sim.read())
        return out

    forward(simulation)
    state = pickle.loads(pickle.dumps(simulation.state))
    expected = forward(simulation)
    simulation.state = other.state = state
    assert forward(simulation) == expected
    assert forward(other) == expected
    simulation.reset()
    assert simulation.time == 0.0
    assert simulation["worm_gear_twist"] == 2e-3
    simulation.reset(lm.TrainInitial(speeds={"rotor": 3.0}))
    assert simulation["rotor_speed"] == 3.0


def test_several_variables_of_a_train_come_as_an_array() -> None:
    simulation = lm.Simulation(WORM)
    simulation.advance(1e-3, **HOLDING)
    pair = simulation["worm_gear_twist", "worm_angle"]
    assert pair.tolist() == [simulation["worm_gear_twist"], simulation["worm_angle"]]
    # phi_worm = i (phi_drum + d): the drum is at 0
    assert pair.tolist() == [2e-3, 50.0 * 2e-3]


def test_a_train_alone_may_be_loaded_everywhere() -> None:
    train = chain([1.0, 2.0], [10.0])
    assert lm.Simulation(train).inputs == ("m_command", "s0_load_torque", "s1_load_torque")
    only = lm.Simulation(train, loaded=["s1"])
    assert only.inputs == ("m_command", "s1_load_torque")
    only.advance(0.5, m_command=0.0, s1_load_torque=-3.0)  # free: the middle of the masses gains 3 N·m/(3 kg·m²) * 0.5 s
    assert (only["s0_speed"] + 2.0 * only["s1_speed"]) / 3.0 == pytest.approx(0.5, rel=1e-12)


REFUSED = [
    (lambda s: s.advance(1e-3), "motor_command: missing; all commands and references are to be given"),
    (lambda _: lm.Simulation(lm.load("two-motors-one-ring")).advance(1e-3, 0.1), "command: there are several; give them by name"),
    (lambda s: s.advance(1e-3, motor_comand=0.1), "motor_comand: is no input of this train; did you mean motor_command?"),
    (lambda s: s.advance(1e-3, motor_command=0.0, worm_load_torque=1.0), 'with loaded=["worm"]'),
    (lambda s: s.advance(1e-3, motor_command="0,1"), 'motor_command: "0,1" has a decimal comma; write "0.1"'),
    (lambda s: s.advance(1e-3, motor_command=math.nan), "motor_command: nan must be a finite number"),
    (lambda s: s.advance(0.0, motor_command=0.0), "interval 0.0 s must lie between"),
    (lambda s: s.advance("x", motor_command=0.0), 'interval: "x" is not one number with one unit'),
    (lambda s: s["rotor_sped"], '"rotor_sped" is no variable; did you mean rotor_speed?'),
    (lambda s: s.reset(lm.Initial(load_speed=1.0)), "key initial.speeds.load: is no shaft of this train"),
    (lambda s: s.reset(lm.TrainInitial(speeds={"x": 1.0})), "key initial.speeds.x: is no shaft of this train"),
    (lambda s: setattr(s, "state", lm.Simulation(BELT).state), "is the state of another drive"),
    (lambda s: setattr(s, "state", lm.Simulation(WORM.replace(**{"shafts.drum.inertia": 3.0})).state), "of another drive"),
    (lambda _: lm.Simulation(WORM, loaded=["dum"]), 'loaded: "dum" is no shaft of this train; did you mean drum?'),
    (lambda _: lm.linearize(WORM), "depends on the operating point (dry contacts: rotor_contact, worm_contact)"),
    (lambda _: lm.linearize(lm.load("two-motors-one-ring"), lm.TrainInitial(), command=0.1), "command: there are several; give them by name"),
    (lambda _: lm.linearize(WORM, lm.TrainInitial(), inputs={"motor_comand": 1.0}), '"motor_comand" is no input of this train; did you'),
    (lambda _: lm.linearize(WORM, lm.TrainInitial(), time=0.1), "state: at a time of a run, state and inputs are its own"),
    (lambda _: lm.linearize(WORM.train(), time=0.1), "time: a drive alone has no run"),
    (lambda _: lm.linearize(WORM, time=9.0), "time 9.0 s must lie between 0 and the duration, 1.5 s"),
    (lambda s: lm.linearize(s, time=0.1), "time: a simulation is linearised as it stands"),
    (lambda _: lm.explain(WORM), "time is missing"),
]  # fmt: skip


@pytest.mark.parametrize(("call", "sentence"), REFUSED, ids=[s for _, s in REFUSED])
def test_what_does_not_go_together_is_said_in_one_line(call: Any, sentence: str) -> None:
    simulation = lm.Simulation(WORM)
    simulation.advance(1e-3, **HOLDING)
    before = simulation.state
    assert sentence in refused(lambda: call(simulation))
    assert simulation.state == before


def test_where_a_train_jams_the_message_names_the_contact() -> None:
    # The load sits on a rigid gear that locks itself: with this inertia there is no motion, or there are several.
    jamming = WORM.replace(**{"gears.worm_gear.stiffness": {"kind": "rigid"}, "gears.worm_gear.mesh_damping": 0.0, "initial.twists": {}})
    simulation = lm.Simulation(jamming, initial=lm.TrainInitial(speeds={"worm": -50.0, "rotor": -50.0, "drum": -1.0}))
    before = simulation.state
    with pytest.raises(lm.SolverError, match=r"the friction jams|accumulate"):
        for _ in range(2000):
            before = simulation.state
            simulation.advance(1e-3, motor_command=-0.15, drum_load_torque=20.0)
    assert simulation.state == before


# --- linear models ---
def test_an_arm_under_gravity_is_the_pendulum_of_the_textbook() -> None:
    """J w' = -m g r cos(phi0) (phi - phi0) + ..., with its angle one state; chords of sin within 1e-6 are h = 3 mrad long, and
    their slope is off by h^2/6 at 0 and h/2 elsewhere."""
    J, weight = 2.0, 3.0  # kg m^2, N m
    arm = lm.DriveTrain(
        shafts={"arm": lm.Shaft(inertia=J - ROTOR, viscous_friction=0.4)},
        motors={"m": lm.ShaftMotor(shaft="arm", kind="torque_source", rotor_inertia=ROTOR)},
        gravity={"g": lm.model.Gravity(shaft="arm", mass=1.0, radius=weight / 9.80665, error=1e-6)},
    )
    for angle in (0.0, 1.0, math.pi):
        model = lm.linearize(arm, lm.TrainInitial(angles={"arm": angle}))
        assert model.states == ("arm_speed", "arm_angle")
        assert model.B.shape == (2, 2)
        slope = -weight * math.cos(angle) / J
        assert np.array([[-0.2, slope], [1.0, 0.0]]) == pytest.approx(model.A, rel=1e-12, abs=2e-3 * weight / J)
    hanging = lm.linearize(arm, lm.TrainInitial())
    ((frequency, damping),) = hanging.resonances()
    assert frequency == pytest.approx(math.sqrt(weight / J) / (2.0 * math.pi), rel=1e-5)
    assert damping == pytest.approx(0.1 / math.sqrt(weight / J), rel=1e-5)


def test_a_chain_has_the_matrices_and_eigenvalues_of_the_textbook() -> None:
    J, c, d = [2.0, 1.0, 3.0, 0.5], [40.0, 90.0, 25.0], 0.3
    model = lm.linearize(chain(J, c, d))
    speeds, twists = [f"s{k}_speed" for k in range(4)], [f"g{k}_twist" for k in range(3)]
    assert model.states == (*speeds, *twists, "s3_angle")
    # J w' = E_in u - G (c d + damping d'), d' = G' w with the incidence of the springs G
    G = np.zeros((4, 3))
    for k in range(3):
        G[k, k], G[k + 1, k] = 1.0, -1.0
    M = np.diag(J)
    A = np.zeros((8, 8))
    A[:4, :4] = -np.linalg.solve(M, G @ (d * np.eye(3)) @ G.T)
    A[:4, 4:7] = -np.linalg.solve(M, G @ np.diag(c))
    A[4:7, :4] = G.T
    A[7, 3] = 1.0
    assert pytest.approx(A, rel=1e-15, abs=1e-15) == model.A
    assert model.inputs == ("m_command", "s0_load_torque", "s1_load_torque", "s2_load_torque", "s3_load_torque")
    B = np.zeros((8, 5))
    B[:4, 1:] = -np.linalg.inv(M)
    B[0, 0] = 1.0 / J[0]
    assert pytest.approx(B, rel=1e-15, abs=1e-15) == model.B
    # Undamped, the squares of the frequencies are the eigenvalues of K over M.
    K = G @ np.diag(c) @ G.T
    omega = np.sqrt(np.clip(scipy.linalg.eigh(K, M, eigvals_only=True), 0.0, None))[1:]
    found = [2.0 * math.pi * f for f, _ in lm.linearize(chain(J, c)).resonances()]
    assert found == pytest.approx(omega, rel=1e-12)
    # Units come with the names; an angle that the solver does not integrate is an output, too: phi_0 = sum of twists + phi_3.
    assert {model.units[name] for name in twists} == {"rad"}
    row = model.C[model.outputs.index("s0_angle")]
    assert dict(zip(model.states, row, strict=True)) == dict.fromkeys(speeds, 0.0) | dict.fromkeys((*twists, "s3_angle"), 1.0)
    assert np.allclose(model.C[model.outputs.index("g1_output_torque")], c[1] * A[0] * 0 + _spring_row(c[1], d))


def _spring_row(c: float, d: float) -> np.ndarray:
    return np.array([0.0, d, -d, 0.0, 0.0, c, 0.0, 0.0])


def test_the_linear_model_of_a_train_is_that_of_the_drive() -> None:
    scenario = lm.load("paper-2dof-nl-small")
    start = lm.Initial(motor_speed=100.0, load_speed=1.2, twist=2e-3, hysteresis_capacity=1.0, motor_torque=0.1)
    same = lm.TrainInitial(
        speeds={"motor": 100.0, "load": 1.2}, twists={"gearbox": 2e-3}, motor_torques={"motor": 0.1}, hysteresis_capacities={"gearbox": 1.0}
    )
    drive = lm.linearize(scenario, start, command=0.4, load_torque=3.0)
    train = lm.linearize(scenario.long(), same, inputs={"motor_command": 0.4, "load_load_torque": "3 N*m"})
    assert train.states == ("motor_torque", "motor_speed", "load_speed", "gearbox_twist", "load_angle")
    assert np.array_equal(train.A, drive.A)
    assert np.array_equal(train.B, drive.B)
    assert np.array_equal(train.rate, drive.rate)
    for name in ("output_torque", "input_torque"):
        k, n = train.outputs.index(f"gearbox_{name}"), drive.outputs.index(name)
        assert np.array_equal(train.C[k], drive.C[n])
        assert train.offset[k] == drive.offset[n]
    assert list(train.contacts.values()) == [m for m in drive.contacts.values() if m != 2]
    assert drive.point["command"] == train.point["motor_command"] == 0.4


@pytest.mark.parametrize("scenario", [WORM, RING, BELT], ids=lambda s: s.title[:12])
def test_within_a_regime_a_run_follows_the_exponential_of_its_matrix(scenario: lm.Scenario) -> None:
    simulation = lm.Simulation(scenario)
    commands = {name: 0.3 for name in simulation.inputs if name.endswith("_command")}
    loads = {name: 5.0 for name in simulation.inputs if name.endswith("_load_torque")}
    inputs = commands | loads
    checked = 0
    for _ in range(60):
        simulation.advance(1e-3, **inputs)
        model, u = lm.linearize(simulation), np.array(list(inputs.values()))
        assert model.inputs == tuple(inputs)
        h, n = 2e-5, len(model.states)
        whole = np.zeros((n + 1, n + 1))
        whole[:n, :n], whole[:n, n] = model.A, model.B @ u + model.rate
        x0 = np.array([model.point[name] for name in model.states])
        outputs = dict(zip(model.outputs, model.C @ x0 + model.D @ u + model.offset, strict=True))
        for name, gear in scenario.gears.items():
            if simulation[f"{gear.input}_speed"] == 0.0:  # a share of what a contact at rest holds is not linear
                del outputs[f"{name}_input_torque"]
        assert list(outputs.values()) == pytest.approx(simulation[list(outputs)], rel=1e-10, abs=1e-10)
        before = {c: simulation[c] for c in model.contacts}
        simulation.advance(h, **inputs)
        again = lm.linearize(simulation)
        if {c: simulation[c] for c in model.contacts} != before or not np.array_equal(again.A, model.A):
            continue
        x = (scipy.linalg.expm(whole * h) @ np.append(x0, 1.0))[:n]
        assert simulation[list(model.states)] == pytest.approx(x, rel=1e-9, abs=1e-12)
        checked += 1
    assert checked > 30


def test_a_run_until_an_instant_and_a_simulation_give_the_same_model() -> None:
    constant = WORM.replace(**{"command.motor": -0.15, "initial.twists": {"worm_gear": "2 mrad"}})
    of_run = lm.linearize(constant, time=0.25)
    simulation = lm.Simulation(constant)
    simulation.advance(0.25, motor_command=-0.15, drum_load_torque=20.0)
    as_it_stands = lm.linearize(simulation)
    assert np.array_equal(of_run.A, as_it_stands.A)
    assert of_run.contacts == as_it_stands.contacts
    assert of_run.point == pytest.approx(as_it_stands.point, rel=1e-9)
    drive = lm.load("paper-2dof-nl-small")
    assert lm.linearize(drive, time=0.3).contacts["input_contact"] == lm.explain(drive, 0.3).contacts[0].mode


def test_python_control_gets_the_names_of_a_train() -> None:
    model = lm.linearize(chain([1.0, 2.0, 3.0], [10.0, 20.0]))
    system = model.to_control()
    assert system.input_labels == list(model.inputs)
    assert system.output_labels == list(model.outputs)
    # Free masses: the middle one is driven by both springs; its transfer function at one frequency by hand.
    s = 2j * math.pi * 0.7
    K = np.array([[10.0, -10.0, 0.0], [-10.0, 30.0, -20.0], [0.0, -20.0, 20.0]])
    expected = np.linalg.solve(s**2 * np.diag([1.0, 2.0, 3.0]) + K, [1.0, 0.0, 0.0])[1] * s
    assert model.response(0.7, "s1_speed", "m_command")[0] == pytest.approx(expected, rel=1e-12)


# --- explanations ---
def test_the_worm_holds_by_what_its_angles_say() -> None:
    explanation = lm.explain(WORM, 0.05)
    rotor, worm = explanation.contacts
    lead, friction = math.radians(4.0), math.atan(0.084)
    forward, backward = math.tan(lead) / math.tan(lead + friction), math.tan(lead - friction) / math.tan(lead)
    # The load of 20 N·m pulls the worm forward with 0.4 N·m, which the mesh can hold; driving it needs more.
    assert (worm.mode, worm.torque) == (0, pytest.approx(-0.4, rel=1e-12))
    assert worm.capacity_forward == pytest.approx((1.0 / forward - 1.0) * 0.4, rel=1e-12)
    assert worm.capacity_backward == pytest.approx((1.0 - backward) * 0.4, rel=1e-12)
    assert (rotor.mode, rotor.capacity_forward, rotor.torque) == (0, pytest.approx(0.01, rel=1e-15), 0.0)
    (motor,) = explanation.motors
    assert motor.command_backward == pytest.approx(backward * 0.4 - 0.01, rel=1e-12)
    assert motor.command_forward == pytest.approx(0.4 / forward + 0.01, rel=1e-12)
    assert "worm_contact: stuck, holds -0.4 N·m of +0.4857 / -0.48 N·m" in str(explanation)
    assert "backward with a constant command below -0.09003" in str(explanation)
    (verdict,) = explanation.self_locking
    assert (verdict.gear, verdict.lowering) == ("worm_gear", "chatters")
    assert "worm_gear: self-locking" in str(explanation)


def test_two_motors_hold_each_other_by_hand() -> None:
    quiet = RING.replace(**{"command.first_motor": 0.4, "command.second_motor": -0.4, "shafts.ring.torque": 0.0})
    first, second = lm.explain(quiet, 0.0).motors
    # Forward: the ring takes the second gear along from behind, against its motor and friction; the load is 0.
    pulled = (0.4 + 0.01) * 200.0 / 0.93
    assert first.command_forward == pytest.approx(pulled / (200.0 * 0.94) + 0.01, rel=1e-12)
    # Backward the second motor pushes with 0.4 less its friction, and the first gives way to it overrunning.
    pushed = (0.4 - 0.01) * 200.0 * 0.94
    assert first.command_backward == pytest.approx(pushed * 0.93 / 200.0 - 0.01, rel=1e-12)
    assert second.command_forward == pytest.approx(-first.command_backward, rel=1e-12)
    assert second.command_backward == pytest.approx(-first.command_forward, rel=1e-12)


@pytest.mark.parametrize(
    ("scenario", "motor", "held"),
    [(WORM, "motor", HOLDING), (RING, "first_motor", {"second_motor_command": -0.4, "ring_load_torque": 0.0}), (BELT, "servo", {})],
    ids=["worm", "ring", "belt"],
)
def test_the_smallest_command_turns_a_motor_for_good_and_less_does_not(scenario: lm.Scenario, motor: str, held: dict[str, float]) -> None:
    command, angle = f"{motor}_command", f"{scenario.motors[motor].shaft}_angle"
    for way in (+1, -1):
        middle = {"first_motor": 0.4}.get(motor, 0.0)
        at_rest = lm.Simulation(scenario)
        for _ in range(50):
            at_rest.advance(0.1, **held | {command: middle})
        smallest = next(m for m in lm.explain(at_rest).motors if m.name == motor)
        border = smallest.command_forward if way > 0 else smallest.command_backward
        for share, turns in ((0.97, False), (1.03, True)):
            simulation = lm.Simulation(scenario)
            simulation.state = at_rest.state
            there = middle + share * (border - middle)
            for k in range(200):  # slowly
                u = [middle + (there - middle) * n / 200.0 for n in (k, k + 1)]
                simulation.advance(0.1, **held | {command: (u[0], u[1])})
            start = simulation[angle]
            simulation.advance(10.0, **held | {command: there})
            moved = way * (simulation[angle] - start)
            assert (moved > 0.5) == turns, (way, share, moved)


def test_what_a_capacity_consists_of_is_named() -> None:
    braked = WORM.replace(**{"brakes.hold": {"shaft": "worm", "torque": 2.0}, "command.hold": 0.25})
    worm = lm.explain(braked, 0.05).contacts[1]
    assert worm.shares["hold"] == (0.5, 0.5)
    assert worm.capacity_forward == pytest.approx(worm.shares["worm_gear"][0] + 0.5, rel=1e-15)
    assert "(hold +0.5 / -0.5, worm_gear +0.4857 / -0.48)" in str(worm)


@pytest.mark.parametrize("path", [p for p in SCENARIOS if p not in CONTROLLED], ids=lambda p: p.stem)
def test_a_drive_is_explained_as_its_train(path: Path) -> None:
    scenario = lm.load(path)
    for share in (0.0, 0.31, 0.77):
        time = share * scenario.simulation.duration
        drive, train = lm.explain(scenario, time), lm.explain(scenario.long(), time)
        assert len(drive.contacts) == len(train.contacts)
        for a, b in zip(drive.contacts, train.contacts, strict=True):
            values = (a.speed, a.torque, a.capacity_forward, a.capacity_backward)
            assert (b.speed, b.torque, b.capacity_forward, b.capacity_backward) == pytest.approx(values, rel=1e-12)
            assert a.mode == b.mode
        (motor,) = train.motors
        assert motor.command_forward == pytest.approx(drive.command_forward, rel=1e-12)
        assert motor.command_backward == pytest.approx(drive.command_backward, rel=1e-12)

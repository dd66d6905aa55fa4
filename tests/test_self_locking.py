"""What is said of self-locking gears before a run is what the exact solver then does."""

import math
import re
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from conftest import ROOT
from lostmotion.data_sheets.components import gearbox_table
from lostmotion.model.self_locking import SelfLocking
from refusals import refused
from tables import run_of

RATIO, WORM, MASS, STIFFNESS, LOAD = 50.0, 1e-4, 2.0, 1e4, 20.0


def worm_tables(
    eta_b: float = -0.2,
    *,
    worm: float = WORM,
    mass: float = MASS,
    stiffness: float | None = STIFFNESS,
    load: float = LOAD,
    ratio: float = RATIO,
    viscous: float = 0.0,
    damping: float = 0.0,
) -> dict[str, Any]:
    """A worm with the motor on its shaft, and the load that it lowers."""
    mesh = {"kind": "rigid"} if stiffness is None else {"kind": "linear", "stiffness": stiffness}
    losses = {"kind": "mesh_efficiency", "drive_efficiency": 0.4, "backdrive_efficiency": eta_b}
    gear = {"input": "worm", "output": "drum", "ratio": ratio, "stiffness": mesh, "losses": losses}
    return {
        "shafts": {"worm": {"inertia": worm, "viscous_friction": viscous}, "drum": {"inertia": mass, "torque": load}},
        "motors": {"motor": {"shaft": "worm", "kind": "torque_source", "rotor_inertia": 0.0}},
        "gears": {"gear": gear | {"mesh_damping": damping}},
    }


def scenario(tables: dict[str, Any], **more: Any) -> lm.Scenario:
    return lm.Scenario(**({"simulation": {"duration": 1.0, "sample_interval": 1e-3}} | tables | more))


def verdict(load: float = LOAD, speed: float | None = None, **values: Any) -> SelfLocking:
    return lm.sizing.self_locking(scenario(worm_tables(load=load, **values)).train(), "gear", load, speed)


# --- closed forms ---
def test_the_rate_is_that_of_two_inertias_on_the_mesh():
    found = verdict()
    assert found.lowering == "chatters"
    assert found.rate == pytest.approx(math.sqrt(1e4 * (0.2 / (1e-4 * 2500.0) - 1.0 / 2.0)), rel=1e-12)
    assert found.undamped_rate == pytest.approx(54.772255750516614, rel=1e-12)
    assert found.inertia_ratio == pytest.approx(8.0, rel=1e-12)
    assert found.overrunning.critical_inertia_ratio == pytest.approx(5.0, rel=1e-12)


def test_the_boundary_is_that_of_rigid_friction():
    for mass, rigid, soft in ((1.2499, "smooth", "smooth"), (1.2501, "jams", "chatters")):
        assert verdict(mass=mass, stiffness=None).lowering == rigid
        assert verdict(mass=mass).lowering == soft


@pytest.mark.parametrize("mass", [0.5, 1.2, 1.3, 2.0])
def test_a_rigid_worm_is_refused_by_the_solver_where_it_is_said_to_jam(mass: float):
    overrun = scenario(worm_tables(mass=mass, stiffness=None), initial={"speeds": {"worm": -100.0, "drum": -2.0}})
    if verdict(mass=mass, stiffness=None).lowering == "jams":
        with pytest.raises(lm.SolverError, match="jams"):
            lm.simulate(overrun)
    else:
        stopped = lm.simulate(overrun)
        slowing = 0.2 * LOAD / RATIO / (WORM - 0.2 * mass / RATIO**2)
        stops = float(lm.switchings_of(stopped)["instant"][0])
        assert stops == pytest.approx(100.0 / slowing, rel=1e-9)
        assert float(stopped["worm_speed"][-1]) == 0.0


def test_with_a_coupling_the_worm_alone_counts_in_a_fast_instability():
    # p^2 d = -k (eta_b/(i^2 J(p)) + 1/J_2) d with J(p) = J_1 + J_M k_1/(k_1 + J_M p^2), the rotor behind its coupling.
    rotor, coupling, worm = 4e-4, 0.05, 1e-4
    tables = worm_tables(worm=worm)
    tables["shafts"]["rotor"] = {}
    tables["motors"]["motor"] |= {"shaft": "rotor", "rotor_inertia": rotor}
    link = {"input": "rotor", "output": "worm", "ratio": 1.0, "stiffness": {"kind": "linear", "stiffness": coupling}}
    tables["gears"]["coupling"] = link
    found = lm.sizing.self_locking(scenario(tables).train(), "gear", LOAD)
    # (p + k/J_2) (J_1 (k_1 + J_M p) + J_M k_1) + k eta_b/i^2 (k_1 + J_M p) = 0
    p = np.polynomial.Polynomial
    together = p([coupling * (worm + rotor), worm * rotor])
    roots = (p([STIFFNESS / MASS, 1.0]) * together + STIFFNESS * -0.2 / RATIO**2 * p([coupling, rotor])).roots()
    assert found.lowering == "chatters"
    assert found.rate == pytest.approx(np.sqrt(roots.astype(complex)).real.max(), rel=1e-9)
    # With the rotor rigidly on it, the same load would come down smoothly.
    assert verdict(worm=worm + rotor).lowering == "smooth"
    assert found.inertia_ratio == pytest.approx(MASS / (worm * RATIO**2))


@pytest.mark.parametrize(("share", "lowering"), [(0.3, "smooth"), (1.0, "chatters")])
def test_the_rate_is_that_of_the_classic_drive_with_a_dc_motor_and_a_loss_map(share: float, lowering: str):
    """Against `linearize`, whose core shares no equation with that of trains."""
    values = ((0.1, 0.08, 0.1), (0.75, 0.7, 0.66), (2.3, 2.2, 2.1))  # steeper at high load: the slope is not eta_b
    losses = lm.model.LossMap(
        speeds=(0.0, 0.5, 1.2), loads=(0.0, 0.5, 1.5), values=tuple(tuple(share * m for m in row) for row in values), mirrored=True
    )
    gearbox = lm.Gearbox(
        ratio=60.0, rated_input_speed=150.0, rated_output_torque=70.0, stiffness=lm.model.LinearStiffness(stiffness=2e4), losses=losses
    )
    motor = lm.Motor(rotor_inertia=2e-5, rated_torque=0.5, rated_speed=300.0, electrical_time_constant=1e-3, armature_voltage_constant=8.0)
    drive = lm.Drive(motor=motor, gearbox=gearbox, load=lm.Load(inertia=5.0))
    M, w = 60.0, 100.0
    found = lm.sizing.self_locking(drive.train(), "gearbox", M, w)
    at = lm.Initial(motor_speed=-w, load_speed=-w / 60.0, twist=M / 2e4)
    rates = np.linalg.eigvals(lm.linearize(drive, at, load_torque=M).A).real
    assert found.lowering == lowering
    assert found.rate == pytest.approx(max(rates.max(), 0.0), rel=1e-9, abs=1e-9)
    assert abs(found.overrunning.slope - found.overrunning.backward_efficiency) > 0.02


# --- the solver ---
def test_a_disturbance_grows_at_the_rate_that_is_said():
    rate, first = verdict().rate, 1e-5 * LOAD
    d = first / STIFFNESS
    # The growing solution: d'' = rate^2 d, with the speeds that belong to it.
    start = {
        "speeds": {"worm": -100.0 + 0.2 * first / (RATIO * WORM * rate), "drum": -2.0 + first / (MASS * rate)},
        "twists": {"gear": LOAD / STIFFNESS + d},
    }
    tables = worm_tables()
    run = lm.simulate(scenario(tables, command={"motor": -0.2 * LOAD / RATIO}, initial=start, simulation=run_of(0.15, 1e-3)))
    grown = run["gear_output_torque"].values - LOAD
    assert grown == pytest.approx(first * np.exp(rate * run["time"].values), rel=1e-7)
    assert grown[-1] > 1000.0 * first


def lowered(eta_b: float, speed: float, **values: Any) -> tuple[str, float]:
    """What the solver does from 2 % beside the steady lowering at this speed: what, and the largest deviation of the mesh torque at the
    end of a long run, relative to the load."""
    load, ratio, mass = values["load"], values["ratio"], values["mass"]
    swing = math.sqrt(values["stiffness"] / mass)
    duration = 2000.0 / swing
    run = lm.simulate(
        scenario(
            worm_tables(eta_b, **values),
            command={"motor": eta_b * load / ratio - values["viscous"] * speed},
            initial={"speeds": {"worm": -speed, "drum": -0.98 * speed / ratio}, "twists": {"gear": load / values["stiffness"]}},
            simulation={"duration": duration, "sample_interval": duration / 4000},
        ),
        energy=False,
    )
    off = abs(run["gear_output_torque"].values / load - 1.0)
    begin, end = off[:100].max(), off[-400:].max()
    stops = lm.switchings_of(run)["cause"].values == "came to rest"
    # It locks again and again, or the swinging mesh loses its load: |T_2 - M| beyond M.
    return ("chatters" if stops.any() or end > 1.0 else "smooth" if end < begin else "neither"), float(end)


def random_lowering(rng: np.random.Generator) -> tuple[float, dict[str, float]]:
    """(eta_b, values) of a worm and its load."""
    eta_b = float(-rng.uniform(0.05, 1.0) if rng.random() < 0.8 else rng.uniform(0.05, 0.6))
    ratio, worm = float(rng.choice([10.0, 30.0, 60.0])), float(10.0 ** rng.uniform(-5, -3))
    mass = float(10.0 ** rng.uniform(-0.7, 0.9)) / abs(eta_b) * worm * ratio**2
    stiffness, load = float(10.0 ** rng.uniform(3, 5)), float(rng.uniform(5.0, 50.0))
    swing = math.sqrt(stiffness / mass)
    viscous = worm * swing * float(10.0 ** rng.uniform(-2, 0.3))
    damping = 0.0 if rng.random() < 0.4 else 2.0 * float(rng.uniform(0.01, 0.3)) * math.sqrt(stiffness * mass)
    values = {"worm": worm, "mass": mass, "stiffness": stiffness, "load": load, "ratio": ratio}
    return eta_b, values | {"viscous": viscous, "damping": damping}


def test_the_verdict_is_what_the_solver_does():
    rng = np.random.default_rng(5)
    seen = {"smooth": 0, "chatters": 0}
    near = 0
    for _ in range(150):
        eta_b, values = random_lowering(rng)
        swing = math.sqrt(values["stiffness"] / values["mass"])
        speed = values["load"] / values["stiffness"] * swing * values["ratio"] * float(rng.uniform(0.2, 3.0))
        train = scenario(worm_tables(eta_b, **values)).train()
        found = lm.sizing.self_locking(train, "gear", values["load"], speed)
        # Within a run of 2000/swing a disturbance of 2 % grows tenfold or dies out if its rate is 2.3/2000 of the swing.
        _, rate, _ = train.core(()).steady_regime([-speed, -speed / values["ratio"]], [values["load"]])
        rates = np.linalg.eigvals(rate).real
        if abs(rates[abs(rates) > 1e-9 * swing]).min() < 5e-3 * swing and found.rate < 5e-3 * swing:
            near += 1
            continue
        did, _ = lowered(eta_b, speed, **values)
        assert did == found.lowering, (eta_b, values, found)
        seen[found.lowering] += 1
    assert min(seen.values()) > 30
    assert near < 40


def test_viscous_friction_of_the_worm_makes_the_mesh_swing_up_below_the_boundary_and_mesh_damping_cures_it():
    values = {"worm": WORM, "mass": 0.5, "stiffness": STIFFNESS, "load": LOAD, "ratio": RATIO}
    a, A, B = 10.0, 0.2 / (WORM * RATIO**2), 1.0 / 0.5
    for viscous, damping, lowering in ((0.0, 0.0, "smooth"), (1e-3, 0.0, "chatters"), (1e-3, 20.0, "smooth")):
        assert verdict(mass=0.5, viscous=viscous, damping=damping).lowering == lowering
        if viscous:
            assert lowered(-0.2, 60.0, viscous=viscous, damping=damping, **values)[0] == lowering
    # To first order in a = b/J_1: a A/(2 (B - A)).
    assert verdict(mass=0.5, viscous=1e-3).rate == pytest.approx(a * A / (2.0 * (B - A)), rel=0.05)
    small = verdict(mass=0.5, viscous=1e-5)
    assert small.rate == pytest.approx(0.01 * a * A / (2.0 * (B - A)), rel=1e-4)
    assert small.undamped_rate == 0.0


@pytest.mark.parametrize("eta_b", [-0.6, -0.05, 0.05, 0.4])
def test_what_holds_and_stops_a_load_does_so(eta_b: float):
    found = verdict(eta_b=eta_b).overrunning
    assert (found.holds, found.stops) == (eta_b < 0.0, eta_b < 0.0)
    still = lm.simulate(scenario(worm_tables(eta_b), initial={"twists": {"gear": LOAD / STIFFNESS}}))
    assert bool((still["worm_speed"] == 0.0).all()) is found.holds
    moving = {"speeds": {"worm": -5.0, "drum": -0.1}, "twists": {"gear": LOAD / STIFFNESS}}
    run = lm.simulate(scenario(worm_tables(eta_b, mass=0.05), initial=moving))
    assert (float(run["worm_speed"][-1]) == 0.0) is found.stops


def hoist(share: float) -> tuple[lm.Scenario, float]:
    """Motor, belt with losses, coupled worm and drum, all with friction; the motor gives a share of the least torque."""
    tables = worm_tables(viscous=1e-3, damping=20.0, mass=0.2)
    tables["shafts"]["worm"] |= {"friction_torque": 0.01, "breakaway_torque": 0.02}
    tables["shafts"]["motor"] = {}
    tables["motors"]["motor"] |= {"shaft": "motor", "rotor_inertia": 2e-5, "friction_torque": 0.005}
    belt = {"input": "motor", "output": "worm", "ratio": 2.0, "stiffness": {"kind": "linear", "stiffness": 5.0}}
    losses = {"kind": "mesh_efficiency", "drive_efficiency": 0.9, "backdrive_efficiency": 0.85}
    tables["gears"]["belt"] = belt | {"losses": losses, "mesh_damping": 5e-3}
    least = lm.sizing.self_locking(scenario(tables).train(), "gear", LOAD).least_torque
    wound = {"gear": LOAD / STIFFNESS}
    ramp = {"ramps": [{"rise": -share * least, "duration": 1.0}]}
    return scenario(tables, command={"motor": ramp}, initial={"twists": wound}), least


def test_the_least_torque_includes_friction_and_the_losses_up_to_the_motor():
    _, least = hoist(1.0)
    assert least == pytest.approx((0.2 * LOAD / RATIO + 0.02) / (2.0 * 0.9) + 0.005, rel=1e-12)
    for share in (0.99, 1.01):
        lowering, _ = hoist(share)
        run = lm.simulate(lowering.replace(**{"simulation.duration": 1.5}))
        # Break-away friction above sliding friction: once loose it goes on.
        assert bool((run["worm_speed"] == 0.0).all()) is (share < 1.0)


# --- the catalogue ---
WORMS = [r.name for r in lm.catalogue() if getattr(r, "kind", "") == "worm" and r.losses.efficiency]


def catalogue_worm(name: str) -> lm.Gearbox:
    """With what the record lacks."""
    changes = {"inertia": 1e-5, "stiffness": {"kind": "linear", "stiffness": 2e4}, "rated_output_torque": 70.0}
    table, _ = gearbox_table(name, changes)
    return lm.Gearbox(**table)


@pytest.mark.parametrize("name", WORMS)
def test_a_worm_gear_of_the_catalogue_does_what_is_said(name: str):
    gearbox = catalogue_worm(name)
    found = lm.sizing.overrunning(gearbox)
    load = 70.0
    motor = lm.Motor(kind="torque_source", rotor_inertia=1e-5)
    drive = lm.Drive(motor=motor, gearbox=gearbox, load=lm.Load(inertia=0.01, viscous_friction=5.0))
    # The motor lowers with a bit less, then a bit more than the least torque; downward is negative.
    for share, loose in ((-1e-6, False), (1e-6, True)):
        command = -found.input_torque - share * load / gearbox.ratio
        start = lm.Initial(twist=load / 2e4)
        run = lm.simulate(drive, command=command, load_torque=load, duration=0.2, sample_interval=0.01, initial=start)
        assert bool((run["motor_speed"] < 0.0).any()) is loose, share
    # Left alone at its rated speed, it goes on only if the load drives it in motion.
    w = gearbox.rated_input_speed
    alone = lm.Drive(motor=motor, gearbox=gearbox, load=lm.Load(inertia=0.01))
    start = lm.Initial(motor_speed=-w, load_speed=-w / gearbox.ratio, twist=load / 2e4)
    run = lm.simulate(alone, load_torque=load, duration=0.05, sample_interval=0.001, initial=start)
    assert (abs(float(run["motor_speed"][-1])) < w) is found.stops


# --- where it is said ---
def test_a_gear_of_a_train_is_measured_on_the_rig_as_its_losses_say():
    gear = lm.load("worm-lowering").gears["worm_gear"]
    assert "lacks rated_input_speed and rated_output_torque, by which the test rig" in refused(lambda: lm.test_rig.TestRig(gear))
    rated = gear.model_copy(update={"rated_input_speed": 150.0, "rated_output_torque": 20.0})
    rig = lm.test_rig.TestRig(rated)
    eta_f, _ = gear.losses.efficiencies()
    assert rig.efficiency(100.0, 0.7) == pytest.approx(eta_f, rel=1e-9)
    assert rig.backdriving_torque() is None
    assert lm.sizing.overrunning(rig.gearbox).backward_efficiency == pytest.approx(gear.losses.efficiencies()[1], rel=1e-12)


def test_the_drive_check_takes_a_train_and_says_how_it_lowers():
    found = {f.rule: f for f in lm.check_drive(lm.load("worm-lowering"))}
    assert found["self_locking"].verdict == "warning"
    assert "chatters, a disturbance grows at 37.8" in found["self_locking"].value
    smooth = lm.load("worm-lowering").replace(**{"shafts.drum.inertia": 0.5})
    assert {f.rule: f for f in lm.check_drive(smooth)}["self_locking"].verdict == "ok"
    belt = lm.check_drive(lm.load("belt-before-gearbox"))
    assert not [f for f in belt if f.rule == "self_locking"]
    judged = {f.what: f.verdict for f in belt}
    assert judged["strain_wave: output torque, largest"] == judged["servo: motor torque, rms"] == "ok"
    assert judged["belt: output torque, largest"] == "unknown"
    assert judged["holding with command 0"] == "ok"  # no load acts at rest


def test_explain_says_that_a_gearbox_locks():
    drive = lm.Drive(
        motor=lm.Motor(kind="torque_source", rotor_inertia=1e-5), gearbox=catalogue_worm("nord-sk1si50-100"), load=lm.Load(inertia=0.5)
    )
    simulation = lm.Simulation(drive)
    simulation.advance(1e-3, command=0.0, load_torque=30.0)
    text = str(lm.explain(simulation))
    assert "gearbox: self-locking: holds its load at rest and stops it in motion" in text
    assert "lowering 30 N·m takes more than" in text
    assert "self-locking" not in str(lm.explain(lm.load("paper-2dof-nl-small"), 0.5))
    of_train = str(lm.explain(lm.load("worm-lowering"), 0.05))
    assert "worm_gear: self-locking: holds its load at rest and stops it in motion" in of_train
    assert "lowering 20 N·m takes more than 0.09003 N·m of motor; chatters" in of_train
    assert "coupling: not self-locking" not in of_train


# --- at rest, and at the start ---
def test_the_torque_that_a_stuck_shaft_holds_is_shared_by_bearing_and_gear_as_their_capacities_are():
    tables = worm_tables()
    tables["shafts"]["worm"]["friction_torque"] = 0.12
    run = lm.simulate(scenario(tables, command={"motor": 0.1}, initial={"twists": {"gear": LOAD / STIFFNESS}}))
    held = 0.1 - LOAD / RATIO  # by the contact, backward: the load overruns
    gear = 1.2 * LOAD / RATIO
    assert run["worm_contact"].values == pytest.approx(0.0)
    assert run["gear_input_torque"].values == pytest.approx(LOAD / RATIO + held * gear / (gear + 0.12), rel=1e-12)
    drive = lm.load("paper-2dof-nl-small")  # as a train it has the same torque at rest
    short, long = lm.simulate(drive), lm.simulate(drive.long())
    stuck = short["input_contact"].values == 0.0
    assert stuck.sum() > 100
    assert long["gearbox_input_torque"].values[stuck] == pytest.approx(short["input_torque"].values[stuck], rel=1e-12)


@pytest.mark.parametrize(("speeds", "message"), [
    ({"worm": 100.0, "drum": 0.0}, ".drum: 0 rad/s does not fit worm = 100 rad/s .* makes it 2 rad/s"),
    ({"worm": 100.0, "drum": 2.1}, ".drum: 2.1 rad/s does not fit worm = 100 rad/s .* makes it 2 rad/s"),
    ({"handle": 1.0}, ": handle = 1 rad/s and worm = 0 rad/s do not fit the freewheel hand, whose input cannot be faster"),
])  # fmt: skip
def test_speeds_that_contradict_each_other_are_refused(speeds: dict[str, float], message: str):
    tables = worm_tables(stiffness=None, mass=0.5)
    tables["shafts"]["handle"] = {"inertia": 1e-4}
    tables["freewheels"] = {"hand": {"input": "handle", "output": "worm"}}
    refused(lambda: scenario(tables, initial={"speeds": speeds}), match=f"key initial.speeds{message}")
    for fitting in ({"worm": 100.0, "drum": 2.0}, {"worm": 100.0}):
        free = scenario(tables, initial={"speeds": fitting})
        assert float(lm.simulate(free)["drum_speed"][0]) == 2.0


# --- the page ---
PAGE = (ROOT / "docs" / "self-locking.md").read_text()


def test_the_page_shows_what_is_printed_and_its_table_every_worm_gear(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    import self_locking_figures

    train = lm.load("worm-lowering").train()
    assert str(lm.sizing.self_locking(train, "worm_gear", 20.0)) == re.findall(r"```text\n(.*?)\n```", PAGE, re.S)[0]
    for name, load, text in (
        ("worm_gaer", 20.0, "worm_gaer is no gear of this train; did you mean"),
        ("worm_gear", None, "key gears.worm_gear: load_torque is missing, and the gear has"),
        ("worm_gear", 0.0, "0 N·m drives nothing"),
    ):
        refused(lambda n=name, load=load: lm.sizing.self_locking(train, n, load), match=text)
    rows = [line.strip("| ").split(" | ") for line in self_locking_figures.worm_table().splitlines()[2:]]
    assert [row[0].strip("`") for row in rows] == WORMS
    for row in rows:
        eta_f, eta_b, static = (float(value) for value in row[2:5])
        assert eta_b == pytest.approx(2.0 - 1.0 / eta_f, abs=0.03)  # of rounded efficiencies
        verdict = "locks" if eta_b < 0.0 else "holds" if static < 0.0 else "overruns"
        assert row[5].startswith(verdict)
        assert (row[6] == "none") is (verdict == "overruns")
    ratios = {kind: [float(row[1]) for row in rows if row[5].startswith(kind)] for kind in ("overruns", "holds", "locks")}
    assert max(ratios["overruns"]) == 25.0
    assert min(ratios["locks"]) == 80.0
    assert "Up to a ratio of 25 or 15 the load drives the gear" in PAGE


def test_a_motor_without_inertia_is_explained_and_checked() -> None:
    """Beside no inertia the load has infinitely much, and nothing swings against it."""
    motor = {"kind": "torque_source", "rotor_inertia": 0.0, "rated_torque": 1.0}
    slide = {"mass": 10.0, "friction_force": 10.0}
    axis = lm.Scenario(axis={"motor": motor, "belt": {"travel_per_turn": 0.1}, "slide": slide}, command=0.5, simulation=run_of(0.1, 0.01))
    assert lm.sizing.self_locking(axis.train(), "belt", load_torque=1.0).inertia_ratio == math.inf
    radius = 0.1 / (2.0 * math.pi)
    assert f"above {10.0 * radius:.4g}" in str(lm.explain(axis, 0.05))
    soft = axis.replace(**{"axis.belt.stiffness": 1e6, "axis.belt.damping": 1e3})
    assert not [f for f in lm.check_drive(soft) if f.rule == "resonance" and f.use is not None]

"""Shafts coupled by a mass matrix: against scipy's exponential, rigid differentials, the adaptive solver and closed forms."""

import itertools
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

import lostmotion as lm
from conftest import some
from lostmotion.simulation.forms.key_aliases import DRIVE
from refusals import refusals_of, refused, refuses

SCENARIOS = sorted(Path(__file__).parent.parent.glob("scenarios/*.toml"))
ARM: dict[str, Any] = {
    "shafts": {
        "shoulder": {"viscous_friction": 0.3, "torque": {"mean": -1.5}},
        "elbow": {"viscous_friction": 0.1, "torque": {"mean": 0.7}},
    },
    "mass_matrices": {"arm": {"shafts": ["shoulder", "elbow"], "matrix": [[2.6, 0.7], [0.7, 0.4]]}},
    "simulation": {"duration": 2.0, "sample_interval": 0.125},
}


def scenario(**tables: Any) -> lm.Scenario:
    """The arm with some of its tables replaced."""
    return lm.Scenario(**(ARM | tables))


def test_two_links_move_as_the_matrix_exponential_says() -> None:
    """M w' = -b w - K phi - load from rest; with the constant load as a further state it is linear."""
    M, b, K, load = np.array([[2.6, 0.7], [0.7, 0.4]]), np.diag([0.3, 0.1]), np.diag([40.0, 15.0]), [-1.5, 0.7]
    spring = {n: {"shaft": n, "stiffness": {"kind": "linear", "stiffness": k}} for n, k in (("shoulder", 40.0), ("elbow", 15.0))}
    r = lm.simulate(scenario(springs=spring))
    A = np.zeros((5, 5))
    A[:2, :2], A[:2, 2:4], A[:2, 4] = (np.linalg.solve(M, -x) for x in (b, K, np.array(load)))
    A[2:4, :2] = np.eye(2)
    expected = np.array([(expm(A * t) @ [0, 0, 0, 0, 1.0])[:4] for t in r.time.values])
    seen = np.array([r[n].values for n in ("shoulder_speed", "elbow_speed", "shoulder_angle", "elbow_angle")]).T
    assert np.abs(seen - expected).max() <= 1e-12 * np.abs(expected).max()
    ledger = lm.energy_of(r)
    assert abs(ledger["residual"]) <= 1e-12 * ledger["turned_over"]
    w = seen[-1, :2]
    assert ledger["stored_change"] == pytest.approx(0.5 * w @ M @ w, rel=1e-12)  # springs to the frame are entries of their own


def with_diagonals(s: lm.Scenario) -> lm.Scenario:
    """The inertias of its shafts and the masses of its slides as the diagonal of one matrix."""
    data = s.model_dump()
    inertias = {}
    for table, key in (("shafts", "inertia"), ("slides", "mass")):
        for name, shaft in data[table].items():
            if shaft[key] > 0.0 and not shaft.get("inclination"):
                inertias[name] = shaft[key]
                shaft[key] = 0.0
    data["mass_matrices"] = {"all": {"shafts": list(inertias), "matrix": np.diag(list(inertias.values())).tolist()}}
    return lm.Scenario(**data)


LONG = [path for path in SCENARIOS if lm.load(path).form != DRIVE and not lm.load(path).mass_matrices]
"""without a mass matrix of their own"""


@pytest.mark.parametrize("path", LONG, ids=lambda path: path.stem)
def test_a_diagonal_matrix_has_the_bits_of_uncoupled_shafts(path: Path) -> None:
    s = lm.load(path)
    if s.form != DRIVE and any(c.inverse_model is not None for c in s.axes().values()):
        pytest.skip("the law computes with its own model")
    plain, matrix = lm.simulate(s), lm.simulate(with_diagonals(s))  # type: ignore[arg-type]
    assert list(plain) == list(matrix)
    for name in plain:
        assert np.array_equal(plain[name].values, matrix[name].values, equal_nan=True), name
    first, second = lm.energy_of(plain), lm.energy_of(matrix)
    assert dict(first) == dict(second)


def spread(r: random.Random, low: float, high: float) -> float:
    return float(low * (high / low) ** r.random())


def random_signal(r: random.Random, size: float) -> dict[str, float]:
    return {
        "mean": r.uniform(-size, size),
        "amplitude": r.uniform(0.0, size),
        "frequency": spread(r, 0.5, 5.0),
        "phase": r.uniform(-3.0, 3.0),
    }


def random_tables(r: random.Random, names: list[str]) -> dict[str, Any]:
    """Shafts with friction and loads, joined to each other and to others by what has contacts, without inertias of those."""
    made: dict[str, Any] = {"shafts": {}, "gears": {}, "clutches": {}, "brakes": {}, "springs": {}, "command": {}}
    for name in names:
        shaft: dict[str, Any] = {"torque": random_signal(r, 2.0)}
        if r.random() < 0.7:
            shaft["friction_torque"] = spread(r, 0.05, 1.0)
            if r.random() < 0.4:
                shaft["breakaway_torque"] = 1.4 * shaft["friction_torque"]
        if r.random() < 0.5:
            shaft["viscous_friction"] = spread(r, 0.05, 0.5)
        made["shafts"][name] = shaft
    for name in names:
        if r.random() < 0.5:
            continue
        other = f"{name}_other"
        made["shafts"][other] = {"inertia": spread(r, 0.1, 2.0), "torque": random_signal(r, 1.0)}
        if r.random() < 0.5:
            made["shafts"][other]["friction_torque"] = spread(r, 0.05, 0.5)
        if r.random() < 0.25:
            made["clutches"][f"{name}_clutch"] = {"input": name, "output": other, "torque": spread(r, 0.2, 2.0), "kind": "safety"}
            continue
        gear: dict[str, Any] = {"input": name, "output": other, "ratio": spread(r, 0.5, 3.0)}
        kind = r.randrange(4)
        if kind == 0:
            gear["stiffness"] = {"kind": "linear", "stiffness": spread(r, 5.0, 100.0)}
            gear |= {"hysteresis": {"efficiency": r.uniform(0.5, 0.95)}, "rated_output_torque": 2.0}
        elif kind < 3:
            gear["stiffness"] = {"kind": "curve", "backlash": spread(r, 0.01, 0.1), "slopes": [spread(r, 5.0, 100.0)]}
        made["gears"][f"{name}_gear"] = gear
    if r.random() < 0.4:
        made["brakes"]["brake"] = {"shaft": r.choice(names), "torque": spread(r, 0.2, 2.0)}
        made["command"]["brake"] = {"mean": 0.5, "amplitude": 0.5, "frequency": 1.0, "phase": r.uniform(-3.0, 3.0)}
    if len(names) > 1 and r.random() < 0.3:
        made["clutches"]["between"] = {"input": names[0], "output": names[1], "torque": spread(r, 0.2, 2.0), "kind": "safety"}
    made["simulation"] = {"duration": 1.0, "sample_interval": 0.02}
    return made


def random_matrix(r: random.Random, n: int) -> list[list[float]]:
    """With eigenvalues between 0.3 and 3."""
    q, _ = np.linalg.qr(np.array([[r.gauss(0.0, 1.0) for _ in range(n)] for _ in range(n)]))
    M = q @ np.diag([spread(r, 0.3, 3.0) for _ in range(n)]) @ q.T
    return (0.5 * (M + M.T)).tolist()


def gap(a: Any, b: Any, names: list[str]) -> float:
    """The largest difference of two results, of each variable in units of its largest value."""
    return max(float(np.abs(a[n].values - b[n].values).max() / max(1e-3, np.abs(a[n].values).max())) for n in names)


def test_a_matrix_moves_as_the_rigid_differential_that_it_stands_for() -> None:
    """A third shaft with w_3 = w_1/i + (1 - 1/i) w_2 and the inertia J has the energy J w_3^2/2: entries J c c^T of a matrix."""
    switchings, cases = 0, some(300, 60)
    for seed in range(cases):
        r = random.Random(f"differential {seed}")
        tables = random_tables(r, ["a", "b"])
        own, J, ratio = [spread(r, 0.1, 2.0), spread(r, 0.1, 2.0)], spread(r, 0.1, 2.0), spread(r, 1.3, 4.0)
        c = np.array([1.0 / ratio, 1.0 - 1.0 / ratio])
        matrix = (np.diag(own) + J * np.outer(c, c)).tolist()
        coupled = lm.Scenario(**tables, mass_matrices={"m": {"shafts": ["a", "b"], "matrix": matrix}})
        shafts = {n: s | ({"inertia": own[n == "b"]} if n in ("a", "b") else {}) for n, s in tables["shafts"].items()}
        gears = tables["gears"] | {"differential": {"input": "a", "output": "c", "housing": "b", "ratio": ratio}}
        joined = lm.Scenario(**tables | {"shafts": shafts | {"c": {"inertia": J}}, "gears": gears})
        one, other = lm.simulate(coupled), lm.simulate(joined)
        speeds = [f"{n}_speed" for n in tables["shafts"]]
        # Rounding grows by up to a thousand from switching to switching in runs of this length.
        assert gap(one, other, speeds) <= 1e-9, seed
        ledger = lm.energy_of(one)
        assert abs(ledger["residual"]) <= 1e-10 * max(1.0, ledger["turned_over"]), seed
        switchings += lm.switchings_of(one).sizes["switching"]
    assert switchings > 6 * cases


def test_exact_and_adaptive_solver_agree_on_random_trains_with_coupled_shafts() -> None:
    compared, undecided, cases = 0, 0, some(300, 60)
    for seed in range(cases):
        r = random.Random(f"adaptive {seed}")
        n = r.randint(2, 4)
        names = ["a", "b", "c", "d"][:n]
        tables = random_tables(r, names)
        order = r.sample(names, n)
        s = lm.Scenario(**tables, mass_matrices={"m": {"shafts": order, "matrix": random_matrix(r, n)}})
        exact = lm.simulate(s)
        fine, coarse = (lm.simulate(s, solver="dormand-prince", relative_tolerance=t) for t in (1e-11, 1e-9))
        speeds = [f"{name}_speed" for name in tables["shafts"]]
        own = gap(fine, coarse, speeds)
        if own > 1e-5:  # a grazing contact: the adaptive runs differ from each other
            undecided += 1
            continue
        assert gap(exact, fine, speeds) <= max(1e-7, 2.0 * own), seed
        ledger = lm.energy_of(exact)
        assert abs(ledger["residual"]) <= 1e-10 * max(1.0, ledger["turned_over"]), seed
        compared += 1
    assert compared >= cases - 2
    assert undecided <= 2


def test_a_link_that_friction_holds_breaks_away_where_its_neighbour_asks_for_more() -> None:
    """While the elbow rests, w_1' = T/M_11, and it holds M_12 T/M_11; beyond its friction both move."""
    M = np.array([[2.6, 0.7], [0.7, 0.4]])
    holds, rate = 0.5, 4.0
    shafts = {"shoulder": {"torque": {"ramps": [{"rise": -rate, "duration": 1.0}]}}, "elbow": {"friction_torque": holds}}
    r = lm.simulate(scenario(shafts=shafts, simulation={"duration": 1.0, "sample_interval": 0.01}))
    at = holds * M[0, 0] / M[0, 1] / rate
    t = r.time.values
    held = t < at
    assert np.all(r.elbow_speed.values[held] == 0.0)
    assert np.allclose(r.shoulder_speed.values[held], 0.5 * rate * t[held] ** 2 / M[0, 0], rtol=1e-13, atol=0.0)
    assert float(lm.switchings_of(r).instant[-1]) == pytest.approx(at, rel=1e-13)
    beyond = t[~held]
    torque = np.array([0.5 * rate * (beyond**2 - at**2), holds * (beyond - at)])
    expected = np.array([[0.5 * rate * at**2 / M[0, 0]], [0.0]]) + np.linalg.solve(M, torque)
    seen = np.array([r.shoulder_speed.values, r.elbow_speed.values])[:, ~held]
    assert np.allclose(seen, expected, rtol=1e-12, atol=1e-13)


def test_a_given_motion_drives_what_the_matrix_couples_to_it() -> None:
    """Shoulder speed sin W t: w_2 = -M_12/M_22 sin W t, and the drive feels M_11 - M_12^2/M_22."""
    r = lm.simulate(scenario(shafts={"shoulder": {"speed": {"amplitude": 1.0, "frequency": 1.0}}, "elbow": {"torque": 0.0}}))
    W, t = 2.0 * np.pi, r.time.values
    assert np.allclose(r.elbow_speed, -0.7 / 0.4 * np.sin(W * t), rtol=0.0, atol=1e-13)
    assert np.allclose(r.shoulder_drive_torque, (2.6 - 0.49 / 0.4) * W * np.cos(W * t), rtol=0.0, atol=1e-12)
    ledger = lm.energy_of(r)
    assert abs(ledger["residual"]) <= 1e-12 * ledger["turned_over"]


def test_rotors_and_gears_add_to_the_diagonal() -> None:
    motors = {"m": {"shaft": "elbow", "kind": "torque_source", "rotor_inertia": 0.1, "rated_torque": 1.0}}
    whole = {"arm": {"shafts": ["shoulder", "elbow"], "matrix": [[2.6, 0.7], [0.7, 0.5]]}}
    a, b = lm.simulate(scenario(motors=motors)), lm.simulate(scenario(mass_matrices=whole))
    assert np.allclose(a.elbow_speed, b.elbow_speed, rtol=1e-13)


def test_a_cart_and_its_pendulum_take_units_by_domain() -> None:
    """Slide and shaft: kg, kg*m and kg*m^2; the momentum of both stays zero under a torque between frame and pendulum."""
    s = lm.Scenario(
        shafts={"pendulum": {"torque": -1.0}},
        slides={"cart": {}},
        mass_matrices={"cart_pole": {"shafts": ["cart", "pendulum"], "matrix": [["3000 g", "50 kg*cm"], ["50 kg*cm", "1800 kg*cm^2"]]}},
        simulation={"duration": 1.0, "sample_interval": 0.25},
    )
    assert s.mass_matrices["cart_pole"].matrix == ((3.0, 0.5), (0.5, 0.18))
    r = lm.simulate(s)
    assert np.allclose(3.0 * r.cart_speed + 0.5 * r.pendulum_speed, 0.0, atol=1e-12)
    refused(
        lambda: lm.Scenario(
            slides={"cart": {"force": 1.0}},
            mass_matrices={"m": {"shafts": ["cart"], "matrix": [["3 kg*m^2"]]}},
            simulation={"duration": 1.0, "sample_interval": 0.25},
        ),
        "mass_matrices.m.matrix.0.0",
    )


test_what_is_no_mass_matrix_is_refused = refusals_of(
    lambda matrices: scenario(mass_matrices=matrices),
    ({"m": {"shafts": ["shoulder", "elbow"], "matrix": [[1.0, 2.0], [2.0, 1.0]]}}, "mass_matrices.m: smallest eigenvalue is -1;"),
    ({"m": {"shafts": ["shoulder", "elbow"], "matrix": [[1.0, 1.0], [1.0, 1.0]]}}, "mass_matrices.m: not positive definite"),
    (
        {"m": {"shafts": ["shoulder", "elbow"], "matrix": [[1.0, 0.0], [0.0, 0.0]]}},
        "mass_matrices.m: has no inertia of shaft 'elbow' on its diagonal; give one, or leave it out",
    ),
    ({"m": {"shafts": ["shoulder", "elbow"], "matrix": [[1.0, 0.5], [0.4, 1.0]]}}, "mass_matrices.m: 0.5 and 0.4"),
    ({"m": {"shafts": ["shoulder", "elbow"], "matrix": [[1.0, 0.5]]}}, "mass_matrices.m: give its matrix 2 rows of 2 numbers"),
    ({"m": {"shafts": ["shoulder", "shoulder"], "matrix": [[1.0, 0.5], [0.5, 1.0]]}}, "mass_matrices.m: 'shoulder' twice"),
    ({"m": {"shafts": ["shoulder", "elbov"], "matrix": [[1.0, 0.5], [0.5, 1.0]]}}, "mass_matrices.m.shafts.1: is no shaft"),
    (
        {"m": {"shafts": ["shoulder", "elbow"], "matrix": [[1.0, 0.5], [0.5, 1.0]]}, "n": {"shafts": ["elbow"], "matrix": [[1.0]]}},
        "mass_matrices.n: names shaft 'elbow', which is in mass matrix 'm' too",
    ),
)


def test_an_inertia_stated_twice_is_refused() -> None:
    shafts = {"shoulder": {"inertia": 1.5}, "elbow": {}}
    refused(lambda: scenario(shafts=shafts), "mass_matrices.arm")


def test_the_eigenvalue_in_the_message_is_that_of_lapack() -> None:
    r = random.Random(5)
    for n in (2, 3, 5, 8):
        A = np.array([[r.gauss(0.0, 1.0) for _ in range(n)] for _ in range(n)])
        M = 0.5 * (A + A.T)
        names = [f"s{k}" for k in range(n)]
        with pytest.raises(lm.InputError, match=f"smallest eigenvalue is {np.linalg.eigvalsh(M)[0]:.6g};"):
            lm.Scenario(
                shafts={name: {"torque": 1.0} for name in names},
                mass_matrices={"m": {"shafts": names, "matrix": M.tolist()}},
                simulation={"duration": 1.0, "sample_interval": 0.5},
            )


def test_linear_models_and_sensitivities_take_the_matrix() -> None:
    s = scenario()
    M, b = np.array([[2.6, 0.7], [0.7, 0.4]]), np.diag([0.3, 0.1])
    model = lm.linearize(s, time=0.5)
    speeds = [list(model.states).index(n) for n in ("shoulder_speed", "elbow_speed")]
    assert np.allclose(model.A[np.ix_(speeds, speeds)], -np.linalg.solve(M, b), rtol=1e-13)
    key, h = "shafts.elbow.viscous_friction", 1e-4
    r = lm.simulate(s, sensitivities=[key])
    up, down = (lm.simulate(s.replace(**{key: 0.1 + d})).shoulder_speed.values for d in (h, -h))
    found = r.shoulder_speed_sensitivity.values.ravel()
    assert np.allclose(found, (up - down) / (2.0 * h), rtol=1e-6, atol=1e-9)


# --- step by step ---
def test_steps_with_the_matrix_of_the_train_have_the_bits_of_steps_without() -> None:
    train = scenario()
    one, other = lm.Simulation(train), lm.Simulation(train)
    for k in range(20):
        one.advance(0.01, shoulder_load_torque=0.1 * k)
        other.advance(0.01, shoulder_load_torque=0.1 * k, mass_matrix={"arm": [[2.6, 0.7], [0.7, 0.4]]})
    assert one.read() == other.read()


def test_a_changed_matrix_holds_from_its_step_on_and_with_a_restored_state() -> None:
    simulation = lm.Simulation(scenario())
    simulation.advance(0.1, shoulder_load_torque=-1.0)
    before, w = simulation.state, simulation["shoulder_speed", "elbow_speed"]
    M = np.array([[2.0, 0.1], [0.1, 0.3]])
    for _ in range(2):
        simulation.advance(0.1, shoulder_load_torque=-1.0, mass_matrix={"arm": M})
        A = np.zeros((3, 3))
        A[:2, :2], A[:2, 2] = -np.linalg.solve(M, np.diag([0.3, 0.1])), np.linalg.solve(M, [1.0, 0.0])
        expected = (expm(A * 0.1) @ [*w, 1.0])[:2]
        assert np.allclose(simulation["shoulder_speed", "elbow_speed"], expected, rtol=1e-13)
        changed = simulation.state
        simulation.state = before
        assert np.array_equal(simulation["shoulder_speed", "elbow_speed"], w)
    simulation.state = changed
    simulation.advance(0.1, shoulder_load_torque=-1.0)  # the matrix stays
    assert np.allclose(simulation["shoulder_speed", "elbow_speed"], (expm(A * 0.2) @ [*w, 1.0])[:2], rtol=1e-13)
    simulation.reset()
    assert simulation.state.mass_matrices["arm"].matrix[0][0] == 2.6


def test_freezing_the_pose_has_an_error_of_the_step() -> None:
    """An arm that is drawn in, J(t) = 2 - t, with the bias torque J' w: J w stays but for the freezing, which halves with h."""
    errors = []
    for n in (50, 100, 200):
        h = 1.0 / n
        s = lm.Scenario(
            shafts={"arm": {"torque": 0.0}, "other": {"torque": 0.0}},
            mass_matrices={"m": {"shafts": ["arm", "other"], "matrix": [[2.0, 0.1], [0.1, 1.0]]}},
            initial={"speeds": {"arm": 1.0}},
            simulation={"duration": 1.0, "sample_interval": 0.5},
        )
        simulation = lm.Simulation(s)
        for k in range(n):
            J = 2.0 - (k + 0.5) * h
            w = simulation["arm_speed"]
            simulation.advance(h, arm_load_torque=-w, mass_matrix={"m": [[J, 0.1], [0.1, 1.0]]})
        w = simulation["arm_speed", "other_speed"]
        # d/dt (J w + 0.1 v) = 0 and 0.1 w + v = 0.1 at all times.
        exact = (2.0 + 0.1 * 0.0 - 0.1 * 0.1) / (1.0 - 0.01)
        errors.append(abs(w[0] - exact))
    assert errors[0] < 0.05
    for coarse, fine in itertools.pairwise(errors):
        assert fine == pytest.approx(0.5 * coarse, rel=0.1)


@pytest.mark.parametrize(("matrix", "message"), [
    ({"arm": [[1.0, 2.0], [2.0, 1.0]]}, "mass_matrix.arm: is not positive definite"),
    ({"leg": [[1.0]]}, "mass_matrix..leg.: is none of this train; the mass matrices are arm"),
    ([[1.0]], "is no dictionary"),
    ({"arm": "heavy"}, "mass_matrix.arm: "),
])  # fmt: skip
def test_a_step_with_no_mass_matrix_is_refused_and_changes_nothing(matrix: Any, message: str) -> None:
    simulation = lm.Simulation(scenario())
    simulation.advance(0.1, shoulder_load_torque=-1.0)
    before = simulation.read()
    refused(lambda: simulation.advance(0.1, mass_matrix=matrix), match=message)
    assert simulation.read() == before
    assert simulation.time == 0.1


def test_rules_that_take_one_inertia_alone_refuse_a_coupled_shaft() -> None:
    s = lm.load("position-axis-with-belt")
    assert s.form != DRIVE
    data = s.model_dump()
    last = list(data["shafts"])[-1]
    inertia, data["shafts"][last]["inertia"] = data["shafts"][last]["inertia"], 0.0
    data["shafts"]["other"] = {"torque": 0.0}
    data["mass_matrices"] = {"m": {"shafts": [last, "other"], "matrix": [[inertia, 0.5 * inertia], [0.5 * inertia, inertia]]}}
    data["controllers"] = {n: c | {"shaft": c.get("shaft") or last} for n, c in data["controllers"].items()}
    with refuses("mass_matrices.m"):
        lm.tune(lm.Scenario(**data))

"""Examples of Modelica.Mechanics.Rotational, rebuilt as drive trains, against an integration of their equations by scipy.

The equations stand here as the examples' pages give them, with event logic of their own: nothing of the core is used.
"""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import lostmotion as lm
from tables import gear_between

Vector = NDArray[np.float64]
TIGHT: dict[str, float] = {"rtol": 1e-12, "atol": 1e-13}


@dataclass
class Contact:
    """Dry friction between shafts a and b (None: the frame), which takes what is given of the time [N·m].

    With weights, its speed is that sum of the speeds of all shafts.
    """

    a: int
    b: int | None
    slipping: Callable[[float], float]
    holding: Callable[[float], float]
    forward: float = math.inf
    """factor of what it holds while b is driven forward: math.inf of a one-way clutch"""
    one_way: bool = False
    weights: Sequence[float] | None = None

    def row(self, shafts: int) -> Vector:
        if self.weights is not None:
            return np.asarray(self.weights)
        row = np.zeros(shafts)
        row[self.a] = 1.0
        if self.b is not None:
            row[self.b] = -1.0
        return row


@dataclass
class Hybrid:
    """Shafts with inertias, a smooth torque on each, and contacts: integrated from event to event."""

    inertias: Sequence[float]
    torque: Callable[[float, Vector], Vector]
    """of the time and the state (speeds, then twists), on each shaft"""
    contacts: list[Contact]
    twists: list[tuple[int, int]] = field(default_factory=list)

    def speed(self, c: Contact, y: Vector) -> float:
        return float(c.row(len(self.inertias)) @ y[: len(self.inertias)])

    def solve(self, t: float, y: Vector, modes: dict[int, int]) -> tuple[Vector, dict[int, float]]:
        """Accelerations, and the torque of each contact."""
        n = len(self.inertias)
        f = self.torque(t, y)
        stuck = [k for k, mode in modes.items() if mode == 0]
        W = np.zeros((len(stuck), n))
        for k, mode in modes.items():
            c = self.contacts[k]
            row = c.row(n)
            if mode == 0:
                W[stuck.index(k)] = row
            else:
                f = f - mode * c.slipping(t) * row
        M = np.diag(1.0 / np.asarray(self.inertias))
        torques = {k: mode * self.contacts[k].slipping(t) for k, mode in modes.items()}
        if stuck:
            held = np.linalg.solve(W @ M @ W.T, W @ M @ f)
            f = f - W.T @ held
            torques.update(zip(stuck, map(float, held), strict=True))
        return M @ f, torques

    def margin(self, k: int, t: float, torque: float) -> float:
        c = self.contacts[k]
        return math.inf if torque >= 0.0 and c.one_way else c.holding(t) - abs(torque)

    def choose(self, t: float, y: Vector, active: list[int], broken: dict[int, int]) -> dict[int, int]:
        """Modes that are consistent, those with most contacts stuck first."""
        choices = []
        for k in active:
            v = self.speed(self.contacts[k], y)
            if k in broken:
                choices.append([broken[k]])
            elif abs(v) > 1e-9:
                choices.append([1 if v > 0.0 else -1])
            else:
                choices.append([0, -1] if self.contacts[k].one_way else [0, 1, -1])
        for combination in sorted(itertools.product(*choices), key=lambda m: sum(map(abs, m))):
            modes = dict(zip(active, combination, strict=True))
            rates, torques = self.solve(t, y, modes)
            if all(
                self.margin(k, t, torques[k]) >= -1e-9
                if mode == 0
                else abs(self.speed(self.contacts[k], y)) > 1e-9 or mode * self.speed(self.contacts[k], rates) > -1e-9
                for k, mode in modes.items()
            ):
                return modes
        raise AssertionError(f"no consistent modes at {t}")

    def run(self, y: Vector, times: Vector, breaks: Sequence[float]) -> tuple[Vector, int]:
        """States at the times, and how often a contact changed its mode."""
        out, events = [np.array(y)], 0
        stops = sorted({*breaks, float(times[-1])})
        t = 0.0
        for stop in stops:
            broken: dict[int, int] = {}
            while t < stop:
                middle = 0.5 * (t + stop)
                active = [k for k, c in enumerate(self.contacts) if c.one_way or c.holding(middle) > 0.0]
                modes = self.choose(t, y, active, broken)
                t, y, broken, part = self.advance(t, y, stop, times, modes)
                events += t < stop
                out.extend(part)
        return np.array(out), events

    def advance(
        self, t: float, y: Vector, stop: float, times: Vector, modes: dict[int, int]
    ) -> tuple[float, Vector, dict[int, int], list[Vector]]:
        """One regime, to its end."""
        n = len(self.inertias)

        def rates(time: float, state: Vector) -> Vector:
            return np.concatenate([self.solve(time, state, modes)[0], [state[a] - state[b] for a, b in self.twists]])

        def guard(k: int) -> Callable[[float, Vector], float]:
            c, mode = self.contacts[k], modes[k]
            if mode == 0:
                return lambda time, state: min(1e9, self.margin(k, time, self.solve(time, state, modes)[1][k]))
            return lambda time, state: mode * self.speed(c, state)

        guards = []
        for k in modes:
            g = guard(k)
            g.terminal, g.direction = True, -1  # type: ignore[attr-defined]
            guards.append(g)
        wanted = times[(times > t) & (times <= stop)]
        s = solve_ivp(rates, (t, stop), y, "DOP853", dense_output=True, events=guards, max_step=5e-3, **TIGHT)
        end = float(s.t[-1])
        state = s.y[:, -1].copy()
        broken = {}
        for k, fired in zip(modes, s.t_events, strict=True):
            if len(fired) and modes[k] == 0:
                broken[k] = 1 if self.solve(end, state, modes)[1][k] > 0.0 else -1
            elif len(fired) and self.contacts[k].b is None and self.contacts[k].weights is None:
                state[self.contacts[k].a] = 0.0
        assert np.all(np.isfinite(state[:n]))
        return end, state, broken, [s.sol(time) for time in wanted if time <= end]


def speeds(scenario: lm.Scenario, *names: str) -> Vector:
    result = lm.simulate(scenario)
    return np.array([result[f"{name}_speed"].values for name in names]).T


def close(train: Vector, expected: Vector, tolerance: float = 1e-8) -> None:
    size = np.abs(expected).max()
    assert np.abs(train - expected).max() < tolerance * size


def simulation(duration: float, interval: float = 0.01) -> dict[str, float]:
    return {"duration": duration, "sample_interval": interval}


def test_first() -> None:
    scenario = lm.Scenario(
        shafts={
            "motor": {"inertia": 0.1, "torque": {"amplitude": 10.0, "frequency": 5.0, "phase": math.pi}},
            "gear": {"inertia": 2.0, "viscous_friction": 10.0},
            "load": {"inertia": 2.0},
        },
        gears={"ideal": gear_between("motor", "gear", 10.0), "spring": gear_between("gear", "load", 1.0, 1e4)},
        simulation=simulation(1.0),
    )
    # The motor counts 100-fold at the output of the gear.
    reduced = Hybrid(
        [2.0 + 0.1 * 100.0, 2.0],
        lambda t, y: np.array([100.0 * math.sin(10.0 * math.pi * t) - 10.0 * y[0] - 1e4 * y[2], 1e4 * y[2]]),
        [],
        [(0, 1)],
    )
    times = np.arange(101) * 0.01
    expected, _ = reduced.run(np.zeros(3), times, [])
    close(speeds(scenario, "gear", "load"), expected[:, :2])


@pytest.mark.parametrize("inertia", [0.0, 1e-3])
def test_elastic_bearing(inertia: float) -> None:
    """A gear whose housing of 5 kg·m² rests on a spring and a damper; a brake stands for the ground.

    Between gear and spring the example has no inertia: the two are one compliant gear. With an inertia there the gear is rigid.
    """
    stiffness = {"stiffness": {"kind": "linear", "stiffness": 1e3}}
    ends = {"input": "shaft", "output": "output" if inertia else "load", "housing": "housing", "ratio": 3.0}
    bearing = {"stiffness": {"kind": "linear", "stiffness": 1e5}, "mesh_damping": 5.0}
    gears = {"gear": ends if inertia else ends | stiffness, "bearing": {"input": "housing", "output": "ground", "ratio": 1.0} | bearing}
    if inertia:
        gears["spring"] = {"input": "output", "output": "load", "ratio": 1.0} | stiffness
    scenario = lm.Scenario(
        shafts={
            "shaft": {"inertia": 1.0, "torque": {"ramps": [{"rise": -100.0, "duration": 5.0}]}},
            "housing": {"inertia": 5.0},
            "load": {"inertia": 50.0},
            "ground": {"inertia": 1.0},
        }
        | ({"output": {"inertia": inertia}} if inertia else {}),
        gears=gears,
        brakes={"fixed": {"shaft": "ground", "torque": 1e6}},
        command={"fixed": {"mean": 1.0}},
        simulation=simulation(10.0),
    )

    # The flanges of the gear: w_a - w_s = 3 (w_b - w_s), tau_b = -3 tau_a, tau_a + tau_b + tau_s = 0.
    def rates(t: float, y: Vector) -> Vector:
        shaft, housing, load, output, bearing, twist = y
        spring = 1e3 * twist
        mesh, at_output = spring, 0.0
        if inertia:  # tau_b accelerates the output flange as fast as the other two let it turn
            free = 20.0 * min(t, 5.0) / 3.0 - 2.0 / 3.0 * (1e5 * bearing + 5.0 * housing) / 5.0
            mesh = (free + spring / inertia) / (1.0 / 9.0 + 4.0 / 9.0 / 5.0 + 1.0 / inertia)
            at_output = (mesh - spring) / inertia
        else:
            output = (shaft - housing) / 3.0 + housing
        accelerations = [
            20.0 * min(t, 5.0) - mesh / 3.0,
            (-1e5 * bearing - 5.0 * housing - 2.0 / 3.0 * mesh) / 5.0,
            spring / 50.0,
            at_output,
        ]
        return np.array([*accelerations, housing, output - load])

    times = np.arange(1001) * 0.01
    first = solve_ivp(rates, (0.0, 5.0), np.zeros(6), "DOP853", t_eval=times[:501], **TIGHT)
    second = solve_ivp(rates, (5.0, 10.0), first.y[:, -1], "DOP853", t_eval=times[500:], **TIGHT)
    expected = np.concatenate([first.y.T, second.y.T[1:]])
    result = lm.simulate(scenario)
    for name, column in (("shaft_speed", 0), ("housing_speed", 1), ("load_speed", 2), ("bearing_twist", 4)):
        close(result[name].values, expected[:, column])
    energy = lm.energy_of(result)
    assert abs(energy["residual"]) < 1e-10 * energy["turned_over"]
    adaptive = lm.simulate(scenario, solver="dormand-prince", relative_tolerance=1e-11)
    close(adaptive["load_speed"].values, expected[:, 2], 1e-7)


def test_simple_gear_shift() -> None:
    """A planetary gear of 75/50 shifts: a brake lets its ring go while a clutch ties the ring to the sun. The ring has no inertia.

    The quadratic load is 80 straight lines, in the train and in the reference.
    """
    nodes = np.linspace(0.0, 40.0, 81)
    drag = 20.0 * (nodes / (math.pi / 0.3)) ** 2
    engaging = {"ramps": [{"rise": 1.0, "begin": 2.0, "duration": 0.1}]}
    scenario = lm.Scenario(
        shafts={
            "engine": {"inertia": 1.0, "torque": {"steps": [{"height": -20.0, "time": 0.5}]}},
            "ring": {},
            "load": {"inertia": 10.0, "drag": {"kind": "curve", "speeds": nodes.tolist(), "torques": drag.tolist()}},
        },
        gears={"planetary": {"input": "engine", "output": "load", "housing": "ring", "ratio": 2.5}},
        clutches={"clutch": {"input": "engine", "output": "ring", "torque": 100.0}},
        brakes={"brake": {"shaft": "ring", "torque": 100.0}},
        command={"clutch": engaging, "brake": {"mean": 1.0, "ramps": [{"rise": -1.0, "begin": 2.0, "duration": 0.1}]}},
        simulation=simulation(5.0),
    )

    def engaged(t: float) -> float:
        return min(max((t - 2.0) / 0.1, 0.0), 1.0)

    def torque(t: float, y: Vector) -> Vector:
        return np.array([20.0 if t >= 0.5 else 0.0, -math.copysign(np.interp(abs(y[1]), nodes, drag), y[1])])

    # w_sun + 1.5 w_ring = 2.5 w_carrier
    ring = np.array([-1.0, 2.5]) / 1.5
    sun = np.array([1.0, 0.0])
    reference = Hybrid(
        [1.0, 10.0],
        torque,
        [
            Contact(0, None, *[lambda t: 100.0 * engaged(t)] * 2, weights=(sun - ring).tolist()),
            Contact(0, None, *[lambda t: 100.0 * (1.0 - engaged(t))] * 2, weights=ring.tolist()),
        ],
    )
    times = np.arange(501) * 0.01
    expected, events = reference.run(np.zeros(2), times, [0.5, 2.0, 2.1])
    assert events >= 2  # the brake gives way, and the clutch closes
    result = lm.simulate(scenario)
    speed = {name: result[f"{name}_speed"].values for name in ("engine", "ring", "load")}
    close(np.array([speed["engine"], speed["load"]]).T, expected)
    close(speed["ring"], expected @ ring)
    assert speed["load"][199] / speed["engine"][199] == pytest.approx(1.0 / 2.5, rel=1e-12)  # 1/(1 + ratio)
    assert speed["load"][-1] / speed["engine"][-1] == pytest.approx(1.0, rel=1e-12)
    energy = lm.energy_of(result)
    assert abs(energy["residual"]) < 1e-10 * energy["turned_over"]


def coupled_clutches(peak: float) -> tuple[lm.Scenario, Hybrid]:
    scenario = lm.Scenario(
        shafts={
            "j1": {"inertia": 1.0, "torque": {"amplitude": 10.0, "frequency": 5.0, "phase": math.pi}},
            **{name: {"inertia": 1.0} for name in ("j2", "j3", "j4")},
        },
        clutches={f"c{k}": {"input": f"j{k}", "output": f"j{k + 1}", "torque": 10.0, "breakaway_torque": 10.0 * peak} for k in (1, 2, 3)},
        command={
            "c1": {"amplitude": 1.0, "frequency": 0.2, "phase": 0.5 * math.pi},
            "c2": {"steps": [{"height": 1.0, "time": 0.4}]},
            "c3": {"steps": [{"height": 1.0, "time": 0.9}]},
        },
        initial={"speeds": {"j1": 10.0}},
        simulation=simulation(1.5),
    )
    engaged = (lambda t: max(0.0, math.cos(0.4 * math.pi * t)), lambda t: float(t >= 0.4), lambda t: float(t >= 0.9))

    def torque(t: float, y: Vector) -> Vector:
        return np.array([10.0 * math.sin(10.0 * math.pi * t), 0.0, 0.0, 0.0])

    contacts = [
        Contact(k, k + 1, lambda t, u=u: 10.0 * u(t), lambda t, u=u: 10.0 * peak * u(t))  # type: ignore[misc]
        for k, u in enumerate(engaged)
    ]
    return scenario, Hybrid([1.0] * 4, torque, contacts)


@pytest.mark.parametrize("peak", [1.0, 1.1])
def test_coupled_clutches(peak: float) -> None:
    scenario, reference = coupled_clutches(peak)
    times = np.arange(151) * 0.01
    expected, events = reference.run(np.array([10.0, 0.0, 0.0, 0.0]), times, [0.4, 0.9, 1.25])
    assert events >= 4
    close(speeds(scenario, "j1", "j2", "j3", "j4"), expected)


def friction(**tables: Any) -> lm.Scenario:
    spring = {"ratio": 1.0, "stiffness": {"kind": "linear", "stiffness": 160.0}, "mesh_damping": 1.0}
    return lm.Scenario(
        gears={"spring": {"input": "inertia2", "output": "inertia1", **spring}},
        clutches={"clutch": {"input": "inertia3", "output": "inertia2", "torque": 80.0}},
        brakes={"brake": {"shaft": "inertia1", "torque": 800.0}},
        **tables,
    )


def test_friction() -> None:
    """A clutch and a brake, which closes at 0.5 s, when the torque ends."""
    shafts = {"inertia3": {"inertia": 1.0}, "inertia2": {"inertia": 0.05}, "inertia1": {"inertia": 1.0}}
    driven = {**shafts, "inertia3": {"inertia": 1.0, "torque": {"amplitude": 200.0, "frequency": 50.0 / math.pi, "phase": math.pi}}}
    idle = {**shafts, "inertia3": {"inertia": 1.0, "torque": 0.0}}
    names = ("inertia3", "inertia2", "inertia1")
    first = lm.simulate(
        friction(
            shafts=driven,
            command={"clutch": {"mean": 1.0}, "brake": {"mean": 0.0}},
            initial={"speeds": {"inertia3": 100.0, "inertia2": 90.0, "inertia1": 90.0}},
            simulation=simulation(0.5),
        )
    )
    end = {name: float(first[f"{name}_speed"][-1]) for name in names}
    second = speeds(
        friction(
            shafts=idle,
            command={"clutch": {"mean": 1.0}, "brake": {"mean": 1.0}},
            initial={"speeds": end, "twists": {"spring": float(first["spring_twist"][-1])}},
            simulation=simulation(2.5),
        ),
        *names,
    )

    def torque(t: float, y: Vector) -> Vector:
        spring = 160.0 * y[3] + (y[1] - y[2])
        return np.array([200.0 * math.sin(100.0 * t) if t < 0.5 else 0.0, -spring, spring])

    contacts = [Contact(0, 1, lambda t: 80.0, lambda t: 80.0), Contact(2, None, lambda t: 800.0 * (t >= 0.5), lambda t: 800.0 * (t >= 0.5))]
    times = np.arange(301) * 0.01
    expected, events = Hybrid([1.0, 0.05, 1.0], torque, contacts, [(1, 2)]).run(np.array([100.0, 90.0, 90.0, 0.0]), times, [0.5])
    assert events >= 4
    close(np.concatenate([np.array([first[f"{n}_speed"].values for n in names]).T, second[1:]]), expected[:, :3])


def test_one_way_clutch() -> None:
    """A freewheel and a clutch between the same shafts: while both are stuck, one torque serves for two."""
    scenario = lm.Scenario(
        shafts={"input": {"inertia": 1.0, "torque": {"amplitude": 10.0, "frequency": 3.0, "phase": math.pi}}, "output": {"inertia": 1.0}},
        clutches={"clutch": {"input": "input", "output": "output", "torque": 1.5, "breakaway_torque": 37.5}},
        freewheels={"freewheel": {"input": "input", "output": "output"}},
        command={"clutch": {"steps": [{"height": h, "time": t} for h, t in ((1.0, 0.3), (-1.0, 0.95), (1.0, 1.6))]}},
        initial={"speeds": {"input": -0.5}},
        simulation=simulation(2.0),
    )

    def engaged(t: float) -> float:
        return float(0.3 <= t < 0.95 or t >= 1.6)

    contact = Contact(0, 1, lambda t: 1.5 * engaged(t), lambda t: 37.5 * engaged(t), one_way=True)
    reference = Hybrid([1.0, 1.0], lambda t, y: np.array([10.0 * math.sin(6.0 * math.pi * t), 0.0]), [contact])
    times = np.arange(201) * 0.01
    expected, events = reference.run(np.array([-0.5, 0.0]), times, [0.3, 0.95, 1.6])
    assert events >= 2  # the brake gives way, and the clutch closes
    close(speeds(scenario, "input", "output"), expected)


def test_lossy_gear_with_bearing_friction() -> None:
    """LossyGearDemo2: both may be stuck at once, so that their torques are not unique; the motion is."""
    wave, losses = {"amplitude": 10.0, "frequency": 1.0, "phase": math.pi}, {"drive_efficiency": 0.5, "backdrive_efficiency": 0.5}
    scenario = lm.Scenario(
        shafts={
            "a": {"inertia": 1.0, "friction_torque": 0.5, "viscous_friction": 0.5, "torque": wave},
            "b": {"inertia": 1.5, "torque": {"mean": 10.0, "ramps": [{"rise": -5.0, "duration": 2.0}]}},
        },
        gears={"gear": {"input": "a", "output": "b", "ratio": 2.0, "losses": {"kind": "mesh_efficiency", **losses}}},
        simulation=simulation(0.5, 1e-3),
    )

    def load(t: float) -> float:
        return 10.0 - 2.5 * t

    def loss(s: int, T_2: float) -> float:
        return (1.0 / 0.5 - 1.0 if s * T_2 > 0.0 else 1.0 - 0.5) * abs(T_2) / 2.0

    def rate(t: float, w: float, s: int) -> float:
        """w' with 1.5 w'/2 = T_2 - load and w' = 10 sin - T_2/2 - s (0.5 + loss) - 0.5 w, for the sign of T_2 that fits."""
        for sign in (1, -1):
            per_T_2 = 0.5 + s * loss(s, sign) * sign
            a = (10.0 * math.sin(2.0 * math.pi * t) - per_T_2 * load(t) - 0.5 * s - 0.5 * w) / (1.0 + 0.75 * per_T_2)
            if sign * (load(t) + 0.75 * a) >= 0.0:
                return a
        raise AssertionError("no torque fits")

    def margins(t: float) -> tuple[float, float]:
        held = 10.0 * math.sin(2.0 * math.pi * t) - load(t) / 2.0
        return 0.5 + loss(1, load(t)) - held, 0.5 + loss(-1, load(t)) + held

    times = np.arange(501) * 1e-3
    expected, t, w, s, events = np.zeros(501), 0.0, 0.0, 0, 0
    s = 0 if min(margins(0.0)) >= 0.0 else 1 if margins(0.0)[0] < 0.0 else -1
    while t < 0.5:
        guards: list[Any] = [lambda t, y: margins(t)[0], lambda t, y: margins(t)[1]] if s == 0 else [lambda t, y, s=s: s * y[0] + 0.0]
        for g in guards:
            g.terminal, g.direction = True, -1
        rates = (lambda t, y: [0.0]) if s == 0 else (lambda t, y, s=s: [rate(t, y[0], s)])
        part = solve_ivp(rates, (t, 0.5), [w], "DOP853", dense_output=True, events=guards, max_step=1e-3, **TIGHT)
        inside = (times >= t) & (times <= part.t[-1])
        expected[inside] = part.sol(times[inside])[0]
        t, w = float(part.t[-1]), float(part.y[0, -1])
        if t >= 0.5:
            break
        events += 1
        if s == 0:
            s = 1 if len(part.t_events[0]) else -1
        else:
            w = 0.0
            s = 0 if min(margins(t)) >= 0.0 else 1 if margins(t)[0] < 0.0 else -1
    assert events >= 4
    close(speeds(scenario, "a", "b"), np.array([expected, expected / 2.0]).T)


@pytest.mark.parametrize("limited", [False, True])
def test_elastic_backlash(limited: bool) -> None:
    """Backlash with ElastoBacklash2: the flanks push as spring and damper, and part where these would pull. With ElastoBacklash
    (limited) the torque of the damper is at most that of the spring as well."""
    J, c, d, half = 5.0, 2e4, 50.0, math.pi / 8.0
    flanks = {"stiffness": {"kind": "curve", "backlash": 2.0 * half, "slopes": [c]}, "mesh_damping": d, "damping_limited": limited}
    scenario = lm.Scenario(
        shafts={"inertia": {"inertia": J, "torque": 0.0}, "wall": {"inertia": 1.0}},
        gears={"mesh": {"input": "inertia", "output": "wall", "ratio": 1.0, **flanks}},
        brakes={"ground": {"shaft": "wall", "torque": 1e6}},
        command={"ground": {"mean": 1.0}},
        initial={"twists": {"mesh": 0.5 * math.pi}},
        simulation=simulation(1.0, 1e-3),
    )
    result = lm.simulate(scenario)
    times = result["time"].values
    expected = np.zeros((2, len(times)))
    t, y, events = 0.0, [0.5 * math.pi, 0.0], 0
    law = "both"  # of the flank on this side: gap, both, or the doubled spring while the damping is limited
    while t < 1.0:
        side = 1.0 if y[0] > 0.0 else -1.0

        def spring(y: Sequence[float], side: float = side) -> float:
            return c * (side * y[0] - half)

        def torque(y: Sequence[float], side: float = side, law: str = law) -> float:
            if law == "gap":
                return 0.0
            return 2.0 * spring(y) if law == "doubled" else spring(y) + d * side * y[1]

        def rates(t: float, y: Sequence[float], side: float = side, torque: Any = torque) -> list[float]:
            return [y[1], -side * torque(y) / J]

        def pressed(t: float, y: Sequence[float], side: float = side) -> float:
            return spring(y) + d * side * y[1]

        def spare(t: float, y: Sequence[float], side: float = side, way: float = 1.0 if law == "both" else -1.0) -> float:
            return way * (spring(y) - d * side * y[1])

        pressed.terminal, pressed.direction = True, -1  # type: ignore[attr-defined]
        spare.terminal, spare.direction = limited, -1  # type: ignore[attr-defined]
        end = 1.0
        if law == "gap":  # to the other flank: the one that was left lies behind
            end = min(1.0, t + (half + side * y[0]) / abs(y[1]))
        guards = {"gap": [], "both": [pressed, spare] if limited else [pressed], "doubled": [spare]}[law]
        part = solve_ivp(rates, (t, end), y, "DOP853", dense_output=True, events=guards, **TIGHT)
        inside = (times >= t) & (times <= part.t[-1])
        expected[:, inside] = part.sol(times[inside])
        t, y, events = float(part.t[-1]), list(part.y[:, -1]), events + 1
        if law == "gap":
            law = "doubled" if limited else "both"
        else:
            law = "gap" if law == "both" and len(part.t_events[0]) else "doubled" if law == "both" else "both"
    assert events >= (12 if limited else 8)
    close(result["mesh_twist"].values, expected[0])
    close(result["inertia_speed"].values, expected[1])
    if limited:
        torques = result["mesh_output_torque"].values
        springs = c * (np.abs(expected[0]) - half).clip(0.0)
        assert np.all(np.abs(torques) <= 2.0 * springs + 1e-5)

"""Rigid flanks with backlash: impacts with a coefficient of restitution, and contact where they have accumulated."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import lostmotion as lm
from conftest import some
from refusals import refusals_of
from tables import gear_between, run_of
from test_end_stops import ball

Vector = NDArray[np.float64]


def pair(
    e: float,
    *,
    ratio: float = 1.0,
    inertias: tuple[float, float] = (0.5, 2.0),
    backlash: float = 0.02,
    torques: tuple[Any, Any] = (3.0, 0.0),
    duration: float = 1.0,
    **initial: Any,
) -> lm.Scenario:
    """Two shafts whose flanks strike; torques that drive them [N·m]."""
    return lm.Scenario(
        shafts={"a": {"inertia": inertias[0], "torque": torques[0]}, "b": {"inertia": inertias[1], "torque": torques[1]}},
        gears={"mesh": gear_between("a", "b", ratio, {"kind": "rigid", "backlash": backlash, "restitution": e})},
        initial=initial,
        simulation=run_of(duration, duration / 200.0),
    )


@pytest.mark.parametrize("ratio", [1.0, -3.0, 10.0])
@pytest.mark.parametrize("e", [0.0, 0.3, 0.5, 0.8, 0.95])
def test_impacts_end_where_the_geometric_series_does(e: float, ratio: float) -> None:
    """From the middle of the gap: t_1 = sqrt(2 s/a), and from then on 2 e v_1/(a (1 - e)); all of m v_1^2/2 is lost."""
    J_a, J_b, T = 0.5, 2.0, 3.0
    a = T / J_a / abs(ratio)  # of the twist
    s = 0.01
    first = math.sqrt(2.0 * s / a)
    v = a * first
    end = first + 2.0 * e * v / (a * (1.0 - e))
    result = lm.simulate(pair(e, ratio=ratio, torques=(-T, 0.0), duration=1.5 * end))
    events = lm.switchings_of(result)
    times = events["instant"].values
    assert times[0] == pytest.approx(first, rel=1e-13)
    assert times[-1] == pytest.approx(end, rel=3e-13)
    # The impacts that are listed one by one.
    for k in range(min(5, len(times) - 2)):
        at = first + 2.0 * v / a * sum(e**j for j in range(1, k + 1))
        assert times[k] == pytest.approx(at, rel=1e-12)
    mass = 1.0 / (1.0 / (J_a * ratio**2) + 1.0 / J_b)
    energy = lm.energy_of(result)
    assert energy["mesh: impacts"] == pytest.approx(0.5 * mass * v**2, rel=1e-12)
    assert abs(energy["residual"]) < 1e-13 * energy["turned_over"]
    # As one body since the beginning, but for what the flanks have run apart.
    t = result["time"].values
    closed = t > end
    assert closed.sum() > 50
    expected = T * t / (J_a + J_b / ratio**2)
    np.testing.assert_allclose(result["a_speed"].values[closed], expected[closed], rtol=1e-12)
    np.testing.assert_allclose(result["b_speed"].values[closed], expected[closed] / ratio, rtol=1e-12)
    np.testing.assert_array_equal(result["mesh_twist"].values[closed], math.copysign(s, ratio))
    torque = J_b * T / (J_a + J_b / ratio**2) / ratio
    np.testing.assert_allclose(result["mesh_output_torque"].values[closed], torque, rtol=1e-12)


def test_elastic_flanks_keep_the_energy() -> None:
    result = lm.simulate(pair(1.0, torques=(0.0, 0.0), duration=5.0, speeds={"a": 1.0}))
    energy = lm.energy_of(result)
    assert energy["mesh: impacts"] == 0.0
    J_a, J_b = 0.5, 2.0
    kinetic = 0.5 * (J_a * result["a_speed"].values ** 2 + J_b * result["b_speed"].values ** 2)
    np.testing.assert_allclose(kinetic, 0.25, rtol=1e-12)
    momentum = J_a * result["a_speed"].values + J_b * result["b_speed"].values
    np.testing.assert_allclose(momentum, 0.5, rtol=1e-12)
    # Across the gap of 0.02 rad at 1 rad/s: impacts every 20 ms, the first after 10 ms.
    times = lm.switchings_of(result)["instant"].values
    np.testing.assert_allclose(times, 0.01 + 0.02 * np.arange(len(times)), rtol=1e-11)
    assert len(times) == 250


def test_elastic_flanks_that_torques_press_are_closed_but_for_flights_that_cannot_be_seen() -> None:
    """They bounce for ever, by 1e-9 of 0.02 rad: speeds are those of one body but for sqrt(2 a h)."""
    J_a, J_b, T, h = 0.5, 2.0, 3.0, 1e-9
    result = lm.simulate(pair(1.0, torques=(-T, 0.0), duration=1.0, twists={"mesh": 0.01 - h}))
    assert len(lm.switchings_of(result)["instant"]) < 5
    t = result["time"].values
    for name in ("a_speed", "b_speed"):
        np.testing.assert_allclose(result[name].values, T * t / (J_a + J_b), atol=math.sqrt(2.0 * T / J_a * h))
    np.testing.assert_allclose(result["mesh_output_torque"].values[2:], J_b * T / (J_a + J_b), rtol=1e-9)
    energy = lm.energy_of(result)
    assert 0.0 <= energy["mesh: impacts"] <= 1.01 * J_b * T / (J_a + J_b) * h
    assert abs(energy["residual"]) < 1e-13 * energy["turned_over"]


class Reference:
    """Two inertias under constant torques between steps, from impact to impact by parabolas."""

    def __init__(self, J: tuple[float, float], ratio: float, reach: float, e: float) -> None:
        self.J, self.ratio, self.reach, self.e = J, ratio, reach, e
        self.mass = 1.0 / (1.0 / (J[0] * ratio**2) + 1.0 / J[1])
        self.lost = 0.0
        self.impacts = 0

    def run(self, twist: float, speeds: list[float], steps: list[tuple[float, float, float]], end: float) -> Vector:
        """State at the end: both speeds and the twist."""
        t, d, w = 0.0, twist, list(speeds)
        side = 0  # of the flanks that touch
        for k, (begin, T_a, T_b) in enumerate(steps):
            stop = steps[k + 1][0] if k + 1 < len(steps) else end
            assert t == begin
            rate = (T_a / self.J[0], T_b / self.J[1])
            a = rate[0] / self.ratio - rate[1]
            # Contact lasts as long as its torque presses.
            if side * a > 0.0:
                self.together(w, (T_a, T_b), stop - t)
                t = stop
                continue
            side = 0
            while t < stop:
                v = w[0] / self.ratio - w[1]
                left, way = self.flight(d, v, a)
                if t + left >= stop:
                    h = stop - t
                    d += v * h + 0.5 * a * h * h
                    w = [w[0] + rate[0] * h, w[1] + rate[1] * h]
                    t = stop
                    break
                w = [w[0] + rate[0] * left, w[1] + rate[1] * left]
                t += left
                d = way * self.reach
                v = w[0] / self.ratio - w[1]
                self.impacts += 1
                self.strike(w, v, self.e)
                v *= -self.e
                rest = 2.0 * abs(v) / (abs(a) * (1.0 - self.e)) if way * a > 0.0 else math.inf
                if 0.5 * v * v < 1e-7 * self.reach * abs(a) and t + rest < stop:
                    self.strike(w, v, 0.0)
                    self.together(w, (T_a, T_b), stop - t)
                    side, t = int(way), stop
        return np.array([*w, d])

    def flight(self, d: float, v: float, a: float) -> tuple[float, float]:
        """How long to which end of the gap."""
        best = (math.inf, 0.0)
        for way in (1.0, -1.0):
            # way (d + v t + a t^2/2) = reach
            gap, speed, rate = self.reach - way * d, way * v, way * a
            if (gap == 0.0 and speed < 0.0) or (gap == 0.0 and speed == 0.0 and rate <= 0.0):
                t = -2.0 * speed / rate if rate > 0.0 else math.inf
            else:
                root = speed * speed + 2.0 * rate * gap
                if root < 0.0:
                    continue
                root = math.sqrt(root)
                t = ((-speed + root) / rate if rate > 0.0 else math.inf) if speed + root <= 0.0 else 2.0 * gap / (speed + root)
            if t < best[0]:
                best = (t, way)
        return best

    def strike(self, w: list[float], v: float, e: float) -> None:
        P = (1.0 + e) * v * self.mass
        w[0] -= P / self.ratio / self.J[0]
        w[1] += P / self.J[1]
        self.lost += 0.5 * (1.0 - e * e) * self.mass * v * v

    def together(self, w: list[float], T: tuple[float, float], h: float) -> None:
        rate = (T[0] + T[1] / self.ratio) / (self.J[0] + self.J[1] / self.ratio**2)
        w[0] += rate * h
        w[1] += rate / self.ratio * h


def random_case(draw: np.random.Generator) -> tuple[lm.Scenario, Reference, Vector]:
    J = (float(10.0 ** draw.uniform(-2.0, 0.5)), float(10.0 ** draw.uniform(-2.0, 0.5)))
    ratio = float(draw.choice([-5.0, -1.0, 1.0, 2.0, 10.0]))
    backlash = float(10.0 ** draw.uniform(-3.0, -1.0))
    e = float(draw.choice([0.0, 0.2, 0.5, 0.7, 0.9]))
    # A natural time: across the gap under a torque of 1 N m on the input.
    unit = math.sqrt(backlash * J[0] * abs(ratio))
    times = np.cumsum(draw.uniform(0.5, 4.0, 3)) * unit
    torques = draw.uniform(-1.0, 1.0, (3, 2))
    torques[:, 1] *= J[1] / J[0] / abs(ratio)
    speeds = [float(draw.uniform(-1.0, 1.0) * unit / J[0]), 0.0]
    twist = float(draw.uniform(-0.45, 0.45) * backlash)
    begins = [0.0, float(times[0]), float(times[1])]

    def signal(column: int) -> dict[str, Any]:
        value = (-torques[:, column]).tolist()
        heights = np.diff(value).tolist()
        return {"mean": value[0], "steps": [{"time": begins[k + 1], "height": height} for k, height in enumerate(heights)]}

    scenario = pair(
        e,
        ratio=ratio,
        inertias=J,
        backlash=backlash,
        torques=(signal(0), signal(1)),
        duration=float(times[2]),
        speeds={"a": speeds[0]},
        twists={"mesh": twist},
    )
    reference = Reference(J, ratio, 0.5 * backlash, e)
    steps = [(b, float(T[0]), float(T[1])) for b, T in zip(begins, torques, strict=True)]
    return scenario, reference, reference.run(twist, speeds, steps, float(times[2]))


def test_random_cases_against_parabolas() -> None:
    draw = np.random.default_rng(7)
    impacts, cases = 0, some(1000, 200)
    for case in range(cases):
        scenario, reference, expected = random_case(draw)
        result = lm.simulate(scenario)
        end = np.array([float(result[name].values[-1]) for name in ("a_speed", "b_speed", "mesh_twist")])
        size = np.array([*2 * [max(1e-3, *np.abs(expected[:2]))], scenario.gears["mesh"].stiffness.backlash])  # type: ignore[union-attr]
        # Instants are found to rounding; an impact passes on at most the ratio of the inertias of such an error.
        assert np.all(np.abs(end - expected) < 1e-9 * size), (case, end, expected)
        energy = lm.energy_of(result)
        assert energy["mesh: impacts"] == pytest.approx(reference.lost, rel=1e-9, abs=1e-12), case
        assert abs(energy["residual"]) < 1e-11 * max(energy["turned_over"], 1e-6), case
        impacts += reference.impacts
    assert impacts > 3 * cases


def group(**changes: Any) -> lm.Scenario:
    """Rigid gears on both sides of the flanks, a shaft without inertia among them, friction, a spring and backlash in it behind."""
    tables: dict[str, Any] = {
        "shafts": {
            "rotor": {"inertia": 0.01, "torque": {"amplitude": 2.0, "frequency": 3.0}},
            "pinion": {"friction_torque": 0.05},
            "wheel": {"inertia": 0.05},
            "table": {"inertia": 0.2, "friction_torque": 0.1},
            "end": {"inertia": 0.1},
        },
        "gears": {
            "first": gear_between("rotor", "pinion", -2.0),
            "mesh": gear_between("pinion", "wheel", 3.0, {"kind": "rigid", "backlash": 0.02, "restitution": 0.4}),
            "second": gear_between("wheel", "table", 1.5),
            "soft": gear_between(
                "table", "end", 1.0, {"kind": "curve", "backlash": 0.01, "slopes": [300.0]}, hysteresis={"efficiency": 0.9}
            ),
        },
        "simulation": run_of(1.0, 2e-3),
    }
    return lm.Scenario(**(tables | changes))


def test_both_solvers_agree_on_rigid_groups_with_friction_and_hysteresis() -> None:
    scenario = group()
    exact = lm.simulate(scenario)
    other = lm.simulate(scenario, solver="dormand-prince", relative_tolerance=1e-11)
    causes = lm.switchings_of(exact)["cause"]
    assert len(causes) > 20
    for name in ("rotor_speed", "wheel_speed", "end_speed", "mesh_twist"):
        size = float(np.abs(exact[name].values).max())
        np.testing.assert_allclose(other[name].values, exact[name].values, rtol=0.0, atol=1e-6 * size, err_msg=name)
    energy = lm.energy_of(exact)
    assert energy["mesh: impacts"] > 0.0
    assert abs(energy["residual"]) < 1e-11 * energy["turned_over"]
    np.testing.assert_allclose(exact["rotor_speed"].values, -2.0 * exact["pinion_speed"].values, rtol=1e-14, atol=1e-14)
    assert np.abs(exact["mesh_twist"].values).max() <= 0.01


def test_an_impact_keeps_the_momentum_that_a_mass_matrix_gives() -> None:
    """A mass matrix couples the input of the flanks with a third shaft, which an impact sets in motion."""
    M = np.array([[0.5, 0.2], [0.2, 0.3]])
    e, J_b, ratio = 0.5, 2.0, 2.0
    scenario = lm.Scenario(
        shafts={"a": {}, "c": {"torque": 0.0}, "b": {"inertia": J_b}},
        gears={"mesh": {"input": "a", "output": "b", "ratio": ratio, "stiffness": {"kind": "rigid", "backlash": 0.02, "restitution": e}}},
        mass_matrices={"arm": {"shafts": ["a", "c"], "matrix": M.tolist()}},
        initial={"speeds": {"a": 2.0}},
        simulation={"duration": 0.015, "sample_interval": 1e-3},
    )
    result = lm.simulate(scenario)
    whole = np.zeros((3, 3))
    whole[:2, :2] = M
    whole[2, 2] = J_b
    g = np.array([1.0 / ratio, 0.0, -1.0])
    before = np.array([2.0, 0.0, 0.0])
    P = (1.0 + e) * (g @ before) / (g @ np.linalg.solve(whole, g))
    after = before - np.linalg.solve(whole, g) * P
    end = np.array([float(result[f"{name}_speed"].values[-1]) for name in ("a", "c", "b")])
    np.testing.assert_allclose(end, after, rtol=1e-13)
    lost = 0.5 * before @ whole @ before - 0.5 * after @ whole @ after
    assert lm.energy_of(result)["mesh: impacts"] == pytest.approx(lost, rel=1e-12)


def test_flanks_in_a_row_strike_at_once_without_a_gain_of_energy() -> None:
    """Three shafts: the second flanks touch when the first strike. Newton's law with all of them, against enumeration."""
    stiffness = {"kind": "rigid", "backlash": 0.02, "restitution": 0.5}
    scenario = lm.Scenario(
        shafts={"a": {"inertia": 1.0, "torque": 0.0}, "b": {"inertia": 0.5}, "c": {"inertia": 2.0}},
        gears={"one": gear_between("a", "b", 1.0, stiffness), "two": gear_between("b", "c", 1.0, stiffness)},
        initial={"speeds": {"a": 1.0}, "twists": {"two": 0.01}},
        simulation=run_of(0.0101, 1e-4),
    )
    result = lm.simulate(scenario)
    # u_1 = w_a - w_b from 1 to -1/2, u_2 = w_b - w_c stays 0: b and c are one body of 2.5 kg m^2.
    a = 1.0 - 1.5 / (1.0 + 1.0 / 2.5)
    end = [float(result[f"{name}_speed"].values[-1]) for name in "abc"]
    np.testing.assert_allclose(end, [a, (1.0 - a) / 2.5, (1.0 - a) / 2.5], rtol=1e-13)
    assert abs(lm.energy_of(result)["residual"]) < 1e-14


def test_flanks_that_touch_part_where_they_would_pull() -> None:
    """Closed under a torque that falls to its opposite: they part where the torque between them is zero."""
    scenario = pair(
        0.0, torques=({"mean": -1.0, "ramps": [{"rise": 2.0, "begin": 0.2, "duration": 0.2}]}, 0.0), duration=0.32, twists={"mesh": 0.01}
    )
    result = lm.simulate(scenario)
    events = lm.switchings_of(result)["instant"].values
    assert np.any(np.abs(events - 0.3) < 1e-13)
    t, twist = result["time"].values, result["mesh_twist"].values
    after = t > 0.3
    np.testing.assert_allclose(twist[after], 0.01 - 10.0 / 0.5 * (t[after] - 0.3) ** 3 / 6.0, rtol=1e-12)
    torque = result["mesh_output_torque"].values
    assert np.all(torque >= 0.0)
    assert np.all(torque[after] == 0.0)


test_what_is_no_law_of_flanks_or_impacts_do_not_cover_is_refused = refusals_of(
    lambda changes: pair(0.5).replace(**changes),
    ({"gears.mesh.stiffness": {"kind": "rigid", "backlash": 0.02}}, "gears.mesh.stiffness: give their restitution, 0 to 1, or a stiffness"),
    ({"gears.mesh.stiffness": {"kind": "rigid", "restitution": 0.5}}, "gears.mesh.stiffness: has a restitution but no backlash"),
    ({"gears.mesh.stiffness": {"kind": "rigid", "backlash": 0.02, "restitution": 1.5}}, "gears.mesh.stiffness.restitution: 1.5"),
    ({"gears.mesh.losses": {"kind": "constant_efficiency", "efficiency": 0.9}}, "gears.mesh: is rigid and has losses"),
    ({"shafts.a": {"inertia": 1.0, "speed": {"mean": 1.0}}}, "gears.mesh: the motion of shaft 'a' is given; give the gear"),
    ({"freewheels": {"f": {"input": "a", "output": "b"}}}, "gears.mesh: rigid flanks beside the freewheel 'f'"),
    ({"initial.twists": {"mesh": 0.02}}, "initial.twists.mesh: the flanks begin beyond the end"),
    ({"gears.mesh.mesh_damping": 1.0}, "gears.mesh: has mesh damping but is rigid"),
)


def test_explanations_and_events_name_flanks_and_impacts() -> None:
    scenario = pair(0.5, torques=(-3.0, 0.0), duration=0.5)
    assert "mesh_twist_contact: in the gap, at " in str(lm.explain(scenario, 0.03))
    assert "mesh_twist_contact: the flanks touch and press with 2.4 N·m" in str(lm.explain(scenario, 0.3))
    events = lm.switchings_of(lm.simulate(scenario))["cause"]
    names = dict(zip(events.attrs["flag_values"], events.attrs["flag_meanings"].split(), strict=True))
    assert {names[cause] for cause in events.values.tolist()} == {"struck"}


test_functions_without_impacts_say_so = refusals_of(
    lambda use: use(pair(0.5)),
    (lm.linearize, ": gears.mesh has rigid flanks with backlash"),
    (lambda s: lm.linearize(s.train(), lm.TrainInitial()), ": gears.mesh has rigid flanks with backlash"),
    (lambda s: lm.linearize(lm.Simulation(s.train())), ": gears.mesh has rigid flanks with backlash"),
    (lambda s: lm.simulate(s, sensitivities=["shafts.a.inertia"]), ": gears.mesh has rigid flanks with backlash"),
    (lm.check_drive, ": gears.mesh has rigid flanks with backlash"),
    (lambda _: lm.linearize(ball({"restitution": 0.5})), ": slides.ball.end_stops"),
    (lambda _: lm.simulate(ball({"restitution": 0.5}), sensitivities=["slides.ball.mass"]), ": slides.ball.end_stops"),
)

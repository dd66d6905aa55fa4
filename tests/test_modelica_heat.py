"""Examples of Modelica.Mechanics.Rotational with heat: HeatLosses and EddyCurrentBrake, with their own parameters and no added inertia.

Parameters: Modelica Standard Library 4.1, Mechanics/Rotational/Examples/HeatLosses.mo and EddyCurrentBrake.mo (BSD-3-Clause). The
references integrate the equations of the library's documentation by scipy, with event logic of their own.
"""

import itertools
import math
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import lostmotion as lm
from refusals import refused

Vector = NDArray[np.float64]
Modes = tuple[int, ...]
TIGHT: dict[str, float] = {"rtol": 1e-10, "atol": 1e-12}

J, RATIO = 2.0, 2.0
SPRING, DAMPING = 1e4, 20.0
FLANK, FLANK_DAMPING, HALF = 1e5, 100.0, 5e-4
LAST_TIMES = np.arange(1001) * 1e-3


def efficiency(w: float) -> float:
    """Efficiency of the lossy gear: 0.8 at rest, 0.7 at 1 rad/s, and further along that line."""
    return 0.8 - 0.1 * abs(w)


def bearing(w: float) -> float:
    """Friction of the bearings of the lossy gear at its input: 1 N m at rest, 2 N m at 1 rad/s."""
    return 1.0 + abs(w)


def taken(T_2: float, w: float, way: int) -> float:
    """Torque at the input of the lossy gear while it turns one way."""
    mesh = T_2 / RATIO + way * bearing(w)
    return mesh / efficiency(w) if mesh * way >= 0.0 else mesh * efficiency(w)


def force(t: float) -> float:
    """Normalized force of clutch, one-way clutch and brake."""
    return math.sin(0.4 * math.pi * t)


BEARING, GEAR, CLUTCH, ONE_WAY, BRAKE = range(5)  # the dry contacts, each with a mode -1, 0 (stuck) or 1
A, T_B, T_1, T_2, T_O, T_K = slice(0, 6), 6, 7, 8, 9, 10  # unknowns: accelerations, then torques
HEATS = ("inertia1: viscous friction", "spring_damper: hysteresis and damping", "backlash: hysteresis and damping",
         "inertia3: dry friction", "gear: mesh", "clutch: coupling", "one_way: coupling", "brake: brake")  # fmt: skip


class HeatLosses:
    """Six inertias: speeds, angles, and the heat of each element, from event to event.

    The flank is (side, law): in the gap, spring and damper, or the doubled spring while the damper is limited.
    """

    def elements(self, t: float, y: Vector, flank: tuple[float, str]) -> tuple[float, float, float, float]:
        """Torques on the first inertia, of the spring-damper, of the flanks and of the second spring."""
        w, phi = y[:6], y[6:12]
        outer = 20.0 * math.sin(10.0 * math.pi * t) - 10.0 * w[0]
        first = SPRING * (phi[0] - phi[1]) + DAMPING * (w[0] - w[1])
        spring, damper = self.flank_torques(y, flank[0])
        between = {"gap": 0.0, "both": spring + damper, "doubled": 2.0 * spring}[flank[1]]
        return outer, first, between, SPRING * (phi[2] - phi[3])

    @staticmethod
    def flank_torques(y: Vector, side: float) -> tuple[float, float]:
        return FLANK * (y[7] - y[8] - side * HALF), FLANK_DAMPING * (y[1] - y[2])

    def solve(self, t: float, y: Vector, modes: Modes, flank: tuple[float, str]) -> Vector:
        w = y[:6]
        outer, first, between, second = self.elements(t, y, flank)
        matrix, right = np.zeros((11, 11)), np.zeros(11)
        for k, torque in enumerate((outer - first, first - between, between - second, second, 0.0, 0.0)):
            matrix[k, k], right[k] = J, torque
        for k, unknown, sign in ((2, T_B, 1.0), (3, T_1, 1.0), (4, T_2, -1.0), (4, T_O, 1.0), (5, T_O, -1.0), (5, T_K, 1.0)):
            matrix[k, unknown] = sign  # fmt: skip
        stuck = ({2: 1.0}, {3: 1.0}, {3: 1.0 / RATIO, 4: -1.0}, {4: 1.0, 5: -1.0}, {5: 1.0})
        slipping = (1.0, math.nan, 5.0 * force(t), 0.5 * force(t), force(t))
        for contact, mode in enumerate(modes):
            row = 6 + contact
            if mode == 0:
                for unknown, value in stuck[contact].items():
                    matrix[row, unknown] = value
            elif contact != GEAR:
                matrix[row, (T_B, T_1, T_2, T_O, T_K)[contact]], right[row] = 1.0, mode * slipping[contact]
        if modes[GEAR] == 0:
            if modes[1:] == (0, 0, 0, 0):  # several torques hold the chain at rest; its motion is unique
                return np.linalg.lstsq(matrix, right, rcond=None)[0]
            return np.linalg.solve(matrix, right)
        eta, way = efficiency(w[3]), modes[GEAR]
        for share in (1.0 / eta, eta):  # the input drives, or the output does
            matrix[7, T_1], matrix[7, T_2], right[7] = 1.0, -share / RATIO, share * way * bearing(w[3])
            found = np.linalg.solve(matrix, right)
            if found[T_1] * way >= 0.0:
                break
        return found

    @staticmethod
    def slips(w: Vector) -> list[float]:
        """Speeds of the contacts, or with accelerations their rates."""
        return [w[2], w[3], w[3] / RATIO - w[4], w[4] - w[5], w[5]]

    @staticmethod
    def margins(t: float, found: Vector, modes: Modes) -> dict[int, float]:
        """What is missing until a stuck contact slips."""
        out = {BEARING: 1.0 - abs(found[T_B])} if modes[BEARING] == 0 else {}
        if modes[1:] == (0, 0, 0, 0):  # the brake holds the chain forward, the one-way clutch backward
            upper, lower = taken(force(t), 0.0, 1), taken(-0.5 * force(t), 0.0, -1)
            return out | {GEAR: min(upper - found[T_1], found[T_1] - lower)}
        each = {
            GEAR: min(taken(found[T_2], 0.0, 1) - found[T_1], found[T_1] - taken(found[T_2], 0.0, -1)),
            CLUTCH: 5.0 * force(t) - abs(found[T_2]),
            ONE_WAY: 0.5 * force(t) + found[T_O],
            BRAKE: force(t) - abs(found[T_K]),
        }
        return out | {k: margin for k, margin in each.items() if modes[k] == 0}

    def choose(self, t: float, y: Vector, flank: tuple[float, str], broken: dict[int, int]) -> Modes:
        """Modes that are consistent, those with most contacts stuck first."""
        speeds = self.slips(y[:6])
        choices: list[list[int]] = []
        for k, v in enumerate(speeds):
            at_rest = [0, -1] if k == ONE_WAY else [0, 1, -1]
            choices.append([broken[k]] if k in broken else at_rest if abs(v) < 1e-10 else [1 if v > 0.0 else -1])
        t += 1e-9
        for modes in sorted(itertools.product(*choices), key=lambda m: sum(map(abs, m))):
            try:
                found = self.solve(t, y, modes, flank)
            except np.linalg.LinAlgError:
                continue
            rates = self.slips(found[A])
            if min(self.margins(t, found, modes).values(), default=0.0) > -1e-8 and all(
                mode == 0 or abs(speeds[k]) > 1e-10 or mode * rates[k] > (-1e-6 if k in broken else 1e-7) for k, mode in enumerate(modes)
            ):
                return modes
        raise AssertionError(f"no consistent modes at {t}")

    def rates(self, t: float, y: Vector, modes: Modes, flank: tuple[float, str]) -> Vector:
        """Of speeds and angles, and the powers that become heat: of the flanks all that is not the spring's."""
        found, w = self.solve(t, y, modes, flank), y[:6]
        spring = self.flank_torques(y, math.copysign(1.0, y[7] - y[8]))[0] if abs(y[7] - y[8]) > HALF else 0.0
        between = self.elements(t, y, flank)[2]
        dry = np.array([found[T_B], 0.0, found[T_2], found[T_O], found[T_K]]) * self.slips(w)
        heats = [10.0 * w[0] ** 2, DAMPING * (w[0] - w[1]) ** 2, (between - spring) * (w[1] - w[2]), dry[BEARING],
                 found[T_1] * w[3] - found[T_2] * w[3] / RATIO, *dry[CLUTCH:]]  # fmt: skip
        return np.concatenate([found[A], w, heats])

    def guards(self, y: Vector, modes: Modes, flank: tuple[float, str], t: float) -> Iterator[tuple[str, Any, Callable[..., float]]]:
        side, law = flank
        for k, mode in enumerate(modes):
            if mode != 0:
                yield "stop", k, lambda t, y, k=k, mode=mode: mode * self.slips(y[:6])[k]
        for k in self.margins(t, self.solve(t, y, modes, flank), modes):
            yield "break", k, lambda t, y, k=k: self.margins(t, self.solve(t, y, modes, flank), modes)[k]
        if law == "gap":  # a flank pushes where it is pressed and the damper does not outweigh the spring
            for s in (1.0, -1.0):
                yield ("hit", s, lambda t, y, s=s: -min(s * (y[7] - y[8]) - HALF, s * sum(self.flank_torques(y, s)) / FLANK))
            return
        yield ("part", 0, lambda t, y: side * (sum(self.flank_torques(y, side)) if law == "both" else self.flank_torques(y, side)[0]))
        way = 1.0 if law == "both" else -1.0
        yield "limit", 0, lambda t, y: way * side * (self.flank_torques(y, side)[0] - self.flank_torques(y, side)[1])  # fmt: skip

    def run(self, times: Vector) -> tuple[Vector, int]:
        """States at the times, and the number of events."""
        y, t, flank, broken, events = np.zeros(20), 0.0, (1.0, "gap"), dict[int, int](), 0
        out = np.zeros((len(times), 20))
        while t < times[-1]:
            modes = self.choose(t, y, flank, broken)
            guards = list(self.guards(y, modes, flank, t))
            part = solve_ivp(
                self.rates, (t, times[-1]), y, "DOP853", dense_output=True, args=(modes, flank), max_step=4e-4,
                events=_terminal(guards), **TIGHT
            )  # fmt: skip
            inside = (times >= t) & (times <= part.t[-1])
            if inside.any():
                out[inside] = part.sol(times[inside]).T
            t, y, broken, events = float(part.t[-1]), part.y[:, -1].copy(), {}, events + 1
            keep_stuck(y, modes)
            for (kind, k, _), instants in zip(guards, part.t_events, strict=True):
                if not len(instants):
                    continue
                if kind == "stop":
                    keep_stuck(y, tuple(0 if c == k else 1 for c in range(5)))
                elif kind == "break":
                    broken |= self.broken(self.solve(t, y, modes, flank), modes, k)
                else:
                    flank = self.next_flank(y, flank, kind, k)
        return out, events

    @staticmethod
    def broken(found: Vector, modes: Modes, k: int) -> dict[int, int]:
        if k == GEAR and modes[1:] == (0, 0, 0, 0):
            return {GEAR: 1, BRAKE: 1} if found[T_1] > 0.0 else {GEAR: -1, ONE_WAY: -1}
        if k == GEAR:
            forward = taken(found[T_2], 0.0, 1) - found[T_1] < found[T_1] - taken(found[T_2], 0.0, -1)
            return {GEAR: 1 if forward else -1}
        return {k: -1 if k == ONE_WAY else 1 if found[(T_B, T_1, T_2, T_O, T_K)[k]] > 0.0 else -1}

    def next_flank(self, y: Vector, flank: tuple[float, str], kind: str, k: float) -> tuple[float, str]:
        if kind == "part":
            return 1.0, "gap"
        if kind == "limit":
            return flank[0], "doubled" if flank[1] == "both" else "both"
        spring, damper = self.flank_torques(y, k)
        return k, "doubled" if k * damper > k * spring else "both"


def _terminal(guards: list[tuple[str, Any, Callable[..., float]]]) -> list[Any]:
    """The guards with the arguments of the equations."""
    made = []
    for _, _, guard in guards:
        event: Any = lambda t, y, *_, guard=guard: guard(t, y)  # noqa: E731
        event.terminal, event.direction = True, -1
        made.append(event)
    return made


def keep_stuck(y: Vector, modes: Modes) -> None:
    """Speeds without what integration has added where a contact is stuck."""
    for contact, shaft in ((BEARING, 2), (GEAR, 3), (BRAKE, 5)):
        if modes[contact] == 0:
            y[shaft] = 0.0
    if modes[CLUTCH] == 0:
        y[4] = y[3] / RATIO
    if modes[ONE_WAY] == 0:
        shafts = (5, 4) if modes[BRAKE] != 0 else (4, 5)
        y[shafts[0]] = y[shafts[1]]


def loss_map(loads: int, speeds: int) -> dict[str, Any]:
    """The lossy gear by triangles over the torque up to 60 N m and the speed up to 1 rad/s."""
    rows = sorted({*np.linspace(-1.0, 1.0, 2 * loads + 1).tolist(), -2.05 / 60.0, -2.1 / 60.0})
    columns = [k / speeds for k in range(speeds + 1)]
    values = [[RATIO * taken(60.0 * mu, v, 1) / 60.0 - mu for v in columns] for mu in rows]
    return {"kind": "map", "loads": rows, "speeds": columns, "values": values}


def heat_losses(loads: int, speeds: int) -> lm.Scenario:
    shafts: dict[str, Any] = {f"inertia{k}": {"inertia": J} for k in range(1, 7)} | {"gear_output": {}}
    shafts["inertia1"] |= {"viscous_friction": 10.0, "torque": {"amplitude": 20.0, "frequency": 5.0, "phase": math.pi}}
    shafts["inertia3"] |= {"friction_torque": 1.0}
    rigid = {"ratio": RATIO, "stiffness": {"kind": "rigid"}, "rated_input_speed": 1.0, "rated_output_torque": 60.0}
    spring = {"ratio": 1.0, "stiffness": {"kind": "linear", "stiffness": SPRING}}
    flanks = {"kind": "curve", "backlash": 2.0 * HALF, "slopes": [FLANK]}
    pressed = {"amplitude": 1.0, "frequency": 0.2}
    return lm.Scenario(
        shafts=shafts,
        gears={
            "spring_damper": {"input": "inertia1", "output": "inertia2", **spring, "mesh_damping": DAMPING},
            "backlash": {"input": "inertia2", "output": "inertia3", "ratio": 1.0, "stiffness": flanks,
                         "mesh_damping": FLANK_DAMPING, "damping_limited": True},
            "spring": {"input": "inertia3", "output": "inertia4", **spring},
            "gear": {"input": "inertia4", "output": "gear_output", **rigid, "losses": loss_map(loads, speeds)},
        },
        clutches={
            "clutch": {"input": "gear_output", "output": "inertia5", "torque": 5.0},
            "one_way": {"input": "inertia5", "output": "inertia6", "torque": 0.5},
        },
        freewheels={"freewheel": {"input": "inertia5", "output": "inertia6"}},
        brakes={"brake": {"shaft": "inertia6", "torque": 1.0}},
        command={"clutch": pressed, "one_way": pressed, "brake": pressed},
        simulation={"duration": 1.0, "sample_interval": 1e-3},
    )  # fmt: skip


@pytest.mark.slow  # the reference evaluates its equations a million times
def test_heat_losses() -> None:
    """All eight losses. The gear's efficiency falls with the speed, which the loss map follows by triangles: with twice as many in both
    directions the speeds come four times as near.

    Where flanks part before the spring has relaxed, its energy counts as heat here and is in no loss of the library.
    """
    expected, events = HeatLosses().run(LAST_TIMES)
    assert events > 60
    errors = []
    for loads, speeds in ((10, 5), (20, 10), (40, 20)):
        result = lm.simulate(heat_losses(loads, speeds))
        found = np.array([result[f"inertia{k}_speed"].values for k in range(1, 7)]).T
        errors.append(float(np.abs(found - expected[:, :6]).max()))
        ledger = lm.energy_of(result)
        assert abs(ledger["residual"]) < 1e-12
    assert errors[0] < 1e-3
    assert errors[2] < 6e-5
    assert errors[0] > 2.5 * errors[1] > 6.0 * errors[2]
    heats = np.array([ledger[name] for name in HEATS])
    assert heats == pytest.approx(expected[-1, 12:], rel=5e-4)


# --- eddy-current brake ---
PEAK, CRITICAL, COPPER = 100.0, 10.0, 3.920e-3  # N m, rad/s, 1/K


def brake_reference(times: Vector) -> tuple[Vector, Vector]:
    """Speed and heat: J = 1, heat capacity 1 J/K, the critical speed rises with the temperature, excitation from 0.1 to 0.2 s."""

    def rates(t: float, y: Vector) -> list[float]:
        s = y[0] / (CRITICAL * (1.0 + COPPER * y[1]))
        torque = 2.0 * PEAK * min(max(10.0 * (t - 0.1), 0.0), 1.0) ** 2 * s / (1.0 + s * s)
        return [-torque, torque * y[0]]

    y, found = np.array([20.0, 0.0]), [np.array([[20.0], [0.0]])]
    for begin, end in ((0.0, 0.1), (0.1, 0.2), (0.2, 1.0)):
        inside = times[(times > begin) & (times <= end + 1e-12)]
        part = solve_ivp(rates, (begin, end), y, "DOP853", t_eval=inside, rtol=1e-12, atol=1e-12)
        found.append(part.y)
        y = part.y[:, -1]
    speed, heat = np.concatenate(found, axis=1)
    return speed, heat


def brake_steps(step: float) -> tuple[Vector, float]:
    """Speeds at the ends of steps in which excitation and temperature stay what they are in the middle, and the heat."""
    w, heat, speeds = 20.0, 0.0, [20.0]
    for k in range(round(1.0 / step)):
        peak = PEAK * min(max(10.0 * ((k + 0.5) * step - 0.1), 0.0), 1.0) ** 2
        critical = CRITICAL * (1.0 + COPPER * heat)
        s = w / critical
        half = 0.5 * step * 2.0 * peak * s / (1.0 + s * s) * w  # heat until the middle of the step, by its begin
        drag: dict[str, Any] = {"kind": "eddy_current", "peak_torque": peak, "error": 5e-4 * peak, "max_speed": 21.0}
        drag["critical_speed"] = CRITICAL * (1.0 + COPPER * (heat + half))
        result = lm.simulate(
            lm.Scenario(
                shafts={"disc": {"inertia": 1.0, "torque": 0.0, "drag": drag if peak > 0.0 else None}},
                initial={"speeds": {"disc": w}},
                simulation={"duration": step, "sample_interval": step},
            )
        )
        heat -= lm.energy_of(result)["stored_change"]
        w = float(result["disc_speed"][-1])
        speeds.append(w)
    return np.array(speeds), heat


def test_eddy_current_brake_in_steps() -> None:
    """Excitation and temperature are held over steps. The error falls with the square of the step; the straight lines leave the rest."""
    errors = []
    for step in (0.05, 0.025, 0.0125):
        times = np.arange(round(1.0 / step) + 1) * step
        expected, heat = brake_reference(times)
        found, heated = brake_steps(step)
        errors.append(float(np.abs(found - expected).max()))
        assert heated == pytest.approx(0.5 * (400.0 - found[-1] ** 2), rel=1e-12)
    assert errors[2] < 0.02
    assert errors[0] > 3.0 * errors[1] > 9.0 * errors[2]
    assert heated == pytest.approx(heat[-1], rel=1e-6)


def test_eddy_current_brake_at_full_excitation() -> None:
    """At its reference temperature, with s = w/w_c, ln(s0/s) + (s0^2 - s^2)/2 = 2 T t/(J w_c); finer straight lines come nearer."""
    errors = []
    for error in (0.4, 0.1, 0.03):
        drag = {"kind": "eddy_current", "peak_torque": PEAK, "critical_speed": CRITICAL, "max_speed": 20.0, "error": error}
        result = lm.simulate(
            lm.Scenario(
                shafts={"disc": {"inertia": 1.0, "torque": 0.0, "drag": drag}},
                initial={"speeds": {"disc": 20.0}},
                simulation={"duration": 0.6, "sample_interval": 0.01},
            )
        )
        s = result["disc_speed"].values / CRITICAL
        t = (np.log(2.0 / s) + 0.5 * (4.0 - s * s)) * CRITICAL / (2.0 * PEAK)
        errors.append(float(np.abs(t - result["time"].values).max()))
    assert errors[0] > 2.0 * errors[1] > 4.0 * errors[2]
    assert errors[2] < 2e-3
    slopes = np.diff(result["disc_speed"].values)
    assert np.argmin(slopes) == pytest.approx(np.argmin(np.abs(s - 1.0)), abs=1)  # brakes most at the critical speed


def test_an_error_that_takes_too_many_straight_lines_is_refused_with_its_key() -> None:
    drag = {"kind": "eddy_current", "peak_torque": PEAK, "critical_speed": CRITICAL, "max_speed": 20.0, "error": 1e-3}
    refused(
        lambda: lm.Scenario(
            shafts={"disc": {"inertia": 1.0, "torque": 0.0, "drag": drag}}, simulation={"duration": 1.0, "sample_interval": 0.1}
        ),
        "shafts.disc.drag",
    )

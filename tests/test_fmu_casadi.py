"""FMUs in CasADi: rates and exact Jacobians at any point are those of the linear model there; the example against its closed form."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from test_examples import example
from test_fmu import pytestmark

ca: Any = pytest.importorskip("casadi", reason="CasADi is missing: .venv/bin/pip install --group examples")
__all__ = ["pytestmark"]


class Rates:
    """The rates of an FMU over states and inputs, and their Jacobians."""

    def __init__(self, scenario: Any, path: Path, fmi: int) -> None:
        lm.export_fmu(scenario, path, fmi=fmi)
        self.model = ca.DaeBuilder(path.stem, str(path))
        self.rates = self.model.create("f", ["x", "u"], ["ode"])
        self.jacobians = self.model.create("J", ["x", "u"], ["jac_ode_x", "jac_ode_u"])
        self.states = [n.removeprefix("state.") for n in self.model.x()]
        self.inputs = [n for n in self.model.u() if not n.startswith("der(")]
        self.all_inputs = self.model.u()

    def at(self, states: dict[str, float], inputs: dict[str, float]) -> list[np.ndarray]:
        x, u = [states.get(n, 0.0) for n in self.states], [inputs.get(n, 0.0) for n in self.all_inputs]
        dx, du = self.jacobians(x, u)
        return [np.array(self.rates(x, u)).ravel(), np.array(dx), np.array(du)[:, [self.all_inputs.index(n) for n in self.inputs]]]


def expected(model: Rates, linear: lm.response.LinearModel) -> list[np.ndarray]:
    """The same of a linear model, in the order of the FMU."""
    x = [linear.states.index(n) for n in model.states]
    u = [linear.inputs.index(n) for n in model.inputs]
    point = np.array([linear.point[n] for n in linear.states]), np.array([linear.point[n] for n in linear.inputs])
    rates = linear.A @ point[0] + linear.B @ point[1] + linear.rate
    return [rates[x], linear.A[np.ix_(x, x)], linear.B[np.ix_(x, u)]]


POINTS = {
    "driven forward": ({"motor_speed": 20.0, "load_speed": 0.2, "twist": 2e-4, "motor_torque": 0.1}, 0.3, 1.0, 1),
    "overrun backward": ({"motor_speed": -30.0, "load_speed": -0.3, "twist": 3e-4}, -0.1, -2.0, -1),
    "stuck": ({}, 0.001, 0.0, 0),
    "stuck under load": ({"twist": 1e-5, "load_speed": 0.01}, 0.0, 0.0, 0),
}


@pytest.mark.parametrize("fmi", [2, 3])
def test_rates_and_jacobians_of_a_drive_are_those_of_the_linear_model(fmi: int, tmp_path: Path) -> None:
    """Point after point, there and back: what was asked for before changes nothing."""
    scenario = lm.load("paper-2dof-nl-small")
    model = Rates(scenario, tmp_path / f"drive{fmi}.fmu", fmi)
    for name in (*POINTS, *reversed(POINTS)):
        states, command, torque, contact = POINTS[name]
        linear = lm.linearize(scenario, lm.Initial(**states), command=command, load_torque=torque)
        assert linear.contacts["input_contact"] == contact, name
        told = model.at(states, {"command": command, "load_torque": torque})
        for got, wanted in zip(told, expected(model, linear), strict=True):
            assert np.all(np.abs(got - wanted) <= 1e-12 * np.max(np.abs(wanted), initial=1e-30)), name


def test_rates_and_jacobians_of_a_train_are_those_of_the_linear_model(tmp_path: Path) -> None:
    scenario = lm.load("belt-before-gearbox")
    model = Rates(scenario, tmp_path / "train.fmu", 2)
    for speed, command in ((10.0, 0.2), (-5.0, 0.0)):
        states = {n: speed / (50.0 if n.startswith("joint") else 1.0) for n in model.states if n.endswith("_speed")}
        initial = lm.TrainInitial(speeds={n.removesuffix("_speed"): v for n, v in states.items()})
        linear = lm.linearize(scenario, initial, inputs={"servo_command": command})
        told = model.at(states, {"servo_command": command})
        assert np.any(told[1])
        for got, wanted in zip(told, expected(model, linear), strict=True):
            assert np.all(np.abs(got - wanted) <= 1e-12 * np.max(np.abs(wanted), initial=1e-30))


def test_start_values_are_the_state_of_the_scenario(tmp_path: Path) -> None:
    states = {"motor_speed": 20.0, "load_speed": 0.2, "twist": 2e-4}
    scenario = lm.load("paper-2dof-nl-small", [f"initial.{name}={value}" for name, value in states.items()])
    for fmi in (2, 3):
        model = Rates(scenario, tmp_path / f"drive{fmi}.fmu", fmi)
        start = {n: float(np.ravel(model.model.start(f"state.{n}"))[0]) for n in model.states}
        assert start == {n: states.get(n, 0.0) for n in model.states}
        rates = model.at(start, {})[0]
        assert rates[model.states.index("load_angle")] == 0.2
        assert rates[model.states.index("twist")] == pytest.approx(20.0 / scenario.gearbox.ratio - 0.2, rel=1e-12)


def test_derivatives_by_parameters_are_refused_with_their_key(monkeypatch: Any, tmp_path: Path, capfd: Any) -> None:
    monkeypatch.undo()
    lm.export_fmu(lm.load("lossy-rigid-gear"), tmp_path / "drive.fmu")
    model = ca.DaeBuilder("drive", str(tmp_path / "drive.fmu"))
    rates = model.create("f", ["x", "u", "p"], ["ode"])
    sizes = [rates.size1_in(k) for k in range(3)]
    start = [float(np.ravel(model.start(n))[0]) for n in model.p()]
    with pytest.raises(RuntimeError):
        rates.jacobian()(ca.DM.zeros(sizes[0]), ca.DM.zeros(sizes[1]), start, ca.DM.zeros(sizes[0]))
    assert "by inputs and states alone, not by the parameter motor.rotor_inertia" in capfd.readouterr().out


def test_the_rest_to_rest_example_finds_the_least_squares_of_the_closed_form(monkeypatch: Any) -> None:
    """A rigid gearbox without losses but dry friction: two linear conditions on the commands, the least norm by linear algebra."""
    module = example("casadi_rest_to_rest")
    monkeypatch.setattr(module, "INTERVALS", 10)
    scenario = module.DRIVE.replace(**{"gears.gearbox.stiffness": {"kind": "rigid"}, "shafts.table.viscous_friction": 0.0})
    found = module.optimal_commands(scenario, 0.5, 0.4)
    inertia, friction, h = 1e-4 + 0.5 / 50.0**2, 0.1, 0.04
    # Speeds rise by (u - friction) h / inertia in each interval; the angle of the motor is 25 rad at the end, its speed 0.
    conditions = np.array([np.ones(10), h * (10 - np.arange(10) - 0.5)]) * h / inertia
    wanted = np.linalg.lstsq(conditions, conditions @ np.full(10, friction) + [0.0, 0.5 * 50.0], rcond=None)[0]
    # Both fulfil the conditions, so that the sum of squares exceeds the least one by |found - wanted|^2: the quasi-Newton
    # method ends where that is 1e-8 of it.
    assert np.linalg.norm(conditions @ (found - wanted)) < 1e-9
    assert np.linalg.norm(found - wanted) < 1e-4 * np.linalg.norm(wanted)
    run = lm.simulate(scenario.replace(command={"motor": module.held(found, 0.4)}))
    assert float(run["table_angle"][-1]) == pytest.approx(0.5, rel=1e-5)
    assert abs(float(run["table_speed"][-1])) < 1e-4 * float(run["table_speed"].max())

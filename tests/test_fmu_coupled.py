"""A drive of ours and an FMU of another tool, coupled by a third tool: a controller against the closed loop in the core, a pendulum
against the equations of both."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import lostmotion as lm
import pendulum_fmu as joint
import speed_controller as law
from tables import gear_between, run_of

NANOSECOND = 1e-9
DURATION = 1.0


def closed_loop() -> lm.Scenario:
    """The drive of the paper, without the windings of its motor, under the loops of speed_controller.py."""
    scenario = lm.load("paper-2dof-nl-small")
    assert isinstance(scenario, lm.Scenario)
    motor = {"kind": "torque_source", "rotor_inertia": 8.0e-5, "rated_torque": law.RATED_TORQUE, "friction_torque": 0.02}
    controller = {
        "sample_time": law.SAMPLE_TIME,
        "delay": 1,
        "encoder": {"ideal": True},
        "reference": {"kind": "position", "amplitude": law.AMPLITUDE, "frequency": law.FREQUENCY},
        "position": {"gain": law.POSITION_GAIN, "feedforward": 1.0},
        "speed": {"gain": law.SPEED_GAIN, "integral_gain": law.INTEGRAL_GAIN, "torque_limit": law.TORQUE_LIMIT},
        "current": {"kind": "ideal"},
    }
    simulation = {"duration": DURATION, "sample_interval": law.SAMPLE_TIME}
    return scenario.replace(motor=motor, controller=controller, command={}, simulation=simulation)


Connection = tuple[int, str, int, str]


def coupled(
    fmus: Sequence[Path], connections: Sequence[Connection], names: Sequence[str], step: float, steps: int
) -> dict[str, np.ndarray]:
    """FMUs under libcosim: what one gives at the end of a step the others have in the next one. Variables of the first FMU."""
    from libcosimpy.CosimEnums import CosimVariableType
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    log_output_level(CosimLogLevel.WARNING)
    execution = CosimExecution.from_step_size(step_size=round(step / NANOSECOND))
    slaves = [execution.add_local_slave(CosimLocalSlave(str(path), path.stem)) for path in fmus]
    references: list[dict[str, int]] = [
        {v.name.decode(): v.reference for v in execution.slave_variables(slave_index=index)} for index in slaves
    ]
    for source, output, target, name in connections:
        failed = execution.connect_real_variables(slaves[source], references[source][output], slaves[target], references[target][name])
        assert not failed
    observer = CosimObserver.create_time_series(buffer_size=steps + 1)
    assert execution.add_observer(observer=observer)
    for name in names:
        assert observer.start_time_series(slave_index=slaves[0], value_reference=references[0][name], variable_type=CosimVariableType.REAL)
    assert execution.step(step_count=steps)
    out = {}
    for name in names:
        _, _, values = observer.time_series_real_samples(
            slave_index=slaves[0], value_reference=references[0][name], from_step=1, sample_count=steps
        )
        out[name] = np.array(values)
    return out


@pytest.fixture
def builder() -> Any:
    pytest.importorskip("libcosimpy", reason="libcosimpy is missing: .venv/bin/pip install --group portable")
    found: Any = pytest.importorskip("pythonfmu.builder", reason="pythonfmu is missing: .venv/bin/pip install --group portable")
    return found.FmuBuilder


def test_a_drive_and_a_controller_of_another_tool_move_as_in_the_core(tmp_path: Path, builder: Any) -> None:
    scenario = closed_loop()
    lm.export_fmu(scenario, tmp_path / "drive.fmu", controllers=False)
    controller = builder.build_FMU(law.__file__, dest=tmp_path)
    found = coupled(
        [tmp_path / "drive.fmu", Path(controller)],
        # what an encoder on the motor shows
        [(0, "load_angle", 1, "load_angle"), (0, "twist", 1, "twist"), (1, "command", 0, "command")],
        ("motor_speed", "load_angle", "twist"),
        law.SAMPLE_TIME,
        round(DURATION / law.SAMPLE_TIME),
    )
    expected = lm.simulate(scenario)
    assert float(abs(expected["output_torque"]).max()) > 1.0
    for name, values in found.items():
        exact = expected[name].values[1:]
        assert len(values) == len(exact)
        assert np.abs(values - exact).max() <= 1e-12 * np.abs(exact).max(), name


def test_a_drive_in_the_joint_of_a_pendulum_converges_to_the_equations_of_both(tmp_path: Path, builder: Any) -> None:
    """The drive is an actuator of another tool: it has the motion of its output shaft as inputs and returns the torque."""
    motor, flange, ratio, stiffness, damping, torque = 1e-4, 0.02, 50.0, 2000.0, 2.0, 0.2
    scenario = lm.Scenario(
        shafts={"motor": {"inertia": motor, "torque": -torque}, "joint": {"inertia": flange}},
        gears={"gear": gear_between("motor", "joint", ratio, stiffness, mesh_damping=damping)},
        simulation=run_of(DURATION, 1e-3),
    )
    lm.export_fmu(scenario, tmp_path / "drive.fmu", motion_inputs=["joint"])
    pendulum = builder.build_FMU(joint.__file__, dest=tmp_path)

    def rates(_: float, y: np.ndarray) -> list[float]:
        shaft, shaft_speed, angle, speed = y
        mesh = stiffness * (shaft / ratio - angle) + damping * (shaft_speed / ratio - speed)
        forces = -joint.WEIGHT * math.sin(angle) + mesh
        return [shaft_speed, (torque - mesh / ratio) / motor, speed, forces / (joint.INERTIA + flange)]

    exact = solve_ivp(rates, (0.0, DURATION), np.zeros(4), method="DOP853", rtol=1e-12, atol=1e-12).y
    errors = []
    for step in (2e-4, 1e-4):
        found = coupled(
            [tmp_path / "drive.fmu", Path(pendulum)],
            [*((1, name, 0, f"joint_given_{name}") for name in ("angle", "speed", "acceleration")), (0, "joint_drive_torque", 1, "torque")],
            ("joint_angle", "motor_speed"),
            step,
            round(DURATION / step),
        )
        errors.append(abs(found["joint_angle"][-1] - exact[2, -1]))
        assert abs(found["motor_speed"][-1] - exact[1, -1]) < 0.02 * np.abs(exact[1]).max()
    assert abs(exact[2, -1]) > 0.1
    assert errors[0] < 0.01 * abs(exact[2, -1])
    assert errors[1] == pytest.approx(errors[0] / 2.0, rel=0.1)  # of first order: values are held over a step

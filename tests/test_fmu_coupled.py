"""Two FMUs, a drive of ours and a controller of another tool, coupled by a third tool, against the closed loop in the core."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
import speed_controller as law

NANOSECOND = 1e-9
DURATION = 1.0


def closed_loop() -> lm.Scenario:
    """The drive of the paper, without the windings of its motor, under the loops of speed_controller.py."""
    scenario = lm.load("paper-2dof-nl-small")
    assert isinstance(scenario, lm.Scenario)
    motor = {
        "kind": "torque_source",
        "rotor_inertia": 8.0e-5,
        "rated_torque": law.RATED_TORQUE,
        "friction_torque": 0.02,
    }
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


def coupled(drive: Path, controller: Path) -> dict[str, np.ndarray]:
    """Both under libcosim: what one gives at the end of a step the other has in the next one."""
    from libcosimpy.CosimEnums import CosimVariableType
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    log_output_level(CosimLogLevel.WARNING)
    execution = CosimExecution.from_step_size(step_size=round(law.SAMPLE_TIME / NANOSECOND))
    slaves = [execution.add_local_slave(CosimLocalSlave(str(path), path.stem)) for path in (drive, controller)]
    references: list[dict[str, int]] = [
        {v.name.decode(): v.reference for v in execution.slave_variables(slave_index=index)} for index in slaves
    ]

    def connect(source: int, output: str, target: int, name: str) -> None:
        failed = execution.connect_real_variables(
            slaves[source], references[source][output], slaves[target], references[target][name]
        )
        assert not failed

    for name in ("load_angle", "twist"):  # what an encoder on the motor shows
        connect(0, name, 1, name)
    connect(1, "command", 0, "command")
    steps = round(DURATION / law.SAMPLE_TIME)
    observer = CosimObserver.create_time_series(buffer_size=steps + 1)
    assert execution.add_observer(observer=observer)
    names = ("motor_speed", "load_angle", "twist")
    for name in names:
        assert observer.start_time_series(
            slave_index=slaves[0], value_reference=references[0][name], variable_type=CosimVariableType.REAL
        )
    assert execution.step(step_count=steps)
    out = {}
    for name in names:
        _, _, values = observer.time_series_real_samples(
            slave_index=slaves[0], value_reference=references[0][name], from_step=1, sample_count=steps
        )
        out[name] = np.array(values)
    return out


def test_a_drive_and_a_controller_of_another_tool_move_as_in_the_core(tmp_path: Path) -> None:
    pytest.importorskip("libcosimpy", reason="libcosimpy is missing: .venv/bin/pip install --group portable")
    builder: Any = pytest.importorskip(
        "pythonfmu.builder", reason="pythonfmu is missing: .venv/bin/pip install --group portable"
    )
    scenario = closed_loop()
    lm.export_fmu(scenario, tmp_path / "drive.fmu", controllers=False)
    controller = builder.FmuBuilder.build_FMU(law.__file__, dest=tmp_path)
    found = coupled(tmp_path / "drive.fmu", Path(controller))
    expected = lm.simulate(scenario)
    assert float(abs(expected["output_torque"]).max()) > 1.0
    for name, values in found.items():
        exact = expected[name].values[1:]
        assert len(values) == len(exact)
        assert np.abs(values - exact).max() <= 1e-12 * np.abs(exact).max(), name

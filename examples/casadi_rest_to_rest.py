"""The command that moves a geared load from rest to rest with the least heat in the motor, found by CasADi.

The drive has dry friction and a compliant gearbox. CasADi takes its equations and their exact derivatives from the FMU; direct
collocation at Gauss points, which lie between the instants at rest, where friction may hold.
"""

import tempfile
from pathlib import Path

import casadi as ca
import numpy as np

import lostmotion as lm

ANGLE, DURATION, INTERVALS, DEGREE = 0.5, 0.4, 40, 3  # [rad], [s], commands, collocation points in each interval

DRIVE = lm.Scenario(
    title="A torque motor, a compliant gearbox and a table",
    shafts={"rotor": {"friction_torque": 0.1}, "table": {"inertia": 0.5, "viscous_friction": 1.0}},
    motors={"motor": {"shaft": "rotor", "kind": "torque_source", "rotor_inertia": 1e-4, "rated_torque": 1.0}},
    gears={
        "gearbox": {"input": "rotor", "output": "table", "ratio": 50.0, "stiffness": {"kind": "curve", "slopes": [5e3]}}
    },
    command={
        "motor": {"steps": [{"time": 0.0, "height": 0.5}, {"time": 0.2, "height": -0.8}]}
    },  # as great as it may be
    simulation={"duration": DURATION, "sample_interval": 1e-3},
)


def optimal_commands(scenario: lm.Scenario, angle: float, duration: float) -> np.ndarray:
    """Constant commands over equal intervals, whose sum of squares is least."""
    with tempfile.TemporaryDirectory() as folder:
        lm.export_fmu(scenario, Path(folder) / "drive.fmu")
        model = ca.DaeBuilder("drive", str(Path(folder) / "drive.fmu"))
        rates = model.create("rates", ["x", "u"], ["ode"])
        names = [name.removeprefix("state.") for name in model.x()]
        scale = np.array([model.nominal(name) for name in model.x()])
        end = angle * np.array([name == "table_angle" for name in names])
        interval = duration / INTERVALS
        opti = ca.Opti()
        commands = opti.variable(INTERVALS)
        slopes, at_end, _ = ca.collocation_coeff(ca.collocation_points(DEGREE, "legendre"))
        x = ca.DM(np.zeros(len(names)))
        for k in range(INTERVALS):
            inside = opti.variable(len(names), DEGREE)
            points = ca.horzcat(x / scale, inside)
            forced = [rates(scale * inside[:, j], commands[k]) for j in range(DEGREE)]
            opti.subject_to(ca.vec(points @ slopes - interval * ca.horzcat(*forced) / scale) == 0.0)
            opti.subject_to(inside[names.index("rotor_speed"), :] >= 0.0)  # the motor does not turn back
            opti.set_initial(inside, np.outer(end / scale, np.ones(DEGREE)) * k / INTERVALS + 0.1)
            x = scale * (points @ at_end)
        opti.subject_to(x / scale == end / scale)
        opti.minimize(ca.sumsqr(commands))
        quiet = {"print_level": 0, "sb": "yes", "tol": 1e-10}
        opti.solver("ipopt", {"print_time": False}, quiet | {"hessian_approximation": "limited-memory"})
        return np.array(opti.solve().value(commands))


def held(commands: np.ndarray, duration: float) -> dict[str, object]:
    """The commands as a signal of a scenario."""
    times = np.arange(len(commands)) * duration / len(commands)
    heights = np.diff(commands, prepend=0.0)
    return {"steps": [{"time": float(t), "height": float(h)} for t, h in zip(times, heights, strict=True)]}


if __name__ == "__main__":
    found = optimal_commands(DRIVE, ANGLE, DURATION)
    run = lm.simulate(DRIVE.replace(command={"motor": held(found, DURATION)}))
    print(f"mean square of the command {np.mean(found**2):.6f}, greatest command {np.abs(found).max():.4f}")
    for name in ("table_angle", "table_speed", "rotor_speed", "gearbox_twist"):
        print(f"{name:>12} at the end of the exact run: {float(run[name][-1]):.3g}")

"""A controller of one's own at full speed: a numba function as the law of an axis, beside the same law in Python.

Position loop, speed loop and a dead zone of one encoder step at the load, at 8 kHz on the motor's torque.
"""

import math
import time

from numba import cfunc, types

import lostmotion as lm

RATIO, RATED_TORQUE = 90.0, 0.521  # [-], [N m]
K_V, K_P, K_I, STEP = 10.0, 8.29e-3, 0.1266, 2.0 * math.pi / 8192.0 / RATIO

number = types.CPointer(types.float64)


@cfunc(types.intc(types.float64, number, number, number, number, types.voidptr))
def compiled(_time, measured, reference, state, command, _data):
    error = reference[0] - measured[0]
    wanted = RATIO * ((0.0 if abs(error) < STEP else K_V * error) + reference[1])
    off = wanted - measured[1]
    command[0] = (K_P * off + state[0]) / RATED_TORQUE
    state[0] += 125e-6 * K_I * off
    return 0


def in_python(_time, measured, reference, state):
    error = reference[0] - measured[0]
    wanted = RATIO * ((0.0 if abs(error) < STEP else K_V * error) + reference[1])
    off = wanted - measured[1]
    command = (K_P * off + state[0]) / RATED_TORQUE
    state[0] += 125e-6 * K_I * off
    return command


def axis() -> lm.Scenario:
    """The shipped axis with a law in place of its loops."""
    shipped = lm.load("position-axis")
    controller = shipped.controller.model_dump(exclude_none=True)
    for loop in ("position", "speed", "feedforward"):
        del controller[loop]
    return shipped.replace(controller={**controller, "law": True, "current": {"kind": "ideal"}})


def run(law) -> tuple[float, float]:
    """Peak error [rad] and the time that the run took [s]."""
    scenario = axis()
    begin = time.perf_counter()
    result = lm.simulate(scenario, law=lm.control.Law(law, states=1), energy=False)
    took = time.perf_counter() - begin
    return float(abs(result["position_reference"] - result["load_angle"]).max()), took


if __name__ == "__main__":
    run(compiled)  # what is done once
    for name, law in (("numba", compiled), ("Python", in_python)):
        error, took = run(law)
        print(f"{name:>6}: peak error {1e3 * error:.6f} mrad, 2.6 s of motion in {1e3 * took:.0f} ms")

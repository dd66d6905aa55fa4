"""Play, compliance and Coulomb friction by the procedure of the data's author, of the logs and of the drive identified from them."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import lostmotion as lm
from lostmotion.identification.rig.rig_runs import run_log

STEP = 5e-4  # [s] to which his analysis resamples
LARGE = 100  # ramps from this number on are those to the largest torque
TURN = 2 * np.pi
RATIO = 13.0


def play_and_compliance(tests: list[np.ndarray]) -> tuple[float, float]:
    """(play [deg], compliance [deg/(N·m)]) of tests at several angles of the output.

    Each test has the rows time [s], command [N·m], torque [N·m], position [deg] and number of the ramp. The ramps of a test are averaged
    over time, then the tests. The play is the distance between the positions at zero torque, on the way up and on the way down;
    the compliance is the mean slope of both ways beyond the play.
    """
    small, large = (_mean([mean_ramp(test, large=big) for test in tests]) for big in (False, True))
    up, down = _loading(small)
    low, high = small[2, up][0], small[2, down][0]
    up, down = _loading(large)
    rising, falling = large[:, up], large[:, down]
    rising, falling = rising[:, rising[2] > high], falling[:, falling[2] < low]
    slopes = [np.polyfit(way[1], way[2], 1)[0] for way in (rising, falling)]
    return float(high - low), float(np.mean(slopes))


def mean_ramp(test: np.ndarray, *, large: bool) -> np.ndarray:
    """(command, torque, position) over time, the mean of the ramps of a test; the position about its own mean."""
    return _mean(ramps(test, large=large))


def ramps(test: np.ndarray, *, large: bool) -> list[np.ndarray]:
    """(command, torque, position) of each ramp of a test, resampled."""
    found = []
    for number in np.unique(test[4]):
        if (number >= LARGE) == large:
            part = test[:, test[4] == number]
            time = np.arange(part[0, 0], part[0, -1], STEP)
            found.append(np.array([np.interp(time, part[0], row) for row in part[1:4]]))
    return found


def _mean(curves: list[np.ndarray]) -> np.ndarray:
    """Mean of several (command, torque, position), smoothed over 50 ms, the position about its mean."""
    length = min(curve.shape[1] for curve in curves)
    mean = np.mean([curve[:, :length] for curve in curves], axis=0)
    padded = np.pad(mean, ((0, 0), (50, 49)), mode="edge")
    smooth = np.array([np.convolve(row, np.full(100, 0.01), "valid") for row in padded])
    smooth[2] -= smooth[2].mean()
    return smooth


def _loading(curve: np.ndarray) -> tuple[slice, slice]:
    """From zero to the largest torque, and from zero to the least."""
    top, bottom = int(curve[0].argmax()), int(curve[0].argmin())
    zero = top + int(np.abs(curve[0, top:bottom]).argmin())
    return slice(0, top), slice(zero, bottom)


def coulomb_friction(scenario: lm.Scenario) -> float:
    """Mean torque [N·m] at the output while it turns freely with 0.05 to 0.45 turns per second, of both directions."""
    free = scenario.replace(
        **{
            "shafts.output.friction_torque": 0.0,
            "controllers.motor": {
                "sample_time": 1e-3,
                "encoder": {"ideal": True},
                "reference": {"kind": "speed", "amplitude": 0.6 * TURN * RATIO, "frequency": 0.04},
                "speed": {"gain": 0.02, "integral_time": 0.1, "torque_limit": 2.0},
                "current": {"kind": "ideal"},
            },
            "simulation.duration": 25.0,
            "simulation.sample_interval": 5e-3,
        }
    )
    run = lm.simulate(free, energy=False)
    speed, torque = run["output_speed"].values / TURN, RATIO * run["motor_torque"].values
    forward, back = ((sign * speed > 0.05) & (sign * speed < 0.45) for sign in (1, -1))
    return float(torque[forward].mean() - torque[back].mean()) / 2


def tests_of(result: lm.identification.IdentificationResult, *, simulated: bool) -> list[np.ndarray]:
    """The logs of an identification, with the position that was measured, or that of the identified drive under the same torque."""
    tests = []
    for log in result.logs:
        assert result.rig is not None
        run = run_log(result.rig, log, result.values_for(log.name), result.chosen)
        position = np.degrees((run if simulated else log.measured)["position"])
        command, torque, ramp = (log.log.values(name) for name in ("command", "torque", "ramp"))
        tests.append(np.array([log.time, command, torque, position, ramp]))
    return tests


if __name__ == "__main__":
    result = lm.identify(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).with_name("baseline.toml"))
    print(result)
    for what, simulated in (("measured", False), ("identified", True)):
        play, compliance = play_and_compliance(tests_of(result, simulated=simulated))
        print(f"{what:10}  play {play:.3f} deg, compliance {compliance:.3f} deg/(N m)")
    print(f"Coulomb friction of the identified drive {coulomb_friction(result.scenario):.2f} N m")

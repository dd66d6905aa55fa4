"""A filter designed with python-control in the speed loop of an axis: a notch at the resonance of its belt."""

import control
import numpy as np

import lostmotion as lm

AXIS = lm.load("position-axis-with-belt")
FREQUENCY, DEPTH, WIDTH = 150.0, 0.1, 0.7  # [Hz], damping of zeros and poles


def notch(sample_time: float) -> control.TransferFunction:
    """((s/w)^2 + 2 D_z s/w + 1)/((s/w)^2 + 2 D_n s/w + 1) by Tustin's rule, exact at w."""
    w = 2.0 * np.pi * FREQUENCY
    continuous = control.tf([1 / w**2, 2 * DEPTH / w, 1], [1 / w**2, 2 * WIDTH / w, 1])
    return control.sample_system(continuous, sample_time, method="tustin", prewarp_frequency=w)


def axis(*filters: object) -> lm.Scenario:
    """The axis with these filters of the torque."""
    return AXIS.replace(**{"controllers.servo.speed.torque_filters": filters})


def margins(scenario: lm.Scenario) -> tuple[float, float]:
    """Least phase margin [deg] and greatest sensitivity of the speed loop in all regimes of the gear."""
    rows = [row.margins for row in lm.commission(scenario).loops if row.loop == "speed"]
    return float(np.degrees(min(m.phase_margin for m in rows))), max(m.sensitivity_peak for m in rows)


if __name__ == "__main__":
    designed = lm.control.as_filter(notch(AXIS.controllers["servo"].sample_time))
    for name, scenario in (
        ("without a filter", axis()),
        ("filter of python-control", axis(designed)),
        ("notch of the scenario", AXIS),
    ):
        phase, peak = margins(scenario)
        print(f"{name:>24}: phase margin {phase:.3f} deg, sensitivity {peak:.4f}")

"""Wind as a torque: spectra and their integrals, what the samples have of them, and a load that is shaken by it."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.signal import periodogram
from scipy.special import gamma

import lostmotion as lm
from refusals import refused

ON_AREA: dict[str, Any] = {"speed": 12.0, "drag_coefficient": 1.3, "area": 2.0, "lever": 0.4, "duration": 100.0, "max_frequency": 4.0}
WINDS: dict[str, dict[str, Any]] = {
    "davenport": ON_AREA | {"kind": "davenport", "surface_drag": 0.008},
    "von_karman": ON_AREA | {"kind": "von_karman", "turbulence": 0.18, "length_scale": 90.0},
    "kaimal": ON_AREA | {"kind": "kaimal", "height": 15.0},
    "table": {
        "kind": "table", "frequencies": (0.02, 0.3, 5.0), "densities": ("3 N^2*m^2/Hz", 2.0, 0.01), "duration": 100.0, "max_frequency": 4.0,
    },
}  # fmt: skip
PER_GUST = 1.225 * 1.3 * 2.0 * 0.4 * 12.0
"""rho c A r V [N m s/m]: torque for a gust of 1 m/s"""


def wind(name: str, **change: Any) -> Any:
    return lm.TorqueSignal(wind=WINDS[name] | change).wind


def test_the_spectra_hold_the_variance_of_their_closed_forms() -> None:
    # Of (u*)^2 = K V^2 Davenport's has 6; Kaimal's 105/33 3/2; of sigma^2 von Karman's 4 sqrt(pi/70.8)/2 Gamma(1/3)/Gamma(5/6).
    wanted = {
        "davenport": 6.0 * 0.008 * 12.0**2,
        "kaimal": 105.0 / 22.0 * (0.4 * 12.0 / np.log(15.0 / 0.03)) ** 2,
        "von_karman": (0.18 * 12.0) ** 2 * 2.0 * np.sqrt(np.pi / 70.8) * gamma(1.0 / 3.0) / gamma(5.0 / 6.0),
    }
    for name, variance in wanted.items():
        w = wind(name)
        found = quad(lambda u: w.spectrum(np.array([np.exp(u)]))[0] * np.exp(u), -25.0, 40.0, limit=500)[0]  # noqa: B023
        assert found == pytest.approx(variance * PER_GUST**2, rel=1e-5), name


def test_a_table_is_a_power_law_between_its_points() -> None:
    w = wind("table")
    assert w.spectrum(np.array([0.02, 0.3, 5.0])) == pytest.approx([3.0, 2.0, 0.01])
    assert w.spectrum(np.array([np.sqrt(0.02 * 0.3)]))[0] == pytest.approx(np.sqrt(6.0))
    assert (w.spectrum(np.array([0.0199, 5.01])) == 0.0).all()


@pytest.mark.parametrize("name", WINDS)
def test_the_periodogram_of_a_run_is_the_spectrum(name: str) -> None:
    w = wind(name)
    time, torque = w.samples()
    step = time[1]
    r = lm.simulate(
        lm.Scenario(
            shafts={"dish": {"inertia": 40.0, "viscous_friction": 30.0, "torque": {"wind": WINDS[name]}}},
            simulation={"duration": 100.0, "sample_interval": step},
        ),
        energy=False,
    )
    given = r["dish_load_torque"].values
    np.testing.assert_allclose(given, torque, rtol=0.0, atol=1e-10 * np.abs(torque).max())
    f, density = periodogram(given[:-1], 1.0 / step)
    lines = w.lines()
    assert f[1 : lines.size + 1] == pytest.approx(lines)
    np.testing.assert_allclose(density[1 : lines.size + 1], w.spectrum(lines), rtol=1e-8, atol=1e-12)
    assert density[lines.size + 1 :].max() < 1e-12 * density.max()
    assert np.var(given[:-1]) == pytest.approx(w.spectrum(lines).sum() / 100.0, rel=1e-9)
    whole = quad(lambda x: w.spectrum(np.array([x]))[0], 0.5 / 100.0, lines[-1] + 0.5 / 100.0, limit=300)[0]
    assert np.var(given[:-1]) == pytest.approx(whole, rel=0.03)  # the midpoint rule where the spectrum is steepest
    mean = 0.0 if name == "table" else 0.5 * PER_GUST * 12.0
    assert given[:-1].mean() == pytest.approx(mean, abs=1e-9)


def test_a_load_is_shaken_as_its_frequency_response_says() -> None:
    # J w' + b w = -M: each line of the wind by 1/(b + i 2 pi f J), after the transient exp(-t b/J), b/J = 2 1/s.
    J, b, w = 15.0, 30.0, wind("von_karman")
    s = lm.Scenario(
        shafts={"dish": {"inertia": J, "viscous_friction": b, "torque": {"wind": WINDS["von_karman"]}}},
        simulation={"duration": 100.0, "sample_interval": 0.02},
    )
    speed = lm.simulate(s, energy=False)["dish_speed"].values[1000:]
    f = w.lines()
    variance = np.sum(w.spectrum(f) / 100.0 / (b**2 + (2.0 * np.pi * f * J) ** 2))
    assert np.var(speed) == pytest.approx(variance, rel=0.25)  # 80 of the 100 s that the slowest line takes
    time, torque = w.samples()
    phases = np.fft.rfft(torque[:-1])[1 : f.size + 1] / (0.5 * (time.size - 1))
    at = np.arange(1000, 5001) * 0.02
    steady = -np.real(np.exp(2j * np.pi * np.outer(at, f)) @ (phases / (b + 2j * np.pi * f * J))) - w.mean() / b
    # Chords between the points leave (pi/16)^2/2 of the fastest line, which hardly moves the load.
    assert np.abs(speed - steady).max() < 1e-3 * np.ptp(steady)


def test_a_seed_is_a_wind_and_a_longer_spectrum_keeps_its_phases() -> None:
    one, same, other = (wind("kaimal", seed=k).samples()[1] for k in (7, 7, 8))
    np.testing.assert_array_equal(one, same)
    assert abs(np.corrcoef(one, other)[0, 1]) < 0.5
    long = wind("kaimal", seed=7, max_frequency=8.0)
    assert np.fft.rfft(long.samples()[1][:-1])[3] * one.size / long.samples()[1].size == pytest.approx(np.fft.rfft(one[:-1])[3], rel=2e-3)


def test_a_wind_turns_around_with_its_signal() -> None:
    signal = lm.TorqueSignal(wind=WINDS["kaimal"], mean=2.0)
    forth, back = signal.breakpoint_list(), signal.mirrored().breakpoint_list()
    np.testing.assert_array_equal(np.array(forth) * [1.0, -1.0, -1.0], np.array(back))
    assert lm.TorqueSignal.model_validate_json(signal.model_dump_json()) == signal


@pytest.mark.parametrize(
    ("name", "change", "said"),
    [
        ("kaimal", {"roughness_length": 20.0}, "roughness_length"),
        ("kaimal", {"max_frequency": 1e4}, "more than"),
        ("kaimal", {"max_frequency": 1e-3}, "no line"),
        ("kaimal", {"kind": "breeze"}, "davenport"),
        ("table", {"densities": (1.0, 2.0)}, "as many of each"),
        ("table", {"frequencies": (0.1, 0.1, 1.0)}, "rise"),
        ("table", {"densities": ("1 N*m", 1.0, 1.0)}, "densities"),
        ("von_karman", {"turbulence": 1.5}, "turbulence"),
        ("davenport", {"area": "2 m"}, "area"),
    ],
)
def test_what_does_not_fit_is_refused(name: str, change: dict[str, Any], said: str) -> None:
    refused(lambda: wind(name, **change), match=said)

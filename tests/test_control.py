"""Sampled controllers: closed forms, independent recursions, published axes, and what must not change a run."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

import lostmotion as lm
from refusals import assert_file_refused, refused
from tables import MOTOR
from two_mass import A, B, T, two_mass


def scenario(**tables: Any) -> lm.Scenario:
    return lm.Scenario(**tables)


def torque_source(**changes: Any) -> dict[str, Any]:
    return {"shaft": "motor", "kind": "torque_source", "rotor_inertia": 0.0, "rated_torque": 1.0} | changes


# --- closed forms ---
def test_the_current_loop_overshoots_by_one_part_in_27() -> None:
    """g/(z (z - 1)) with g = 1/3 closed: c[k+2] = c[k+1] - (c[k] - r)/3, whose largest value is 28/27."""
    axis = scenario(
        shafts={"motor": {"inertia": 1e6}},  # stands
        motors={"m": {"shaft": "motor", "rotor_inertia": 0.0, "rated_torque": 0.5, "rated_speed": 300.0,
                      "electrical_time_constant": 1.3e-3, "armature_voltage_constant": 4.0}},
        controllers={"m": {"sample_time": T, "reference": {"kind": "torque", "mean": 0.5}, "current": {"kind": "pi"}}},
        simulation={"duration": 40 * T, "sample_interval": T},
    )  # fmt: skip
    torque = lm.simulate(axis)["m_torque"].to_numpy() / 0.5
    expected = [0.0, 0.0]
    while len(expected) < 41:
        expected.append(expected[-1] - (expected[-2] - 1.0) / 3.0)
    assert torque == pytest.approx(np.array(expected), abs=1e-9)
    assert torque.max() == pytest.approx(28.0 / 27.0, abs=1e-9)


def oscillation(gain: float, kind: str, ticks: int) -> np.ndarray:
    """Speed over ticks of a rigid drive at its first speed 1, under a proportional loop of `gain` J/T to speed 0."""
    J = 3e-4
    axis = scenario(
        shafts={"motor": {}},
        motors={"m": {"shaft": "motor", "rotor_inertia": J, "rated_torque": 0.5, "rated_speed": 300.0,
                      "electrical_time_constant": 1.3e-3, "armature_voltage_constant": 4.0}},
        controllers={"m": {
            "sample_time": T, "reference": {"kind": "speed"}, "encoder": {"ideal": True},
            "speed": {"gain": gain * J / T, "estimate": {"kind": kind}}, "current": {"kind": "ideal"},
        }},
        initial={"speeds": {"motor": 1.0}},
        simulation={"duration": ticks * T, "sample_interval": T},
    )  # fmt: skip
    return lm.simulate(axis, energy=False)["motor_speed"].to_numpy()[:ticks]


LIMITS = [("difference", 2.0 * (math.sqrt(2.0) - 1.0), 8), ("exact", 1.0, 6)]


@pytest.mark.parametrize(("kind", "limit", "period"), LIMITS)
def test_stability_ends_at_the_gain_and_the_frequency_of_theory(kind: str, limit: float, period: int) -> None:
    """w[k+2] = w[k+1] - K m[k], m the mean of w[k] and w[k-1] with the difference, w[k] with the true speed."""
    window = 100 * period
    at_limit = oscillation(limit, kind, 4 * window)
    assert at_limit[-window:] == pytest.approx(at_limit[window : 2 * window], abs=1e-9)
    spectrum = np.abs(np.fft.rfft(at_limit[-window:]))
    assert int(spectrum.argmax()) == window // period  # f_s/8, f_s/6
    for gain, grows in ((0.999 * limit, False), (1.001 * limit, True)):
        speed = oscillation(gain, kind, 4 * window)
        early, late = (float(np.sqrt(np.mean(part**2))) for part in (speed[:window], speed[-window:]))
        assert (late > early) == grows
        share = [0.0, 1.0] if kind == "exact" else [0.5, 0.5]  # of w[k-1] and w[k]
        z = np.abs(np.roots([1.0, -1.0, gain * share[1], gain * share[0]])).max()
        assert late / early == pytest.approx(z ** (3 * window), rel=0.01)


def test_a_linear_two_mass_drive_under_a_sampled_pi_is_the_linear_recursion() -> None:
    k_p, k_i, weight, share = 1.1, 45.0, 0.6, 1.0
    estimate = {"kind": "difference", "time_constant": 2e-4}
    axis = two_mass({"gain": k_p, "integral_gain": k_i, "reference_weight": weight, "estimate": estimate})
    axis = axis.replace(**{"simulation.duration": 400 * T})
    result = lm.simulate(axis)
    # Plant: w_M, w, twist, phi_M under a torque held for T.
    phi = expm(np.block([[A, B], [np.zeros((1, 5))]]) * T)
    x, integral, estimate, before, pending = np.zeros(4), 0.0, 0.0, 0.0, 0.0
    k_t, smoothing = weight * k_p, -math.expm1(-T / 2e-4) * share
    speeds = []
    for _ in range(401):
        speeds.append(x[:2].copy())
        estimate += smoothing * ((x[3] - before) / T - estimate)
        before = x[3]
        v = integral - (k_p - k_t) * estimate
        torque = k_t * (3.0 - estimate) + v
        integral += T * k_i / k_t * (torque - v)
        x, pending = phi[:4, :4] @ x + phi[:4, 4] * pending, torque
    expected = np.array(speeds).T
    scale = np.abs(expected).max()
    assert np.abs(result["motor_speed"].to_numpy() - expected[0]).max() < 1e-12 * scale
    assert np.abs(result["load_speed"].to_numpy() - expected[1]).max() < 1e-12 * scale


# --- step by step ---
@pytest.fixture
def axis() -> lm.Scenario:
    s = lm.load("position-axis", {"simulation.duration": 0.4})
    assert isinstance(s, lm.Scenario)
    return s


def test_steps_of_any_length_lead_where_the_run_leads(axis: lm.Scenario) -> None:
    run = lm.simulate(axis)
    rng = np.random.default_rng(5)
    simulation = lm.Simulation(axis)
    at = np.unique(np.concatenate([rng.uniform(0.0, 0.4, 150), np.arange(1, 40) * 1e-2, np.arange(1, 200) * T]))
    for begin, end in zip([0.0, *at[:-1]], at, strict=True):
        simulation.advance(end - begin)
    simulation.advance(0.4 - at[-1])
    for name in ("motor_speed", "load_speed", "twist", "load_angle"):
        scale = float(np.abs(run[name]).max())
        assert simulation[name] == pytest.approx(float(run[name][-1]), abs=1e-9 * scale)


def test_a_state_within_a_tick_continues_bit_for_bit(axis: lm.Scenario) -> None:
    one = lm.Simulation(axis)
    one.advance(0.1)
    one.advance(0.4 * T)
    state = one.state
    for _ in range(300):
        one.advance(0.7 * T)
    other = lm.Simulation(axis)
    other.state = state
    for _ in range(300):
        other.advance(0.7 * T)
    assert one.read() == other.read()
    assert one.state.values == other.state.values


def test_a_law_of_your_own_that_is_the_loop_moves_the_drive_as_the_loop_does() -> None:
    tables: dict[str, Any] = {
        "shafts": {"motor": {"inertia": 2e-3}, "load": {"inertia": 5e-3}},
        "motors": {"m": torque_source(rated_torque=2.0)},
        "gears": {"g": {"input": "motor", "output": "load", "ratio": 5.0, "stiffness": {"kind": "linear", "stiffness": 700.0}}},
        "simulation": {"duration": 0.1, "sample_interval": 1e-3},
    }  # fmt: skip
    common = {"sample_time": T, "reference": {"kind": "speed", "mean": 3.0}, "encoder": {"lines": 2048}}
    loop = lm.simulate(scenario(**tables, controllers={"m": common | {"speed": {"gain": 0.4, "integral_gain": 20.0}}}))

    def law(time: float, measured: Any, reference: Any, state: Any) -> float:
        torque = 0.4 * (5.0 * reference[0] - measured[1]) + state[0]
        state[0] += T * 20.0 / 0.4 * (torque - state[0])
        return torque / 2.0  # type: ignore[no-any-return]

    own = lm.simulate(scenario(**tables, controllers={"m": common | {"law": True}}), law=lm.control.Law(law, states=1))
    for name in ("motor_speed", "load_speed"):
        assert own[name].to_numpy() == pytest.approx(loop[name].to_numpy(), abs=1e-9 * float(np.abs(loop[name]).max()))


def test_what_a_law_raises_comes_through() -> None:
    tables: dict[str, Any] = {
        "shafts": {"motor": {"inertia": 2e-3}},
        "motors": {"m": torque_source()},
        "controllers": {"m": {"sample_time": T, "reference": {"kind": "torque"}, "encoder": {"ideal": True}, "law": True}},
        "simulation": {"duration": 0.1, "sample_interval": 1e-3},
    }  # fmt: skip

    def broken(*given: Any) -> float:
        raise ZeroDivisionError("in my law")

    with pytest.raises(ZeroDivisionError, match="in my law"):
        lm.simulate(scenario(**tables), law=broken)
    simulation = lm.Simulation(scenario(**tables), law=broken)
    with pytest.raises(ZeroDivisionError, match="in my law"):
        simulation.advance(1e-3)
    with pytest.raises(lm.SolverError, match="controller failed"):
        lm.simulate(scenario(**tables), law=lambda *given: math.nan)


# --- A controller that cannot be used is refused in one line that names the key and the remedy ---
AXIS = (
    MOTOR
    + """
[gearbox]
ratio = 90
rated_input_speed = "3630 rpm"
rated_output_torque = 51.6
stiffness = { kind = "linear", stiffness = 21200 }
losses = { kind = "constant_efficiency", efficiency = 0.9 }

[load]
inertia = 2.0

[controller]
sample_time = "125 us"
encoder = { lines = 2048 }
reference = { kind = "position", mean = 0.1 }
position = { gain = "10 1/s", sample_time = "1 ms" }
speed = { gain = "8.29e-3 N*m*s/rad", integral_gain = "0.1266 N*m/rad" }
current = { kind = "pi" }

[simulation]
duration = "10 ms"
sample_interval = "1 ms"
"""
)

ENCODER, POSITION, SPEED = (
    "encoder = { lines = 2048 }", 'position = { gain = "10 1/s", sample_time = "1 ms" }',
    'speed = { gain = "8.29e-3 N*m*s/rad", integral_gain = "0.1266 N*m/rad" }',
)  # fmt: skip

# (what is wrong, text to replace, its replacement, words that the message must contain)
BROKEN = [
    ("sample times that do not nest", '"1 ms" }', '"1.1 ms" }', ["controller.", "position.sample_time", "0.0011", "0.001125"]),
    ("a loop faster than the innermost", '"1 ms" }', '"60 us" }', ["position.sample_time", "6e-05"]),
    ("sample time of zero", '"125 us"', "0", ["controller.sample_time"]),
    ("negative sample time", '"125 us"', "-1e-3", ["controller.sample_time"]),
    ("sample time that is no time", '"125 us"', '"8 kHz"', ["controller.sample_time", "s"]),
    ("gain of the wrong unit", '"10 1/s"', '"10 N*m"', ["controller.position.gain", "1/s"]),
    ("gain of the wrong sign", '"10 1/s"', '"-10 1/s"', ["controller.position.gain"]),
    ("speed gain of the wrong unit", '"8.29e-3 N*m*s/rad"', '"8.29e-3 N*m/rad"', ["controller.speed.gain"]),
    ("speed gain of zero", '"8.29e-3 N*m*s/rad"', "0", ["controller.speed.gain"]),
    ("integral gain of the wrong sign", '"0.1266 N*m/rad"', "-0.1", ["controller.speed.integral_gain"]),
    ("gain that is not a number", '"10 1/s"', "nan", ["controller.position.gain"]),
    ("encoder without resolution", ENCODER, "encoder = {}", ["controller.encoder", "resolution", "lines"]),
    ("no encoder", ENCODER, "", ["controller", "encoder", "lines"]),
    ("encoder twice", "lines = 2048", "lines = 2048, resolution = 1e-4", ["controller.encoder", "resolution"]),
    ("ideal encoder with lines", "lines = 2048", "lines = 2048, ideal = true", ["controller.encoder", "ideal"]),
    ("encoder of no lines", "lines = 2048", "lines = 0", ["controller.encoder.lines"]),
    ("encoder of half a line", "lines = 2048", "lines = 2048.5", ["controller.encoder.lines"]),
    ("encoder on an unknown shaft", "lines = 2048", 'lines = 2048, shaft = "lod"', ["controller.encoder.shaft", "lod", "load"]),
    ("error without periods", "lines = 2048", "bits = 12, error = 1e-4", ["controller.encoder", "error_periods"]),
    ("delay longer than a period", "[controller]", "[controller]\ndelay = 2", ["controller.delay", "1"]),
    ("delay of a time", "[controller]", '[controller]\ndelay = "125 us"', ["controller.delay"]),
    ("reference's shaft unknown", "[controller]", '[controller]\nshaft = "lod"', ["controller.shaft", "load"]),
    ("controller and command", "[load]", "[command]\nmean = 0.1\n[load]", ["command", "controller", "leave one"]),
    ("position loop without position reference", 'kind = "position"', 'kind = "speed"', ["controller", "position", "leave it out"]),
    ("torque reference with a speed loop", 'kind = "position"', 'kind = "torque"', ["controller", "leave it out"]),
    ("position reference without its loop", POSITION, "", ["controller", "position", "gain"]),
    ("position reference without speed loop", SPEED, "", ["controller", "speed", "gain"]),
    ("no reference", 'reference = { kind = "position", mean = 0.1 }', "", ["controller.reference", "missing"]),
    ("reference without kind", 'kind = "position", mean', "mean", ["controller.reference", "kind"]),
    ("reference of an unknown kind", 'kind = "position"', 'kind = "angle"', ["controller.reference", "angle"]),
    ("reference of the wrong unit", "mean = 0.1", 'mean = "1 N*m"', ["controller.reference.mean"]),
    ("misspelt key", "sample_time = \"125 us\"", "sampel_time = \"125 us\"", ["controller.sampel_time", "sample_time"]),
    ("misspelt loop", POSITION, POSITION.replace("gain", "gian"), ["controller.position.gian", "gain"]),
    ("phase that does not nest", "[controller]", '[controller]\nphase = "100 us"', ["controller.", "phase"]),
    ("phase beyond the position loop", "[controller]", '[controller]\nphase = "1 ms"', ["controller.", "phase"]),
    ("integral gain and time", '"0.1266 N*m/rad"', '"0.1266 N*m/rad", integral_time = "10 ms"', ["controller.speed", "integral_time"]),
    ("dead zone without integrator", 'gain = "10 1/s",', 'gain = "10 1/s", dead_zone = [1e-4, 2e-4],', ["controller.position", "dead_zone"]),
    ("dead zone inside out", 'gain = "10 1/s",', 'gain = "10 1/s", integral_gain = 1.0, dead_zone = [2e-4, 1e-4],', ["dead_zone", "outer"]),
    ("filter beyond half the sampling rate", "speed = {", 'speed = { torque_filters = [{ kind = "low_pass", frequency = "5 kHz" }],',
     ["controller.speed.torque_filters[0]", "frequency", "8000"]),
    ("notch of no frequency", "speed = {", 'speed = { torque_filters = [{ kind = "notch" }],', ["controller.speed.torque_filters[0]"]),
    ("transfer function with more zeros than poles", "speed = {",
     'speed = { torque_filters = [{ kind = "transfer_function", numerator = [1, 2, 3], denominator = [1, 0.5] }],',
     ["controller.speed.torque_filters[0]", "zeros"]),
    ("transfer function of another sample time", "speed = {",
     'speed = { torque_filters = [{ kind = "transfer_function", numerator = [1], denominator = [1, 0.5], sample_time = "1 ms" }],',
     ["controller.speed.torque_filters[0]", "sample_time", "0.000125"]),
    ("current loop of a torque source", "[motor]", '[motor]\nkind = "torque_source"', ["motor"]),
    ("current gain above 1", 'kind = "pi"', 'kind = "pi", gain = 1.5', ["controller.current.gain"]),
    ("voltage without a law", 'kind = "pi"', 'kind = "voltage"', ["controller", "law = true"]),
    ("blend without a second encoder", "[controller]", '[controller]\nblend_time = "10 ms"', ["controller", "position_encoder"]),
    ("backlash without rate", "[controller]", "[controller]\nfeedforward = { backlash = 1e-3 }", ["controller.feedforward", "backlash_rate"]),
    ("observer without bandwidth", "speed = {", 'speed = { estimate = { kind = "observer" },', ["controller.speed.estimate", "bandwidth"]),
    ("difference over no samples", "speed = {", "speed = { estimate = { span = 0 },", ["controller.speed.estimate"]),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "words"), [case[1:] for case in BROKEN], ids=[case[0] for case in BROKEN])
def test_what_cannot_be_used_is_refused_by_key(old: str, new: str, words: list[str], tmp_path) -> None:
    assert_file_refused(tmp_path / "axis.toml", AXIS, old, new, words)


def test_the_axis_itself_is_sound(tmp_path) -> None:
    path = tmp_path / "axis.toml"
    path.write_text(AXIS)
    assert abs(float(lm.simulate(lm.load(path))["motor_speed"][-1])) > 1.0


def train(**changes: Any) -> lm.Scenario:
    controller = {"sample_time": 1e-3, "reference": {"kind": "speed"}, "encoder": {"bits": 12}, "speed": {"gain": 0.1}}
    tables: dict[str, Any] = {
        "shafts": {"a": {"inertia": 1.0}, "b": {"inertia": 1.0}, "alone": {"inertia": 1.0, "torque": 0.1}},
        "motors": {"m": {"shaft": "a", "kind": "torque_source", "rotor_inertia": 0.0}},
        "gears": {"g": {"input": "a", "output": "b", "ratio": 2.0}},
        "controllers": {"m": controller | {"shaft": "b"} | changes.pop("controller", {})},
        "simulation": {"duration": 0.01, "sample_interval": 1e-3},
    }
    return lm.Scenario(**(tables | changes))


def test_of_a_train_they_are_refused_by_the_name_of_the_motor() -> None:
    assert train().controllers["m"].shaft == "b"
    other = train().controllers["m"]
    message = refused(lambda: train(controllers={"n": other}))
    assert "controllers.n" in message
    assert "m" in message.split(";")[-1]
    message = refused(lambda: train(command={"m": {"mean": 0.1}}))
    assert "command.m" in message
    assert "controllers.m" in message
    for key, value, words in (
        ("shaft", "alone", ["controllers.m.shaft", "no gear leads", "alone"]),
        ("encoder", {"bits": 12, "shaft": "alone"}, ["controllers.m.encoder.shaft", "no gear leads"]),
        ("encoder", {"bits": 12, "shaft": "c"}, ["controllers.m.encoder.shaft", "is no shaft"]),
    ):
        message = refused(lambda k=key, v=value: train(controller={k: v}))
        assert all(word in message for word in words), message

"""A controller that cannot be used is refused in one line that names the key and the remedy."""

from typing import Any

import pytest

import lostmotion as lm
from refusals import assert_file_refused, refused

AXIS = """
[motor]
rotor_inertia = 8e-6
friction_torque = 0.016
rated_torque = 0.521
rated_speed = "3300 rpm"
rated_voltage = 24
electrical_time_constant = "0.1286 ms"
armature_voltage_constant = 3.1169

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

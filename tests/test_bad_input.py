"""Bad input ends in one line that names the file, the key and the remedy, and in exit code 1; nothing is left behind."""

import math
import pickle
import re
import time
from collections.abc import Callable
from pathlib import Path
from time import process_time

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import lostmotion as lm
from conftest import ROOT, lostmotion
from lostmotion.inputs.refusal_messages import listed, nearest
from lostmotion.studies.expressions.expressions import Expression
from lostmotion.studies.expressions.vocabulary import vocabulary_of
from refusals import assert_file_refused, assert_plain, refusals_of, refused
from tables import MOTOR

GOOD = (
    """
[command]
amplitude = 1.0
frequency = 1.0
"""
    + MOTOR
    + """
[gearbox]
ratio = 90
inertia = 6.7e-6
rated_input_speed = "3630 rpm"
rated_output_torque = 51.6

[gearbox.stiffness]
kind = "curve"
breaks = ["0.6 mrad", "3 mrad"]
slopes = [2650, 21200, 26500]

[gearbox.hysteresis]
efficiency = 0.93

[gearbox.losses]
kind = "map"
mirrored = true
speeds = [0, 1]
loads = [0, 1]
values = [[0.02, 0.06], [0.08, 0.12]]

[load]
inertia = 2.0
torque = 0.0

[simulation]
duration = 0.01
sample_interval = 0.001
"""
)

# (what is wrong, text to replace, its replacement, words that the message must contain)
BROKEN = [
    ("missing inertia of the load", "inertia = 2.0\n", "", ["load.inertia", "missing"]),
    ("missing ratio", "ratio = 90\n", "", ["gearbox.ratio", "missing"]),
    ("missing table", "[simulation]\nduration = 0.01\nsample_interval = 0.001\n", "", ["simulation", "missing"]),
    ("missing kind of stiffness", 'kind = "curve"\n', "", ["gearbox.stiffness", "kind"]),
    ("missing kind of losses", 'kind = "map"\n', "", ["gearbox.losses", "kind"]),
    ("missing speed of a dc motor", 'rated_speed = "3300 rpm"\n', "", ["motor", "rated_speed"]),
    ("missing time constant of a dc motor", 'electrical_time_constant = "0.1286 ms"\n', "", ["electrical_time_constant"]),
    ("missing duration", "duration = 0.01\n", "", ["simulation.duration", "missing"]),
    ("misspelt key", "rotor_inertia", "rotor_inertai", ["motor.rotor_inertai", "did you mean rotor_inertia"]),
    ("misspelt table", "[load]", "[laod]", ["laod", "did you mean load"]),
    ("misspelt nested table", "[gearbox.hysteresis]", "[gearbox.histeresis]", ["gearbox.histeresis", "hysteresis"]),
    ("misspelt kind", 'kind = "curve"', 'kind = "curv"', ["gearbox.stiffness", "curv", "linear"]),
    ("key of another kind", "mirrored = true", "mirrored = true\nefficiency = 0.9", ["gearbox.losses.efficiency", "a key of kind"]),
    ("unknown key at the top", "[command]", "speed = 1\n[command]", ["speed", "not known"]),
    ("unknown key in the command", "amplitude = 1.0", "amplitud = 1.0", ["command.amplitud", "did you mean amplitude"]),
    ("unit of something else", '"3300 rpm"', '"3300 N*m"', ["motor.rated_speed", "3300 N*m", "rad/s"]),
    ("unknown unit", '"3300 rpm"', '"3300 rmp"', ["motor.rated_speed", "3300 rmp", "rad/s"]),
    ("number as text without unit", '"3300 rpm"', '"3300"', ["motor.rated_speed", "no unit"]),
    ("nonsense text", '"3300 rpm"', '"fast"', ["motor.rated_speed", "fast"]),
    ("empty text", '"3300 rpm"', '""', ["motor.rated_speed"]),
    ("text with brackets", '"3300 rpm"', '"(3300 rpm"', ["motor.rated_speed"]),
    ("angle where a time belongs", '"0.1286 ms"', '"0.1286 mrad"', ["electrical_time_constant", "mrad"]),
    ("time where an angle belongs", '"0.6 mrad"', '"0.6 ms"', ["gearbox.stiffness.breaks[0]", "rad"]),
    ("unit on a pure number", "armature_voltage_constant = 3.1169", 'armature_voltage_constant = "3 V"', ["armature_voltage_constant"]),
    ("unit on the command", "amplitude = 1.0", 'amplitude = "1 V"', ["command.amplitude"]),
    ("Boolean", "ratio = 90", "ratio = true", ["gearbox.ratio", "Boolean"]),
    ("list for a number", "ratio = 90", "ratio = [90]", ["gearbox.ratio"]),
    ("table for a number", "ratio = 90", "ratio = { value = 90 }", ["gearbox.ratio"]),
    ("key in the table of another", "[gearbox.hysteresis]\nefficiency", "hysteresis", ["gearbox.stiffness.hysteresis"]),
    ("date for a number", "ratio = 90", "ratio = 2026-01-01", ["gearbox.ratio"]),
    ("negative inertia", "inertia = 2.0", "inertia = -2.0", ["load.inertia", "-2.0", "greater than 0"]),
    ("zero inertia of the load", "inertia = 2.0", "inertia = 0.0", ["load.inertia", "greater than 0"]),
    ("negative inertia of the gearbox", "inertia = 6.7e-6", "inertia = -6.7e-6", ["gearbox.inertia"]),
    ("zero ratio", "ratio = 90", "ratio = 0", ["gearbox.ratio", "0 is no ratio; give input speed"]),
    ("negative friction", "friction_torque = 0.016", "friction_torque = -0.016", ["motor.friction_torque"]),
    ("negative time constant", '"0.1286 ms"', '"-1 ms"', ["electrical_time_constant", "at least 0"]),
    ("voltage constant below one", "3.1169", "0.9", ["armature_voltage_constant", "greater than 1"]),
    ("hysteresis above one", "efficiency = 0.93", "efficiency = 1.93", ["gearbox.hysteresis.efficiency"]),
    ("NaN", "ratio = 90", "ratio = nan", ["gearbox.ratio", "finite"]),
    ("infinity", "inertia = 2.0", "inertia = inf", ["load.inertia", "finite"]),
    ("NaN in the map", "[0.02, 0.06]", "[0.02, nan]", ["gearbox.losses.values[0][1]", "finite"]),
    ("negative loss", "[0.02, 0.06]", "[0.02, -0.06]", ["gearbox.losses.values[0][1]"]),
    ("hole in the map", "[0.02, 0.06]", "[0.02]", ["gearbox.losses", "hole", "row 0"]),
    ("missing row of the map", ", [0.08, 0.12]]", "]", ["gearbox.losses", "1 rows", "2 loads"]),
    ("unsorted speeds", "speeds = [0, 1]", "speeds = [0, -1]", ["gearbox.losses.speeds"]),
    ("repeated loads", "loads = [0, 1]", "loads = [0, 0]", ["gearbox.losses.loads", "rise"]),
    ("map that does not begin at standstill", "speeds = [0, 1]", "speeds = [0.1, 1]", ["gearbox.losses", "first must be 0"]),
    ("mirrored map with negative loads", "loads = [0, 1]", "loads = [-1, 1]", ["gearbox.losses", "mirrored"]),
    ("map for one direction only", "mirrored = true", "mirrored = false", ["gearbox.losses", "one direction"]),
    ("map with one speed", "speeds = [0, 1]", "speeds = [0]", ["gearbox.losses.speeds"]),
    ("unsorted curve", '["0.6 mrad", "3 mrad"]', '["3 mrad", "0.6 mrad"]', ["gearbox.stiffness", "rise"]),
    ("too many breaks", '["0.6 mrad", "3 mrad"]', '["0.6 mrad", "3 mrad", "4 mrad"]', ["gearbox.stiffness", "3 slopes and 3 breaks"]),
    ("negative slope", "[2650, 21200, 26500]", "[2650, -1, 26500]", ["gearbox.stiffness.slopes[1]"]),
    ("curve that ends slack", "[2650, 21200, 26500]", "[2650, 21200, 0]", ["gearbox.stiffness", "slope 0"]),
    ("no slopes", "[2650, 21200, 26500]", "[]", ["gearbox.stiffness.slopes"]),
    ("backlash and preload", 'kind = "curve"', 'kind = "curve"\nbacklash = 1e-3\npreload = 1.0', ["gearbox.stiffness", "preload"]),
    ("amplitude without frequency", "frequency = 1.0\n", "", ["command", "lacks frequency"]),
    ("phase without sine", "amplitude = 1.0\nfrequency = 1.0", "phase = 1.0", ["command", "phase"]),
    ("negative frequency", "frequency = 1.0", "frequency = -1.0", ["command.frequency"]),
    ("samples that go back in time", "\ntorque = 0.0", "\ntorque.samples = { times = [0, 2, 1], values = [0, 1, 2] }", ["load.torque.samples", "rise"]),
    ("samples of unequal length", "\ntorque = 0.0", "\ntorque.samples = { times = [0, 2], values = [0, 1, 2] }", ["load.torque.samples", "2 times and 3 values"]),
    ("command samples as torque", "\ntorque = 0.0", '\ntorque = "3 rad"', ["load.torque"]),
    ("voltage limit without rated voltage", "rated_voltage = 24", "voltage_limit = 24", ["motor", "rated_voltage"]),
    ("voltage limit of a torque source", "rated_voltage = 24", 'kind = "torque_source"\nvoltage_limit = 24', ["motor", "voltage_limit"]),
    ("zero duration", "duration = 0.01", "duration = 0", ["simulation.duration"]),
    ("interval beyond the duration", "sample_interval = 0.001", "sample_interval = 1", ["simulation", "longer than its duration"]),
    ("too many samples", "sample_interval = 0.001", "sample_interval = 1e-12", ["simulation", "samples"]),
    ("twist of a rigid gear", 'kind = "curve"\nbreaks = ["0.6 mrad", "3 mrad"]\nslopes = [2650, 21200, 26500]', 'kind = "rigid"', ["gearbox", "rigid"]),
    ("rigid start that does not fit", "[simulation]", "[initial]\nhysteresis_capacity = -1\n[simulation]", ["initial.hysteresis_capacity"]),
    ("broken TOML", "ratio = 90", "ratio = = 90", ["not valid TOML", "line"]),
    ("key given twice", "ratio = 90", "ratio = 90\nratio = 91", ["not valid TOML"]),
    ("base that does not exist", "[command]", 'base = "nowhere.toml"\n[command]', ["key base: ", "nowhere.toml: there is no such file"]),
    ("base that is no name", "[command]", "base = 3\n[command]", ["base"]),
    ("base that leads back", "[command]", 'base = "broken.toml"\n[command]', ["base", "circle"]),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "words"), [b[1:] for b in BROKEN], ids=[b[0] for b in BROKEN])
def test_broken_scenario_is_refused_in_one_clear_line(tmp_path: Path, old: str, new: str, words: list[str]) -> None:
    assert_file_refused(tmp_path / "broken.toml", GOOD, old, new, words)


OVERRIDES = [
    ("load.inertia=1,2 kg*m^2", 'key load.inertia: "1,2 kg*m^2" has a decimal comma; write "1.2 kg*m^2"'),
    ("load.inertia=-2 kgcm2", 'key load.inertia: "-2 kgcm2" must be greater than 0'),  # as it was written
    ("load.inertia=2026-01-01", "key load.inertia: 2026-01-01 must be a number"),
    ("load.inertia=1e400", "key load.inertia: inf must be a finite number"),
    ("load.inertia.x=1", "key load.inertia.x: load.inertia is the value 2.0, not a table"),
    ("command.steps.0.height=1", "key command.steps.0: there is no entry 0; the list has 0 entries"),
    ("command.steps=3", "key command.steps: 3 must be a list"),
    ("command.steps=[3]", "key command.steps[0]: 3 must be a table with some of the keys height, time"),
    ("gearbox.losses.mirrored=1", "key gearbox.losses.mirrored: 1 must be true or false"),
    ("gearbox.losses.mirrored=yes", 'key gearbox.losses.mirrored: "yes" must be true or false'),
    ("gearbox.losses.values=[[1, true]]", "key gearbox.losses.values[0][1]: true is a Boolean"),
    ("gearbox.added_backlash=0.01", "key gearbox.added_backlash: is for gearboxes by name (gearbox.from); here change gearbox.stiffness.backlash"),
    ("title=5", "key title: 5 must be text"),
    ("motor.kind=torque-source", 'did you mean "torque_source"?'),
    ("motor.limits.max_winding_temperature=-300 degC", '"-300 degC" must be at least -273.15'),
    ("command.chirp.points_per_period=true", "true must be a whole number"),
    ("command=true", "key command: true must be a table"),
    ("gearbox=maxon-ec-i-52-606793", "maxon-ec-i-52-606793 is a motor; a gearbox is wanted here"),
]  # fmt: skip


@pytest.mark.parametrize(("override", "sentence"), OVERRIDES, ids=[o for o, _ in OVERRIDES])
def test_an_override_that_cannot_be_is_refused_as_it_was_written(tmp_path: Path, override: str, sentence: str) -> None:
    (tmp_path / "good.toml").write_text(GOOD)
    message = refused(lambda: lm.load(tmp_path / "good.toml", [override]))
    assert sentence in message
    assert_plain(message)


def test_all_missing_keys_are_named_at_once(tmp_path: Path) -> None:
    (tmp_path / "empty.toml").write_text("")
    refused(lambda: lm.load(tmp_path / "empty.toml"), "motor", "gearbox", "load", "simulation")
    (tmp_path / "some.toml").write_text(GOOD.replace("ratio = 90\n", "").replace("duration = 0.01\n", ""))
    refused(lambda: lm.load(tmp_path / "some.toml"), "gearbox.ratio", "simulation.duration")
    (tmp_path / "s.toml").write_text(GOOD.replace("ratio = 90", "ratio = 0").replace("[command]", "[comand]").replace("mirrored", "miror"))
    message = refused(lambda: lm.load(tmp_path / "s.toml"))
    for words in ("comand: is not known; did you mean command", "losses.miror: is not known", "ratio: 0 is no ratio"):
        assert words in message


PARTS = [
    (lambda: lm.Motor(rotor_inertia="1,2 kg*m^2"), 'key rotor_inertia: "1,2 kg*m^2" has a decimal comma'),
    (lm.Load, "key inertia: is missing; add it"),
    (lambda: lm.Load(inertia=1, frction_torque=2), "key frction_torque: is not known; did you mean friction_torque?"),
    (lambda: lm.Load(inertia=None), "key inertia: None must be a number in kg*m^2"),
    (lambda: lm.Load(inertia=10**400), "is beyond the range of numbers"),
    (lambda: lm.Load.model_validate({"inertia": -1}), "key inertia: -1.0 must be greater than 0"),
    (lambda: lm.Load(inertia=1).model_copy(update={"inertia": "1,2 kg*m^2"}), "has a decimal comma"),
    (lambda: lm.Load(inertia=1).model_copy(update={"inertja": 2}), "key inertja: is not known; did you mean inertia?"),
    (lambda: lm.model.TorsionCurve(slopes=[1, 2]), "the torsion curve has 2 slopes and 0 breaks"),
    (lambda: lm.model.TorsionCurve(slopes=5), "key slopes: 5 must be a list"),
    (lambda: lm.CommandSignal(amplitude=3), "the command signal lacks frequency"),
    (lambda: lm.data_sheets.GearboxSheet(name="x", kind="magic", ratio=3), 'key kind: "magic" must be one of "strain_wave"'),
    (lambda: lm.data_sheets.GearboxSheet(name="My Gear", kind="other", ratio=3), "must consist of letters, digits, dots and dashes; capitals are read as small letters"),
    (lambda: setattr(lm.Load(inertia=1), "inertia", 2), "the load is frozen"),
    (lambda: lm.gearbox("paper-gearbox", added_backlash="1,5 arcmin"), 'write "1.5 arcmin"'),
    (lambda: lm.motor("paper-motor", voltage_limit="24 A"), 'key voltage_limit: "24 A" has the unit of something else'),
]  # fmt: skip


@pytest.mark.parametrize(("make", "sentence"), PARTS, ids=[s for _, s in PARTS])
def test_constructors_refuse_in_the_words_of_the_command_line(make: Callable[[], object], sentence: str) -> None:
    message = refused(make)
    assert sentence in message
    assert_plain(message.replace("None must", "must"))


FUNCTIONS = [
    (lambda s: lm.simulate(3), ": 3 must be a Scenario"),
    (lambda s: lm.simulate(s, solver="euler"), ": solver 'euler' is not known"),
    (lambda s: lm.simulate(s, relative_tolerance=1e-9), ": the exact solver has none"),
    *(
        (
            lambda s, t=t: lm.simulate(s, solver="dormand-prince", relative_tolerance=t),
            f": relative_tolerance {t:g} must lie" if math.isfinite(t) else f": relative_tolerance: {t:g} must be a finite number",
        )
        for t in (math.nan, math.inf, -1.0, 0.0, 1e-300, 1.0)
    ),
    (lambda s: lm.simulate(s.drive()), ": needs duration and sample_interval"),
    (lambda s: lm.simulate(s, duration="1,5 s"), 'duration: "1,5 s" has a decimal comma; write "1.5 s"'),
    (lambda s: lm.simulate(s, command="50 Hz"), 'command.mean: "50 Hz" has the unit of something else'),
    (lambda s: lm.explain(s, 99.0), ": must lie between 0 and the duration"),
    (lambda s: lm.explain(s, "0,1 s"), ': time: "0,1 s" has a decimal comma'),
    (lm.explain, ": time is missing"),
    (lambda s: lm.explain(s.drive(), 0.1), ": must be a Scenario, such as load(path) returns, or a Simulation"),
    (lambda s: lm.check_drive(s.drive()), ": must be a Scenario, such as load(path) returns"),
    (lambda s: lm.frequency_response(s, ["60 rpm"], [0.1]), ': frequencies: "60 rpm" is a speed of rotation'),
    (lambda s: lm.frequency_response(s, [math.nan], [0.1]), ": frequencies: nan must be a finite number"),
    (lambda s: lm.frequency_response(s, [1.0], [0.1], harmonics=0), ": harmonics: 0 must be a whole number above 0"),
    (lambda s: lm.linearize(s, 5), ": state: 5 must be a state, such as Initial(motor_speed=100)"),
    (lambda s: lm.linearize(s, lm.Initial(), command=math.nan), ": command: nan must be a finite number"),
    (lambda s: lm.Simulation(s, step="1,5 ms"), ': step: "1,5 ms" has a decimal comma'),
    (lambda s: lm.Simulation(s).advance("1 mm", 0.1), ': interval: "1 mm" has the unit of something else'),
    (lambda s: lm.gearbox(5), ": name: 5 must be the name of a record, or of a file with one"),
    (lambda s: lm.load(5), ": 5 must be the name of a scenario"),
    (lambda s: lm.Scenario.from_json("{"), ": is not valid JSON"),
    (lambda s: lm.Scenario.from_json("[]"), ": must be a table"),
    (lambda s: lm.simulate(s).drop_vars("twist").lm.plot(), ": lacks twist"),
    (lambda s: lm.Simulation(s.drive(), step=0.0), ": must lie between"),
    (lambda s: lm.Simulation(s.drive()).advance(-1.0, 0.0), ": must lie between"),
    (lambda s: lm.frequency_response(s.drive(), [-1.0], [0.1]), ": frequencies must be positive"),
    (lambda s: lm.periodic_motion(s.drive(), command=0.1), ": needs at least one sine"),
    (lambda s: lm.data_sheets.build_loss_map(lm.data_sheets.GearboxSheet(name="x", kind="other", ratio=3)), ": lacks rated_output_torque"),
    (
        lambda s: lm.test_rig.TestRig(s.replace(**{"gearbox.stiffness": {"kind": "rigid"}, "gearbox.hysteresis": None}).gearbox).loop(1.0),
        ": rigid",
    ),
    (lambda s: s.replace(**{"load.inertia": "1 000 kg*m^2"}), 'load.inertia: "1 000 kg*m^2" has separators'),
    (lambda s: s.replace(**{"load.inertja": 1}), "load.inertja: is not known; did you mean inertia?"),
    (lambda s: lm.Scenario.from_json('{"title": 3}'), "motor, gearbox, load, simulation: are missing"),
]


test_functions_refuse_bad_input_with_the_same_error = refusals_of(lambda call, *, large: call(lm.load(large)), *FUNCTIONS)


RECORD = {"gearbox.from": "schaeffler-rt1-h-20-100"}
OTHER_PLACES = [
    ({"gearbox.backlash": 1e-3}, "key gearbox.backlash: is not known here; it is written as gearbox.stiffness.backlash"),
    (RECORD | {"gearbox.backlash": 1e-3}, "key gearbox.backlash: is not known here; it is written as gearbox.stiffness.backlash"),
    (RECORD | {"gearbox.backlsh": 1e-3}, "did you mean gearbox.stiffness.backlash?"),
    ({"gearbox.stiffness": {"kind": "linear", "stiffness": 1e4, "backlash": 1e-3}}, 'backlash: is a key of kind "curve" or "rigid", and this table'),
    ({"motor.max_speed": 1.0}, "it is written as motor.limits.max_speed"),
    ({"gearbox.efficiency": 0.9}, "it is written as gearbox.hysteresis.efficiency or gearbox.losses.efficiency"),
    ({"load_inertia": 1.0}, "key load_inertia: is not known here; it is written as load.inertia"),
    ({"motor.ratedSpeed": 1.0}, "did you mean rated_speed?"),
    ({"motor.speed_rated": 1.0}, "did you mean rated_speed?"),
    ({"motor.rotorinertia": 1.0}, "did you mean rotor_inertia?"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "sentence"), OTHER_PLACES, ids=[s for _, s in OTHER_PLACES])
def test_a_key_of_another_table_is_told_where_it_is_written(large: Path, changes: dict, sentence: str) -> None:
    message = refused(lambda: lm.load(large, changes))
    assert sentence in message
    assert "added_backlash?" not in message


def test_no_suggestion_leads_to_another_quantity() -> None:
    """A key with another word in it, or with one more, is that of another quantity."""
    known = {"added_backlash", "rated_torque", "rated_speed", "rotor_inertia", "friction_torque", "max_speed", "begin_time"}
    for wrong in ("backlash", "rated_current", "rated_input_speed", "inertia", "torque", "min_speed", "end_time", "speed"):
        assert nearest(wrong, known) == "", wrong
    for misspelt in ("aded_backlash", "rated_torqe", "ratedspeed", "RotorInertia", "torque_friction", "max-speed"):
        assert nearest(misspelt, known) in known, misspelt


def test_very_many_unknown_keys_are_refused_in_seconds(tmp_path: Path) -> None:
    path = tmp_path / "many.toml"
    path.write_text("".join(f"k{k} = 1\n" for k in range(200_000)) + GOOD)
    begin = time.process_time()
    message = refused(lambda: lm.load(path))
    assert time.process_time() - begin < 20.0  # 3 s; looking at each for all that precede it took 87 s
    assert f"{path}: key k0: is not known" in message
    assert re.search(r"; and 19999\d more$", message)


def test_long_lists_in_messages_are_cut(tmp_path: Path) -> None:
    names = [f"shaft_{k}" for k in range(200)]
    assert listed(names[:3]) == "shaft_0, shaft_1, shaft_2"
    text = listed(names)
    shown, _, more = text.partition(" and ")
    assert shown.split(", ") == names[: len(shown.split(", "))]
    assert more == f"{200 - len(shown.split(', '))} more"
    assert listed(["x" * 500]) == "x" * 117 + "..."
    path = tmp_path / "s.toml"
    for wrong in (
        'base = "no such one"',
        f'base = "{"x" * 5000}"',
        "[motor]\nx = 1\ny = 2\n[gearbox]\nz = 3",
        "[shafts]\na = 1\nb = 2\n[gears.g]\ninput = 'c'\n[gears.h]\noutput = 5\n[gears.i]\nkind = 3",
        "[shafts.a]\ninertia = 1\n" + "".join(f"[brakes.b{k}]\nshaft = 'none{k}'\ntorque = 1\n" for k in range(50)),
    ):
        path.write_text(wrong)
        assert len(refused(lambda: lm.load(path)).removeprefix(str(path))) <= 290, wrong
    for wrong in ("x", "peak(x)", "load_speed.foo()", "energy.none", "peak(load_speed" + " + 1" * 400):
        with pytest.raises(ValueError, match=r"^.") as caught:
            Expression(wrong, vocabulary_of(lm.load("paper-2dof-nl-small")))
        assert len(str(caught.value)) <= 290


@pytest.mark.parametrize(
    "text",
    ["{} = 1", "[{}]", "[[ {} ]]", "x = {{ {} = 1 }}", "x = [{{ y = 1, {} = 1 }}]"],
    ids=["key", "table", "list of tables", "entry", "entry in a list"],
)
@pytest.mark.parametrize("part", ["a", '"a"', "'a.b'", r'"\""'], ids=["bare", "quoted", "literal", "escaped"])
def test_a_dotted_key_of_many_parts_is_refused_at_once(tmp_path: Path, text: str, part: str) -> None:
    """The parser of TOML takes half a minute for it, and four times that for twice as many parts."""
    path = tmp_path / "dots.toml"
    path.write_text("title = 'a.b'\n" + text.format(".".join([part] * 40_000)))
    begin = process_time()
    assert refused(lambda: lm.load(path)).startswith(f"{path}: has more than 50 levels of tables and lists")
    assert process_time() - begin < 2.0


def test_what_is_nested_too_deeply_is_refused_with_its_file(tmp_path: Path) -> None:
    path = tmp_path / "deep.toml"
    for text in ("x = " + "[" * 5000 + "]" * 5000, "x = " + "{a = " * 900 + "1" + "}" * 900, f"[{'.'.join('a' * 3000)}]"):
        path.write_text(text)
        assert refused(lambda: lm.load(path)).startswith(f"{path}: has more than 50 levels of tables and lists")
    deep: object = 1
    for _ in range(5000):
        deep = [deep]
    assert "is nested too deeply" in refused(lambda: lm.Load(inertia=deep))
    path.write_text(GOOD)
    assert "--set x: has too many levels" in refused(lambda: lm.load(path, [f"x={'[' * 5000}{']' * 5000}"]))
    assert "has more than 50 levels" in refused(lambda: lm.load(path, {"a." * 5000: 1}))
    for k in range(150):
        (tmp_path / f"b{k}.toml").write_text(f'base = "{f"b{k - 1}" if k else "deep"}.toml"')
    assert "key base: is the base of 100 files" in refused(lambda: lm.load(tmp_path / "b149.toml"))


def test_files_that_cannot_be_named_are_refused_by_their_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for one, other in (("a", "b"), ("b", "a")):
        Path(f"{one}.toml").symlink_to(f"{other}.toml")
    for name in ("n" * 5000, "n" * 5000 + ".toml", "n/" * 3000 + "x.toml", "n" * 5000 + ".csv", "a.toml", "zero\0.toml"):
        start = name[:20].replace("\0", r"\x00")
        for call in (lm.load, lm.studies.load_study, lm.studies.load_task, lm.identification.load_identification, lm.gearbox):
            message = refused(lambda call=call, name=name: call(name))
            assert start in message, message
    for base in ("n" * 5000 + ".toml", "a.toml", r"zero\u0000.toml"):
        Path("based.toml").write_text(f'base = "{base}"')
        assert re.match(r"based\.toml: key base|a\.toml: cannot be read", refused(lambda: lm.load("based.toml")))


tables = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | st.dates(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)
KEYS = ["command", "command.steps", "motor", "motor.kind", "motor.limits", "gearbox.stiffness", "gearbox.stiffness.kind"]
KEYS += ["gearbox.stiffness.slopes", "gearbox.losses.values", "gearbox.losses.mirrored", "load", "load.torque", "initial"]
KEYS += ["gearbox", "gearbox.from", "gearbox.ratio", "load.torque.samples", "command.chirp", "simulation.duration", "title"]


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(key=st.sampled_from(KEYS), value=tables)
def test_any_value_under_any_key_is_read_or_refused_in_one_plain_line(large: Path, key: str, value: object) -> None:
    try:
        lm.load(large, {key: value})
    except lm.InputError as error:
        message = str(error)
        assert "\n" not in message
        assert not re.search(r"Input should|https?:|pydantic|valid tuple", message)


def test_a_jamming_gear_is_refused_with_the_advice_to_give_it_a_compliance(tmp_path: Path) -> None:
    text = GOOD.replace('kind = "curve"\nbreaks = ["0.6 mrad", "3 mrad"]\nslopes = [2650, 21200, 26500]', 'kind = "rigid"')
    text = text.replace("[gearbox.hysteresis]\nefficiency = 0.93\n", "").replace("inertia = 2.0", "inertia = 2000.0")
    text = text.replace("mirrored = true\nspeeds = [0, 1]\nloads = [0, 1]", "speeds = [0, 1]\nloads = [-1, 0, 1]")
    text = text.replace("[[0.02, 0.06], [0.08, 0.12]]", "[[1.4, 1.4], [0, 0], [2, 2]]")
    path = tmp_path / "jams.toml"
    path.write_text(text)
    refused(lambda: lm.load(path), reason="compliance")
    path.write_text(GOOD.replace("rotor_inertia = 8e-6", "rotor_inertia = 0").replace("inertia = 6.7e-6", "inertia = 0"))
    refused(lambda: lm.load(path), reason="the drive has no inertia on the input shaft; give")


# --- the command line ---
CALLS = [
    ("a file that is not there", ["run", "nothing.toml"], ["nothing.toml", "no such file"]),
    ("a file with a near name", ["run", "goood.toml"], ["did you mean good.toml"]),
    ("a directory", ["run", "."], ["directory"]),
    ("a binary file", ["run", "binary.toml"], ["UTF-8"]),
    ("an override without value", ["run", "good.toml", "--set", "ratio"], ["KEY=VALUE"]),
    ("an override of an unknown key", ["run", "good.toml", "--set", "gearbox.ration=3"], ["gearbox.ration", "ratio"]),
    ("an override with a wrong unit", ["run", "good.toml", "--set", "load.inertia=3 rad"], ["load.inertia", "3 rad"]),
    ("a number for a table", ["run", "good.toml", "--set", "gearbox.hysteresis=0.9"], ["gearbox.hysteresis", "0.9"]),
    ("an override into a value", ["run", "good.toml", "--set", "gearbox.ratio.big=3"], ["gearbox.ratio", "not a table"]),
    ("an unknown ending", ["run", "good.toml", "-o", "out.xlsx"], ["out.xlsx", ".parquet"]),
    ("no ending", ["run", "good.toml", "-o", "out"], ["ending"]),
    ("a directory as output", ["run", "good.toml", "-o", "folder.csv"], ["directory"]),
    ("an output in no directory", ["run", "good.toml", "-o", "none/out.csv"], ["none/out.csv", "directory"]),
    ("a plot of an unknown ending", ["run", "good.toml", "--plot", "out.txt"], ["out.txt", ".png"]),
    ("an explanation after the end", ["run", "good.toml", "--explain", "99"], ["--explain 99", "0.01"]),
    ("an unknown solver", ["run", "good.toml", "--solver", "euler"], ["euler", "exact"]),
    ("a tolerance of zero", ["run", "good.toml", "--solver", "dormand-prince", "--tolerance", "0"], ["tolerance"]),
    ("a tolerance below rounding", ["run", "good.toml", "--solver", "dormand-prince", "--tolerance", "1e-300"], ["--tolerance 1e-300", "between 1e-15 and 0.001"]),
    ("a tolerance of the exact solver", ["run", "good.toml", "--tolerance", "1e-9"], ["--tolerance", "exact solver has none"]),
    ("a report into a file", ["reproduce", "-o", "good.toml"], ["good.toml", "directory"]),
    ("a run that leaves all bounds", ["run", "good.toml", "--set", "command.amplitude=1e12"], ["t ="]),
    ("a range without measure", ["response", "good.toml", "--frequencies", "1..100:1000000000"], ["--frequencies 1..100:1000000000", "has more than 100000 values"]),
    (
        "a stiffness without measure",
        ["run", "good.toml", "--set", 'gearbox.stiffness={kind="linear", stiffness=1e200}'],
        ["left the range that can be computed at t =", "stiffness"],
    ),
]  # fmt: skip


@pytest.mark.parametrize(("arguments", "words"), [c[1:] for c in CALLS], ids=[c[0] for c in CALLS])
def test_bad_call_ends_in_one_line_and_exit_code_1(tmp_path: Path, arguments: list[str], words: list[str]) -> None:
    (tmp_path / "good.toml").write_text(GOOD)
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00\x01")
    (tmp_path / "folder.csv").mkdir()
    before = sorted(tmp_path.iterdir())
    done = lostmotion(*arguments, cwd=tmp_path)
    assert done.returncode == 1
    assert len(done.stderr.strip().splitlines()) == 1
    assert "Traceback" not in done.stderr
    for word in words:
        assert word in done.stderr
    assert sorted(tmp_path.iterdir()) == before


def test_titles_and_names_of_files_do_not_command_the_terminal(tmp_path: Path) -> None:
    (tmp_path / "e\x1b[31m\x07.toml").write_text(f'title = "t\\u001b]0;x\\u0007\\u009b\\r"\n{GOOD}')
    calls = [["run", "e\x1b[31m\x07.toml", "-o", "o\x1b\x07.csv"], ["run", "o\x1b\x07.csv"], ["run", "no\x1b\x07"]]
    calls += [["check", "e\x1b[31m\x07.toml"], ["run", "e\x1b[31m\x07.toml", "--set", "load.inertia=\x1b\x07"]]
    calls += [["study", "show", "\x1b\x07"], ["run", "--no\x1b\x07"]]
    for arguments in calls:
        done = lostmotion(*arguments, cwd=tmp_path)
        shown = done.stdout + done.stderr
        assert r"\x1b" in shown, arguments
        assert not re.search("[^\n\x20-\x7e\xa0-\U0010ffff]", shown), arguments
    assert lm.simulate(lm.load(tmp_path / "e\x1b[31m\x07.toml")).lm.summary().startswith(r"t\x1b]0;x\x07\x9b\r")


USAGE = [
    (["run"], ["Missing argument", "lostmotion run --help"]),
    (["rum", "good.toml"], ["rum", "lostmotion --help"]),
    (["run", "good.toml", "--bogus"], ["--bogus"]),
    (["run", "good.toml", "--explain", "0,005"], ['--explain: "0,005" has a decimal comma; write "0.005 s"']),
    (["run", "good.toml", "--explain", "5 rpm"], ['--explain: "5 rpm" has the unit of something else']),
    (["run", "good.toml", "--solver", "dormand-prince", "--tolerance", "small"], ['--tolerance: "small" is not one number']),
    (["study", "good.toml", "--threads", "two"], ['--threads: "two" must be a whole number above 0']),
]


@pytest.mark.parametrize(("arguments", "words"), USAGE, ids=[" ".join(a) for a, _ in USAGE])
def test_a_command_that_cannot_be_read_ends_in_one_line_and_exit_code_2(tmp_path: Path, arguments: list[str], words: list[str]) -> None:
    (tmp_path / "good.toml").write_text(GOOD)
    done = lostmotion(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert len(done.stderr.strip().splitlines()) == 1
    assert_plain(done.stderr)
    for word in words:
        assert word in done.stderr


def test_an_instant_may_be_given_with_its_unit(tmp_path: Path) -> None:
    (tmp_path / "good.toml").write_text(GOOD)
    bare = lostmotion("run", "good.toml", "--explain", "0.005", cwd=tmp_path)
    assert bare.returncode == 0
    first, _, rest = bare.stdout.partition("\n")
    assert first == "--explain: 0.005 s; a bare number is read in SI units"
    assert rest == lostmotion("run", "good.toml", "--explain", "5 ms", cwd=tmp_path).stdout


@pytest.mark.parametrize("ending", [".csv", ".nc", ".parquet"])
def test_a_full_disk_ends_in_one_line_and_leaves_nothing(tmp_path: Path, ending: str) -> None:
    (tmp_path / "good.toml").write_text(GOOD)
    (tmp_path / f"full{ending}").symlink_to("/dev/full")
    done = lostmotion("run", "good.toml", "-o", f"full{ending}", cwd=tmp_path)
    assert done.returncode == 1
    assert "full" in done.stderr
    assert "Traceback" not in done.stderr
    assert sorted(p.name for p in tmp_path.iterdir()) == [f"full{ending}", "good.toml"]


def test_an_old_result_survives_a_failed_write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "good.toml").write_text(GOOD)
    result = lm.simulate(lm.load(tmp_path / "good.toml"))
    target = tmp_path / "result.csv"
    lm.save(result, target)
    old = target.read_bytes()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("lostmotion.simulation.runs.result_files._header", full)
    assert "No space left" in refused(lambda: lm.save(result, target))
    assert target.read_bytes() == old
    assert sorted(p.name for p in tmp_path.iterdir()) == ["good.toml", "result.csv"]


def test_an_unreadable_file_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "secret.toml"
    path.write_text(GOOD)

    def refuse(*_: object, **__: object) -> str:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)  # a test that runs as root could read anything
    assert "secret.toml: cannot be read: Permission denied" in refused(lambda: lm.load(path))


@pytest.mark.parametrize("ending", [".csv", ".nc", ".parquet"])
def test_a_result_that_is_cut_off_or_no_result_is_refused_in_plain_words(large: Path, tmp_path: Path, ending: str) -> None:
    lm.save(lm.simulate(lm.load(large)), tmp_path / f"whole{ending}")
    content = (tmp_path / f"whole{ending}").read_bytes()
    cuts = [content[:length] for length in (len(content) // 50, len(content) // 2, len(content) - 3)]  # the last one within a number
    cut = tmp_path / f"cut{ending}"
    refused(lambda: lm.open_result(cut), reason="no such file")
    for damaged in (*cuts, b"not a result\n1,2\n"):
        cut.write_bytes(damaged)
        message = refused(lambda: lm.open_result(cut), match=re.escape(cut.name))
        assert_plain(message)
        assert not re.search("Error|Arrow|sblock|header", message)


def test_an_error_carries_keys_and_reasons_as_data(tmp_path: Path) -> None:
    """Errors have keys, reasons, the file and the number of further problems as data."""
    with pytest.raises(lm.InputError) as one:
        lm.Load(inertia=-1.0)
    assert [(p.keys, p.reason) for p in one.value.problems] == [(("inertia",), "-1.0 must be greater than 0")]
    again = pickle.loads(pickle.dumps(one.value))
    assert (str(again), again.problems) == (str(one.value), one.value.problems)
    assert str(again.with_keys("load.{}".format)) == "key load.inertia: -1.0 must be greater than 0"
    with pytest.raises(lm.InputError) as several:
        lm.Motor(kind="dc", rotor_inertia=-1.0, friction_torque=-2.0)
    keys = {key for problem in several.value.problems for key in problem.keys}
    assert {"rotor_inertia", "friction_torque"} <= keys
    assert str(several.value) == "; ".join(problem.sentence() for problem in several.value.problems)
    # In the short form a continuous controller has the key that its file has, wherever in the train it is refused.
    path = tmp_path / "short.toml"
    path.write_text(
        'base = "paper-2dof-nl-small"\n[controller]\nkind = "continuous"\nlimit = 1.0\nshaft = "lod"\n'
        'reference = { kind = "position", mean = 0.1 }\nposition = { gain = 2.0 }\n'
    )
    refused(lambda: lm.load(path), "controller.shaft")


def test_no_layer_takes_a_message_apart() -> None:
    """Text of an error is passed on as it is: nothing is replaced in it, cut off or looked for."""
    apart = re.compile(r"str\((error|problem|refused)\)\.(replace|removeprefix|removesuffix|partition|startswith)")
    found = {p.name: apart.findall(p.read_text()) for p in (ROOT / "src" / "lostmotion").rglob("*.py")}
    assert {name for name, hits in found.items() if hits} == set()

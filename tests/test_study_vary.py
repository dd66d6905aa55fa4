"""What a study can vary: records by name, conditions of their use, entries of lists; and what it cannot."""

import re
from pathlib import Path

import numpy as np
import pytest

import lostmotion as lm
from conftest import ROOT, lostmotion
from lostmotion.data_sheets.gearbox_sheet import GearboxSheet
from lostmotion.reports.study import read_table
from lostmotion.studies.runs.chunk import scenario_of_run
from refusals import refused

JOINT = ROOT / "scenarios" / "catalogue-robot-joint.toml"
OVERRUNNING = ROOT / "scenarios" / "overrunning-load.toml"
GEARBOXES = ("schaeffler-rt1-h-20-100", "schaeffler-rt1-h-25-100")
SHORT = 'set = { "simulation.duration" = 0.2, "simulation.sample_interval" = 0.002 }\n'


def write(tmp_path: Path, text: str, base: Path = JOINT) -> Path:
    path = tmp_path / "s.toml"
    keep = '[keep]\npeak = "peak(twist)"\nlost = "energy.gear_losses"\n'
    path.write_text(f'base = "{base}"\n{SHORT}{text}\n{keep}')
    return path


def rows_of(path: Path, tmp_path: Path) -> tuple[lm.studies.Study, dict]:
    study = lm.studies.load_study(path)
    return study, read_table(lm.study(study, tmp_path / "rows")).to_pydict()


@pytest.mark.parametrize("key", ["gearbox", "gearbox.from"])
def test_a_row_of_a_gearbox_equals_the_single_run_with_it(tmp_path: Path, key: str):
    study, rows = rows_of(write(tmp_path, f'[[vary]]\nkey = "{key}"\nvalues = {list(GEARBOXES)}'), tmp_path)
    assert rows[key] == list(GEARBOXES)
    short = {"simulation.duration": 0.2, "simulation.sample_interval": 0.002}
    for run, name in enumerate(GEARBOXES):
        part = lm.gearbox(name).model_copy(update={"hysteresis": lm.model.Hysteresis(efficiency=0.95)})  # beside `from`
        single = lm.load(JOINT, short).model_copy(update={"gearbox": part})
        assert scenario_of_run(study, run).gearbox.model_copy(update={"note": ""}) == part.model_copy(update={"note": ""})
        result = lm.simulate(single)
        assert rows["peak"][run] == float(abs(result["twist"]).max())
        assert rows["lost"][run] == lm.energy_of(result)["gear_losses"]


def test_a_row_of_a_motor_equals_the_single_run_with_it(tmp_path: Path):
    names = ["maxon-ec-i-52-606793", "maxon-ec-60-flat-614949"]
    study, rows = rows_of(write(tmp_path, f'[[vary]]\nname = "m"\nkey = "motor"\nvalues = {names}'), tmp_path)
    assert rows["m"] == names
    for run, name in enumerate(names):
        assert scenario_of_run(study, run).motor == lm.motor(name)
        assert rows["peak"][run] == float(abs(lm.simulate(scenario_of_run(study, run))["twist"]).max())


def test_wear_and_temperature_of_a_record_vary(tmp_path: Path):
    text = """
design = "list"
[[vary]]
key = "gearbox.added_backlash"
values = [0, "1 arcmin", 0, 0]
[[vary]]
key = "gearbox.loss_factor"
values = [1, 1, 1.5, 1]
[[vary]]
key = "gearbox.temperature"
values = ["20 degC", "20 degC", 20, 60]
"""
    study, rows = rows_of(write(tmp_path, text), tmp_path)
    made = [(0.0, 1.0, 20.0), (np.pi / 10800.0, 1.0, 20.0), (0.0, 1.5, 20.0)]
    for run, (backlash, factor, temperature) in enumerate(made):
        part = lm.gearbox(GEARBOXES[0], added_backlash=backlash, loss_factor=factor, temperature=temperature)
        own = scenario_of_run(study, run).gearbox
        assert own.losses == part.losses
        assert own.stiffness.slopes == part.stiffness.slopes
        assert own.stiffness.backlash == pytest.approx(part.stiffness.backlash, rel=1e-15)
    assert len(set(rows["peak"][:3])) == 3
    assert rows["error"][:3] == [""] * 3
    assert "for 60 °C it also needs losses.lubricant" in rows["error"][3]


def test_of_each_gearbox_its_own_figures_are_scaled(tmp_path: Path):
    text = f"""
[[vary]]
key = "gearbox"
values = {list(GEARBOXES)}
[[vary]]
key = "gearbox.stiffness.slopes"
relative = true
values = [0.9, 1.1]
[[vary]]
key = "gearbox.loss_factor"
values = [1, 2]
"""
    study, rows = rows_of(write(tmp_path, text), tmp_path)
    assert study.total == len(rows["run"]) == 8
    for run in range(8):
        own = scenario_of_run(study, run).gearbox
        plain = lm.gearbox(rows["gearbox"][run], loss_factor=rows["gearbox.loss_factor"][run])
        factor = rows["gearbox.stiffness.slopes"][run]
        assert own.stiffness.slopes == pytest.approx([factor * k for k in plain.stiffness.slopes], rel=1e-15)
        assert own.losses == plain.losses


def test_a_random_design_draws_names_too(tmp_path: Path):
    text = f"""
design = "random"
runs = 40
seed = 2
[[vary]]
key = "gearbox"
values = {list(GEARBOXES)}
[[vary]]
key = "load.inertia"
uniform = [1.0, 2.0]
"""
    study, rows = rows_of(write(tmp_path, text), tmp_path)
    assert set(rows["gearbox"]) == set(GEARBOXES)
    assert rows["error"] == [""] * 40
    assert study.parameters(7, 8)[0, 1] == rows["load.inertia"][7]


def test_a_constant_load_torque_varies_in_its_own_unit(tmp_path: Path):
    study, rows = rows_of(write(tmp_path, '[[vary]]\nkey = "load.torque"\nvalues = ["3 N*m", "500 N*cm"]', OVERRUNNING), tmp_path)
    assert rows["load.torque"] == [3.0, 5.0]
    assert [scenario_of_run(study, run).load.torque.mean for run in range(2)] == [3.0, 5.0]
    assert study.vary[0].unit == "N*m"
    refused(lambda: lm.studies.load_study(write(tmp_path, '[[vary]]\nkey = "load.torque"\nvalues = ["3,5 N*m"]', OVERRUNNING)), "vary[0]")


def test_runs_that_fail_are_counted_on_the_command_line(tmp_path: Path):
    path = write(tmp_path, '[[vary]]\nkey = "gearbox.temperature"\nvalues = ["20 degC", "40 degC"]')
    done = lostmotion("study", path, "-o", path.stem, cwd=tmp_path)
    assert done.returncode == 1
    assert len(done.stderr.strip().splitlines()) == 1
    assert "1 of 2 runs failed, such as: gearbox schaeffler-rt1-h-20-100: has data for 20 °C only" in done.stderr
    rows = read_table(tmp_path / path.stem).to_pydict()  # what went well stays, with what went wrong
    assert [bool(error) for error in rows["error"]] == [False, True]


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ('key = "gearbox"\ncatalogue = { ratio = [120, 50] }', "has catalogue.ratio = [120, 50], which is reversed"),
        ('key = "gearbox"\ncatalogue = { ratio = [120] }', "has catalogue.ratio = [120]; it must be a list of minimum"),
        ('key = "gearbox"\ncatalogue = { kind = ["worm", true] }', 'catalogue.kind = ["worm", true]; it must be a text'),
        ('key = "gearbox"\ncatalogue = ["worm"]', 'has catalogue = ["worm"]; it must be a table'),
        ('key = "gearbox"\nvalues = [true]', "has the value true, which is no name of a gearbox"),
        ('key = "temperature"\nvalues = [20]', "did you mean gearbox.temperature?"),
        ('key = "inertja"\nvalues = [20]', "varies inertja, which the base scenario does not know (there is no inertja)"),
        ('key = "motor.inertia"\nvalues = [20]', "does not know (there is no inertia)"),  # that of the load is another one
        ('key = "gearbox.backlash"\nvalues = [0]', "did you mean gearbox.stiffness.backlash?"),
        ('key = "load.inertai"\nvalues = [20]', "did you mean load.inertia?"),
    ],
)
def test_what_is_wrong_with_a_parameter_is_said_in_the_words_of_the_file(tmp_path: Path, text: str, sentence: str):
    message = refused(lambda: lm.studies.load_study(write(tmp_path, f"[[vary]]\n{text}")))
    assert sentence in message
    assert not re.search("True|'", message)


def test_the_catalogue_is_filtered_by_figures(tmp_path: Path):
    filters = '{ kind = "strain_wave", ratio = [90, 110], rated_output_torque = ["20 N*m", "60 N*m"], manufacturer = "Schae*" }'
    study = lm.studies.load_study(write(tmp_path, f'[[vary]]\nkey = "gearbox"\ncatalogue = {filters}'))
    fitting = {
        r.name
        for r in lm.catalogue()
        if isinstance(r, GearboxSheet)
        and r.kind == "strain_wave"
        and r.manufacturer.startswith("Schae")
        and 90 <= r.ratio <= 110
        and r.rated_output_torque is not None
        and 20 <= r.rated_output_torque <= 60
    }
    assert set(study.vary[0].values) == fitting
    assert len(fitting) > 1
    everything = lm.studies.load_study(write(tmp_path, '[[vary]]\nkey = "gearbox"\ncatalogue = {}'))
    bought = [r for r in lm.catalogue() if isinstance(r, GearboxSheet) and not r.illustrative]
    assert everything.total == len(bought)


def test_a_record_with_gaps_is_a_row_that_says_what_it_lacks(tmp_path: Path):
    names = [GEARBOXES[0], "nord-sk1si50-60"]
    _, rows = rows_of(write(tmp_path, f'[[vary]]\nkey = "gearbox"\nvalues = {names}'), tmp_path)
    assert rows["error"][0] == ""
    assert "nord-sk1si50-60" in rows["error"][1]
    assert "lacks inertia" in rows["error"][1]


def test_a_sheet_of_one_s_own_stands_beside_the_study(tmp_path: Path):
    sheet = (ROOT / "src" / "lostmotion" / "data_sheets" / "gearbox-template.toml").read_text()
    (tmp_path / "own.toml").write_text(sheet)
    study = lm.studies.load_study(write(tmp_path, f'[[vary]]\nkey = "gearbox"\nvalues = ["own.toml", "{GEARBOXES[0]}"]'))
    assert study.vary[0].names == (str(tmp_path / "own.toml"), GEARBOXES[0])
    assert scenario_of_run(study, 0).gearbox.ratio == 100.0


def test_entries_of_lists_vary(tmp_path: Path):
    text = """
design = "list"
[[vary]]
key = "command.ramps.0.rise"
values = [-0.15, -0.3]
[[vary]]
key = "command.ramps.0.duration"
values = ["500 ms", "0.1 s"]
[[vary]]
key = "gearbox.stiffness.slopes.1"
relative = true
values = [1.0, 1.2]
"""
    study, rows = rows_of(write(tmp_path, text, OVERRUNNING), tmp_path)
    base = study.scenario
    assert scenario_of_run(study, 0) == base
    other = scenario_of_run(study, 1)
    assert other.command.ramps[0].model_dump() == {"rise": -0.3, "duration": 0.1, "begin": 0.2}
    first, second, third = base.gearbox.stiffness.slopes
    assert other.gearbox.stiffness.slopes == (first, 1.2 * second, third)
    assert rows["command.ramps.0.duration"] == [0.5, 0.1]


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ('key = "gearbox.stiffness"\nrelative = true\nvalues = [1, 2]', "is a table; vary one of its keys: gearbox.stif"),
        ('key = "gearbox.stiffness"\nvalues = [1, 2]', "gearbox.stiffness.slopes"),
        ('key = "command"\nrelative = true\nvalues = [1, 2]', "is a table"),
        ('key = "load"\nvalues = [1, 2]', "is a table"),
        ('key = "motor.voltage_limit"\nrelative = true\nvalues = [1, 2]', "no value there to multiply"),
        ('key = "command.sines.0.amplitude"\nvalues = [1, 2]', "no entry 0; the list has 0 entries"),
        ('key = "command.ramps.3.rise"\nvalues = [1, 2]', "no entry 3"),
        ('key = "command.ramps.rise"\nvalues = [1, 2]', "'rise' is no index"),
        ('key = "command.ramps"\nrelative = true\nvalues = [1, 2]', "is a list; vary its entries"),
        ('key = "gearbox.stiffness.slopes"\nvalues = [1e4, 2e4]', "is a list; vary its entries"),
        ('key = "command.chirp"\nvalues = [1, 2]', "does not have; give it there first"),
        ('key = "motor.kind"\nvalues = [1, 2]', "no number"),
        ('key = "title"\nvalues = [1, 2]', "no number"),
        ('key = "gearbox.losses.mirrored"\nvalues = [0, 1]', "no number"),
        ('key = "load.__class__"\nvalues = [1, 2]', "does not know"),
        ('key = "drive"\nvalues = [1, 2]', "does not know"),
        ('key = "gearbox.loss_factor"\nvalues = [1, 2]', "belongs beside `from`, but the gearbox of the base"),
        ('key = "gearbox"\nvalues = ["schaeffler-rt1-h-20-10"]', "did you mean schaeffler-rt1-h-20-100"),
        ('key = "gearbox"\nvalues = [1]', "which is no name of a gearbox"),
        ('key = "gearbox"\nvalues = ["maxon-ec-i-52-606793"]', "is a motor; a gearbox is wanted here"),
        ('key = "gearbox"\nvalues = ["none.toml"]', "no such file"),
        ('key = "gearbox"\nuniform = [0, 1]', "needs? .*values or catalogue"),
        ('key = "gearbox"\nrelative = true\nvalues = ["schaeffler-rt1-h-20-100"]', "a key of their own"),
        ('keys = ["gearbox", "load.inertia"]\nvalues = ["schaeffler-rt1-h-20-100"]', "a key of their own"),
        ('key = "gearbox"\ncatalogue = { colour = "red" }', "colour, which is no datum of a gearbox"),
        ('key = "gearbox"\ncatalogue = { ratio = 100 }', "list of minimum and maximum"),
        ('key = "gearbox"\ncatalogue = { ratio = ["1 N", "2 N"] }', "ratio"),
        ('key = "gearbox"\ncatalogue = { kind = "belt" }', "which no gearbox of the catalogue has"),
        ('key = "gearbox"\ncatalogue = { kind = 1 }', "must be a text"),
        ('key = "gearbox"\ncatalogue = "all"', "must be a table"),
        ('key = "gearbox"\ncatalogue = {}\nvalues = ["schaeffler-rt1-h-20-100"]', "give one of the two"),
        ('key = "load.inertia"\ncatalogue = {}', "which only gearbox"),
        ('key = "load.inertia"\nvalues = ["schaeffler-rt1-h-20-100"]', "load.inertia"),
        ('key = "load.inertai"\nvalues = ["1.5 kg*m^2"]', "does not know .*; did you mean load.inertia"),
        ('key = "load.inertia"\nrelative = "no"\nvalues = [1, 2]', 'relative: "no"'),
    ],
)
def test_what_cannot_vary_ends_in_one_clear_line(tmp_path: Path, text: str, match: str):
    path = write(tmp_path, f"[[vary]]\n{text}", OVERRUNNING)
    assert refused(lambda: lm.studies.load_study(path), match=match).startswith(str(path))


def test_a_record_varied_twice_is_refused(tmp_path: Path):
    one, other = (f'[[vary]]\nkey = "{k}"\nvalues = ["{GEARBOXES[0]}"]\n' for k in ("gearbox", "gearbox.from"))
    assert "which are the same" in refused(lambda: lm.studies.load_study(write(tmp_path, one + other)))


def test_lists_of_lists_are_scaled_too(tmp_path: Path):
    text = '[[vary]]\nkey = "gearbox.losses.values"\nrelative = true\nvalues = [1.0, 0.5]'
    study, rows = rows_of(write(tmp_path, text, OVERRUNNING), tmp_path)
    half = np.array(scenario_of_run(study, 1).gearbox.losses.values)
    assert half == pytest.approx(0.5 * np.array(study.scenario.gearbox.losses.values))
    assert rows["lost"][1] < rows["lost"][0]


def test_a_study_made_in_python_varies_records_as_well(tmp_path: Path):
    study = lm.studies.Study(
        scenario=lm.load(OVERRUNNING, {"simulation.duration": 0.1}),
        vary=[{"key": "gearbox", "values": GEARBOXES}],
        keep={"peak": "peak(twist)"},
    )
    table = read_table(lm.study(study, tmp_path / "s"))
    assert table["gearbox"].to_pylist() == list(GEARBOXES)
    assert scenario_of_run(study, 1).gearbox == lm.gearbox(GEARBOXES[1])

"""Expressions of what a study keeps: their grammar and what it refuses, their values, their units."""

import os
import time
from pathlib import Path

import numpy as np
import pint
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

import lostmotion as lm
from conftest import ROOT
from lostmotion.paper import paper_scenario
from lostmotion.simulation.runs.results import ENERGY
from lostmotion.simulation.variables import VARIABLES
from lostmotion.studies.expressions.expressions import OF_THE_RUN, read_expression
from lostmotion.studies.expressions.functions import FUNCTIONS, METHODS
from lostmotion.studies.expressions.vocabulary import vocabulary_of
from refusals import refused

VOCABULARY = vocabulary_of(lm.load("paper-2dof-nl-small"))


@pytest.mark.parametrize(
    ("expression", "unit"),
    [
        ("mean(input_contact == 0)", "1"),
        ("(output_torque * motor_speed).integrate('time')", "N*m*rad"),
        ("sqrt(mean(output_torque**2))", "N*m"),
        ("peak(output_torque) / peak(twist)", "N*m/rad"),
        ("bandwidth(0.1)", "Hz"),
        ("bandwidth(amplitude=0.1)", "Hz"),
        ("dead_time(load_angle, share=0.05)", "s"),
        ("energy.source - energy.load_work", "J"),
        ("peak(load_speed - ideal_speed)", "rad/s"),
        ("load_speed.differentiate('time').var('time')", "rad^2/s^4"),
        ("motor_power.where(motor_power > 0, 0).integrate()", "W*s"),
        ("load_angle.idxmax()", "s"),
        ("twist.sel(time=0.1, method='nearest')", "rad"),
        ("peak(twist) * 1e6", ""),  # of what may be a change of unit nothing is claimed
        ("peak(twist) + peak(load_speed)", ""),
    ],
)
def test_an_expression_has_the_unit_of_what_it_gives(expression: str, unit: str):
    parse = pint.UnitRegistry().Unit
    found = read_expression(expression, VOCABULARY).unit
    assert (found == "") == (unit == "")
    assert parse("" if found == "1" else found.replace("^", "**")) == parse("" if unit == "1" else unit)


def test_the_page_on_studies_names_all_that_an_expression_may_use():
    page = (ROOT / "docs" / "studies.md").read_text()
    for name in (*FUNCTIONS, *OF_THE_RUN, *(f".{m}" for m in METHODS)):
        assert f"`{name}" in page


# --- values ---


def sampled() -> dict[str, xr.DataArray]:
    """Three runs of eleven samples, with a gap in one of them."""
    rng = np.random.default_rng(1)
    coordinates = {"time": np.arange(11) * 0.1}
    data = {v.name: xr.DataArray(rng.normal(size=(3, 11)), coordinates, ("run", "time")) for v in VARIABLES}
    data["efficiency"][1, 3:5] = np.nan
    data["input_contact"] = np.sign(data["input_contact"]).where(abs(data["input_contact"]) > 0.5, 0.0)
    return data


@pytest.mark.parametrize(
    "expression",
    [
        "efficiency.where(motor_power > 0).mean('time')",
        "efficiency.where((motor_power > 0) & ~(load_speed < 0.1) | (twist == 0)).max('time')",
        "load_speed.where(twist > 0, -1).min('time')",
        "(2*load_speed**2 - 3/twist + -motor_speed).sum('time')",
        "load_angle.std('time') / load_angle.median('time')",
        "load_angle.var('time')**0.5",
        "load_angle.quantile(0.9, 'time')",
        "load_speed.differentiate('time').max('time')",
        "motor_power.integrate('time')",
        "twist.idxmax('time') - twist.idxmin('time')",
        "efficiency.count('time') + 2*(load_speed > 0).any('time') - (load_speed > -9).all('time')",
        "efficiency.fillna(0.5).mean('time')",
        "twist.clip(-0.5, 0.5).mean('time')",
        "twist.clip(max=0.5).mean('time')",
        "efficiency.isnull().mean('time') + efficiency.notnull().mean('time')",
        "twist.isel(time=-1) - twist.isel(time=0)",
        "twist.sel(time=0.32, method='nearest')",
        "(0 < twist).mean('time')",
    ],
)
def test_an_expression_gives_what_xarray_gives_for_it(expression: str):
    data = sampled()
    expected = eval(expression, {"__builtins__": {}}, dict(data))  # of the list above
    assert read_expression(expression, VOCABULARY).values(data, 3) == pytest.approx(expected.values, rel=1e-14, nan_ok=True)


def test_functions_and_chains_of_comparisons_give_what_numpy_gives():
    data = sampled()
    x = data["twist"].values
    expected = {
        "peak(twist)": np.max(np.abs(x), axis=1),
        "rms(twist - 1)": np.sqrt(np.mean((x - 1.0) ** 2, axis=1)),
        "final(abs(twist))": np.abs(x[:, -1]),
        "mean(exp(sign(twist)))": np.mean(np.exp(np.sign(x)), axis=1),
        "log(sqrt(largest(twist) + 9))": np.log(np.sqrt(np.max(x, axis=1) + 9.0)),
        "mean(-0.5 < twist < 0.5)": np.mean((x > -0.5) & (x < 0.5), axis=1),
        "mean((twist > 0) - (twist < 0))": np.mean(np.sign(x), axis=1),
        "tracking_error(twist, reference=0.5)": np.sqrt(np.mean((x - 0.5) ** 2, axis=1)),
        "1 / 0 + 2**-1": np.full(3, np.inf),
        "9**9**9**9": np.full(3, np.inf),
    }
    for text, values in expected.items():
        assert read_expression(text, VOCABULARY).values(data, 3) == pytest.approx(values, rel=1e-13), text


# --- what is refused ---

HARMFUL = [
    # methods and attributes that write, load or call
    "load_speed.to_netcdf('f')",
    "load_speed.mean('time').to_netcdf('f')",
    "abs(load_speed).to_netcdf('f')",
    "(load_speed + 0).to_zarr('f')",
    "peak(load_speed.to_netcdf('f'))",
    "load_speed.where(load_speed.to_netcdf('f')).mean('time')",
    "load_speed.where(twist > 0, load_speed.to_pickle('f')).mean('time')",
    "load_speed.to_dataset(name='x').to_netcdf('f')",
    "load_speed.to_pandas().to_pickle('f')",
    "load_speed.to_dataframe('x').to_csv('f')",
    "load_speed.to_series()",
    "load_speed.values.tofile('f')",
    "load_speed.data.dump('f')",
    "load_speed.variable.values.tofile('f')",
    "load_speed.plot()",
    "load_speed.pipe(abs)",
    "load_speed.reduce(abs, 'time')",
    "load_speed.map_blocks(abs)",
    "load_speed.attrs.update(a=1)",
    "load_speed.load()",
    "load_speed.coords",
    "load_speed.T.values",
    "load_speed.mean",
    "energy.gear_losses.to_netcdf('f')",
    "energy.gear_losses.mean('time')",
    "energy.__dict__",
    "energy.source.__class__",
    "time.to_netcdf('f')",
    "ideal_speed.to_netcdf('f')",
    "bandwidth.__globals__",
    "bandwidth().to_netcdf('f')",
    # ways to what Python has
    "__import__('os').system('touch f')",
    "open('f', 'w')",
    "eval('1')",
    "exec('1')",
    "getattr(load_speed, 'to_netcdf')('f')",
    "load_speed.__class__",
    "load_speed.__class__.__mro__",
    "().__class__.__bases__[0].__subclasses__()",
    "(1).__class__",
    "1..real",
    "''.__class__.__mro__[1].__subclasses__()",
    "'{0.__class__}'.format(load_speed)",
    "f'{load_speed.__class__}'",
    "f'{load_speed.to_netcdf(1)}'",
    "peak.__globals__",
    "peak.of_values",
    "peak.__closure__[0].cell_contents",
    "peak.__call__(load_speed)",
    "peak.to_netcdf('f')",
    "sqrt.__self__",
    "exp.reduce(load_speed)",
    "abs.__self__",
    "(lambda: 1)()",
    "(lambda x: x.to_netcdf('f'))(load_speed)",
    "(x := load_speed).to_netcdf('f')",
    "[x for x in load_speed]",
    "{x for x in load_speed}",
    "{x: 1 for x in load_speed}",
    "sum(x for x in load_speed)",
    "[load_speed.to_netcdf('f')][0]",
    "(load_speed.to_netcdf('f'), 1)[1]",
    "{'a': load_speed}['a']",
    "load_speed if load_speed.to_netcdf('f') else twist",
    "peak(load_speed) and load_speed.to_netcdf('f')",
    "not peak(load_speed)",
    "peak(*[load_speed])",
    "peak(**{'x': load_speed})",
    "peak(x=load_speed, **{})",
    "load_speed.mean(**{'dim': 'run'})",
    "(yield load_speed)",
    "await load_speed",
    "print('f')",
    "globals()",
    # arguments that are not theirs
    "load_speed.mean('run')",
    "load_speed.mean(dim='run')",
    "load_speed.mean('time', keep_attrs=True)",
    "load_speed.mean(dim=load_speed.to_netcdf('f'))",
    "load_speed.mean('time', 'run')",
    "load_speed.isel(run=0)",
    "load_speed.isel(time=0.5)",
    "load_speed.isel(time=peak(twist))",
    "load_speed.isel(time=slice(0, 1))",
    "load_speed.sel(time='2020')",
    "load_speed.sel(time=0.1, method='f')",
    "load_speed.sel(time=0.1, tolerance=load_speed.to_netcdf('f'))",
    "load_speed.quantile('0.5', 'time')",
    "load_speed.quantile(peak(twist))",
    "load_speed.quantile(1.5)",
    "dead_time(load_speed, -0.1)",
    "load_speed.where('twist > 0').mean('time')",
    "load_speed.where(twist).mean('time')",
    "load_speed.where(lambda x: x > 0).mean('time')",
    "load_speed.where(twist > 0, drop=True).mean('time')",
    "load_speed.fillna('f').mean('time')",
    "load_speed.clip(0, 1, keep_attrs=True).mean('time')",
    "peak(load_speed, 'run')",
    "peak()",
    "peak(3)",
    "peak(peak(load_speed))",
    "peak(peak)",
    "dead_time(load_speed, peak(twist))",
    "bandwidth('0.1')",
    "bandwidth(load_speed)",
    "bandwidth(0.1, 0.2)",
    "tracking_error(load_speed)",
    # what is not a number, name or operator of the grammar
    "'f'",
    "b'f'",
    "True",
    "None",
    "...",
    "1j",
    "peak",
    "energy",
    "bandwidth",
    "load_speed",
    "load_speed[0]",
    "load_speed[..., -1]",
    "load_speed[:, 0]",
    "peak(load_speed) // 2",
    "peak(load_speed) % 2",
    "peak(load_speed) @ twist",
    "peak(load_speed) << 2",
    "peak(load_speed) ^ 2",
    "peak(load_speed) is 2",
    "1 in load_speed",
    "~load_speed",
    "peak(load_speed) & 1",
    "peak(load_speed); peak(twist)",
    "peak(load_speed) = 1",
    "import os",
    "peak(load_speed",
    "",
    "#",
    "\x00",
    "peak(load_speed)\x00",
    "1e999",
    "9" * 400,
    "9" * 5000,
    "-" * 1500 + "1",
    "(" * 900 + "1" + ")" * 900,
    "(" * 150 + "1" + ")" * 150 + "()",
    "peak(" * 150 + "twist" + ")" * 150,
    "1" + "+1" * 3000,
    "abs(" * 90 + "load_speed.to_netcdf('f')" + ")" * 90,
    # names in other letters: Python reads them as the plain ones
    "load_speed.\uff54o_netcdf('f')",
    "\uff4fpen('f')",
]


@pytest.mark.parametrize("expression", HARMFUL, ids=lambda text: repr(text[:40]))
def test_what_is_not_in_the_grammar_is_refused_before_anything_runs(expression: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    begun = time.process_time()
    with pytest.raises(ValueError, match=r".") as caught:
        read_expression(expression, VOCABULARY)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 2600
    assert time.process_time() - begun < 2.0
    assert os.listdir() == []


def test_a_study_file_with_such_an_expression_is_refused_as_a_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(tmp_path)
    base = ROOT / "scenarios" / "paper-2dof-nl-large.toml"
    study = f"""base = "{base}"\ndesign = "list"\n[[vary]]\nkey = "load.inertia"\nvalues = [1, 2]\n[keep]\n"""
    path = tmp_path / "s.toml"
    path.write_text(study + 'good = "peak(load_speed)"\nbad = "load_speed.to_netcdf(\'f\')"\n')
    refused(lambda: lm.studies.load_study(path), match=r"s\.toml: .*keep\.bad: .*must not use \.to_netcdf; the methods are mean")
    assert os.listdir() == ["s.toml"]
    scenario = paper_scenario("2-DOF-NL", "large")
    with pytest.raises(ValueError, match="must not use"):
        lm.studies.Study(scenario=scenario, vary=[{"key": "load.inertia", "values": [1]}], keep={"bad": "load_speed.values"})


NAMES = (*(v.name for v in VARIABLES), *FUNCTIONS, *OF_THE_RUN, *METHODS, "to_netcdf", "values", "__class__", "open")
PIECES = (*NAMES, *(f"energy.{e}" for e in ENERGY), *"()[]{}.,+-*/~&|<>='", "'time'", "0", "1", "-1", "0.5", "**", "==")


@settings(max_examples=1000, deadline=None)
@given(st.lists(st.sampled_from(PIECES), max_size=9))
def test_whatever_is_written_is_either_read_and_has_a_value_for_each_run_or_refused(pieces: list[str]):
    try:
        expression = read_expression("".join(pieces), VOCABULARY)
    except ValueError:
        return
    names = sampled() | {"energy": {e: xr.DataArray(np.ones(3), dims="run") for e in ENERGY}}
    names |= {"ideal_speed": names["load_speed"], "time": names["load_speed"]["time"]}
    names["bandwidth"] = lambda amplitude=1.0: amplitude * xr.DataArray(np.ones(3), dims="run")
    assert expression.values(names, 3).shape == (3,)

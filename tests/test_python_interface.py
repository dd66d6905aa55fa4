"""The Python interface: what takes a scenario, what can be pickled, shown and plotted, what is exported."""

import copy
import importlib
import inspect
import pickle
import pydoc
import re
import threading
import timeit

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from pydantic import BaseModel

import lostmotion as lm
from conftest import ROOT, SCENARIOS
from lostmotion.inputs.part import Part
from lostmotion.reports import thinning
from public_names import FLAT, NAMESPACES, PATHS, public
from refusals import refused

SMALL = lm.load("paper-2dof-nl-small")


# --- scenarios in place of drives ---
def test_every_function_that_needs_a_drive_takes_a_scenario() -> None:
    drive, rigid = SMALL.drive(), lm.load("paper-1dof-l-large")
    for takes in (
        lambda d: lm.response.bandwidth(d, 1.0),
        lambda d: lm.frequency_response(d, [1.0], 1.0)["response"].values,
        lambda d: lm.response.characteristics(lm.frequency_response(d, [1.0, 9.0], 1.0), d)["bandwidth"].values,
        lambda d: lm.Simulation(d)["command"],
    ):
        assert np.array_equal(takes(drive), takes(SMALL), equal_nan=True)
    assert lm.response.rigid_constants(rigid) == lm.response.rigid_constants(rigid.drive())
    assert lm.linearize(SMALL, lm.Initial(motor_speed=1.0)).contacts == (lm.linearize(drive, lm.Initial(motor_speed=1.0)).contacts)
    one, other = lm.periodic_motion(SMALL), lm.periodic_motion(drive, SMALL.command)
    assert np.array_equal(one["load_speed"], other["load_speed"])
    (only,) = lm.response.periodic_motions(SMALL, starts=[lm.Initial()])
    assert np.array_equal(only["load_speed"], one["load_speed"])


def test_a_scenario_brings_its_constant_inputs_and_its_start_along() -> None:
    scenario = SMALL.replace(**{"command.mean": 0.2, "load.torque": 3.0, "initial.load_angle": 1.5})
    assert lm.Simulation(scenario)["load_angle"] == 1.5
    response = lm.frequency_response(scenario, [1.0], 0.1)
    same = lm.frequency_response(scenario.drive(), [1.0], 0.1, mean_command=0.2, mean_load_torque=3.0)
    without = lm.frequency_response(scenario.drive(), [1.0], 0.1)
    assert np.array_equal(response["response"], same["response"])
    assert not np.array_equal(response["response"], without["response"])


# --- pickling, showing ---
@pytest.mark.parametrize("path", SCENARIOS, ids=lambda p: p.stem)
def test_scenarios_drives_and_results_survive_pickling(path) -> None:
    scenario = lm.load(path)
    parts = {"mean": 1.0, "sines": [{"amplitude": 1.0, "frequency": 2.0}], "steps": [{"height": 1.0}]}
    parts |= {"ramps": [{"rise": 1.0, "duration": 2.0}], "samples": {"times": [0, 1], "values": [0, 1]}}
    chirp = {"amplitude": 1.0, "begin_frequency": 1.0, "end_frequency": 2.0, "duration": 1.0}
    for thing in (scenario, scenario.drive(), scenario.command, scenario.load, lm.TorqueSignal(**parts, chirp=chirp)):
        assert pickle.loads(pickle.dumps(thing)) == thing
        assert copy.deepcopy(thing) == thing
    result = lm.simulate(scenario)
    assert pickle.loads(pickle.dumps(result)).identical(result)
    assert result.lm.scenario == scenario
    assert result.lm.energy == lm.energy_of(result)


def test_representations_are_short_and_name_the_drive() -> None:
    assert repr(SMALL.drive()) == (
        "Drive(Motor(dc, 0.521 N·m at 3300 rpm, rotor 8e-06 kg·m²), Gearbox(90:1, 51.6 N·m at 3630 rpm, "
        "stiffness curve, losses map), Load(2 kg·m²))"
    )
    assert len(repr(SMALL)) < 300
    assert "0.025" in repr(SMALL)
    assert "2001 samples" in repr(SMALL)
    assert repr(lm.CommandSignal(mean=0.5)) == "CommandSignal(mean=0.5)"
    long = lm.CommandSignal(samples={"times": range(1000), "values": range(1000)})
    assert len(repr(long)) < 200
    assert "1000 entries" in repr(long)
    assert "values=(6 x 7 numbers)" in repr(SMALL.gearbox.losses)
    simulation = lm.Simulation(SMALL)
    simulation.advance(0.25, 0.1)
    assert repr(simulation).endswith("at 0.25 s)")
    assert len(repr(lm.linearize(SMALL, lm.Initial(motor_speed=1.0)))) < 300


@pytest.mark.parametrize("name", ["paper-2dof-nl-small", "position-axis", "catalogue-robot-joint"])
def test_notebooks_show_every_value_with_its_unit(name: str) -> None:
    page = lm.load(name)._repr_html_()
    assert "<td>rotor_inertia</td>" in page
    assert "<td>kg·m²</td>" in page
    assert "E_C: 1 is rated voltage" not in page  # a table has its own rows, not its description
    assert page.count("<table>") == page.count("</table>") > 5


def test_the_schema_describes_fields_by_their_docstrings() -> None:
    class Own(lm.Brake):
        torque: float
        colour: str = ""
        """as it is painted"""

    def described(part: type[BaseModel], field: str) -> str | None:
        return part.model_json_schema()["properties"][field].get("description")

    assert str(described(lm.Brake, "shaft")) == "shaft that the brake holds"
    assert str(described(lm.Brake, "torque")).startswith("capacity while it slips")  # of its base
    assert described(Own, "colour") == "as it is painted"
    assert described(Own, "torque") is None  # annotated anew, without one
    assert described(Own, "engagement_delay") == "from a step up of the command until it acts"
    brakes = lm.Scenario.model_json_schema()["$defs"]["train_Brake"]["properties"]
    assert brakes["shaft"]["description"] == "shaft that the brake holds"


# --- plots ---
def test_a_result_draws_the_figures_of_the_command_line() -> None:
    result, before = lm.simulate(SMALL), dict(mpl.rcParams)
    figure = result.lm.plot()
    assert figure._repr_png_().startswith(b"\x89PNG")  # as a notebook shows it
    assert dict(mpl.rcParams) == before
    assert [a.get_xlabel() for a in figure.axes] == ["time [s]"] * 6
    drawn = figure.axes[2].lines[1].get_xydata()
    assert np.array_equal(drawn[:, 1], result["load_speed"])
    response = lm.frequency_response(SMALL, [0.5, 5.0], [0.1, 1.0])
    bode = response.lm.plot("twist")
    assert bode.axes[0].get_ylabel() == "gain [rad]"
    assert len(response.lm.plot_maps().axes) >= 4
    motion = lm.periodic_motion(SMALL)
    assert np.array_equal(motion.lm.plot().axes[0].lines[0].get_ydata(), motion["command"])
    with pytest.raises(ValueError, match="lacks twist, which the figure of a run shows"):
        result.drop_vars("twist").lm.plot()
    with pytest.raises(ValueError, match="no figure of it"):
        lm.test_rig.TestRig(SMALL.gearbox).efficiency_map([100.0], [0.5]).lm.plot()


def test_the_summary_counts_what_contacts_do() -> None:
    """Against the switchings themselves: a contact sticks as often as it slips, or once more or less."""
    result = lm.simulate(lm.load("paper-2dof-nl-small"))
    switchings = lm.switchings_of(result)
    before, after = (switchings[f"input_contact_{when}"].values for when in ("before", "after"))
    sticks, slips = int(np.sum((before != 0) & (after == 0))), int(np.sum((before == 0) & (after != 0)))
    assert sticks > 0
    assert abs(sticks - slips) <= 1
    assert f"  contacts [times]: input sticks {sticks}, slips {slips}" in result.lm.summary()
    train = lm.simulate(lm.load("direction-finder", {"simulation.duration": 0.3})).lm.summary()
    (line,) = [line for line in train.splitlines() if "contacts [times]" in line]
    assert "traverse gear twist sticks " in line


def test_long_curves_are_drawn_from_few_points_that_keep_every_peak() -> None:
    x = np.linspace(0.0, 1.0, 1_000_003)
    y = np.sin(40.0 * x)
    y[123_457], y[777_777], y[500_000] = 5.0, -7.0, np.nan
    thin_x, thin_y = thinning.thinned(x, y)
    assert len(thin_x) == len(thin_y) <= thinning.MAX_POINTS + 10
    assert np.nanmax(thin_y) == 5.0
    assert np.nanmin(thin_y) == -7.0
    assert thin_x[0] == 0.0
    assert thin_x[-1] == 1.0
    assert np.all(np.diff(thin_x) > 0.0)
    loop_x, loop_y = thinning.thinned(np.cos(9 * x), np.sin(9 * x))  # also where x is no time
    assert (loop_x.max(), loop_y.max()) == (np.cos(9 * x).max(), np.sin(9 * x).max())
    few = np.arange(10.0)
    assert thinning.thinned(few, few)[1] is few


# --- step by step ---
def test_reading_a_variable_costs_no_more_than_a_step() -> None:
    simulation = lm.Simulation(SMALL)
    simulation.advance(1e-3, 0.02)

    def cost(what) -> float:
        return timeit.timeit(what, number=500)

    # The two are about equal; the factor is for a busy machine. An array per read, as before, would cost fifteen times as much.
    # In turn, so that whatever slows the machine slows both.
    pairs = [(cost(lambda: simulation["load_speed"]), cost(lambda: simulation.advance(1e-3, 0.02))) for _ in range(60)]
    reading, step = (min(costs) for costs in zip(*pairs, strict=True))
    assert reading < 4.0 * step


def test_variables_read_step_by_step_are_those_of_a_run() -> None:
    names = tuple(v.name for v in lm.simulation.VARIABLES)
    constant = {"command": -0.3, "load.torque": 20.0, "simulation.sample_interval": 0.01}  # driving, overrunning, reversal
    scenario = lm.load("overrunning-load").replace(**constant)
    result = lm.simulate(scenario)
    assert {-1, 1} <= set(np.sign(result["output_torque"].values * result["motor_speed"].values))
    simulation = lm.Simulation(scenario, step=0.01)
    for k in range(1, 60):  # later the vibration has died out, and which way the gear twists is a matter of rounding
        simulation.advance(0.01, -0.3, 20.0)
        here = result.isel(time=k)
        expected = [float(here[name]) for name in names]
        assert simulation[names].tolist() == pytest.approx(expected, rel=1e-9, abs=1e-12, nan_ok=True)
    assert simulation.read() == pytest.approx(dict(zip(names, simulation[names], strict=True)), nan_ok=True)
    assert simulation[list(names)].tolist() == pytest.approx([simulation[name] for name in names], rel=0.0, nan_ok=True)
    assert '"load_sped" is no variable; did you mean load_speed?' in refused(lambda: simulation["load_sped"])


def test_reset_gives_the_same_motion_again() -> None:
    simulation = lm.Simulation(SMALL, initial=lm.Initial(motor_speed=10.0))

    def motion() -> list[float]:
        out = []
        for k in range(50):
            simulation.advance(1e-3, 0.1 * k)
            out.append(simulation["twist"])
        return out

    first = motion()
    simulation.reset()
    assert simulation.time == 0.0
    assert simulation["motor_speed"] == 10.0
    assert motion() == first
    simulation.reset(lm.Initial(load_angle=2.0))
    assert simulation["load_angle"] == 2.0


def test_threads_that_share_a_simulation_lose_no_step() -> None:
    shared, alone = lm.Simulation(SMALL), lm.Simulation(SMALL)

    def steps() -> None:
        for _ in range(500):
            shared.advance(1e-4, 0.1)

    threads = [threading.Thread(target=steps) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for _ in range(2000):
        alone.advance(1e-4, 0.1)
    assert shared.time == alone.time == pytest.approx(0.2)
    assert shared.state.values == alone.state.values


def test_a_law_cannot_change_the_simulation_that_calls_it() -> None:
    scenario = lm.load("speed-axis", {"controller.law": True, "controller.speed": None})
    refused: list[str] = []

    def law(time, measured, reference, state):
        for use in (held[0].read, held[0].reset, lambda: held[0].advance(1e-3)):
            with pytest.raises(lm.InputError) as caught:
                use()
            refused.append(str(caught.value))
        return 0.1

    held = [lm.Simulation(scenario, law=law)]
    held[0].advance(1e-3)
    assert held.pop().time == 1e-3  # the law must not keep what keeps it
    assert refused
    assert set(refused) == {"the simulation is within a step; a law has to take what it needs from its arguments"}


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda p: p.stem)
@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, lambda s: pickle.loads(pickle.dumps(s))], ids=["copy", "deepcopy", "pickle"])
def test_a_copy_of_a_simulation_goes_on_by_itself(path, copied) -> None:
    scenario = lm.load(path)
    first = lm.Simulation(scenario)
    inputs = {name: 0.1 for name in first.inputs if name.endswith("command")}
    for _ in range(5):
        first.advance(1e-3, **inputs)
    second = copied(first)
    assert second.drive == first.drive
    for _ in range(5):
        first.advance(1e-3, **inputs)
    assert second.time == pytest.approx(5e-3)
    for _ in range(5):
        second.advance(1e-3, **inputs)
    assert second.state.values == first.state.values  # bit for bit
    second.reset()
    assert (second.time, first.time) == (0.0, pytest.approx(0.01))


def test_a_copy_keeps_its_law_its_start_its_error_bound_and_what_a_subclass_adds() -> None:
    class Own(lm.Simulation):
        notes: list[str]

    own = Own(SMALL, initial=lm.Initial(load_angle=1.0))
    own.notes = ["kept"]
    own.advance(1e-3, 0.1)
    shallow, deep = copy.copy(own), copy.deepcopy(own)
    assert type(shallow) is type(deep) is Own
    assert shallow.notes is own.notes
    assert deep.notes == own.notes
    assert deep.notes is not own.notes
    deep.reset()
    assert deep["load_angle"] == 1.0
    bounded = lm.Simulation(lm.load("field-weakening"), error_bound=True)
    bounded.advance(1e-3)
    other = copy.copy(bounded)
    assert other.error_bound == bounded.error_bound
    bounded.advance(1e-3)
    other.advance(1e-3)
    assert other.error_bound == bounded.error_bound


def test_numbers_of_any_library_advance_as_those_of_python() -> None:
    result = lm.simulate(SMALL)
    at = {name: result[name][700] for name in ("command", "load_torque")}
    plain, other = lm.Simulation(SMALL), lm.Simulation(SMALL)
    for made in (np.float64, np.array, xr.DataArray, lambda x: f"{x!r} N*m"):
        plain.advance(1e-3, 0.1, (0.0, 0.25))
        other.advance(xr.DataArray(1e-3), np.array(0.1), (np.float32(0.0), made(0.25)))
    plain.advance(1e-3, float(at["command"]), float(at["load_torque"]))
    other.advance("1 ms", **at)
    assert other.state.values == plain.state.values
    train = [lm.Simulation(lm.load("worm-lowering")) for _ in range(2)]
    train[0].advance(1e-3, motor_command=0.1, drum_load_torque=(0.0, 2.0))
    train[1].advance(1e-3, motor_command=np.array(0.1), drum_load_torque=(0, xr.DataArray(2)))
    assert train[0].state.values == train[1].state.values


# --- what is exported ---
def returned_by(thing: object) -> set[str]:
    """Names in the return annotations of a function, or of the public methods and fields of a class."""
    if inspect.isclass(thing):
        texts = [str(t) for t in getattr(thing, "__annotations__", {}).values()] if not issubclass(thing, Part) else []
        for name, member in inspect.getmembers(thing):
            function = member.fget if isinstance(member, property) else member
            own = inspect.isfunction(function) and function.__module__.startswith("lostmotion")
            if own and not name.startswith("_"):
                texts.append(str(function.__annotations__.get("return", "")))
    else:
        texts = [str(getattr(thing, "__annotations__", {}).get("return", ""))]
    return {word for text in texts for word in re.findall(r"(?<![.\w])[A-Z]\w+", text)}


def test_what_functions_return_is_exported() -> None:
    own = {name for module in (ROOT / "src" / "lostmotion").rglob("*.py") for name in re.findall(r"^class (\w+)", module.read_text(), re.M)}
    parts = {name for name in PATHS if inspect.isclass(thing := public(name)) and issubclass(thing, Part | lm.Scenario)}
    inner = {"IdentificationResult", "RungResult"}  # the fit itself is no public type
    for name in set(PATHS) - parts - inner:  # the fields of a part are keys of scenario files
        missing = (returned_by(public(name)) & own) - set(PATHS)
        assert not missing, f"{name} gives {missing}"


def test_every_exported_name_is_in_the_reference_with_its_fields() -> None:
    pages = {path.stem: path.read_text() for path in (ROOT / "docs" / "reference" / "api").glob("*.md")}
    assert set(pages) == {*NAMESPACES, "lostmotion"}
    for name in set(PATHS.values()) - {"__version__"}:
        space, _, _ = name.rpartition(".")
        section = pages[space or "lostmotion"].split(f"\n## `lm.{name}`\n")[1].split("\n## ")[0]
        for key in getattr(public(name.split(".")[-1]), "model_fields", {}):
            assert f"`{key}`" in section, f"{name} lacks {key}"
    assert re.fullmatch(r"\d+\.\d+\.\d+.*", lm.__version__)


@pytest.mark.parametrize("name", [name for name in PATHS if hasattr(public(name), "model_fields")])
def test_help_shows_the_parameters_of_a_part_and_nothing_of_pydantic(name: str) -> None:
    part = public(name)
    shown = pydoc.plain(pydoc.render_doc(part))
    for key in part.model_fields:
        assert re.search(rf"^ \|  {key}\b", shown, re.M)
    assert not [line for line in shown.splitlines() if re.search("pydantic(?!.main.BaseModel$)", line, re.I)]
    if name == "Gearbox":  # unit, range and default
        assert " |  inertia : kg·m², ≥ 0, default 0.0\n |      J_R, on the input shaft" in shown
        assert " |  rated_output_torque : N·m, > 0, needed" in shown
        assert shown.index("Parameters") < shown.index("Examples")


# --- namespaces ---
def test_each_name_has_one_place() -> None:
    attached = {("warp", "attach")}  # to worlds of MuJoCo Warp, as `lm.mujoco.attach` to one of MuJoCo
    listed = FLAT + [name for space in NAMESPACES for name in getattr(lm, space).__all__ if (space, name) not in attached]
    assert sorted(set(listed)) == sorted(listed)
    assert len(FLAT) <= 55  # what fits on a page


@pytest.mark.parametrize("space", NAMESPACES)
def test_no_module_hides_a_public_name_of_its_namespace(space) -> None:
    modules = {p.stem for p in (ROOT / "src" / "lostmotion" / space).iterdir()}
    assert modules & set(getattr(lm, space).__all__) == set()


@pytest.mark.parametrize("name", [n for n in PATHS if n not in FLAT and "." not in n])
def test_a_name_of_a_namespace_is_told_where_it_is(name) -> None:
    with pytest.raises(AttributeError, match=re.escape(f"it is lostmotion.{PATHS[name]}")):
        getattr(lm, name)
    space, _, own = PATHS[name].rpartition(".")
    assert getattr(importlib.import_module(f"lostmotion.{space}"), own) is public(name)
    assert not hasattr(lm, name + "x") and not hasattr(getattr(lm, space), own + "x")

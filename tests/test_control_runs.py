"""Runs under controllers: what must not change them, laws of one's own, and what takes no controller."""

import ctypes
import math
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy import signal

import lostmotion as lm
from conftest import ALL_SCENARIOS
from lostmotion.control.filters import LowPass, Notch, as_filter, discrete
from refusals import refused

SHOWN = ("motor_speed", "load_speed", "load_angle", "twist", "torque_reference", "measured_speed")


@pytest.fixture(scope="module")
def axis() -> lm.Scenario:
    """The scenario's move and the beginning of the way back; an ideal encoder, so that rounding does not become a step."""
    scenario = lm.load("position-axis", ["simulation.duration=1.2"])
    assert isinstance(scenario, lm.Scenario)
    return scenario.replace(**{"controller.encoder": {"ideal": True}})


def same(a: Any, b: Any, share: float = 0.0, sign: float = 1.0) -> None:
    for name in SHOWN:
        x, y = a[name].to_numpy(), sign * b[name].to_numpy()
        assert np.abs(x - y).max() <= share * np.abs(x).max(), name


@pytest.mark.parametrize(("tick", "interval"), [(1e-4, 1e-3), (3e-4, 1e-4), (1e-4, 1e-4), (7e-5, 7e-4)])
def test_what_a_controller_shows_is_of_the_tick_at_the_sample(tick: float, interval: float) -> None:
    """k times the interval and n times the tick differ by rounding where they are the same instant, also at the end."""
    scenario = lm.load("speed-axis").replace(
        **{
            "controller.sample_time": tick,
            "controller.reference": {"kind": "speed", "sines": [{"amplitude": 3.0, "frequency": 2.0}]},
            "simulation.duration": 300 * max(tick, interval),
            "simulation.sample_interval": interval,
        }
    )
    result = lm.simulate(scenario, energy=False)
    samples = np.arange(result.sizes["time"])
    ticks = tick * np.floor(samples * interval / tick + 1e-6)
    wanted = scenario.gearbox.ratio * scenario.controller.reference.at(ticks)[0]
    assert result["speed_reference"].to_numpy() == pytest.approx(wanted, abs=1e-9)
    assert samples[-1] == round(300 * max(tick, interval) / interval)


def test_the_record_changes_nothing(axis: lm.Scenario) -> None:
    coarse = lm.simulate(axis, sample_interval=6e-3)
    fine = lm.simulate(axis, sample_interval=1e-3, energy=False)
    assert coarse.attrs["switching_count"] == fine.attrs["switching_count"]
    same(coarse, fine.isel(time=slice(None, None, 6)), 1e-11)  # within rounding: intervals are halved from the sample interval
    part = lm.simulate(axis, duration=0.60003, sample_interval=6e-3)
    assert part["time"].to_numpy()[100:] == pytest.approx([0.6, 0.60003])  # the last sample is the end
    same(coarse.isel(time=slice(0, 101)), part.isel(time=slice(0, 101)), 1e-11)


def test_energy_exact_and_adaptive_and_mirror_image_agree(axis: lm.Scenario) -> None:
    exact = lm.simulate(axis)
    energy = lm.energy_of(exact)
    assert energy["source"] > 1.0
    assert abs(energy["residual"]) < 1e-9 * energy["turned_over"]
    same(exact, lm.simulate(axis, solver="dormand-prince", relative_tolerance=1e-12), 1e-7)
    moves = [{"to": -move.to} for move in axis.controller.reference.moves]  # type: ignore[union-attr]
    same(exact, lm.simulate(axis.replace(**{"controller.reference.moves": moves})), 1e-12, -1.0)


CONTROLLED = [path.stem for path in ALL_SCENARIOS if "[controller" in path.read_text()]


@pytest.mark.parametrize("title", CONTROLLED)
def test_both_solvers_agree_on_all_controlled_scenarios(title: str) -> None:
    s = lm.load(title)
    data = s.model_dump(exclude_none=True)
    # Steps of encoders and cameras make much of rounding, and gravity is by straight lines in the exact solver alone.
    for controller in data["controllers"].values() if "controllers" in data else [data["controller"]]:
        for key in ("encoder", "position_encoder"):
            if key in controller:
                controller[key] = {"ideal": True} | {k: controller[key][k] for k in ("shaft",) if k in controller[key]}
        if "camera" in controller:
            controller["camera"] |= {"pixel": None, "pixel_parts": 1}
    for mass in data.get("gravity", {}).values():
        mass["error"] = 1e-6
    scenario = type(s)(**data)
    time = {"duration": min(0.25, s.simulation.duration), "sample_interval": 1.25e-3}
    exact = lm.simulate(scenario, **time, energy=False)
    other = lm.simulate(scenario, **time, energy=False, solver="dormand-prince", relative_tolerance=1e-11)
    for name in (v for v in exact.data_vars if str(v).endswith(("_speed", "_angle", "_reference"))):
        x, y = exact[name].to_numpy(), other[name].to_numpy()
        assert np.abs(x - y).max() <= 1e-5 * np.abs(x).max(), name


def test_a_controlled_run_is_written_and_read_back(axis: lm.Scenario, tmp_path: Path) -> None:
    axis = axis.replace(**{"controller.speed.gain": "9e-3 N*m*s/rad"})
    assert axis.controller.speed.gain == 9e-3  # type: ignore[union-attr]
    assert lm.load("position-axis", ["controller.speed.gain=9e-3"]).controller.speed.gain == 9e-3  # type: ignore[union-attr]
    assert lm.Scenario.from_json(axis.to_json()) == axis
    result = lm.simulate(axis)
    for name in ("run.nc", "run.csv", "run.parquet"):
        lm.save(result, tmp_path / name)
        back = lm.open_result(tmp_path / name)
        same(result, back)
        assert back["torque_reference"].attrs["units"] == result["torque_reference"].attrs["units"] == "N*m"
        assert lm.simulation.scenario_of(back) == axis
        assert lm.load(tmp_path / name) == axis


def test_the_long_form_of_a_controlled_drive_moves_alike(axis: lm.Scenario) -> None:
    short, long = lm.simulate(axis), lm.simulate(axis.long())
    for name, other in (("load_speed", "load_speed"), ("torque_reference", "motor_torque_reference")):
        assert np.abs(short[name].to_numpy() - long[other].to_numpy()).max() < 1e-9 * np.abs(short[name]).max()


# --- laws of one's own ---
K, W, LIMIT = 8e-3, 120.0, 0.4  # N m s/rad, rad/s, N m


def loop(**changes: Any) -> lm.Scenario:
    """A proportional speed loop to W, or a law in its place."""
    controller = {"sample_time": 250e-6, "reference": {"kind": "speed", "mean": W}, "encoder": {"lines": 1000}}
    return lm.Scenario(
        shafts={"motor": {"inertia": 3e-5, "friction_torque": 0.01}},
        motors={"m": {"shaft": "motor", "kind": "torque_source", "rotor_inertia": 0.0, "rated_torque": 0.5}},
        controllers={"m": controller | changes},
        simulation={"duration": 0.05, "sample_interval": 250e-6},
    )


def python_law(time: float, measured: Any, reference: Any, state: Any) -> float:
    return max(-LIMIT, min(LIMIT, K * (reference[0] - measured[1]))) / 0.5


def compiled_laws() -> list[Any]:
    def of_pointers(time: float, measured: Any, reference: Any, state: Any, command: Any, data: Any) -> int:
        command[0] = max(-LIMIT, min(LIMIT, K * (reference[0] - measured[1]))) / 0.5
        return 0

    numbers = ctypes.POINTER(ctypes.c_double)
    kind = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_double, numbers, numbers, numbers, numbers, ctypes.c_void_p)
    laws: list[Any] = [python_law, kind(of_pointers)]
    try:
        from numba import cfunc, types
    except ImportError:
        return laws
    pointer = types.CPointer(types.float64)
    signature = types.int32(types.float64, pointer, pointer, pointer, pointer, types.voidptr)
    return [*laws, cfunc(signature)(of_pointers)]


@pytest.mark.parametrize("law", compiled_laws(), ids=lambda law: type(law).__name__)
def test_a_law_that_is_the_loop_gives_its_bits(law: Any) -> None:
    built_in = lm.simulate(loop(speed={"gain": K, "torque_limit": LIMIT}))
    assert np.abs(built_in["m_torque"].to_numpy()).max() == LIMIT
    own = lm.simulate(loop(law=True), law=law)
    for name in ("motor_speed", "motor_angle", "m_torque", "m_measured_speed"):
        assert (own[name].to_numpy() == built_in[name].to_numpy()).all(), name
    assert (lm.simulate(loop(law=True), law={"m": lm.control.Law(law)})["motor_speed"] == own["motor_speed"]).all()


def test_a_law_keeps_its_state_and_gets_its_data() -> None:
    def integrating(time: float, measured: Any, reference: Any, state: Any) -> float:
        state[0] += 250e-6 * (reference[0] - measured[1])
        return 0.01 * state[0]

    a = lm.simulate(loop(law=True), law=lm.control.Law(integrating, states=1))
    b = lm.simulate(loop(law=True), law=lm.control.Law(integrating, states=1))  # begins at 0 anew
    assert (a["motor_speed"] == b["motor_speed"]).all()
    assert float(a["m_torque"][-1]) > 0.0


def failing(time: float, *_: Any) -> float:
    if time > 0.01:
        raise KeyError("of the law's own")
    return 0.0


@pytest.mark.parametrize(("law", "changes", "kind", "words"), [
    (failing, {"law": True}, KeyError, "of the law's own"),
    (lambda *_: math.nan, {"law": True}, (lm.InputError, lm.SolverError), "number"),
    (lambda *_: math.inf, {"law": True}, (lm.InputError, lm.SolverError), "number"),
    (lambda *_: "0.3", {"law": True}, (lm.InputError, TypeError), "number"),
    (lambda *_: None, {"law": True}, (lm.InputError, TypeError), "number"),
    (lambda time: 0.0, {"law": True}, TypeError, "argument"),
    (None, {"law": True}, lm.InputError, "(?=.*law).*m"),
    (3.0, {"law": True}, lm.InputError, "(?=.*law).*function"),
    ({"n": python_law}, {"law": True}, lm.InputError, "(?=.*law).*m"),
    (python_law, {"speed": {"gain": K}}, lm.InputError, "law"),
    (lm.control.Law(python_law, states=-1), {"law": True}, lm.InputError, "states"),
    (lm.control.Law(python_law, data=np.zeros(2)), {"law": True}, lm.InputError, "data"),
])  # fmt: skip
def test_a_law_that_fails_or_has_no_use_ends_the_run(law: Any, changes: dict[str, Any], kind: Any, words: str) -> None:
    with pytest.raises(kind, match=words):
        lm.simulate(loop(**changes), law=law)


# --- filters ---
def test_filters_are_those_of_scipy() -> None:
    T, f = 125e-6, 200.0
    w = 2.0 * math.pi * f
    fs = math.pi * f / math.tan(math.pi * f * T)  # Tustin with this sampling frequency is prewarped at f
    for part, continuous in (
        (LowPass(kind="low_pass", frequency=f), ([1.0], [1.0 / w, 1.0])),
        (LowPass(kind="low_pass", frequency=f, damping=0.7), ([1.0], [1.0 / w**2, 1.4 / w, 1.0])),
        (Notch(kind="notch", frequency=f, depth=0.1, width=0.6, pole_frequency=170.0),
         ([1.0 / w**2, 0.2 / w, 1.0], [(f / 170.0 / w) ** 2, 1.2 * f / 170.0 / w, 1.0])),
    ):  # fmt: skip
        b, a = map(np.array, discrete(part, T)[:2])
        expected_b, expected_a = signal.bilinear(*continuous, fs=fs)
        assert b / a[0] == pytest.approx(expected_b, rel=1e-10, abs=1e-14)
        assert a / a[0] == pytest.approx(expected_a, rel=1e-10, abs=1e-14)


def test_a_filter_in_the_loop_is_lfilter_of_its_input() -> None:
    """Torque filters on a standing drive: the loop's torque is constant, so that its filtered one is a step response."""
    T = 250e-6
    b, a = signal.butter(3, 200.0, fs=1.0 / T)
    for system in (signal.dlti(b, a, dt=T), signal.dlti(*signal.tf2ss(b, a), dt=T)):
        scenario = loop(speed={"gain": 1e-5, "torque_filters": [as_filter(system).model_dump(exclude_none=True)]})
        scenario = scenario.replace(**{"shafts.motor.inertia": 1e9})
        got = lm.simulate(scenario)["m_torque_reference"].to_numpy()
        assert got == pytest.approx(signal.lfilter(b, a, np.full(len(got), 1e-5 * W)), abs=1e-12)
    control = pytest.importorskip("control")
    assert as_filter(control.tf(b, a, T)).numerator == pytest.approx(tuple(b), rel=1e-9)
    assert "sample time" in refused(lambda: as_filter(control.tf([1.0], [1.0, 1.0])))


# --- what takes no controller ---
@pytest.mark.parametrize("form", ["short", "long"])
def test_what_follows_given_commands_refuses_a_controller(axis: lm.Scenario, form: str) -> None:
    scenario: Any = axis if form == "short" else axis.long()
    for function in (lambda: lm.linearize(scenario, time=0.1), lambda: lm.periodic_motion(scenario)):
        refused(function, reason=" scenario.replace")
    assert scenario.replace(**({"controller": None} if form == "short" else {"controllers": {}})).axes() == {}


def test_the_check_holds_the_load_with_the_controller_off(axis: lm.Scenario) -> None:
    loaded = axis.replace(**{"load.torque": {"mean": 20.0}, "simulation.duration": 0.2})
    without = loaded.replace(controller=None)
    held = [[f.value for f in lm.check_drive(s) if f.rule == "holding"] for s in (loaded, without)]
    assert held[0][0].split(" at ")[0] == held[1][0].split(" at ")[0]


def test_a_study_of_a_controlled_drive_runs_its_controller(axis: lm.Scenario, tmp_path: Path) -> None:
    scenario = axis.replace(**{"simulation.duration": 0.5})
    study = lm.studies.Study(
        scenario=scenario,
        vary=[{"key": "gearbox.ratio", "values": [80.0, 90.0]}, {"key": "load.inertia", "values": [1.5, 2.0]}],
        keep={"peak": "peak(load_speed)"},
    )
    rows = pq.read_table(lm.study(study, tmp_path / "s")).to_pylist()
    assert len(rows) == 4
    for row in rows:
        changed = {"gearbox.ratio": row["gearbox.ratio"], "load.inertia": row["load.inertia"]}
        run = lm.simulate(scenario.replace(**changed))
        assert row["peak"] == float(np.abs(run["load_speed"].to_numpy()).max()) > 0.5


def test_a_load_step_at_a_tick_acts_once() -> None:
    T = 250e-6
    axis = loop(speed={"gain": K, "estimate": {"kind": "exact"}}, encoder={"ideal": True}).replace(**{"simulation.sample_interval": T})
    for time in (0.0251, 100 * T):
        energy = lm.energy_of(lm.simulate(axis.replace(**{"shafts.motor.torque": {"steps": [{"time": time, "height": 0.3}]}})))
        assert abs(energy["residual"]) < 1e-9 * energy["turned_over"]

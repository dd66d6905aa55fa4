"""The examples on controllers: a compiled law, a filter from python-control, an environment for reinforcement learning."""

import json
import sys
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest

import lostmotion as lm
from conftest import ROOT, module_at

example = partial(module_at, ROOT / "examples")


def test_the_compiled_law_moves_the_axis_as_the_same_in_python() -> None:
    pytest.importorskip("numba", reason="pip install --group examples")
    numba_law = example("numba_law")
    scenario = numba_law.axis().replace(**{"simulation.duration": 0.4})
    one, two = (lm.simulate(scenario, law=lm.control.Law(law, states=1)) for law in (numba_law.compiled, numba_law.in_python))
    for name in ("motor_speed", "load_angle"):  # the compiler may contract products and sums
        assert np.abs(one[name] - two[name]).max() < 1e-9 * np.abs(one[name]).max()
    assert float(one["load_angle"][-1]) > 0.1


def test_the_filter_of_python_control_is_the_notch_of_the_scenario() -> None:
    pytest.importorskip("control")
    module = example("python_control_filter")
    own = module.axis(lm.control.as_filter(module.notch(250e-6))).replace(**{"simulation.duration": 0.3})
    shipped = module.AXIS.replace(**{"simulation.duration": 0.3})
    plain = module.axis().replace(**{"simulation.duration": 0.3})
    one, two, without = (lm.simulate(s, energy=False)["servo_torque"] for s in (own, shipped, plain))
    assert float(abs(one - two).max()) < 1e-3 * float(abs(two).max())  # rounding may move an encoder's step by a tick
    assert float(abs(two - without).max()) > 1e-2 * float(abs(two).max())


def test_the_environment_is_one_of_gymnasium() -> None:
    gymnasium = pytest.importorskip("gymnasium", reason="pip install --group examples")
    from gymnasium.utils.env_checker import check_env

    module = example("gymnasium_axis")
    axis = module.Axis()
    assert isinstance(axis, gymnasium.Env)
    check_env(axis, skip_render_check=True)


@pytest.mark.parametrize("installed", [True, False])
def test_the_environment_is_the_drive_with_and_without_gymnasium(installed: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    if installed:
        pytest.importorskip("gymnasium", reason="pip install --group examples")
    else:
        monkeypatch.setitem(sys.modules, "gymnasium", None)
    module = example("gymnasium_axis")
    axis = module.Axis()
    assert (module.gymnasium is not None) == installed
    voltages = np.random.default_rng(3).uniform(-1.2, 1.2, module.STEPS)
    seen, told = axis.reset(seed=4, options={"target": 0.1})
    assert told == {"target": 0.1}
    assert seen == pytest.approx([0.1 / module.REACH, 0.0, 0.0, 0.0])
    angles, ended = [], False
    for u in voltages:
        assert not ended
        seen, reward, terminated, ended, _ = axis.step([u])
        assert not terminated
        angles.append(0.1 - seen[0] * module.REACH)
        assert reward == pytest.approx(-(seen[0] ** 2) - 1e-3 * min(abs(u), 1.0) ** 2)
    assert ended
    # The same voltages as steps of a command, in one run.
    clipped = np.clip(voltages, -1.0, 1.0)
    heights = np.diff(clipped, prepend=0.0).tolist()
    steps: list[dict[str, Any]] = [{"height": h, "time": k * module.STEP} for k, h in enumerate(heights)]
    scenario = lm.load("paper-2dof-nl-large").replace(
        command={"steps": steps}, simulation={"duration": module.STEPS * module.STEP, "sample_interval": module.STEP}
    )
    run = lm.simulate(scenario, energy=False)["load_angle"].to_numpy()[1:]
    assert np.array(angles) == pytest.approx(run, abs=1e-9)
    # By hand it ends near the target; seeds repeat.
    assert abs(module.episode(axis, module.by_hand, seed=1)[1]) < 2e-3
    assert axis.reset(seed=7)[1] == axis.reset(seed=7)[1]


def test_the_batch_of_axes_is_a_vectorised_environment() -> None:
    gymnasium = pytest.importorskip("gymnasium", reason="pip install --group examples")
    module = example("batch_axis")
    axes = module.Axes(6, module.GAPS)
    assert isinstance(axes, gymnasium.vector.VectorEnv)
    targets = np.linspace(-module.REACH, module.REACH, 6)
    seen, _ = axes.reset(options={"targets": targets})
    assert seen.shape == axes.observation_space.shape
    assert seen[:, 0] * module.SCALES[0] == pytest.approx(targets)
    for _ in range(module.STEPS):
        seen, reward, ended, cut, _ = axes.step(np.clip(2.0 * seen[:, :1] - seen[:, 1:2], -1.0, 1.0))
    assert reward.shape == ended.shape == cut.shape == (6,)
    assert cut.all()
    assert not ended.any()
    # A proportional law with damping comes near, but for the friction over its gain.
    assert np.abs(seen[:, 0]).max() * module.SCALES[0] < 0.2 * module.REACH


# --- the notebooks of the documentation run from the first cell to the last, and are stored without output ---
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))


def test_the_three_main_paths_have_a_notebook() -> None:
    assert [path.stem for path in NOTEBOOKS] == ["commission", "data-sheet", "identify"]
    home = (ROOT / "docs" / "index.md").read_text()
    assert all(f"notebooks/{path.stem}\n" in home for path in NOTEBOOKS)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_a_notebook_runs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    mpl.use("Agg")
    cells = json.loads(path.read_text())["cells"]
    assert "This notebook is for" in "".join(cells[0]["source"])
    names: dict[str, Any] = {}
    for cell in cells:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == [] and cell["execution_count"] is None
            exec(compile("".join(cell["source"]), path.name, "exec"), names)
    mpl.pyplot.close("all")
    assert list(tmp_path.iterdir()) == []  # a notebook leaves nothing behind

"""What README and documentation show is true."""

import re
import subprocess
import sys
from pathlib import Path

import lostmotion as lm
from conftest import ROOT


def test_the_tutorial_s_scenario_runs(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "tutorial.md").read_text()
    toml = re.search(r"```toml\n(.*?)```", page, re.S)
    assert toml is not None
    path = tmp_path / "my-drive.toml"
    path.write_text(toml.group(1))
    result = lm.simulate(lm.load(path))
    assert float(abs(result["load_speed"]).max()) > 0.1
    for command in re.findall(r"^lostmotion (run my-drive.*)$", page, re.M):
        import shlex

        subprocess.run([sys.executable, "-m", "lostmotion", *shlex.split(command)], cwd=tmp_path, check=True)
    path.write_text(toml.group(1).replace('inertia = "0.40', 'inertai = "0.40'))
    done = subprocess.run(
        [sys.executable, "-m", "lostmotion", "run", "my-drive.toml"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    shown = re.search(r"^lostmotion: my-drive.toml.*$", page, re.M)
    assert shown is not None
    assert done.stderr.strip() == shown.group(0)


def test_the_readme_s_python_runs(tmp_path: Path) -> None:
    code = re.search(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.S)
    assert code is not None
    (tmp_path / "scenarios").symlink_to(ROOT / "scenarios")
    done = subprocess.run(
        [sys.executable, "-c", code.group(1)], cwd=tmp_path, check=True, capture_output=True, text=True
    )
    assert "stuck" in done.stdout
    assert (tmp_path / "small.nc").exists()


def test_the_readme_s_commands_run(tmp_path: Path) -> None:
    command = re.search(r"`lostmotion (run scenarios/[^`]*)`", (ROOT / "README.md").read_text())
    assert command is not None
    (tmp_path / "scenarios").symlink_to(ROOT / "scenarios")
    words = command.group(1).split()
    subprocess.run([sys.executable, "-m", "lostmotion", *words], cwd=tmp_path, check=True)
    assert (tmp_path / "run.png").exists()


def test_generated_pages_name_every_key_and_variable() -> None:
    sys.path.insert(0, str(ROOT / "docs"))
    try:
        import generate
    finally:
        sys.path.pop(0)
    reference = generate.scenario_reference()
    for table in (
        "command",
        "motor",
        "gearbox",
        "gearbox.stiffness",
        "gearbox.hysteresis",
        "gearbox.losses",
        "load",
        "simulation",
    ):
        assert f"[{table}" in reference
    for key in (*lm.Motor.model_fields, *lm.Gearbox.model_fields, *lm.Load.model_fields, *lm.LossMap.model_fields):
        assert f"| `{key}` |" in reference
    for variable in lm.VARIABLES:
        assert f"| `{variable.name}` |" in generate.variables()

"""What README and documentation show is true."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import lostmotion as lm
from conftest import ROOT


def test_the_tutorial_can_be_followed(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "tutorial.md").read_text()
    sheet, drive = re.findall(r"```toml\n(.*?)```", page, re.S)
    commands = re.findall(r"^lostmotion (.*)$", "\n".join(re.findall(r"```sh\n(.*?)```", page, re.S)), re.M)
    assert len(commands) == 6

    def run(command: str) -> str:
        words = [sys.executable, "-m", "lostmotion", *shlex.split(command)]
        return subprocess.run(words, cwd=tmp_path, check=True, capture_output=True, text=True).stdout

    run(commands[0])
    template = (tmp_path / "my-gearbox.toml").read_text()
    assert 'kind = "planetary"' in template
    (tmp_path / "my-gearbox.toml").write_text(sheet)
    (tmp_path / "my-drive.toml").write_text(drive)
    printed = [run(command) for command in commands[1:]]
    assert "hysteresis loss" in printed[0]
    assert "holds 3.89 N·m" in printed[1]
    assert (tmp_path / "sheet" / "rig.html").exists()
    assert (tmp_path / "my-drive.png").exists()
    assert "input shaft: stuck" in printed[4]
    result = lm.simulate(lm.load(tmp_path / "my-drive.toml"))
    assert float(abs(result["load_speed"]).max()) > 0.1
    (tmp_path / "my-drive.toml").write_text(drive.replace("friction_torque =", "friction_torqe ="))
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

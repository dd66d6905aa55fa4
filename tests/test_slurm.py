"""The recipe for SLURM of docs/studies.md: its jobs as they would be submitted, and run by a stand-in for SLURM on this machine."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import lostmotion as lm
from conftest import ROOT
from lostmotion.studies.runs.read_table import read_table

jobqueue = pytest.importorskip("dask_jobqueue", reason="dask-jobqueue is missing: pip install dask-jobqueue")

# As sbatch: keeps a copy of the script, starts it in the background, prints its number. scancel ends it.
SBATCH = """#!/bin/sh
cp "$1" "$JOBS.sh"
setsid sh "$JOBS.sh" >"$JOBS.log" 2>&1 </dev/null &
echo $! >>"$JOBS"
echo "Submitted batch job $!"
"""
SCANCEL = """#!/bin/sh
for job in "$@"; do kill -- "-$job" 2>/dev/null; done
true
"""


def recipe() -> str:
    """The Python of the page."""
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "studies.md").read_text(), re.DOTALL)
    return next(block for block in blocks if "SLURMCluster" in block)


@pytest.mark.filterwarnings("default")
def test_the_jobs_of_the_recipe_ask_for_what_it_says() -> None:
    made = re.search(r"SLURMCluster\((.*?)\)", recipe())
    assert made is not None
    with eval(made[0], {"SLURMCluster": jobqueue.SLURMCluster}) as cluster:
        script = cluster.job_script()
    assert "#SBATCH --cpus-per-task=16" in script
    assert "#SBATCH --mem=15G" in script  # 16 GB, in GiB
    assert "#SBATCH -t 01:00:00" in script
    assert re.search(r"dask_worker tcp://\S+ --name \S+ --nthreads 1 --memory-limit 0.93GiB --nworkers 16 ", script)


def test_the_recipe_gives_the_rows_of_this_machine(tmp_path: Path) -> None:
    for name, text in (("sbatch", SBATCH), ("scancel", SCANCEL)):
        (tmp_path / name).write_text(text)
        (tmp_path / name).chmod(0o755)
    (tmp_path / "tolerance.toml").write_text(
        (ROOT / "examples" / "tolerance.toml").read_text().replace("../scenarios/", f"{ROOT}/scenarios/")
    )
    code, jobs = recipe(), tmp_path / "jobs"
    for written, here in (("cores=16, processes=16", "cores=1, processes=1"), ("/shared/tolerance", "rows")):
        assert written in code
        code = code.replace(written, here)
    (tmp_path / "recipe.py").write_text(code)
    environment = os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}", "JOBS": str(jobs)}
    try:
        done = subprocess.run(
            [sys.executable, "recipe.py"], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=200, check=False
        )
    finally:
        for job in jobs.read_text().split() if jobs.exists() else ():
            subprocess.run([str(tmp_path / "scancel"), job], check=True)
    assert done.returncode == 0, done.stderr
    assert jobs.exists()
    study = lm.studies.load_study(tmp_path / "tolerance.toml")
    assert read_table(tmp_path / "rows").equals(read_table(lm.study(study, tmp_path / "here")))

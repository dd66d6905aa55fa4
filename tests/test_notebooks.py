"""The notebooks of the documentation run from the first cell to the last, and are stored without output."""

import json
from pathlib import Path
from typing import Any

import matplotlib as mpl
import pytest

from conftest import ROOT

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

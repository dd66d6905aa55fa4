"""The live page: what Python writes into it. What it does in a browser is tested in page/tests."""

import base64
import gzip
import json
import re
import sys
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import lostmotion as lm
from conftest import ROOT
from lostmotion.cli import app
from lostmotion.control.command import CommandSignal
from lostmotion.live_page import page as live_page
from lostmotion.live_page.description import describe
from lostmotion.live_page.references import reference_sliders, reference_view
from lostmotion.live_page.sliders import LABELS, UNITS, of_signal
from refusals import refused

SOURCE = (ROOT / "page" / "index.html").read_text()
SHORT = {"simulation.duration": "0.1 s"}


@pytest.fixture
def built(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Stands in for `make page`: its source, and bytes as the core."""
    (tmp_path / "page.html").write_text(SOURCE)
    for kernel in ("drive", "middle", "any"):
        (tmp_path / f"{kernel}.wasm.gz").write_bytes(b"\x1f\x8b" + kernel.encode())
    monkeypatch.setattr(live_page, "TEMPLATE", tmp_path / "page.html")
    monkeypatch.setattr(live_page, "CORES", tmp_path)


def content(page: str, name: str) -> str:
    """Of a script element."""
    return re.search(rf'<script [^>]*id="{name}">(.*?)</script>', page, re.S).group(1)  # type: ignore[union-attr]


def description(page: str) -> Any:
    """That the page unpacks."""
    return json.loads(gzip.decompress(base64.b64decode(content(page, "description"))))


@pytest.mark.usefixtures("built")
def test_the_page_holds_the_core_and_the_scenario() -> None:
    scenario = lm.load("paper-2dof-nl-small", SHORT)
    page = live_page.page(scenario, "drive")
    assert base64.b64decode(content(page, "core")) == b"\x1f\x8bdrive"
    described = description(page)
    assert described["title"] == scenario.title
    assert lm.Scenario(**described["scenario"]) == scenario
    title = '</script><script>alert("1")</script><!--'  # ends no script that holds it
    page = live_page.page(scenario.replace(title=title), "drive")
    assert description(page)["title"] == title
    assert page.count("<script") == SOURCE.count("<script")


def test_a_page_holds_the_smallest_kernel_of_its_train() -> None:
    names = ("paper-2dof-nl-small", "position-axis", "worm-lowering", "direction-finder")
    assert [live_page.core_of(lm.load(name)).name for name in names] == ["drive.wasm.gz", "drive.wasm.gz", "middle.wasm.gz", "any.wasm.gz"]


def test_margins_are_those_of_the_servo_sheet() -> None:
    scenario = lm.load("speed-axis")
    shown = {(v["loop"], v["regime"]): v for v in describe(scenario, "n")["loops"]}
    sheet = lm.commission(scenario)
    assert {(row.loop, row.regime) for row in sheet.loops} == shown.keys()
    for row in sheet.loops:
        view = shown[row.loop, row.regime]
        assert view["stable"] is row.margins.stable
        assert view["phase_margin"] == pytest.approx(row.margins.phase_margin, rel=1e-9, nan_ok=False)
        assert view["bandwidth"] == pytest.approx(row.bandwidth.three_decibels, rel=1e-9)


def test_moves_of_a_reference_can_be_changed() -> None:
    scenario = lm.load("hunting-with-backlash")
    prefix = "controller.reference."
    found = {key.removeprefix(prefix): s for key, s in sliders(scenario).items() if key.startswith(prefix)}
    assert list(found) == ["moves.0.to", "moves.1.to", "speed", "acceleration", "jerk", "dwell"]
    assert found["moves.0.to"]["unit"] == "°"
    assert found["speed"]["target"] == {"reference": 0, "path": ["moves", "speed"]}
    follower = lm.load("direction-finder")  # what follows a target cannot be changed
    assert [reference_view(c.reference, 1.0) for c in follower.axes().values()] == [None] * len(follower.axes())
    assert list(reference_sliders(follower)) == []
    # A command without a sine or a step can get one with the keys that belong to it.
    own = {s.key: s for s in of_signal(CommandSignal(mean=0.5), "command", "Command", "1", {"input": 0}, 1.1, 2.0)}
    assert own["command.amplitude"].needs == {"command.frequency": 1.0}
    assert own["command.steps.0.height"].needs == {"command.steps.0.time": 0.2}


def test_without_a_built_page_the_remedy_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_page, "TEMPLATE", tmp_path / "page.html")
    monkeypatch.setattr(live_page, "made_here", lambda *_: None)  # as in an installed package
    refused(lambda: lm.live(lm.load("paper-2dof-nl-small", SHORT), height=500), reason="run `make page`, which needs node")


def sliders(scenario: lm.Scenario) -> dict[str, dict]:  # type: ignore[type-arg]
    return {s["key"]: s for s in describe(scenario, "n")["sliders"]}


@pytest.mark.parametrize("name", ["paper-2dof-nl-small", "two-motors-one-ring", "position-axis"])
def test_every_slider_stands_at_a_value_of_the_scenario_that_can_be_used(name: str) -> None:
    scenario = lm.load(name)
    found = sliders(scenario)
    assert len(found) >= 8
    for key, slider in found.items():
        assert slider["min"] <= slider["value"] <= slider["max"], key
        assert slider["min"] < slider["max"], key
        assert slider["unit"] in {unit for units in UNITS.values() for unit, _, _ in units}
        if "needs" not in slider:
            assert scenario.replace(**{key: slider["value"]}) == scenario, key
    places = [(slider["group"], slider["label"]) for slider in found.values()]
    assert len(set(places)) == len(places), name
    present = [key for key, slider in found.items() if "needs" not in slider]
    for key in present[::5]:  # each of them is slow to check
        for end in ("min", "max"):
            scenario.replace(**{key: found[key][end]})


def test_a_gap_can_be_opened_where_there_is_none() -> None:
    scenario = lm.load("paper-2dof-nl-small", SHORT)
    slider = sliders(scenario)["gearbox.stiffness.backlash"]
    assert (slider["value"], slider["min"], slider["unit"]) == (0.0, 0.0, "arcmin")
    core = describe(scenario, "n")["core"]
    assert core["with_gap"]["key"] == "gearbox.stiffness.backlash"
    # Beside a hysteresis without a gap the core takes a mesh damping that may be above 0, or a gap.
    assert core["with_gap"]["numbers"] != core["numbers"]
    free = lm.load("position-axis", {**SHORT, "gearbox.hysteresis": None})
    found = describe(free, "n")
    assert found["core"]["with_gap"] is None
    assert [s["key"] for s in found["sliders"]].count("gearbox.stiffness.backlash") == 1


def test_labels_belong_to_keys_of_scenario_files(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "docs")
    import generate

    words = set(re.findall(r"`([\w.]+)`", generate.scenario_reference() + generate.train_reference()))
    assert {label.rpartition(".")[2] for label in LABELS} <= {word.rpartition(".")[2] for word in words}


@pytest.mark.usefixtures("built")
def test_the_command_writes_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    run = CliRunner().invoke
    done = run(app, ["live", "paper-2dof-nl-small", "--set", "simulation.duration=0.1"])
    assert "Page written to paper-2dof-nl-small.html\n" in done.output
    assert opened == [(tmp_path / "paper-2dof-nl-small.html").as_uri()]
    assert description((tmp_path / "paper-2dof-nl-small.html").read_text())["name"] == "paper-2dof-nl-small"
    run(app, ["live", "paper-2dof-nl-small", "-o", "a.html", "--no-open"])
    assert len(opened) == 1
    refused = run(app, ["live", "paper-2dof-nl-small", "-o", "a.pdf"])
    assert str(refused.exception) == "a.pdf: the ending .pdf is not known; it must be .html"


@pytest.mark.usefixtures("built")
def test_a_notebook_shows_the_page_and_reads_its_sliders() -> None:
    scenario = lm.load("paper-2dof-nl-small", SHORT)
    view = lm.live(scenario, height=500)
    assert view.values == {}
    assert view.scenario == scenario
    changed = scenario.replace(**{"load.inertia": 3.0})
    view._widget.values = {"load.inertia": 3.0}  # as the page says it
    view._widget.tables = json.loads(changed.to_json())
    assert view.scenario == changed
    assert "application/vnd.jupyter.widget-view+json" in view._repr_mimebundle_()[0]
    assert "height: 100 pixels must lie between 200 and 10000" in refused(lambda: lm.live(scenario, height=100))


@pytest.mark.usefixtures("built")
def test_without_anywidget_a_notebook_shows_the_page_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "anywidget", None)
    view = lm.live(lm.load("paper-2dof-nl-small", SHORT))
    assert view._repr_mimebundle_()["text/html"].startswith('<iframe srcdoc="&lt;!doctype html&gt;')
    with pytest.raises(lm.MissingLibraryError, match="lostmotion\\[notebook\\]"):
        _ = view.values

"""Reports: the numbers of a page are those of the results; what it shows without its script; pictures on request."""

import itertools
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import lostmotion as lm
from conftest import ROOT
from html_pages import Page, charts
from lostmotion.cli import app
from lostmotion.reports import figure_style, panels, plots
from lostmotion.reports import page as pages
from lostmotion.reports.contours import contours
from lostmotion.reports.figure_style import LOOKS, STYLES, look
from lostmotion.reports.packed import packed
from lostmotion.reports.page import Report, Table, render
from lostmotion.reports.panels import Bars, Contacts, Curve, Flows, Ground, Group, Mark, Matrix, Panel
from lostmotion.reports.pictures import endings
from lostmotion.reports.run import run_report
from lostmotion.reports.servo import servo_report
from lostmotion.reports.svg_charts import svg_of
from lostmotion.reports.thinning import simplified
from lostmotion.reports.written_files import write_report
from lostmotion.units.practical import ARCMIN, practical
from lostmotion.verdict import Verdict
from refusals import refused

X = np.geomspace(1.0, 1000.0, 50)
PANEL = Panel("gain", "frequency [Hz]", "[-]", (Curve("one", X, 10.0 / X, look(0)),), log_x=True, log_y=True, level=1.0,
              marks=(Mark(10.0, 1.0, "10 Hz", look(0)),))  # fmt: skip
TIME = np.linspace(0.0, 1.0, 11)


@pytest.fixture(autouse=True)
def script(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Stands in for what node builds."""
    (tmp_path / "report.js").write_text("void 0;")
    monkeypatch.setattr(pages, "SCRIPT", tmp_path / "report.js")


def report(*charts: object, table: Table | None = None) -> Report:
    group = Group("main", "Main", "", charts)  # type: ignore[arg-type]
    parts = () if table is None else (table,)
    return Report("A <title>", "of `it`", Verdict("fits", ("in order",)), group, parts)


@pytest.fixture(scope="module")
def axis() -> lm.servo.ServoReport:
    return lm.commission(lm.load("speed-axis"))


def test_the_numbers_of_a_page_are_those_of_the_result(axis: lm.servo.ServoReport) -> None:
    found = {chart["title"]: chart for chart in charts(render(servo_report("speed-axis", axis)))}
    (error,) = found["following error over the run, reference less true value"]["lines"]
    assert np.array_equal(error["x"], axis.following.time)
    assert np.array_equal(error["y"], axis.following.error)
    for row in axis.loops:
        gain, phase = (found[f"{row.loop} loop, {which}"] for which in ("open: gain", "open: phase"))
        line = next(line for line in gain["lines"] if line["label"] == row.regime)
        assert np.array_equal(line["x"], row.frequency)
        gains = np.abs(row.open_loop)
        with np.errstate(divide="ignore"):
            wanted = np.where(gains > 1e-9, 20.0 * np.log10(gains), np.nan)
        assert np.allclose(line["y"], wanted, rtol=0.0, atol=1e-9, equal_nan=True)
        margin = next(m for m in phase["marks"] if m["x"] == row.margins.crossover)
        assert np.radians(margin["y"] - margin["to"]) == pytest.approx(row.margins.phase_margin, rel=1e-12)
        assert margin["to"] == pytest.approx(-180.0, abs=2.0)  # the curve is linear between its frequencies there
    shown = axis._repr_html_()  # type: ignore[attr-defined]
    assert shown.startswith("<iframe srcdoc=") and "table in " in shown and "Worst margins" in shown


def test_a_page_is_well_formed_and_asks_for_nothing() -> None:
    energies = {"source": 2.0, "gear_losses": -1.5, "stored_change": 0.5}
    every = report(
        PANEL,
        Contacts("contacts", TIME, {"motor": np.sign(TIME - 0.5)}),
        Flows("energy", energies),
        Bars("bars", "rank correlation [-]", {"a": (0.5,), "b": (-0.7,)}),
        Matrix("correlations", ("a", "b"), np.array([[1.0, -0.5], [-0.5, 1.0]])),
        table=Table("Values", ("what", "value [N·m]"), [["a & b", "1.5"], ["c", ""]]),
    )
    page = render(every)
    assert not Page(page).faults
    assert not re.findall(r"(?:src|href)=\"(?!data:)", page)
    assert "<h1>A &lt;title&gt;</h1>" in page
    assert "<code>it</code>" in page
    assert '<th scope="col" class="number">value [N·m]</th>' in page
    assert [chart["kind"] for chart in charts(page)] == ["lines", "contacts", "flows"]


def test_without_its_script_a_page_has_tables_and_figures_and_names_the_remedy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pages, "SCRIPT", tmp_path / "none.js")
    monkeypatch.setattr(pages, "made_here", lambda *_: None)  # as in an installed package
    page = render(report(PANEL, table=Table("Values", ("what", "value [N·m]"), [["a", "1.5"]])))
    assert "make page-report" in page
    assert "<script" not in page
    assert page.count("<svg role=") == 1
    assert "<td" in page


def test_all_colours_of_figures_are_those_of_the_style_sheet() -> None:
    """No module draws in a colour of its own: neither a hexadecimal one nor a grey."""
    modules = [*(ROOT / "src" / "lostmotion").rglob("*.py"), *(ROOT / "docs").glob("*.py")]
    own = re.compile(r'["\'](?:#[0-9a-fA-F]{3,8}|(?:color|colour)=["\']0?\.\d+)["\']|"colou?r": "0?\.\d+"|color="(?:0?\.\d|black|grey)')
    found = [f"{m.name}: {n}" for m in modules for n, line in enumerate(m.read_text().splitlines(), 1) if own.search(line)]
    assert not found
    drawn = [m.name for m in modules if re.search(r"(?<!\w)Figure\(figsize", m.read_text())]
    assert not drawn, "plots.Picture has the looks"
    # In grey two curves with the same line style would need luminances that are far apart; no two of a panel have the same.
    for styles in (LOOKS, STYLES.values()):
        assert len({str(style["linestyle"]) for style in styles}) == len(styles)


def test_contours_lie_where_the_quantity_has_their_value() -> None:
    """x*y on logarithmic axes is linear after taking logarithms of it: contours of log(x*y) are straight and exact there."""
    x, y = np.geomspace(1.0, 100.0, 7), np.geomspace(2.0, 50.0, 5)
    values = np.log10(x[None, :] * y[:, None])
    found = contours(x, y, values, log_x=True, log_y=True)
    assert len(found) >= 4
    for contour in found:
        there = np.isfinite(contour.x)
        assert there.sum() >= 2
        np.testing.assert_allclose(np.log10(contour.x * contour.y)[there], float(contour.text), atol=1e-12)
        assert np.log10(contour.label[0] * contour.label[1]) == pytest.approx(float(contour.text), abs=1e-12)
    assert contours(x, y, np.ones((5, 7)), log_x=True, log_y=True) == []


def test_a_map_has_labelled_contours_and_a_numbered_front_its_key() -> None:
    x, y = np.linspace(0.0, 1.0, 5), np.linspace(0.0, 2.0, 4)
    ground = Panel("map", "x [-]", "y [-]", (), ground=Ground(x, y, x[None, :] + y[:, None], "z [-]"))
    front = Curve("front", x, x, look(1) | {"marker": "o"}, names=tuple("abcde"), numbered=True)
    page = render(report(ground, Panel("front", "x [-]", "y [-]", (front,))))
    assert not Page(page).faults
    texts = re.findall(r'class="tick contour"[^>]*>([^<]+)<', page)
    assert {"0.5", "1", "1.5", "2"} <= set(texts)
    shown, second = charts(page)
    assert [c["text"] for c in shown["contours"]] == ["0.5", "1", "1.5", "2", "2.5"]
    assert second["lines"][0]["numbered"] is True
    assert '<ol class="key"><li>a</li><li>b</li>' in page
    assert len(re.findall(r'class="mark-text [^>]*>(\d)<', page)) == 5


def test_a_long_curve_keeps_its_extremes() -> None:
    n = 300_000
    y = np.sin(np.arange(n) * 1e-3)
    y[123_456] = 7.0
    (chart,) = charts(render(report(Panel("", "time [s]", "[-]", (Curve("y", np.arange(n) * 1e-4, y, look(0)),)))))
    (line,) = chart["lines"]
    assert len(line["y"]) <= PANEL.max_points + 10
    assert line["y"].max() == 7.0
    assert len(packed(())) < 100


def test_a_static_curve_stays_within_the_line_that_is_seen() -> None:
    x = np.linspace(0.0, 500.0, 3000)
    points = np.column_stack([x, 100.0 + 80.0 * np.sin(x / 40.0)])
    kept = simplified(points, 0.3)
    assert len(kept) < 150
    assert np.abs(np.interp(x, *points[kept].T) - points[:, 1]).max() < 0.8  # 0.3 across a slope of up to 2


def test_a_static_figure_has_its_points_where_the_axes_say() -> None:
    """Over logarithmic axes 10/x is a straight line from corner to corner, and the mark is at a third of it."""
    svg = svg_of(PANEL)
    ends = [tuple(map(float, p)) for p in re.findall(r"[ML]([\d.]+) ([\d.]+)", re.search(r'stroke-width="1.6" d="(.*?)"', svg)[1])]  # type: ignore[index]
    (x0, y0), (x1, y1) = ends
    cx, cy = map(float, re.search(r'<circle cx="([\d.]+)" cy="([\d.]+)"', svg).groups())  # type: ignore[union-attr]
    assert (cx - x0) / (x1 - x0) == pytest.approx(1.0 / 3.0, abs=2e-3)  # coordinates have one decimal
    assert (cy - y0) / (y1 - y0) == pytest.approx(1.0 / 3.0, abs=2e-3)
    assert ">100<" in svg


def test_figures_are_drawn_where_they_are_asked_for(axis: lm.servo.ServoReport, tmp_path: Path) -> None:
    write_report(tmp_path, servo_report("speed-axis", axis), endings("png, svg"))
    made = {p.name for p in tmp_path.iterdir()} - {"report.js"}
    assert made == {"servo.html", "margins.csv"} | {f"{n}.{e}" for n in ("axis", "loops", "steps") for e in ("csv", "png", "svg")}
    assert (tmp_path / "axis.png").read_bytes().startswith(b"\x89PNG")
    assert endings(None) == ()
    assert "gif is not known; write png, svg or pdf" in refused(lambda: endings("png,gif"))


def test_a_report_takes_no_plotting_library_along() -> None:
    modules = sorted(path.stem for path in Path(pages.__file__).parent.glob("*.py"))
    drawing = {"plots", "bar_and_matrix_plots", "hunting_figures", "pictures"}
    reports = [f"lostmotion.reports.{name}" for name in modules if name not in drawing]
    code = f"import sys, {', '.join(reports)}; print('matplotlib' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


def test_a_run_is_reported_with_the_numbers_of_its_dataset(tmp_path: Path) -> None:
    scenario = lm.load("position-axis", {"simulation.duration": 0.3})
    result = lm.simulate(scenario)
    page = render(run_report("position-axis", result))
    found = {chart["title"]: chart for chart in charts(page)}
    (error,) = found["Measured following error"]["lines"]
    wanted = result["position_reference"].values - result["measured_position"].values
    assert np.array_equal(error["y"], ARCMIN * wanted)
    assert np.array_equal(found["Twist"]["lines"][0]["y"], ARCMIN * result["twist"].values)
    modes = {row["label"]: row["modes"] for row in found["Contacts"]["rows"]}
    assert np.array_equal(modes["input"], result["input_contact"].values)
    assert found["Energy of the whole run"]["energies"] == lm.energy_of(result)
    assert len(found["Loss map of gearbox"]["lines"][0]["x"]) == result.sizes["time"]
    assert practical(float(np.abs(wanted).max()), "rad", 4) in page
    assert not Page(page).faults
    assert result.lm._repr_html_().startswith("<iframe")
    run, small = CliRunner().invoke, ["run", "paper-2dof-nl-small", "--report"]
    assert run(app, [*small, str(tmp_path / "r.html")]).exit_code == 0
    assert "Share of the time in which contacts are stuck: input" in (tmp_path / "r.html").read_text()
    assert "its name must end in .html" in str(run(app, [*small, str(tmp_path / "r.pdf")]).exception)


def test_the_figure_of_a_run_shows_its_axis_and_its_contacts_as_bars() -> None:
    figure = lm.simulate(lm.load("direction-finder", {"simulation.duration": 0.05})).lm.plot()
    axes = {a.get_title(): a for a in figure.axes}
    assert {"Position of traverse drive", "Measured following error of elevation drive"} <= axes.keys()
    assert [t.get_text() for t in axes["Contacts"].get_yticklabels()][:2] == ["traverse motor", "traverse gear twist"]


def test_a_page_of_250_logs_stays_below_two_megabytes() -> None:
    """Random walks of 2000 samples, which nothing compresses, with the points that an identification of 250 logs gives each curve."""
    random = np.random.default_rng(1)
    time = np.linspace(0.0, 2.0, 2000)
    panels = []
    for k in range(250):
        walks = np.cumsum(random.normal(size=(2, 2000)), axis=1)
        curves = tuple(Curve(str(n), time, walk, look(n)) for n, walk in enumerate(walks))
        panels.append(Panel(f"log {k}", "time [s]", "position [rad]", curves, max_points=120))
    page = render(report(*panels))
    assert len(page) < 2e6
    assert len(charts(page)) == 250


# --- pictures by matplotlib ---
def drawn(*charts: panels.Chart, columns: int = 2) -> Any:
    """A picture that has its layout."""
    figure = plots.draw(charts, columns, (9.0, 3.5))
    figure.canvas.draw()
    return figure


def test_legends_of_pictures_cover_no_curves() -> None:
    x = np.linspace(0.0, 1.0, 5)
    names = ("motor speed / ratio", "load speed", "reference")
    curves = tuple(panels.Curve(name, x, k * x, figure_style.look(k)) for k, name in enumerate(names))
    contacts = panels.Contacts("contacts", x, {"motor": np.array([0, 1, 1, -1, 0])})
    figure = drawn(panels.Panel("speed", "time [s]", "speed [rad/s]", curves), contacts)
    for axes, labels in zip(figure.axes, (list(names), ["stuck", "slips (up forward, down reverse)"]), strict=True):
        legend, box = axes.get_legend().get_window_extent(), axes.get_window_extent()
        assert legend.y0 >= box.y1 and legend.x1 <= box.x1 + 0.1 * figure.dpi
        assert axes.title.get_window_extent().y0 >= legend.y1
        assert [text.get_text() for text in axes.get_legend().get_texts()] == labels


def test_texts_of_marks_do_not_cover_each_other() -> None:
    x = np.geomspace(1.0, 100.0, 9)
    marks = [panels.Mark(10.0 + 0.1 * k, 0.1 - 1e-3 * k, f"{60 + k}.5°", figure_style.look(k)) for k in range(3)]
    marks.append(panels.Mark(10.0, 0.1, "60.5°", figure_style.look(3)))  # which is written already
    curve = panels.Curve("falling", x, 1.0 / x, figure_style.look(0))
    panel = panels.Panel("gain", "frequency [Hz]", "gain [-]", (curve,), log_x=True, log_y=True, marks=tuple(marks))
    (axes,) = drawn(panel, columns=1).axes
    boxes = [text.get_window_extent() for text in axes.texts]
    assert [text.get_text() for text in axes.texts] == ["60.5°", "61.5°", "62.5°"]
    assert not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2))


def test_an_axis_with_hundreds_of_names_shows_a_few() -> None:
    names = tuple(f"gearbox-{k}" for k in range(227))
    dots = panels.Curve("energy", np.arange(227.0), np.arange(227.0), figure_style.DOTS)
    (axes,) = drawn(panels.Panel("energy", "gearbox", "energy [J]", (dots,), x_names=names), columns=1).axes
    shown = [text.get_text() for text in axes.get_xticklabels()]
    assert shown == list(names[::10])


def test_the_numbers_of_a_matrix_fit_into_its_cells() -> None:
    names = tuple(f"parameter_{k}" for k in range(7))
    group = panels.Group("matrix", "", "", (panels.Matrix("correlation", names, np.full((7, 7), -0.5)),))
    figure = plots.draw_group(group)
    figure.canvas.draw()
    axes = figure.axes[0]
    cell = axes.get_window_extent().width / 7
    assert all(text.get_window_extent().width < cell for text in axes.texts)

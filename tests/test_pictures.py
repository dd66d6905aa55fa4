"""Pictures by matplotlib: legends, marks and names leave the curves to be seen."""

import itertools
from typing import Any

import numpy as np

from lostmotion.reports import looks, panels, plots


def drawn(*charts: panels.Chart, columns: int = 2) -> Any:
    """A picture that has its layout."""
    figure = plots.draw(charts, columns, (9.0, 3.5))
    figure.canvas.draw()
    return figure


def test_legends_of_pictures_cover_no_curves() -> None:
    x = np.linspace(0.0, 1.0, 5)
    names = ("motor speed / ratio", "load speed", "reference")
    curves = tuple(panels.Curve(name, x, k * x, looks.look(k)) for k, name in enumerate(names))
    contacts = panels.Contacts("contacts", x, {"motor": np.array([0, 1, 1, -1, 0])})
    figure = drawn(panels.Panel("speed", "time [s]", "speed [rad/s]", curves), contacts)
    for axes, labels in zip(figure.axes, (list(names), ["stuck", "slips (up forward, down reverse)"]), strict=True):
        legend, box = axes.get_legend().get_window_extent(), axes.get_window_extent()
        assert legend.y0 >= box.y1 and legend.x1 <= box.x1 + 0.1 * figure.dpi
        assert axes.title.get_window_extent().y0 >= legend.y1
        assert [text.get_text() for text in axes.get_legend().get_texts()] == labels


def test_texts_of_marks_do_not_cover_each_other() -> None:
    x = np.geomspace(1.0, 100.0, 9)
    marks = [panels.Mark(10.0 + 0.1 * k, 0.1 - 1e-3 * k, f"{60 + k}.5°", looks.look(k)) for k in range(3)]
    marks.append(panels.Mark(10.0, 0.1, "60.5°", looks.look(3)))  # which is written already
    curve = panels.Curve("falling", x, 1.0 / x, looks.look(0))
    panel = panels.Panel("gain", "frequency [Hz]", "gain [-]", (curve,), log_x=True, log_y=True, marks=tuple(marks))
    (axes,) = drawn(panel, columns=1).axes
    boxes = [text.get_window_extent() for text in axes.texts]
    assert [text.get_text() for text in axes.texts] == ["60.5°", "61.5°", "62.5°"]
    assert not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2))


def test_an_axis_with_hundreds_of_names_shows_a_few() -> None:
    names = tuple(f"gearbox-{k}" for k in range(227))
    dots = panels.Curve("energy", np.arange(227.0), np.arange(227.0), looks.DOTS)
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

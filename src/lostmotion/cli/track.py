"""`lostmotion track`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from .arguments import (
    FiguresOption,
    Overrides,
    ReportOption,
    SourceArgument,
    again,
    as_number,
    load_scenario,
    number,
    option,
    print_bare,
)
from .output_files import pictures_of, writing
from .terminal import about, busy, conclude, console, progress

if TYPE_CHECKING:
    from ..pointing.budget import PointingBudget


def track(
    scenario: SourceArgument,
    output: ReportOption = None,
    after: float | None = option(
        "TIME",
        'Leave out errors before this time, e.g. "2 s"; default: the end of the start-up transient.',
        parser=number("s", "--after"),
    ),
    view: list[str] | None = option(
        "MOTOR=ANGLE",
        'Whole angle of view of an axis, e.g. "motor=6.65 deg"; default: the angle of view of its camera.',
    ),
    limit: list[str] | None = option(
        "MOTOR=ANGLE",
        'Largest permitted error of an axis, e.g. "motor=10 urad"; the verdict compares the peak with it.',
    ),
    overrides: Overrides = None,
    figures: FiguresOption = None,
) -> None:
    """To see how well an axis points, and what limits it.

    \b
    lostmotion track tracking-loss-map --limit "motor=10 urad"
    lostmotion track axes.toml --view "traverse=6.65 deg" --view "elevation=5.27 deg" -o track

    Prints the errors; with -o, writes track.html (one page) and its data as CSV. The page has the errors over time
    and over the speed of the target, their contributions, and the influence of wrong losses, temperature and wear.
    """
    from ..errors import InputError
    from ..reports.pointing import verdict_of

    pictures = pictures_of(figures, output)
    loaded = load_scenario(scenario, overrides)
    from ..pointing.budget import pointing_budget, runs_of, units_of_axes

    units = units_of_axes(loaded)

    def by_motor(option: str, given: list[str] | None) -> dict[str, float | str]:
        angles: dict[str, float | str] = {}
        for text in given or ():
            motor, equals, angle = text.partition("=")
            if not equals:
                raise InputError(f'{option}: "{text}" must be MOTOR=ANGLE, such as "motor=6.65 deg"')
            name, angle = motor.strip(), angle.strip()
            angles[name] = angle if (bare := as_number(angle)) is None else bare
            print_bare(f"{option} {name}", angle, units.get(name))
        return angles

    seen, permitted = by_motor("--view", view), by_motor("--limit", limit)
    with about(scenario), progress(runs_of(loaded), "Runs") as step:
        budget = pointing_budget(loaded, after=after, view=seen, limit=permitted, progress=step)
    _print_summary(loaded.title or Path(scenario).stem, budget)
    if output is None:
        print(f"All charts on a page: lostmotion track {again(scenario, overrides)} -o track")
    else:
        with writing(output), busy("Writing"):
            from ..reports.pointing import pointing_report
            from ..reports.written_files import write_report

            page = write_report(output, pointing_report(Path(scenario).stem, budget), pictures)
        print(f"Report written to {page}")
        print(f"Next: lostmotion run {again(scenario, overrides)} --report {Path(scenario).stem}.html")
    conclude(verdict_of(budget))


ROWS = 24  # of the table in a terminal; a longer one is without the runs of one cause alone, which are on the page


def _print_summary(title: str, budget: PointingBudget) -> None:
    from rich.table import Table
    from rich.text import Text

    from ..reports.pointing import budget_rows, header, order_header, order_rows, verdict_of, view_line

    print(title)
    table = Table(box=None, pad_edge=False)
    for k, name in enumerate(header(budget)):
        table.add_column(Text(name), justify="left" if k < 2 else "right")
    rows = budget_rows(budget)
    for row in rows:
        if len(rows) <= ROWS or not row[1].endswith(" alone"):
            table.add_row(*map(Text, row))
    console(sys.stdout, 160).print(table)
    print(f"  {budget.after_line}")
    if by_order := order_rows(budget):
        orders = Table(box=None, pad_edge=False)
        for name in order_header(budget):
            orders.add_column(Text(name))
        for row in by_order[:ROWS]:
            orders.add_row(*map(Text, row))
        console(sys.stdout, 160).print(orders)
    if budget.view is not None:
        print(f"  {view_line(budget)}")
    if (verdict := verdict_of(budget)) is not None:
        print(f"Verdict: {verdict}")
    else:
        print('  No limit was given; --limit "MOTOR=ANGLE" asks for a verdict.')

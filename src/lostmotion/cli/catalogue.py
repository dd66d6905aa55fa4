"""`lostmotion catalogue`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def catalogue(
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME | new]", help="Show one record; `new`: a template for your own.")
    ] = None,
    kind: Annotated[
        str | None,
        typer.Option(
            "--kind",
            metavar="KIND",
            help="gearbox, motor, screw, rack, belt, linear_motor, actuator, brake, amplifier, or a kind of one: planetary, ironless, ...",
        ),
    ] = None,
    ratio: Annotated[str | None, typer.Option("--ratio", metavar="MIN..MAX", help="Gear ratio.")] = None,
    torque: Annotated[str | None, typer.Option("--torque", metavar="MIN..MAX", help="Rated torque [N·m].")] = None,
    force: Annotated[
        str | None, typer.Option("--force", metavar="MIN..MAX", help="Rated force [N]; of screws the dynamic capacity.")
    ] = None,
    lead: Annotated[
        str | None, typer.Option("--lead", metavar="MIN..MAX", help='Lead of a screw [m], e.g. "5 mm..10 mm".')
    ] = None,
    current: Annotated[
        str | None, typer.Option("--current", metavar="MIN..MAX", help="Continuous current of an amplifier [A rms].")
    ] = None,
    complete: Annotated[bool, typer.Option("--complete", help="Only records that can be simulated.")] = False,
    every: Annotated[bool, typer.Option("--all", help="List all that fit, not only a screen of them.")] = False,
    output: Annotated[Path | None, typer.Option("-o", "--output", metavar="FILE", help="With `new`: the file.")] = None,
) -> None:
    """To find a gearbox, motor or screw, or to write your data sheet.

    \b
    lostmotion catalogue --kind strain_wave --ratio 50..120 --torque 20..100
    lostmotion catalogue schaeffler-rt1-h-20-100
    lostmotion catalogue new -o my-gearbox.toml
    lostmotion catalogue --kind screw --lead "5 mm..10 mm" --force 10000..20000
    lostmotion catalogue new --kind screw -o my-screw.toml

    Without an option: how many records of each kind there are. The list has a column with the level of the model, or the missing data.
    """
    from ..reports.listing import list_records, record_text, summary, template

    if name == "new":
        text = template(kind)
        if output is None:
            print(text, end="")
            return
        from ..errors import InputError
        from ..reports.pages import write_text

        if output.exists():
            raise InputError(f"{output}: exists; name another file")
        write_text(output, text)
        print(f"Template written to {output}; fill in the data of your sheet and delete the rest")
        print(f"Next: lostmotion catalogue {output}")
    elif name is not None:
        print(record_text(name))
    elif not complete and not every and (kind, ratio, torque, force, lead, current) == (None,) * 6:
        print(summary())
    else:
        print(list_records(kind, ratio, torque, complete, force, lead, every, current))

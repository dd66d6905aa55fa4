"""`lostmotion catalogue`."""

from pathlib import Path

from .arguments import argument, flag, option


def catalogue(
    name: str | None = argument("[NAME | new]", "Show one record; `new`: a template for your own."),
    kind: str | None = option(
        "KIND",
        "gearbox, motor, screw, rack, belt, linear_motor, actuator, brake, amplifier, or a kind of one: planetary, ironless, ...",
    ),
    ratio: str | None = option("MIN..MAX", "Gear ratio."),
    torque: str | None = option("MIN..MAX", "Rated torque [N·m]."),
    force: str | None = option("MIN..MAX", "Rated force [N]; of screws the dynamic capacity."),
    lead: str | None = option("MIN..MAX", 'Lead of a screw [m], e.g. "5 mm..10 mm".'),
    current: str | None = option("MIN..MAX", "Continuous current of an amplifier [A rms]."),
    complete: bool = flag("Only records that can be simulated.", "--complete"),
    every: bool = flag("List all that fit, not only a screen of them.", "--all"),
    output: Path | None = option("FILE", "With `new`: the file.", "-o", "--output"),
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
    from ..reports.catalogue_text import list_records, record_text, summary, template

    if name == "new":
        text = template(kind)
        if output is None:
            print(text, end="")
            return
        from ..errors import InputError
        from ..reports.written_files import write_text

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

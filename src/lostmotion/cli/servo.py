"""`lostmotion servo`."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .arguments import (
    FiguresOption,
    Overrides,
    SourceArgument,
    again,
    decibels,
    flag,
    load_scenario,
    number,
    option,
    print_bare,
    print_timed_moves,
)
from .output_files import try_directory, try_file, writing
from .terminal import about, busy, conclude, console, progress

if TYPE_CHECKING:
    from ..errors import InputError
    from ..servo.commissioning_report import ServoReport
    from ..servo.tuning_result import Tuning
    from ..simulation.scenario.scenario import Scenario

OF_RULES = ("--phase-margin", "--gain-margin", "--bandwidth", "--sensitivity-peak", "--feedforward")


def servo(
    scenario: SourceArgument,
    output: list[Path] | None = option(
        "FILE.toml|DIR",
        "Tuned scenario (.toml), or directory of the report, made if missing; both by giving it twice.",
        "-o",
        "--output",
    ),
    motor: str | None = option("NAME", "Motor whose controller is examined. Default: the only one."),
    window: str | None = option(
        "ANGLE",
        'Within which a move has settled, e.g. "1 arcmin", of a slide "5 um"; left out, four encoder steps at the reference\'s '
        "shaft, at least a thousandth of the longest move.",
    ),
    rule: str | None = option(
        "RULE",
        "Tune first: suited, symmetrical_optimum, identical_damping, identical_radius, identical_real_part, margins or search.",
        "--tune",
    ),
    phase_margin: float | None = option(
        "ANGLE", 'With --tune margins, e.g. "45 deg"; default 60 deg.', parser=number("rad", "--phase-margin")
    ),
    gain_margin: float | None = option("DB", 'With --tune margins, e.g. "8 dB"; default 6 dB.', parser=decibels),
    bandwidth: float | None = option(
        "FREQUENCY",
        'With --tune margins: no more gain than this bandwidth of the speed loop takes, e.g. "40 Hz".',
        parser=number("Hz", "--bandwidth"),
    ),
    sensitivity_peak: float | None = option(
        "NUMBER", "With --tune search: largest peak of the sensitivity; default 1.7.", parser=number()
    ),
    feedforward: bool = flag(
        "With --tune: feed forward inertia and friction too, with the losses of gearboxes without load.",
        "--feedforward",
    ),
    drive_units: bool = flag("Print the gains in the units of common drives, to be entered there.", "--drive-units"),
    overrides: Overrides = None,
    figures: FiguresOption = None,
) -> None:
    """To commission a servo axis: gains, margins, settling, hunting.

    \b
    lostmotion servo position-axis -o servo
    lostmotion servo position-axis --tune margins --feedforward -o tuned.toml
    lostmotion servo position-axis --tune margins --phase-margin "45 deg" --gain-margin "8 dB"

    Also computes bandwidths, following error, settling and stiffness.

    The report is servo.html (one page) with the data of its charts and the margins as CSV. The verdict is on stability, the
    window, hunting and limits; what was asked for is written whatever it is. With a continuous controller it is the certificate of
    hunting.
    """
    from ..errors import InputError
    from ..reports.pictures import endings

    pictures = endings(figures)
    files, directories = _targets(output or [], rule)
    if pictures and not directories:
        raise InputError(f"--figures {figures}: needs the directory of the report; add -o DIR")
    options = (phase_margin, gain_margin, bandwidth, sensitivity_peak, feedforward or None)
    wanted = {option: value for option, value in zip(OF_RULES, options, strict=True) if value is not None}
    if wanted and rule is None:
        raise InputError(f"{next(iter(wanted))}: goes with --tune RULE; add a rule")
    missing: list[str] = []
    try:
        loaded = load_scenario(scenario, overrides, None if rule is None else missing)
    except InputError as error:
        raise (_or_tuned(error) if rule is None else error) from None
    _try(files, directories)
    if loaded.continuous() and not loaded.axes():
        asked = {"--tune": rule, "--window": window, "--motor": motor, "--drive-units": drive_units or None}
        _certify(loaded, scenario, directories, pictures, asked)
        return
    from ..simulation.runs.pointing_error import pointed

    if not loaded.axes() and pointed(loaded):
        options_of_loops = {"--tune": rule, "--drive-units": drive_units or None}
        _open_loop(loaded, scenario, motor, window, options_of_loops, directories, pictures, again(scenario, overrides))
        return
    from ..servo.commissioning_report import commission, work

    with about(scenario):
        total = work(loaded, motor)
        tuned = None if rule is None else _tuned(loaded, rule, motor, wanted).without(missing)
    loaded = loaded if tuned is None else tuned.scenario
    settled = None if window is None else _settled(loaded, motor, window)
    with about(scenario), progress(total, "Commissioning") as step:
        report = commission(loaded, motor=motor, window=settled, progress=step)
    written = []
    for path in files:
        assert tuned is not None
        tuned.write(path, scenario, overrides or ())
        written.append(f"Tuned scenario written to {path}")
    for path in directories:
        with writing(path), busy("Writing"):
            from ..reports.servo import servo_report
            from ..reports.written_files import write_report

            page = write_report(path, servo_report(Path(scenario).stem, report), pictures)
            written.append(f"Report written to {page}")
    _print_summary(loaded.title or Path(scenario).stem, report)
    print_timed_moves(loaded)
    if tuned is not None:
        _print_tuned(tuned)
    if drive_units:
        _print_drive_units(loaded, motor)
    print("\n".join([*written, _next(again(scenario, overrides), files, directories, rule, wanted)]))
    conclude(report.verdict)


def _or_tuned(error: InputError) -> InputError:
    """The error of a scenario without gains, with the option that finds them."""
    from ..servo.tuning_result import missing_gains

    if not (keys := missing_gains(error)):
        return error
    return type(error)("no gain is given; add it, or find it: --tune margins", *keys, where=error.where)


def _print_tuned(tuned: Tuning) -> None:
    print(f"Tuned by the rule {tuned.rule}: {tuned.why}")
    _print_columns([(key, f"{old} -> {new}") for key, old, new in tuned.changes()])


def _print_drive_units(scenario: Scenario, motor: str | None) -> None:
    from ..servo.tuning import drive_units

    print("In the units of drives:")
    print("\n".join(f"  {line}" for line in drive_units(scenario, motor)))


def _open_loop(
    loaded: Scenario,
    source: str,
    motor: str | None,
    window: str | None,
    asked: Mapping[str, object],
    directories: list[Path],
    pictures: tuple[str, ...],
    repeated: str,
) -> None:
    """Print what can be said of the axis of a stepper, which has no loop, with its page on request."""
    from ..errors import InputError
    from ..reports.stepper_axis import open_loop_report
    from ..reports.written_files import write_report
    from ..simulation.runs.pointing_error import pointed
    from ..sizing.stepper_axis import NO_LOOP, open_loop
    from ..units.conversion import si_value

    if given := [option for option, value in asked.items() if value is not None]:
        raise InputError(f"{', '.join(given)}: {NO_LOOP}; leave it out")
    within = None
    if window is not None:
        axes = pointed(loaded)
        shaft = axes.get(motor or "", next(iter(axes.values())))[1]
        try:
            within = si_value(window, loaded.train().angle_unit(shaft))
        except ValueError as error:
            raise InputError(f"--window: {window} {error}") from None
    with about(source), busy("Running the axis"):
        found = open_loop(loaded, motor=motor, window=within)
    print(loaded.title or Path(source).stem)
    _print_columns(found.summary())
    for path in directories:
        with writing(path), busy("Writing"):
            page = write_report(path, open_loop_report(Path(source).stem, loaded.title, found), pictures)
        print(f"Report written to {page}")
    print(
        f"Next: lostmotion track {repeated}"
        if directories
        else f"The same on a page: lostmotion servo {repeated} -o report"
    )
    conclude(found.verdict)


def _certify(
    loaded: Scenario, source: str, directories: list[Path], pictures: tuple[str, ...], asked: Mapping[str, object]
) -> None:
    """Print whether an axis with a continuous controller hunts, with its page on request."""
    from ..errors import InputError
    from ..reports.certificate import certificate_report, certificate_rows, verdict_of
    from ..reports.written_files import write_report
    from ..servo.hunting.certificate import hunting_certificate

    if given := [option for option, value in asked.items() if value is not None]:
        raise InputError(
            f"{', '.join(given)}: for sampled controllers, and this scenario has continuous ones; leave it out"
        )
    with about(source), busy("Bounding the map from break-away to break-away"):
        certificate = hunting_certificate(loaded)
    print(loaded.title or Path(source).stem)
    _print_columns(certificate_rows(certificate))
    for path in directories:
        with writing(path), busy("Writing"):
            print(
                f"Report: {write_report(path, certificate_report(Path(source).stem, loaded.title, certificate), pictures)}"
            )
    if not directories:
        print(f"The map as a chart: lostmotion servo {source} -o report")
    conclude(verdict_of(certificate))


def _tuned(scenario: Scenario, rule: str, motor: str | None, wanted: Mapping[str, Any]) -> Tuning:
    """The scenario with the gains of a rule, which is given these options."""
    from ..errors import InputError
    from ..servo.tuning import tune

    given = {option.removeprefix("--").replace("-", "_"): value for option, value in wanted.items()}
    try:
        with busy("Tuning"):
            return tune(scenario, rule=rule, motor=motor, **given)
    except InputError as error:
        options = dict(zip(given, wanted, strict=True))
        raise error.with_keys(lambda key: options.get(key, key)) from None


def _settled(scenario: Scenario, motor: str | None, window: str) -> float:
    """The window in SI: an angle, or of a slide a distance."""
    from ..errors import InputError
    from ..inputs.refusal_messages import shown
    from ..servo.linear_regimes import axis_of
    from ..units.conversion import si_value

    axis = axis_of(scenario, motor)
    unit = axis.train.angle_unit(axis.shaft)
    try:
        value = si_value(window, unit)
    except ValueError as error:
        raise InputError(f"--window: {shown(window)} {error}") from None
    print_bare("--window", window, unit)
    return value


def _targets(output: list[Path], rule: str | None) -> tuple[list[Path], list[Path]]:
    """Files of scenarios, and directories, among what is to be written."""
    from ..errors import InputError

    files = [path for path in output if path.suffix == ".toml"]
    if files and rule is None:
        raise InputError(f"-o {files[0]}: a tuned scenario needs a rule; add --tune RULE, such as --tune margins")
    return files, [path for path in output if path.suffix != ".toml"]


def _try(files: list[Path], directories: list[Path]) -> None:
    for path in files:
        try_file(path)
    for path in directories:
        try_directory(path)


def _next(
    scenario: str, files: list[Path], directories: list[Path], rule: str | None, wanted: Mapping[str, Any]
) -> str:
    """The next useful command."""
    if files:
        return f"Next: lostmotion run {files[0]} --plot run.png"
    if rule is not None:
        if set(wanted) - {"--feedforward"}:
            return "Keep these gains: the same command with -o tuned.toml"
        return f"Keep these gains: lostmotion servo {scenario} --tune {rule}{''.join(f' {x}' for x in wanted)} -o tuned.toml"
    if directories:
        return f"Next: lostmotion servo {scenario} --tune margins -o tuned.toml"
    return f"All charts on a page: lostmotion servo {scenario} -o servo"


def _print_summary(title: str, report: ServoReport) -> None:
    from rich.table import Table

    from ..reports.servo import loop_rows, step_rows

    print(title)
    _print_columns(report.summary())
    table = Table(box=None, pad_edge=False)
    for name in ("loop", "regime", "stable"):
        table.add_column(name)
    for name in ("-3 dB", "-90°", "gain margin", "phase margin", "crossover", "sensitivity"):
        table.add_column(name, justify="right")
    for row in loop_rows(report):
        units = zip((3, 4, 6, 8, 9, 10), (" Hz", " Hz", " dB", "°", " Hz", ""), strict=True)
        table.add_row(*row[:3], *(f"{row[k]}{unit}" if row[k] else "-" for k, unit in units))
    console(sys.stdout, 120).print(table)
    _print_columns(step_rows(report))


def _print_columns(rows: list[tuple[str, str]]) -> None:
    width = max((len(what) for what, _ in rows), default=0)
    for what, value in rows:
        print(f"  {what:<{width}}  {value}")

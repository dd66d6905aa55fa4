"""`lostmotion monitor`."""

from pathlib import Path

import typer

from .arguments import FiguresOption, ReportOption, argument
from .output_files import pictures_of, writing
from .terminal import busy


def monitor(
    file: Path = argument("TASK.toml", "Identification file; its table [monitor] says what is watched.", default=...),
    logs: list[Path] | None = argument("[LOGS]...", "Log files or directories; default: the logs of the file."),
    output: ReportOption = None,
    figures: FiguresOption = None,
) -> None:
    """To follow the wear of a drive from operation logs.

    \b
    lostmotion monitor examples/wear/monitor.toml -o monitored
    lostmotion monitor joint.toml logs/2026-*.csv -o joint-7

    Estimates backlash, friction, stiffness and losses over the life of the drive.

    Prints the findings; with -o, writes monitor.html (one page), values.csv (each log) and watched.csv (trends, changes, limits).
    Does not fit, exit code 1: a value has changed or is beyond its limit. Not decided, exit code 3: too few logs, or an interval
    that contains the limit.
    """
    pictures = pictures_of(figures, output)
    from ..identification.monitor.monitor import monitor as run

    with busy("Monitoring") as tell:
        result = run(file, logs or (), progress=lambda log, k, count: tell(f"log {k} of {count}, {log}"))
    print(result.task.title or "Monitor")
    print(result.verdict)
    print(result)
    unused = {e.log: e.why for e in result.logs if e.why} | result.left_out
    if unused:
        first = next(iter(unused))
        print(f"  {len(unused)} logs are not used, listed on the page; {first}: {unused[first]}")
    if output is None:
        print(f"All trends on a page: lostmotion monitor {' '.join(map(str, (file, *(logs or ())[:3])))} -o monitored")
    else:
        with writing(output), busy("Writing"):
            from ..reports.monitor import monitor_report
            from ..reports.written_files import write_report

            page = write_report(output, monitor_report(file.stem, result), pictures)
        print(f"Report written to {page}")
        print(f"Next: lostmotion identify {file} -o identified")
    if result.verdict.exit_code:
        raise typer.Exit(result.verdict.exit_code)

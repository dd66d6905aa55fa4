"""The application: its commands, and how each way of failing ends."""

import gc
import os
import re
import sys
import warnings
from typing import Any, NoReturn

import typer

from ..verdict import EXIT_HELP
from ..version import __version__
from . import (
    catalogue,
    drive,
    fmu,
    identify,
    live,
    monitor,
    reproduce,
    response,
    rig,
    run,
    scenarios,
    select,
    servo,
    steps,
    study,
    track,
)
from .terminal import fail, harmless_output

UsageError: type[Exception] = typer.BadParameter.__mro__[1]  # of the parser that typer brings along

app = typer.Typer(
    name="lostmotion",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    help="Dynamics of geared servo drives: lost motion, sticking and load-dependent losses, solved exactly.",
    epilog=f"{EXIT_HELP} Errors are one line on stderr.",
)


def main() -> None:
    """Entry point: known errors end in one line and exit code 1, Ctrl-C in 130."""
    gc.set_threshold(
        100_000
    )  # loading makes many objects that stay; collecting them again and again takes a tenth of the time
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # a search of all that is installed
    # Matrices are so small that the threads of BLAS take more time than they save.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # One line for a doubtful value, without the place in the code.
    warnings.showwarning = lambda message, *_, **__: print(f"warning: {message}")
    with harmless_output():
        _run()


def _run() -> NoReturn:
    from pathlib import Path

    from ..errors import InputError, MissingLibraryError
    from ..inputs.toml_files import in_short

    try:
        code = app(standalone_mode=False)
    except (InputError, MissingLibraryError) as error:
        fail(str(error))
    except UsageError as error:
        _explain_usage(error)
    except KeyboardInterrupt:
        fail("interrupted; nothing was written", 130)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except MemoryError:
        fail("more memory is needed than is free; give fewer values or samples, or close other programs")
    except OSError as error:
        what = f"{in_short(Path(str(error.filename)))}: " if error.filename is not None else ""
        fail(f"{what}{error.strerror or error}")
    except (RuntimeError, ValueError) as error:
        # What a solver or a check of a whole scenario reports is a result for the user; anything else is our defect.
        fail(" ".join(str(error).split()))
    else:
        if code == 130:  # typer turns Ctrl-C into this code
            fail("interrupted; nothing was written", 130)
        sys.exit(code)


def _explain_usage(error: Any) -> NoReturn:
    """One line for a command that cannot be read, and exit code 2; the help where a command has no arguments at all."""
    text = str(error.format_message())
    if "\n" in text:
        print(text, file=sys.stderr)
        sys.exit(2)
    command = error.ctx.command_path if error.ctx else "lostmotion"
    text = re.sub("^Invalid value for '([^']*)'", r"\1", text).rstrip(".")
    fail(f"{text}; see `{command.replace('python -m ', '')} --help`", 2)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(__version__)
        raise typer.Exit


def _limit_memory(text: str | None) -> None:
    """Take the limit for this command and for the processes that it starts."""
    if text is None:
        return
    from ..inputs.memory_limits import VARIABLE, size_of

    try:
        size_of(text)
    except ValueError as error:
        raise typer.BadParameter(f'"{text}" {error}') from None
    os.environ[VARIABLE] = text


@app.callback()
def common(
    version: bool = typer.Option(
        False, "--version", callback=_print_version, is_eager=True, help="Print the version and exit."
    ),
    memory: str | None = typer.Option(
        None,
        metavar="SIZE",
        callback=_limit_memory,
        help='Memory that one input file may need, such as "2 GB" (512 MiB; a saved result 4 GiB).',
    ),
) -> None:
    """Dynamics of geared servo drives: lost motion, sticking and load-dependent losses, solved exactly."""


JUDGES = (
    drive.check,
    servo.servo,
    select.select,
    study.study,
    track.track,
    run.run,
    identify.identify,
    monitor.monitor,
)
"""commands that end in a verdict"""
for command in (
    reproduce.reproduce,
    run.run,
    fmu.fmu,
    live.live,
    response.response,
    rig.rig,
    catalogue.catalogue,
    scenarios.scenarios,
    scenarios.new,
    drive.check,
    servo.servo,
    study.study,
    select.select,
    track.track,
    steps.steps,
    identify.identify,
    monitor.monitor,
):
    app.command(epilog=EXIT_HELP if command in JUDGES else None)(command)
drive_app = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help="Check a drive against its task.")
drive_app.command(epilog=EXIT_HELP)(drive.check)
app.add_typer(drive_app, name="drive", hidden=True)  # the name that `lostmotion check` had
app.command()(scenarios.schema)

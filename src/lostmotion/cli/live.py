"""`lostmotion live`."""

from pathlib import Path

from .arguments import Overrides, SourceArgument, again, flag, load_scenario, option
from .output_files import try_file
from .terminal import about, busy


def live(
    scenario: SourceArgument,
    output: Path | None = option("FILE", "HTML file; left out, NAME.html.", "-o", "--output"),
    overrides: Overrides = None,
    show: bool = flag("Open the page in the browser.", "--open/--no-open", default=True),
) -> None:
    """To try values by sliders: write a page that solves the drive.

    \b
    lostmotion live paper-2dof-nl-small
    lostmotion live drive.toml --set load.inertia="3 kg*m^2" -o drive.html --no-open

    The page solves the drive itself, by the same core as here; it needs no server and no network, and can be sent to others.
    """
    from ..errors import InputError
    from ..live_page.page import write_page

    path = Path(f"{Path(scenario).stem}.html") if output is None else output
    if path.suffix not in (".html", ".htm"):
        raise InputError(f"{path}: the ending {path.suffix or '(none)'} is not known; it must be .html")
    try_file(path)
    loaded = load_scenario(scenario, overrides)
    with about(scenario), busy("Writing"):
        write_page(path, loaded)
    print(f"Page written to {path}")
    print(f"Next: lostmotion run {again(scenario, overrides)} --plot run.png")
    if show:
        import webbrowser

        webbrowser.open(path.resolve().as_uri())

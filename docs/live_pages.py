"""The live pages of the documentation."""

from pathlib import Path

import lostmotion as lm
from lostmotion.live_page.page import write_page

PAGES = ("paper-2dof-nl-small", "joint-under-gravity", "worm-lowering", "hunting-with-backlash")


def write(directory: Path) -> None:
    """One page for each scenario, into a directory that is made if missing."""
    directory.mkdir(parents=True, exist_ok=True)
    for name in PAGES:
        write_page(directory / f"{name}.html", lm.load(name))


if __name__ == "__main__":
    write(Path(__file__).parent / "_generated" / "extra" / "live")

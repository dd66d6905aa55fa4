"""Each HTML page that commands write: well-formed, and each class is one of its style sheet."""

import re
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner

import lostmotion as lm
from conftest import ROOT
from html_pages import Page
from identification_logs import SERVO, TRUTH, write_servo_logs
from lostmotion.cli import app

PACKAGE = ROOT / "src" / "lostmotion"


def written(directory: Path, *words: str, code: int = 0) -> str:
    done = CliRunner().invoke(app, [*words, "-o", str(directory)])
    assert (0 if done.exit_code == 0 else 1) == code, done.output
    (path,) = directory.glob("*.html")
    return path.read_text()


def rig(directory: Path) -> str:
    return written(directory, "rig", "wittenstein-tp010-mf-10")  # whose stiffness and lost motion differ


def servo(directory: Path) -> str:
    """An axis that is unstable and hunts."""
    return written(directory, "servo", "position-axis", "--set", "controller.position.gain=2000 1/s", code=1)


def track(directory: Path) -> str:
    return written(directory, "track", "tracking-loss-map", "--set", "simulation.duration=3")


def identify(directory: Path) -> str:
    logs = directory / "logs"
    logs.mkdir(parents=True)
    write_servo_logs(logs, TRUTH, rung=1, count=2)
    text = (SERVO / "identify.toml").read_text().replace("logs/*.json", str(logs / "00[01].json"))
    text = text.replace('held_out = "kp == 8"', "").replace('"servo.toml"', f'"{SERVO / "servo.toml"}"')
    file = directory / "identify.toml"
    rung = '[[ladder]]\nname = "friction"\nfree = ["coulomb_friction"]\n[fit]\niterations = 2\n'
    file.write_text(text[: text.index("[[ladder]]")] + rung)
    return written(directory / "out", "identify", str(file))


PAGES: dict[str, tuple[Callable[[Path], str], set[tuple[str, str]]]] = {
    "rig": (rig, {("tr", "differs"), ("td", "number"), ("th", "number")}),
    "servo": (servo, {("tr", "differs"), ("td", "number"), ("th", "number"), ("section", "misses")}),
    "pointing": (track, {("tr", "chosen"), ("td", "number"), ("th", "number")}),
    "identification": (identify, {("tr", "chosen"), ("td", "number"), ("th", "number"), ("td", "cell")}),
}
"""Name -> what makes the page, and classes that must be on it."""


@pytest.mark.parametrize("name", PAGES)
def test_every_class_on_a_page_is_in_its_style_sheet(name: str, tmp_path: Path) -> None:
    make, classes = PAGES[name]
    found = Page(make(tmp_path / "page"))
    assert not found.faults
    assert classes <= found.classes


def test_the_page_of_an_fmu_is_well_formed(tmp_path: Path) -> None:
    library = tmp_path / "x86_64-linux" / "all.so"  # the page does not depend on it
    library.parent.mkdir()
    library.touch()
    lm.export_fmu(lm.load("paper-2dof-nl-small"), tmp_path / "drive.fmu", libraries=tmp_path)
    page = zipfile.ZipFile(tmp_path / "drive.fmu").read("documentation/index.html").decode()
    assert not Page(page).faults


def test_a_quoted_class_and_crossed_tags_are_found() -> None:
    style = "<style>tr.differs td { color: red; }</style>"
    assert not Page(f'{style}<table><tr class="differs"><td>1</td></tr></table>').faults
    assert Page(f"{style}<table><tr class=&#34;differs&#34;><td>1</td></tr></table>").faults
    assert Page(f'{style}<table><td class="differs">1</td></table>').faults
    assert Page("<p><b>1</p></b>").faults


def test_no_template_writes_an_attribute_from_a_string() -> None:
    """Quotes of a value are escaped, so that the attribute would hold them."""
    for path in PACKAGE.rglob("*.jinja"):
        for expression in re.findall(r"\{\{(.*?)\}\}", path.read_text(), re.S):
            assert '="' not in expression and "='" not in expression, f"{path.name}: {expression}"

"""The page of a scenario: one HTML file with the core inside."""

import base64
import gzip
import json
import shutil
from pathlib import Path

from ..atomic_writer import write_bytes
from ..errors import InputError
from ..portable.checkout import made_here
from ..portable.scenario_as_numbers import kernel_of
from ..simulation.scenario.scenario import Scenario
from .description import describe

# `make page` puts all beside this file, and the wheel carries them.
TEMPLATE = Path(__file__).with_name("page.html")
CORES = Path(__file__).parent


def core_of(scenario: Scenario) -> Path:
    """The core with the kernel that a scenario takes, so that a page holds no other."""
    return CORES / f"{kernel_of(scenario)}.wasm.gz"


def page(scenario: Scenario, name: str = "drive") -> str:
    """The page as HTML; nothing in it refers to anything outside.

    name: by which downloads are called.
    """
    core = core_of(scenario)
    if shutil.which("npm") is not None:
        made_here(
            f"page-{kernel_of(scenario)}",
            [core] if TEMPLATE.is_file() and core.is_file() else [],
            "the core of the live page",
        )
    for part in (TEMPLATE, core):
        if not part.is_file():
            raise InputError(f"{part}: is missing, since the live page is not built; run `make page`, which needs node")
    described = json.dumps(describe(scenario, name), ensure_ascii=False, allow_nan=False).encode()
    packed = {"CORE": core.read_bytes(), "DESCRIPTION": gzip.compress(described, 9, mtime=0)}
    places = {place: base64.b64encode(content).decode() for place, content in packed.items()}
    text = TEMPLATE.read_text(encoding="utf-8")
    for place, content in places.items():
        before, found, after = text.partition(f'">\n      {place}\n')
        if not found:
            raise InputError(f"{TEMPLATE}: has no place for {place}; run `make page` again")
        text = f'{before}">{content}{after.lstrip()}'
    return text


def write_page(path: Path, scenario: Scenario) -> None:
    """Writes the page of a scenario, whole or not at all."""
    write_bytes(path, page(scenario, path.stem).encode())

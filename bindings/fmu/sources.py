"""Writes the sources of FMUs: the core in one header and a few files, for tools and targets that compile FMUs themselves.

    python bindings/fmu/sources.py src/lostmotion/fmu_libraries/sources

An FMU takes lostmotion.hpp, model.cpp, one of the files solving_KERNEL.cpp and one of the files fmiVERSION.cpp.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from c.build import FMU_SOURCES, KERNELS, REGIMES, ROOT, TICKS  # noqa: E402

SEARCHED = (ROOT / "core", HERE, HERE.parent / "c")
INCLUDED = re.compile(r'#include "(.+)"\n')
NAMES = re.compile(r"\blm_\w+|\bfmi[23][A-Z]\w+(?=\()")
# Functions of FMI 3.0 for types that no variable has; a macro makes their names.
OTHER_TYPES = re.compile(r"OTHER_TYPE\((\w+),")


def path_of(name: str, includer: Path) -> Path:
    """The file that an include directive names."""
    return next(p for at in (includer.parent, *SEARCHED) if (p := (at / name).resolve()).is_file())


class Header:
    """The headers that some sources include, each once and after those that it includes."""

    def __init__(self) -> None:
        self.text: list[str] = []
        self._included: set[Path] = set()

    def without_includes(self, source: Path) -> str:
        """The text of a source; what it includes goes into the header, or, where it is a part of a text, to its place."""

        def moved(include: re.Match[str]) -> str:
            path = path_of(include[1], source)
            if "#pragma once" not in path.read_text(encoding="utf-8"):
                return self.without_includes(path)
            self._include(path)
            return ""

        return INCLUDED.sub(moved, source.read_text(encoding="utf-8")).replace("#pragma once\n", "")

    def _include(self, path: Path) -> None:
        if path in self._included:
            return
        self._included.add(path)
        text = self.without_includes(path)  # which adds the headers that this one needs before it
        self.text.append(f"\n// --- {path.relative_to(ROOT).as_posix()} ---\n\n{text}")


def joined(header: Header, sources: list[Path]) -> str:
    """Sources as one file that includes the header."""
    parts = (f"\n// --- {s.relative_to(ROOT).as_posix()} ---\n\n{header.without_includes(s)}" for s in sources)
    return '#include "lostmotion.hpp"\n' + "".join(parts)


def written(to: Path) -> None:
    """Write all files, and names.txt with the names that two FMUs in one program would share, into a directory."""
    header, files = Header(), {}
    interface = [s for s in FMU_SOURCES if s.parent != HERE and s.stem != "freestanding"]
    for kernel, source in KERNELS.items():
        files[f"solving_{kernel}.cpp"] = joined(header, [*TICKS, source])
    files["model.cpp"] = joined(header, [*REGIMES, *interface])
    for version in (2, 3):
        files[f"fmi{version}.cpp"] = joined(header, [HERE / f"fmi{version}.cpp"])
    text = "".join(header.text)
    everything = text + "".join(files.values())
    names = {*NAMES.findall(everything), "lostmotion"}
    names |= {f"fmi3{verb}{of}" for of in OTHER_TYPES.findall(everything) for verb in ("Get", "Set")} - {"fmi3GetNAME"}
    to.mkdir(parents=True, exist_ok=True)
    files["names.txt"] = "".join(f"{name}\n" for name in sorted(names))
    files["lostmotion.hpp"] = f'#pragma once\n\n#include "configuration.hpp"\n{text}'
    for name, content in files.items():
        (to / name).write_text(content, encoding="utf-8")


if __name__ == "__main__":
    written(Path(sys.argv[1]))

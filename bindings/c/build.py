"""Builds the C interface by the Zig compiler: as WebAssembly, as the cores of live pages, or as the libraries of an FMU for all platforms.

    python bindings/c/build.py wasm build/wasm/lostmotion.wasm
    python bindings/c/build.py page src/lostmotion/live_page
    python bindings/c/build.py fmu src/lostmotion/fmu_libraries

Made anew where a source has changed. The compiler is on PyPI: pip install ziglang.
"""

from __future__ import annotations

import argparse
import fcntl
import gzip
import os
import re
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
KERNEL_SOURCES = {name: ROOT / "core" / "kernels" / f"{name}.cpp" for name in ("wide", "middle", "narrow")}
# The longest to compile first.
SOURCES = (
    *KERNEL_SOURCES.values(),
    *(HERE / f"{name}.cpp" for name in ("run", "simulation", "explanation", "scenario", "train", "freestanding")),
)
CORE_FLAGS = (
    *("-std=gnu++20", "-g0", "-fvisibility=hidden", "-fno-sanitize=all", f"-I{ROOT / 'core'}"),
    *("-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"),
)
FLAGS = (*CORE_FLAGS, "-fno-exceptions", "-fno-rtti")
# Of an FMU: no runs in one go.
FMU_SOURCES = (
    *(s for s in SOURCES if s.stem not in ("run", "explanation")),
    HERE.parent / "fmu" / "fmi2.cpp",
    HERE.parent / "fmu" / "fmi3.cpp",
)
# Of a live page, beside the kernel of its drive: nothing else.
PAGE_SOURCES = tuple(s for s in SOURCES if s.stem in ("run", "explanation", "scenario", "freestanding"))
KERNELS = ("drive", *KERNEL_SOURCES)
# The oldest C library that the libraries for Linux need, and the names of the libraries.
PLATFORMS = {
    "x86_64-linux": ("x86_64-linux-gnu.2.17", "lostmotion.so"),
    "aarch64-linux": ("aarch64-linux-gnu.2.17", "lostmotion.so"),
    "x86_64-windows": ("x86_64-windows-gnu", "lostmotion.dll"),
    "aarch64-windows": ("aarch64-windows-gnu", "lostmotion.dll"),
    "x86_64-darwin": ("x86_64-macos", "lostmotion.dylib"),
    "aarch64-darwin": ("aarch64-macos", "lostmotion.dylib"),
}
WASM = ("-target", "wasm32-wasi", "-msimd128")
STACK = 1 << 20


def newest(sources: Sequence[Path]) -> float:
    """When any of these, or of the core's headers, was changed last."""
    headers = [*(ROOT / "core").rglob("*.hpp"), *(ROOT / "bindings").rglob("*.h*"), Path(__file__)]
    return max(path.stat().st_mtime for path in (*headers, *sources))


def zig(command: str, *arguments: str | Path) -> None:
    """A command of the Zig compiler, with its cache in the build directory."""
    cache = str(ROOT / "build" / "zig")
    environment = os.environ | {"ZIG_GLOBAL_CACHE_DIR": cache, "ZIG_LOCAL_CACHE_DIR": cache}
    words = [sys.executable, "-m", "ziglang", command, *map(str, arguments)]
    subprocess.run(words, env=environment, check=True)


def objects(
    sources: Sequence[Path], target: Sequence[str], optimisation: str, directory: Path, flags: Sequence[str] = FLAGS
) -> list[Path]:
    """The object files of some sources, those compiled anew that are older than the core."""
    directory.mkdir(parents=True, exist_ok=True)
    made = [directory / f"{source.stem}.o" for source in sources]
    latest = newest(sources)
    old = [(s, o) for s, o in zip(sources, made, strict=True) if not o.exists() or o.stat().st_mtime < latest]

    def compiled(pair: tuple[Path, Path]) -> None:
        source, to = pair
        unfinished = to.with_suffix(".unfinished.o")
        zig("c++", "-c", *target, *flags, optimisation, source, "-o", unfinished)
        unfinished.replace(to)
        os.utime(to, (latest, latest))  # what is edited in the meantime is newer

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(compiled, old))
    return made


def linked(to: Path, made: Sequence[Path], *exports: str) -> None:
    """A WebAssembly module that imports nothing; `_initialize` is to be called first."""
    unfinished = to.with_suffix(".unfinished.wasm")
    options = ("-mexec-model=reactor", "-s", *(f"-Wl,{e}" for e in exports), f"-Wl,-z,stack-size={STACK}")
    zig("cc", *WASM, *options, *made, "-o", unfinished)
    unfinished.replace(to)


def wasm(to: Path, optimisation: str = "-O3") -> Path:
    """The C interface as a WebAssembly module: the functions of lostmotion.h, and malloc and free."""
    to.parent.mkdir(parents=True, exist_ok=True)
    with (to.parent / f".{to.name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # one process compiles, the others wait
        made = objects(SOURCES, WASM, optimisation, to.parent / f"{to.stem}-objects")
        if not to.exists() or to.stat().st_mtime < max(o.stat().st_mtime for o in made):
            linked(to, made, "--export=malloc", "--export=free", "--export-dynamic")
    return to


def called_by_page() -> list[str]:
    """The functions that page/src calls."""
    sources = "".join(path.read_text() for path in (ROOT / "page" / "src").glob("*.ts"))
    return sorted(set(re.findall(r'"(lm_\w+|malloc|free)"', sources)))


def page_core(kernel: str, optimisation: str = "-O3") -> Path:
    """The core of a live page with one kernel alone: a WebAssembly module with the functions that a page calls."""
    directory = ROOT / "build" / "page-core" / kernel
    directory.mkdir(parents=True, exist_ok=True)
    to = directory / "core.wasm"
    with (directory / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # one process compiles, the others wait
        sources = (KERNEL_SOURCES[kernel], *PAGE_SOURCES) if kernel in KERNEL_SOURCES else PAGE_SOURCES
        made = objects(sources, (*WASM, f"-DLOSTMOTION_KERNEL={kernel}"), optimisation, directory)
        calls = ROOT / "page" / "src" / "core.ts"
        if not to.exists() or to.stat().st_mtime < max(p.stat().st_mtime for p in (*made, calls)):
            linked(to, made, *(f"--export={name}" for name in called_by_page()))
    return to


def page(to: Path, optimisation: str = "-O3", kernels: Sequence[str] = KERNELS) -> None:
    """The cores of live pages as these carry them, KERNEL.wasm.gz."""
    for kernel in kernels:
        packed = gzip.compress(page_core(kernel, optimisation).read_bytes(), 9, mtime=0)
        (to / f"{kernel}.wasm.gz").write_bytes(packed)


def fmu(to: Path, optimisation: str = "-O2", platforms: Sequence[str] = tuple(PLATFORMS)) -> None:
    """The libraries of FMUs, each in a directory named after its platform."""
    for platform in platforms:
        target, name = PLATFORMS[platform]
        library = to / platform / name
        library.parent.mkdir(parents=True, exist_ok=True)
        arguments = ["-target", target, "-mcpu=baseline"] + ([] if "windows" in platform else ["-fPIC"])
        made = objects(FMU_SOURCES, arguments, optimisation, ROOT / "build" / "fmu" / platform)
        unfinished = library.with_suffix(".unfinished")
        whole = ["-Wl,-z,defs"] if "linux" in platform else []  # elsewhere a missing symbol ends the linking anyway
        zig("cc", *arguments, "-shared", "-s", *whole, *made, "-o", unfinished)
        unfinished.replace(library)
        for spare in library.parent.glob("*.lib"):  # the linker for Windows writes an import library beside it
            spare.unlink()
        print(library, library.stat().st_size)


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("what", choices=("wasm", "page", "fmu"))
    parser.add_argument("to", type=Path)
    parser.add_argument("-O", dest="optimisation", default="3")
    parser.add_argument("platforms", nargs="*", help=f"of an FMU: some of {', '.join(PLATFORMS)}; default all")
    given = parser.parse_args()
    if given.what == "wasm":
        print(wasm(given.to, f"-O{given.optimisation}"))
    elif given.what == "page":
        page(given.to, f"-O{given.optimisation}")
    else:
        fmu(given.to, f"-O{given.optimisation}", given.platforms or tuple(PLATFORMS))


if __name__ == "__main__":
    main()

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
# The longest to compile first.
KERNELS = {name: ROOT / "core" / "kernels" / f"{name}.cpp" for name in ("any", "middle", "drive")}
# Sources that are compiled as one, in less time and to less code.
Group = Sequence[Path]
CORE = ROOT / "core" / "lostmotion"


def room(*names: str) -> list[Path]:
    """The sources of directories of the core."""
    return [source for name in names for source in sorted((CORE / name).glob("*.cpp"))]


# What is called at each tick, at each new regime, and now and then.
TICKS, REGIMES = room("control"), room("elements", "model", "simulation")
REST = [*(CORE / "analysis" / f"{name}.cpp" for name in ("breakaway", "train_explain", "train_linear"))]
REST += room("scenario")
INTERFACE = [HERE / f"{name}.cpp" for name in ("run", "simulation", "explanation", "scenario", "train", "freestanding")]
CORE_FLAGS = (
    *("-std=gnu++20", "-g0", "-fvisibility=hidden", "-fno-sanitize=all", f"-I{ROOT / 'core'}"),
    *("-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math"),
)
FLAGS = (*CORE_FLAGS, "-fno-exceptions", "-fno-rtti")
# Of an FMU, beside the kernel of its drive or train: no runs in one go.
FMU_SOURCES = [
    *(source for source in REST if source.stem not in ("explanation", "whole_run")),
    *(s for s in INTERFACE if s.stem in ("simulation", "scenario", "freestanding")),
    *(HERE.parent / "fmu" / f"{name}.cpp" for name in ("fmi2", "fmi3")),
]
# Each FMU and each platform adds to its size: no functions but those of FMI, no tables for exceptions.
FMU_FLAGS = (*FLAGS, "-DLM_API=", "-ffunction-sections", "-fdata-sections", "-fno-unwind-tables")
# Of the kernels of FMUs: a twentieth smaller; a step of 0.35 us takes 0.03 us more.
FMU_KERNEL_FLAGS = ("-mllvm", "-inline-threshold=60", "-mllvm", "-unroll-threshold=40")
# Of a live page, beside the kernel of its drive: nothing else.
PAGE_SOURCES = [
    *TICKS,
    *REGIMES,
    *REST,
    *(s for s in INTERFACE if s.stem in ("run", "explanation", "scenario", "freestanding")),
]
# With the oldest C library that the libraries for Linux need, and the extension of their names.
PLATFORMS = {
    "x86_64-linux": ("x86_64-linux-gnu.2.17", ".so"),
    "aarch64-linux": ("aarch64-linux-gnu.2.17", ".so"),
    "x86_64-windows": ("x86_64-windows-gnu", ".dll"),
    "aarch64-windows": ("aarch64-windows-gnu", ".dll"),
    "x86_64-darwin": ("x86_64-macos", ".dylib"),
    "aarch64-darwin": ("aarch64-macos", ".dylib"),
}
WASM = ("-target", "wasm32-wasi")
# In place of a C library, which would be compiled in half a minute.
WASM_LIBRARY = [HERE / "wasm_library.cpp"]
# Small blocks are cleared and copied in place: an engine leaves memory.fill and memory.copy to a function of its own.
WASM_CODE = (*WASM, "-msimd128", "-mllvm", "-max-store-memset=32", "-mllvm", "-max-store-memcpy=32")
# Of what solves drives in a live page: browsers inline and unroll nothing, and their calls and loops cost more. Trains become a quarter larger by it.
INLINED = ("-mllvm", "-inline-threshold=350", "-mllvm", "-unroll-threshold=600")
STACK = 1 << 20
PAGE_CORES = ROOT / "build" / "page-core"


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


def compiled(
    group: Group, target: Sequence[str], optimisation: str, directory: Path, flags: Sequence[str] = FLAGS
) -> Path:
    """The object file of a group, named after the last of it, compiled anew if it is older than the core."""
    directory.mkdir(parents=True, exist_ok=True)
    *before, last = group
    made, latest = directory / f"{last.stem}.o", newest(group)
    if made.exists() and made.stat().st_mtime >= latest:
        return made
    unfinished = made.with_suffix(".unfinished.o")
    included = [word for source in before for word in ("-include", source)]
    zig("c++", "-c", *target, *flags, optimisation, *included, last, "-o", unfinished)
    unfinished.replace(made)
    os.utime(made, (latest, latest))  # what is edited in the meantime is newer
    return made


def objects(
    groups: Sequence[Group], target: Sequence[str], optimisation: str, directory: Path, flags: Sequence[str] = FLAGS
) -> list[Path]:
    """The object files of some groups."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(lambda group: compiled(group, target, optimisation, directory, flags), groups))


def linked(to: Path, made: Sequence[Path], *exports: str) -> None:
    """A WebAssembly module that imports nothing; `_initialize` is to be called first."""
    unfinished = to.with_suffix(".unfinished.wasm")
    options = ("-nostartfiles", "-fno-sanitize=all", "-s", "-Wl,--no-entry", *(f"-Wl,{e}" for e in exports))
    zig("cc", "-target", "wasm32-freestanding", *options, f"-Wl,-z,stack-size={STACK}", *made, "-o", unfinished)
    unfinished.replace(to)


def wasm(to: Path, optimisation: str = "-O3") -> Path:
    """The C interface as a WebAssembly module: the functions of lostmotion.h, and malloc and free."""
    to.parent.mkdir(parents=True, exist_ok=True)
    with (to.parent / f".{to.name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # one process compiles, the others wait
        groups = [*([kernel] for kernel in KERNELS.values()), [*TICKS, *REGIMES], [*REST, *INTERFACE], WASM_LIBRARY]
        made = objects(groups, WASM_CODE, optimisation, to.parent / f"{to.stem}-objects")
        if not to.exists() or to.stat().st_mtime < max(o.stat().st_mtime for o in made):
            linked(to, made, "--export=malloc", "--export=free", "--export-dynamic")
    return to


def called_by_page() -> list[str]:
    """The functions that page/src calls."""
    sources = "".join(path.read_text() for path in (ROOT / "page" / "src").glob("*.ts"))
    return sorted(set(re.findall(r'"(lm_\w+|malloc|free)"', sources)))


def kernel_target(kernel: str) -> Sequence[str]:
    """What the kernel of a live page is compiled for."""
    return (*WASM_CODE, *(INLINED if kernel == "drive" else ()))


def page_core(kernel: str, made: Sequence[Path]) -> Path:
    """The core of a live page with one kernel alone: a WebAssembly module with the functions that a page calls."""
    to, calls = PAGE_CORES / kernel / "core.wasm", ROOT / "page" / "src" / "core.ts"
    if not to.exists() or to.stat().st_mtime < max(p.stat().st_mtime for p in (*made, calls)):
        linked(to, made, *(f"--export={name}" for name in called_by_page()))
    return to


def page_cores(kernels: Sequence[str], optimisation: str = "-O3") -> list[Path]:
    """The cores of live pages with these kernels: all but the kernel is compiled once."""
    PAGE_CORES.mkdir(parents=True, exist_ok=True)
    with (PAGE_CORES / ".lock").open("w") as lock, ThreadPoolExecutor(os.cpu_count()) as pool:
        fcntl.flock(lock, fcntl.LOCK_EX)  # one process compiles, the others wait
        own = [pool.submit(compiled, [KERNELS[k]], kernel_target(k), optimisation, PAGE_CORES / k) for k in kernels]
        shared = ((PAGE_SOURCES, "-Os"), (WASM_LIBRARY, "-O2"))
        rest = [pool.submit(compiled, group, WASM_CODE, level, PAGE_CORES) for group, level in shared]
        made = [part.result() for part in rest]
        return [page_core(kernel, [of.result(), *made]) for kernel, of in zip(kernels, own, strict=True)]


def page(to: Path, optimisation: str = "-O3", kernels: Sequence[str] = tuple(KERNELS)) -> None:
    """The cores of live pages as these carry them, KERNEL.wasm.gz."""
    for kernel, core in zip(kernels, page_cores(kernels, optimisation), strict=True):
        (to / f"{kernel}.wasm.gz").write_bytes(gzip.compress(core.read_bytes(), 9, mtime=0))


def fmu_libraries(to: Path, platform: str, optimisation: str = "-O2") -> None:
    """The libraries of FMUs for a platform, KERNEL.so or alike: kernels for speed; the rest for size, once for all."""
    target, _ = PLATFORMS[platform]
    arguments = ["-target", target, "-mcpu=baseline", *([] if "windows" in platform else ["-fPIC"])]
    directory = ROOT / "build" / "fmu" / platform
    shared = ((TICKS, optimisation, FMU_KERNEL_FLAGS), (REGIMES, optimisation, ()), (FMU_SOURCES, "-Oz", ()))
    rest = [compiled(group, arguments, level, directory, (*FMU_FLAGS, *more)) for group, level, more in shared]
    for kernel, source in KERNELS.items():
        own = compiled([source], arguments, optimisation, directory, (*FMU_FLAGS, *FMU_KERNEL_FLAGS))
        link_fmu(to, platform, kernel, arguments, [own, *rest])


def link_fmu(to: Path, platform: str, kernel: str, arguments: Sequence[str], made: Sequence[Path]) -> None:
    """The library of FMUs for a platform and a kernel."""
    library = to / platform / f"{kernel}{PLATFORMS[platform][1]}"
    library.parent.mkdir(parents=True, exist_ok=True)
    unfinished = library.with_suffix(".unfinished")
    # A missing symbol ends the linking, not the loading; nothing that is not called, and no names but those of FMI.
    link = {
        "linux": ["-s", "-Wl,-z,defs", "-Wl,--gc-sections"],
        "windows": ["-s"],
        "darwin": ["-Wl,-dead_strip", "-Wl,-x"],
    }[platform.partition("-")[2]]
    zig("cc", *arguments, "-shared", *link, *made, "-o", unfinished)
    unfinished.replace(library)
    for spare in library.parent.glob("*.lib"):  # the linker for Windows writes an import library beside it
        spare.unlink()
    print(library, library.stat().st_size)


def fmu(to: Path, optimisation: str = "-O2", platforms: Sequence[str] = tuple(PLATFORMS)) -> None:
    """The libraries of FMUs, KERNEL.so or alike, each in a directory named after its platform."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(lambda platform: fmu_libraries(to, platform, optimisation), platforms))


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("what", choices=("wasm", "page", "fmu"))
    parser.add_argument("to", type=Path)
    parser.add_argument("-O", dest="optimisation", default="3")
    parser.add_argument(
        "which",
        nargs="*",
        help=f"of a page: some of {', '.join(KERNELS)}; of an FMU: some of {', '.join(PLATFORMS)}; default all",
    )
    given = parser.parse_args()
    if given.what == "wasm":
        print(wasm(given.to, f"-O{given.optimisation}"))
    elif given.what == "page":
        page(given.to, f"-O{given.optimisation}", given.which or tuple(KERNELS))
    else:
        fmu(given.to, f"-O{given.optimisation}", given.which or tuple(PLATFORMS))


if __name__ == "__main__":
    main()

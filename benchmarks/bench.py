"""`make bench`: the paper's run against its peers, in one run on one machine. Times are best of several."""

from __future__ import annotations

import platform
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from peer_scipy import Peer

import lostmotion as lm

ROOT = Path(__file__).parent.parent


def best(repeats: int, work: Callable[[], object]) -> float:
    """Milliseconds."""
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return 1e3 * min(times)


def start_up(*command: str) -> float:
    return best(5, lambda: subprocess.run(command, check=True, stdout=subprocess.DEVNULL))


def main() -> None:
    scenario = lm.load(ROOT / "scenarios" / "paper-2dof-nl-large.toml")
    exact = lm.simulate(scenario)
    rows: list[tuple[str, float, str]] = []
    responses: list[tuple[str, float]] = []
    for line in subprocess.run([sys.argv[1]], check=True, capture_output=True, text=True).stdout.splitlines():
        name, milliseconds, error = line.split("|")
        if name.startswith("response, "):
            responses.append((name.removeprefix("response, "), float(milliseconds)))
        else:
            rows.append((f"C++: {name}", float(milliseconds), error))
    rows.append(("Python to dataset, no ledger", best(100, lambda: lm.simulate(scenario, energy=False)), "0"))
    rows.append(("Python to dataset, with ledger", best(100, lambda: lm.simulate(scenario)), "0"))

    peer = Peer(scenario)
    times = exact["time"].values
    for method in ("LSODA", "Radau"):
        for rtol in (1e-6, 1e-8):
            begin = time.perf_counter()
            try:
                states = peer.run(2.0, times, method, rtol)
            except RuntimeError as error:
                rows.append((f"scipy {method}, rtol {rtol:g}: {error}", float("nan"), "-"))
                continue
            spent = 1e3 * (time.perf_counter() - begin)
            errors = [
                np.max(np.abs(states[:, column] - exact[name].values)) / np.max(np.abs(exact[name].values))
                for column, name in ((2, "load_speed"), (3, "twist"))
            ]
            rows.append((f"scipy {method}, rtol {rtol:g}, events in Python", spent, f"{max(errors):.3g}"))

    reference = next(ms for name, ms, _ in rows if "same drive again" in name)
    print(
        f"\n{platform.platform()}, Python {platform.python_version()}, lostmotion {exact.attrs['lostmotion_version']}"
    )
    print("2-DOF-NL, E_CA = 1.0275, 1 Hz, 2 s from rest, sampled at 1 kHz, stand-in loss table\n")
    print(f"{'':52}{'time [ms]':>12}{'ratio':>10}{'largest error':>16}")
    for name, ms, error in rows:
        print(f"{name:52}{ms:12.4f}{ms / reference:10.1f}{error:>16}")
    print("\nFrequency response of the same drive: 60 frequencies from 0.1 to 100 Hz, 8 amplitudes\n")
    print(f"{'':64}{'time [ms]':>12}{'ratio':>10}")
    for name, ms in responses:
        print(f"{name:64}{ms:12.0f}{ms / responses[0][1]:10.1f}")
    python, command = sys.executable, str(Path(sys.executable).with_name("lostmotion"))
    bare = start_up(python, "-c", "pass")
    print(
        f"\nimport lostmotion            {start_up(python, '-c', 'import lostmotion') - bare:8.1f} ms beyond the interpreter's own {bare:.1f} ms"
    )
    print(f"lostmotion --help            {start_up(command, '--help'):8.1f} ms")
    begin = time.perf_counter()
    subprocess.run(
        [command, "reproduce", "-o", str(ROOT / "build" / "bench-report")], check=True, stdout=subprocess.DEVNULL
    )
    print(f"lostmotion reproduce         {1e3 * (time.perf_counter() - begin):8.0f} ms")


if __name__ == "__main__":
    main()

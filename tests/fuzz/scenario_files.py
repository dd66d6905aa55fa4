"""Scenario files: the shipped ones with other values, keys, tables or bytes."""

from __future__ import annotations

import json
import tomllib
from functools import cache
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

import lostmotion as lm
from fuzz import mutation
from fuzz.verdict import Failure, check_message, ends, refused
from lostmotion.inputs.toml_text import toml_text

ROOT = Path(__file__).parents[2]
SECONDS = 1.5  # of a run until it is interrupted
ENDINGS = (".nc", ".csv", ".parquet")


@cache
def texts() -> list[bytes]:
    """Scenario files to begin with."""
    return [path.read_bytes() for path in sorted((ROOT / "scenarios").glob("*.toml"))]


@cache
def data() -> list[Any]:
    """Their tables."""
    return [tomllib.loads(text.decode()) for text in texts()]


def mutated(random: Random) -> bytes:
    """A scenario file, changed."""
    if random.random() < 0.25:
        return mutation.content(random, random.choice(texts()), random.choice(texts()))
    tables = mutation.tables(random, random.choice(data()), data())
    try:
        return toml_text(tables).encode(errors="surrogatepass")
    except (TypeError, RecursionError):
        return b"x = " + repr(tables).encode(errors="replace")


def case(random: Random, folder: Path) -> None:
    """Read, run, save and open; or refused with the file's name, the key and one line."""
    path = folder / "drive.toml"
    path.write_bytes(mutated(random))
    scenario = refused(lambda: lm.load("drive.toml"), ["drive.toml"])
    if scenario is None:
        return
    result = ends(lambda: refused(lambda: lm.simulate(scenario, energy=True), (), lm.SolverError), SECONDS)
    if result is None:
        return
    check_result(result)
    name = f"result{random.choice(ENDINGS)}"
    ends(lambda: refused(lambda: lm.save(result, name), [name]), 5.0)
    if Path(name).exists():
        again = lm.open_result(name)
        if not np.array_equal(again["time"], result["time"]):
            raise Failure(f"{name}: has other instants than the result")


def check_result(result: Any) -> None:
    """The energy balance closes, or the result says that it does not."""
    if "warning" in result.attrs:
        check_message(result.attrs["warning"])
    share = result.attrs.get("energy_residual", 0.0)
    if not share <= 1e-6 and "energy" not in result.attrs.get("warning", ""):
        raise Failure(f"the energy balance fails by {share:.2g} without a warning: {json.loads(result.attrs['energy'])}")

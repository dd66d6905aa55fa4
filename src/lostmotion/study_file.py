"""Study files: a base scenario, what is varied and how, and what is kept of each run."""

from __future__ import annotations

import json
import math
import warnings
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, ValidationError, model_validator

from .errors import InputError, need
from .quantities import Part
from .scenario import Scenario, find_scenario, load
from .study_expressions import Expression, read_expression
from .study_units import in_si, unit_of_key
from .toml_files import read_toml
from .variables import VARIABLES

CHUNK = 500  # runs that are computed, and written, as one
MAX_RUNS = 100_000_000


WAYS = ("values", "grid", "uniform", "log_uniform", "normal", "triangular")


class Normal(Part):
    """Normal distribution."""

    mean: float
    deviation: Annotated[float, Field(gt=0.0)]


class Vary(Part):
    """One parameter, or several that go together. Values are SI, or strings with a unit of what the key measures."""

    key: str = ""
    """dotted key of the scenario, such as load.inertia"""
    keys: tuple[str, ...] = ()
    """several keys that all get the value"""
    name: str = ""
    """column in the result; the first key if left out"""
    relative: bool = False
    """the value multiplies what the base scenario has (of a list, each entry)"""
    values: tuple[float, ...] | None = None
    """as they are; in a random design each is as likely"""
    grid: tuple[float, float, int] | None = None
    """first, last, how many"""
    uniform: tuple[float, float] | None = None
    log_uniform: tuple[float, float] | None = None
    normal: Normal | None = None
    triangular: tuple[float, float, float] | None = None
    """least, most likely, largest"""

    @model_validator(mode="before")
    @classmethod
    def _read_units(cls, data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        key = data.get("key") or next(iter(data.get("keys") or ()), "")
        unit = "" if data.get("relative") else unit_of_key(str(key))
        try:
            return data | {way: in_si(data[way], unit) for way in WAYS if way in data}
        except ValueError as error:
            raise ValueError(f"of {key}: {error}") from None

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        ways = [w for w in WAYS if getattr(self, w) is not None]
        if bool(self.key) == bool(self.keys):
            raise ValueError("needs key or keys, one of the two")
        if len(ways) != 1:
            raise ValueError(f"of {self.title}: needs one of values, grid, uniform, log_uniform, normal, triangular")
        pair = self.uniform or self.log_uniform
        if pair is not None and not pair[0] < pair[1]:
            raise ValueError(f"of {self.title}: {pair[0]} must be below {pair[1]}")
        if self.log_uniform is not None and self.log_uniform[0] <= 0.0:
            raise ValueError(f"of {self.title}: log_uniform needs positive bounds")
        if self.grid is not None and self.grid[2] < 1:
            raise ValueError(f"of {self.title}: grid needs at least one value")
        if self.values is not None and not self.values:
            raise ValueError(f"of {self.title}: values is empty")
        if self.triangular is not None and not self.triangular[0] <= self.triangular[1] <= self.triangular[2]:
            raise ValueError(f"of {self.title}: triangular must rise")
        return self

    @property
    def all_keys(self) -> tuple[str, ...]:
        return self.keys or (self.key,)

    @property
    def title(self) -> str:
        return self.name or self.all_keys[0]

    @property
    def unit(self) -> str:
        """Of the values."""
        return (unit_of_key(self.all_keys[0]) if not self.relative else None) or "1"

    def levels(self) -> np.ndarray | None:
        """Values of a grid or list; None for a distribution."""
        if self.values is not None:
            return np.array(self.values)
        return None if self.grid is None else np.linspace(self.grid[0], self.grid[1], self.grid[2])

    def quantile(self, u: np.ndarray) -> np.ndarray:
        """Values at probabilities 0 < u < 1."""
        import scipy.stats as st

        levels = self.levels()
        if levels is not None:
            out: Any = levels[np.minimum((u * len(levels)).astype(int), len(levels) - 1)]
        elif self.uniform is not None:
            out = self.uniform[0] + u * (self.uniform[1] - self.uniform[0])
        elif self.log_uniform is not None:
            a, b = (math.log(x) for x in self.log_uniform)
            out = np.exp(a + u * (b - a))
        elif self.normal is not None:
            out = st.norm.ppf(u, self.normal.mean, self.normal.deviation)
        else:
            assert self.triangular is not None
            low, mode, high = self.triangular
            out = st.triang.ppf(u, (mode - low) / (high - low), low, high - low) if high > low else np.full_like(u, low)
        return np.asarray(out, dtype=float)


class Trajectories(Part):
    """Samples to keep, beside the scalars."""

    variables: tuple[str, ...] = Field(min_length=1)
    every: Annotated[int, Field(ge=1)] = 1
    """one of so many samples"""

    @model_validator(mode="after")
    def _known(self) -> Self:
        names = {v.name for v in VARIABLES}
        for v in self.variables:
            if v not in names:
                raise ValueError(f"has the variable {v!r}, which is none; they are {', '.join(sorted(names))}")
        return self


class Study(Part):
    """Many runs of one scenario."""

    title: str = ""
    scenario: Scenario
    """the base, with all values"""
    design: Literal["grid", "list", "latin_hypercube", "sobol", "random", "saltelli"] = "grid"
    """grid: every combination; list: the first value of each, then the second, ...; saltelli: for Sobol indices"""
    runs: Annotated[int, Field(ge=1, le=MAX_RUNS)] | None = None
    """of a random design; of saltelli the base samples, a power of two"""
    seed: Annotated[int, Field(ge=0)] = 0
    vary: tuple[Vary, ...] = Field(min_length=1)
    keep: dict[str, str] = Field(min_length=1)
    """column = expression of the result variables, such as peak(load_speed) or energy.gear_losses"""
    trajectories: Trajectories | None = None

    @model_validator(mode="after")
    def _fits(self) -> Self:
        titles = [v.title for v in self.vary]
        keys = [k for v in self.vary for k in v.all_keys]
        for name, values in (("name", titles), ("key", keys)):
            twice = [x for x in values if values.count(x) > 1]
            if twice:
                raise ValueError(f"has the {name} {twice[0]} twice in vary")
        for v in self.vary:
            if v.levels() is None and self.design in ("grid", "list"):
                raise ValueError(
                    f"has design {self.design}, for which {v.title} needs values or grid, not a distribution"
                )
            for key in v.all_keys:
                if key.split(".", maxsplit=1)[0] == "simulation":
                    raise ValueError(f"varies {key}; all runs must have the same samples")
                base_value(self.scenario, key)
        if self.design in ("grid", "list"):
            if self.runs is not None:
                raise ValueError(f"has runs, but with design {self.design} their number follows; leave it out")
        elif self.runs is None:
            raise ValueError(f"lacks runs, which design {self.design} needs")
        if self.design == "list" and len({len(v.levels()) for v in self.vary}) > 1:  # type: ignore[arg-type]
            raise ValueError("has design list, but vary has lists of different lengths")
        if self.design == "saltelli" and self.runs is not None and self.runs & (self.runs - 1):
            raise ValueError(f"has runs = {self.runs}; saltelli needs a power of two")
        for name, text in self.keep.items():
            if name in {*titles, "run", "error", "switchings"}:
                raise ValueError(f"keeps {name!r}, a name that is taken; choose another")
            try:
                expression = read_expression(text)
            except ValueError as error:
                raise ValueError(f"keep.{name}: {error}") from None
            if "ideal_speed" in expression.names and self.scenario.motor.kind != "dc":
                raise ValueError(
                    f"keep.{name}: ideal_speed needs a motor of kind dc; a torque source has no speed of its own"
                )
        if self.total > MAX_RUNS:
            raise ValueError(f"has {self.total} runs, more than {MAX_RUNS}")
        return self

    @property
    def expressions(self) -> dict[str, Expression]:
        """What to keep, read."""
        return {name: read_expression(text) for name, text in self.keep.items()}

    @property
    def total(self) -> int:
        """Number of runs."""
        if self.design == "grid":
            counts = [len(v.levels()) for v in self.vary]  # type: ignore[arg-type]
            return math.prod(counts)
        if self.design == "list":
            return len(self.vary[0].levels())  # type: ignore[arg-type]
        assert self.runs is not None
        return self.runs * (2 * len(self.vary) + 2) if self.design == "saltelli" else self.runs

    def parameters(self, first: int, last: int) -> np.ndarray:
        """Values of the runs first .. last - 1, one row each. A row depends on the study alone."""
        p = len(self.vary)
        index = np.arange(first, last)
        if self.design == "grid":
            levels = [v.levels() for v in self.vary]
            out, rest = np.empty((len(index), p)), index.copy()
            for k in range(p - 1, -1, -1):
                values = levels[k]
                assert values is not None
                out[:, k] = values[rest % len(values)]
                rest //= len(values)
            return out
        if self.design == "list":
            return np.stack([v.levels()[first:last] for v in self.vary], axis=1)  # type: ignore[index]
        u = self._unit_cube(first, last)
        return np.stack([v.quantile(u[:, k]) for k, v in enumerate(self.vary)], axis=1)

    def _unit_cube(self, first: int, last: int) -> np.ndarray:
        from scipy.stats import qmc

        p = len(self.vary)
        if self.design == "sobol":
            sampler = qmc.Sobol(p, scramble=True, rng=np.random.default_rng(self.seed))
            if first:
                sampler.fast_forward(first)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UserWarning)  # a part need not be a power of two
                return _open(sampler.random(last - first))
        if self.design == "saltelli":
            return _open(_saltelli(p, self.runs or 1, self.seed)[first:last])
        if self.design == "random":
            # Each chunk has its own stream, so that any part can be made without those before it.
            chunks = range(first // CHUNK, (last - 1) // CHUNK + 1)
            rows = np.concatenate([np.random.default_rng([self.seed, c]).random((CHUNK, p)) for c in chunks])
            begin = first - chunks[0] * CHUNK
            return _open(rows[begin : begin + last - first])
        return _open(_latin_hypercube(p, self.total, self.seed)[first:last])


@lru_cache(maxsize=2)  # one part after the other is asked for
def _latin_hypercube(p: int, n: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    out = np.empty((n, p))
    for k in range(p):
        strata, inside = rng.permutation(n), rng.random(n)
        out[:, k] = (strata + inside) / n
    return out


def _open(u: np.ndarray) -> np.ndarray:
    """Within 0 and 1, both excluded."""
    return np.asarray(np.clip(u, 1e-12, 1.0 - 1e-12))


@lru_cache(maxsize=2)
def _saltelli(p: int, base: int, seed: int) -> np.ndarray:
    need("SALib", "The design saltelli", "study")
    from SALib.sample import sobol

    problem = {"num_vars": p, "names": [str(k) for k in range(p)], "bounds": [[0.0, 1.0]] * p}
    return np.asarray(sobol.sample(problem, base, calc_second_order=True, seed=seed))


# --- reading ---


def base_value(scenario: Scenario, key: str) -> Any:
    """What the base scenario has under a dotted key.

    Raises
    ------
    ValueError
        There is nothing of that name.
    """
    node: Any = scenario
    for part in key.split("."):
        node = (
            node.get(part) if isinstance(node, dict) else getattr(node, part, None) if hasattr(node, part) else _Missing
        )
        if node is _Missing:
            raise ValueError(f"varies {key}, which the base scenario does not know ({part})")
    return node


class _Missing:
    """Stands for a key that is not there."""


def load_study(path: str | Path) -> Study:
    """Read a study file. Its key `base` names the scenario file, relative to it; `set` may change values of that.

    Raises
    ------
    InputError
        With one line that names the file, the key, the value and the remedy.
    """
    path = Path(path)
    data = read_toml(path, "a study")
    base = data.pop("base", None)
    if not isinstance(base, str):
        raise InputError(f"{path}: key base: must name the scenario file that is varied")
    changes = data.pop("set", {})
    if not isinstance(changes, dict):
        raise InputError(f'{path}: key set: must be a table, such as set = {{ "load.inertia" = 2 }}')
    scenario = load(find_scenario(base, path.parent), changes)
    try:
        return Study(scenario=scenario, **data)
    except ValidationError as error:
        # A misspelt key is the cause of the missing one.
        first = min(error.errors(), key=lambda problem: problem["type"] != "extra_forbidden")
        key = ".".join(str(k) for k in first["loc"])
        plain = {
            "extra_forbidden": "is not known; see the page on studies for the keys",
            "missing": "is missing; add it",
        }
        text = str(first["ctx"]["error"]) if first["type"] == "value_error" else plain.get(first["type"], first["msg"])
        more = "" if len(error.errors()) == 1 else f" (and {len(error.errors()) - 1} more)"
        raise InputError(f"{path}: {f'key {key}: ' if key else 'the study '}{text}{more}") from None


def from_json(text: str) -> Study:
    """The study that `to_json` wrote."""
    data = json.loads(text)
    data["scenario"] = Scenario(**data["scenario"])
    return Study(**data)


def to_json(study: Study) -> str:
    """All of a study, the base scenario included."""
    return study.model_dump_json(exclude_none=True)

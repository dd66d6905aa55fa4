"""What the core gave, to the last bit: `python tests/golden.py` compares it with golden.toml, `--record` renews that file.

Only numbers that the core itself computes are held to the bit. What numpy, scipy or LAPACK make of them is not, since their
last bits may differ between machines and versions: the Floquet multipliers are compared within `TOLERANCE`.
"""

from __future__ import annotations

import hashlib
import json
import math
import re
import struct
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq

import lostmotion as lm
from chains import chain

ROOT = Path(__file__).parent.parent
FILE = Path(__file__).with_name("golden.toml")

HEADER = """\
# What the core gave when this file was recorded: `python tests/golden.py --record`. CONTRIBUTING.md says when.
# A number is written as a hexadecimal float, which is all its bits. A series has the SHA-256 of its numbers (8 bytes each, little
# endian), their count and some of them by position (first, quarters, last, and the one of the largest magnitude), so that
# a change of the last bit can be told from a wrong value. A list of decimals is compared within a tolerance.
# Series of scenarios with quantised encoders also have a short hash of each of up to 64 blocks, which locates the first
# difference. Another system's mathematical libraries change nothing: see src/lostmotion/reproducible.py.
"""

# LAPACK's eigenvalues of a Jacobian J are those of a matrix within eps |J| of it, |J| < 1.5 here. Multipliers of zero may
# belong to a defective pair, which that moves by sqrt(eps |J|) = 2e-8; all others move less.
TOLERANCE = 1e-7

BLOCKS = 64
MANY = 100  # variables of a run: the series of a larger train are held as one

MASSES = 8, 20, 30, 64  # of chains with friction on each and a gap at every third
STEADY = ("load_speed", "twist", "output_torque")
STEPPED = ("paper-2dof-nl-small", "step-to-standstill")
FREQUENCIES, AMPLITUDES = (0.5, 2.0, 10.0, 40.0), (0.025, 0.3)  # Hz, relative voltage
MEANS = ("motor_power", "load_power", "gear_loss", "angle_advance", "residual")

Values = dict[str, Any]  # name -> number, array (held to the bit) or list (within the tolerance)
Groups = dict[str, Values]


def compute() -> Groups:
    """All groups of values, by their table in the file."""
    groups: Groups = {}
    for path in sorted((ROOT / "scenarios").glob("*.toml")):
        scenario, name = lm.load(path), path.stem
        groups |= {f"{name}.{what}": values for what, values in of_run(scenario).items()}
        if not scenario.is_drive or scenario.controller is not None:
            continue
        s = scenario.command
        if not (s.steps or s.ramps or scenario.load.torque.ramps):
            groups[f"{name}.periodic_motion"] = of_periodic_motion(scenario)
        if name in STEPPED:
            groups[f"{name}.step_by_step"] = of_steps(scenario)
    nonlinear = lm.load(ROOT / "scenarios/paper-2dof-nl-small.toml")
    groups["paper-2dof-nl-small.frequency_response"] = of_response(nonlinear)
    groups["paper-2dof-nl-small.study"] = of_study(nonlinear)
    linear = lm.load(ROOT / "scenarios/paper-2dof-l-large.toml", ["motor.friction_torque=0"])
    long = of_run(linear.replace(**{"simulation.duration": 1e9, "simulation.sample_interval": 1e7}))
    groups |= {f"a-billion-seconds.{what}": values for what, values in long.items()}
    for n in MASSES:
        loose = chain(n, friction=0.02, gaps=tuple(range(1, n - 1, 3)))
        groups |= {f"chain-of-{n}.{what}": values for what, values in of_run(loose).items()}
    return groups


def of_run(scenario: lm.Scenario) -> Groups:
    result = lm.simulate(scenario)
    derived = {v.name for v in lm.simulation.VARIABLES if v.derived}
    switchings = lm.switchings_of(result)
    groups: Groups = {
        "samples": {str(name): result[name].values for name in result if name not in derived},
        "switchings": {str(name): switchings[name].values for name in switchings},
        "end_state": json.loads(result.attrs["end_state"]),
        "energy": lm.energy_of(result),
    }
    gears = scenario.gears.values() if not scenario.is_drive else (scenario.gearbox,)
    for gear in gears:
        if isinstance(gear.losses, lm.model.LossMap):  # not of the core; where it differs, all else does
            groups["input"] = {"loss_map": np.ravel(gear.losses.values)}
    if len(groups["samples"]) > MANY:
        return {
            what: {"all": np.concatenate([np.ravel(v) for v in values.values()])} for what, values in groups.items()
        }
    return groups


def of_periodic_motion(scenario: lm.Scenario) -> Values:
    motion = lm.periodic_motion(scenario)
    exact = {n: v for n, v in motion.attrs.items() if n.startswith("start_") or n in ("residual", "angle_advance")}
    moduli = np.hypot(motion.attrs["multipliers_real"], motion.attrs["multipliers_imag"])
    return (
        exact
        | {name: motion[name].values for name in STEADY}
        | {"jacobian": np.ravel(motion["jacobian"].values), "multipliers": moduli.tolist()}
    )


def of_steps(scenario: lm.Scenario) -> Values:
    """To each level of the command in a straight line over one step, then held over 99."""
    simulation = lm.Simulation(scenario, step=1e-3)
    readings = []
    before = 0.0
    for level in (0.2, -0.1, 0.03, 0.0):
        for k in range(100):
            simulation.advance(1e-3, command=level if k else (before, level), load_torque=20.0 * level)
            readings.append(simulation.read())
        before = level
    return {v.name: np.array([r[v.name] for r in readings]) for v in lm.simulation.VARIABLES if not v.derived}


def of_response(scenario: lm.Scenario) -> Values:
    response = lm.frequency_response(scenario, FREQUENCIES, AMPLITUDES)
    harmonics = {
        f"harmonics_of_{output}": np.ravel(response["harmonics"].sel(output=output).values.view(float))
        for output in response["output"].values
    }
    return harmonics | {name: np.ravel(response[name].values) for name in MEANS}


def of_study(scenario: lm.Scenario) -> Values:
    study = lm.studies.Study(
        scenario=scenario,
        vary=[
            {"key": "load.inertia", "values": [1.5, 2.0, 2.5]},
            {"key": "gearbox.stiffness.slopes", "relative": True, "values": [0.75, 1.0, 1.25]},
            {"key": "command.amplitude", "values": [0.025, 0.5]},
        ],
        keep={
            "peak_load_speed": "peak(load_speed)",
            "rms_twist": "rms(twist)",
            "mean_output_torque": "mean(output_torque)",
            "end_angle": "final(load_angle)",
            "gear_losses": "energy.gear_losses",
        },
    )
    with tempfile.TemporaryDirectory() as directory:
        table = pq.ParquetDataset(lm.study(study, Path(directory) / "study")).read()
    return {name: table[name].to_numpy().astype(float) for name in (*study.keep, "switchings")}


# --- the file ----------------------------------------------------------------------------------------------


def entry(value: Any, blocks: bool = False) -> Any:
    """A value as it is recorded; with short hashes of its blocks if asked for."""
    if isinstance(value, list):
        return value
    if not isinstance(value, np.ndarray):
        return float(value).hex()
    numbers = bits_of(value)
    n = len(numbers)
    if n == 0:
        return {"sha256": hashlib.sha256(b"").hexdigest(), "count": 0, "at": {}}
    largest = int(np.argmax(np.abs(np.nan_to_num(numbers, nan=0.0))))
    places = sorted({0, n // 4, n // 2, 3 * n // 4, n - 1, largest})
    out = {
        "sha256": hashlib.sha256(numbers.tobytes()).hexdigest(),
        "count": n,
        "at": {str(k): float(numbers[k]).hex() for k in places},
    }
    return out | {"blocks": "".join(block_hashes(numbers))} if blocks else out


def block_size(count: int) -> int:
    return max(1, math.ceil(count / BLOCKS))


def block_hashes(numbers: np.ndarray) -> list[str]:
    """Four hexadecimal digits of each block."""
    size = block_size(len(numbers))
    return [hashlib.sha256(numbers[k : k + size].tobytes()).hexdigest()[:4] for k in range(0, len(numbers), size)]


def quantised(scenario: str) -> bool:
    """Whether an encoder of a scenario rounds: 1e-16 may then become one step of the encoder after seconds."""
    path = ROOT / "scenarios" / f"{scenario}.toml"
    axes = lm.load(path).axes().values() if path.exists() else ()
    encoders = [e for c in axes for e in (getattr(c, "encoder", None), getattr(c, "position_encoder", None)) if e]
    return any(not e.ideal and e.step > 0.0 for e in encoders)


def bits_of(values: np.ndarray) -> np.ndarray:
    """The numbers as they are hashed; one NaN is like another."""
    numbers = np.ascontiguousarray(values, dtype="<f8").copy()
    numbers[np.isnan(numbers)] = math.nan
    return numbers


def as_toml(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{k} = {as_toml(v)}" for k, v in value.items()) + " }"
    return json.dumps(value)


def as_key(name: str) -> str:
    return name if re.fullmatch("[A-Za-z0-9_-]+", name) else json.dumps(name)


def record(groups: Groups) -> None:
    located = {name for name in groups if name.endswith(".samples") and quantised(name.removesuffix(".samples"))}
    tables = (
        "\n".join([f"[{name}]", *(f"{as_key(k)} = {as_toml(entry(v, name in located))}" for k, v in values.items())])
        for name, values in groups.items()
    )
    FILE.write_text("\n\n".join([HEADER.rstrip(), *tables]) + "\n", encoding="utf-8")


def recorded() -> Groups:
    nested = tomllib.loads(FILE.read_text(encoding="utf-8"))
    return {f"{name}.{what}": values for name, of in nested.items() for what, values in of.items()}


# --- comparing ---------------------------------------------------------------------------------------------


def differences(groups: Groups, golden: Groups) -> Iterator[str]:
    """One line for each value that is not as recorded: which it is, and how far it is off."""
    for group in {**golden, **groups}:
        now, then = groups.get(group, {}), golden.get(group, {})
        for name in {**then, **now}:
            if name not in now:
                yield f"{group}.{name}: is recorded and not computed"
            elif name not in then:
                yield f"{group}.{name}: is not recorded"
            elif text := difference(then[name], now[name]):
                yield f"{group}.{name}: {text}"


def difference(then: Any, now: Any) -> str:
    """How far a value is from the recorded one; empty if it is the same."""
    if isinstance(now, list):
        off = max(abs(a - b) for a, b in zip(then, now, strict=True))
        return f"differs by {off:.2g}; {TOLERANCE:g} is allowed" if off > TOLERANCE else ""
    located = isinstance(then, dict) and "blocks" in then
    if entry(now, located) == then:
        return ""
    if not isinstance(now, np.ndarray):
        return off_by(float.fromhex(then), float(now))
    parts = [] if then["count"] == now.size else [f"{then['count']} numbers recorded, {now.size} now"]
    if located:
        parts.append(first_difference(then["blocks"], now))
    return "; ".join([*parts, farthest_off({int(k): float.fromhex(v) for k, v in then["at"].items()}, now)])


def first_difference(then: str, now: np.ndarray) -> str:
    """Where a series of a scenario with quantised encoders first differs, which is the difference that counts."""
    numbers = bits_of(now)
    size, hashes = block_size(len(numbers)), block_hashes(numbers)
    recorded = [then[k : k + 4] for k in range(0, len(then), 4)]
    pairs = zip(recorded, hashes, strict=False)
    k = next((k for k, (a, b) in enumerate(pairs) if a != b), min(len(recorded), len(hashes)))
    here = ", ".join(float(v).hex() for v in numbers[k * size : k * size + 3])
    return (
        f"first difference in samples {k * size} to {min((k + 1) * size, len(numbers)) - 1} (now {here}, ...); this first "
        "difference counts, since a quantised encoder turns a last bit into one of its steps later on"
    )


def farthest_off(then: dict[int, float], now: np.ndarray) -> str:
    """Of the numbers that are recorded themselves the one that is farthest off."""
    off = {k: float(now[k]) for k, v in then.items() if k < now.size and float(now[k]).hex() != v.hex()}
    if not off:
        return "the numbers recorded with their values are the same, others differ"
    k = max(off, key=lambda k: distance(then[k], off[k]))
    unit = math.ulp(max(abs(v) for v in then.values() if math.isfinite(v)))
    return (
        f"{len(off)} of {len(then)} recorded numbers differ, number {k} most: {off_by(then[k], off[k])}; "
        f"that is {distance(then[k], off[k]) / unit:.3g} ulp of the largest"
    )


def distance(a: float, b: float) -> float:
    return abs(a - b) if math.isfinite(a - b) else math.inf


def off_by(then: float, now: float) -> str:
    if not (math.isfinite(then) and math.isfinite(now)):
        return f"{then} recorded, {now} now"
    return f"{ulps(then, now)} ulp ({then.hex()} recorded, {now.hex()} now: {then:.6g} and {now:.6g})"


def ulps(a: float, b: float) -> int:
    """How many floating-point numbers lie from one to the other."""

    def place(x: float) -> int:
        (bits,) = struct.unpack("<q", struct.pack("<d", x))
        return bits if bits >= 0 else -(bits & 0x7FFF_FFFF_FFFF_FFFF)

    return abs(place(a) - place(b))


def main() -> int:
    groups = compute()
    lines = list(differences(groups, recorded() if FILE.exists() else {}))
    for line in lines:
        print(line)
    if "--record" in sys.argv[1:]:
        record(groups)
        return 0
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())

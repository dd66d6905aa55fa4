"""What the core gave, to the last bit: `python tests/golden.py` compares it with golden.toml, `--record` renews that file.

The file has a hash of each series. Where one differs, run `--save FILE.npz` with the build that gave the old bits and
`--against FILE.npz` with the new one: this shows the first number that differs, and the one that is farthest off.

Only numbers that the core itself computes are held to the bit. What numpy, scipy or LAPACK make of them is not, since their
last bits may differ between machines and versions: the Floquet multipliers are compared within `TOLERANCE`.
"""

import argparse
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
from lostmotion.simulation.forms.key_aliases import DRIVE

ROOT = Path(__file__).parent.parent
FILE = Path(__file__).with_name("golden.toml")

HEADER = """\
# What the core gave when this file was recorded: `python tests/golden.py --record`. CONTRIBUTING.md says when.
# A series has the first 16 digits of the SHA-256 of its numbers (8 bytes each, little endian). A list of decimals is
# compared within a tolerance. `python tests/golden.py --against` shows the first number that differs from another build.
# Another system's mathematical libraries change nothing: see src/lostmotion/reproducible.py.
"""

# LAPACK's eigenvalues of a Jacobian J are those of a matrix within eps |J| of it, |J| < 1.5 here. Multipliers of zero may
# belong to a defective pair, which that moves by sqrt(eps |J|) = 2e-8; all others move less.
TOLERANCE = 1e-7

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
        if scenario.form != DRIVE or scenario.controller is not None:
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
    gears = scenario.gears.values() if scenario.form != DRIVE else (scenario.gearbox,)
    for gear in gears:
        if isinstance(gear.losses, lm.model.LossMap):  # not of the core; where it differs, all else does
            groups["input"] = {"loss_map": np.ravel(gear.losses.values)}
    if len(groups["samples"]) > MANY:
        return {what: {"all": np.concatenate([np.ravel(v) for v in values.values()])} for what, values in groups.items()}
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


# --- the file ---
def bits_of(value: Any) -> np.ndarray:
    """The numbers of a value as they are hashed; one NaN is like another."""
    numbers = np.array(value, dtype="<f8").ravel()
    numbers[np.isnan(numbers)] = math.nan
    return numbers


def entry(value: Any) -> Any:
    """A value as it is recorded."""
    return value if isinstance(value, list) else hashlib.sha256(bits_of(value).tobytes()).hexdigest()[:16]


def as_key(name: str) -> str:
    return name if re.fullmatch("[A-Za-z0-9_-]+", name) else json.dumps(name)


def record(groups: Groups) -> None:
    tables: dict[str, list[str]] = {}
    for name, values in groups.items():
        table, _, what = name.rpartition(".")
        entries = ", ".join(f"{as_key(k)} = {json.dumps(entry(v))}" for k, v in values.items())
        tables.setdefault(table, []).append(f"{what} = {{ {entries} }}")
    written = ("\n".join([f"[{table}]", *lines]) for table, lines in tables.items())
    FILE.write_text("\n\n".join([HEADER.rstrip(), *written]) + "\n", encoding="utf-8")


def recorded() -> Groups:
    nested = tomllib.loads(FILE.read_text(encoding="utf-8"))
    return {f"{name}.{what}": values for name, of in nested.items() for what, values in of.items()}


# --- comparing ---
def flat(groups: Groups) -> Values:
    return {f"{group}.{name}": value for group, values in groups.items() for name, value in values.items()}


def differences(groups: Groups, golden: Groups) -> Iterator[str]:
    """One line for each value that is not as recorded."""
    now, then = flat(groups), flat(golden)
    for name in {**then, **now}:
        if name not in now:
            yield f"{name}: is recorded and not computed"
        elif name not in then:
            yield f"{name}: is not recorded"
        elif isinstance(now[name], list):
            off = max(abs(a - b) for a, b in zip(then[name], now[name], strict=True))
            if off > TOLERANCE:
                yield f"{name}: differs by {off:.2g}; {TOLERANCE:g} is allowed"
        elif entry(now[name]) != then[name]:
            yield f"{name}: differs"


def first_differences(then: Values, now: Values) -> Iterator[str]:
    """One line for each series of two builds that differs: the first number that does, and the one that is farthest off.

    The first one counts where an encoder is quantised: it turns a last bit into one of its steps later on.
    """
    for name in now.keys() & then.keys():
        a, b = bits_of(then[name]), bits_of(now[name])
        n = min(a.size, b.size)
        other = np.flatnonzero(a[:n].view("<i8") != b[:n].view("<i8"))
        said = [f"{a.size} numbers then, {b.size} now"] if a.size != b.size else []
        if other.size:
            most = other[np.argmax(np.abs(np.nan_to_num(a[other] - b[other], nan=math.inf)))]
            said.append(f"{other.size} of {n} differ, first number {other[0]}: {off_by(a[other[0]], b[other[0]])}")
            said.append(f"most number {most}: {off_by(a[most], b[most])}")
        if said:
            yield f"{name}: {'; '.join(said)}"


def off_by(then: float, now: float) -> str:
    return f"{ulps(then, now)} ulp ({float(then)!r} then, {float(now)!r} now)"


def ulps(a: float, b: float) -> int:
    """How many floating-point numbers lie from one to the other."""

    def place(x: float) -> int:
        (bits,) = struct.unpack("<q", struct.pack("<d", x))
        return bits if bits >= 0 else -(bits & 0x7FFF_FFFF_FFFF_FFFF)

    return abs(place(a) - place(b))


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--record", action="store_true", help="renew golden.toml")
    arguments.add_argument("--save", metavar="FILE.npz", help="write all numbers")
    arguments.add_argument("--against", metavar="FILE.npz", help="compare with numbers that another build saved")
    asked = arguments.parse_args()
    groups = compute()
    lines = list(differences(groups, recorded() if FILE.exists() else {}))
    if asked.against:
        with np.load(asked.against) as then:
            lines = list(first_differences(dict(then), flat(groups)))
    if asked.save:
        np.savez_compressed(asked.save, **flat(groups))
    if asked.record:
        record(groups)
    for line in lines:
        print(line)
    return 1 if lines and not asked.record else 0


if __name__ == "__main__":
    sys.exit(main())

"""Unidentifiable parameters follow from the null directions, and their remedies from the missing channels."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identification_logs import AXIS
from lostmotion.identification.identify import identify_logs
from lostmotion.identification.preparation.prepare import prepared
from lostmotion.identification.readers.log import Channel, Log
from lostmotion.identification.result import IdentificationResult
from lostmotion.identification.rig.rig_scenario import Rig
from lostmotion.identification.task.identification_file import Identification
from lostmotion.identification.virtual_logs import virtual_log

NOISE = 5e-3  # m/s
TIME = 2e-3 * np.arange(1500)
FORCE = 80.0 * np.sin(4.0 * TIME) + 40.0 * np.sin(11.0 * TIME)


def identified(directory: Path, values: dict[str, float], **tables: Any) -> IdentificationResult:
    """Of a log with these values, which are the start values too."""
    (directory / "axis.toml").write_text(AXIS)
    data: dict[str, Any] = {
        "scenario": "axis.toml",
        "logs": {"files": ["*.csv"]},
        "inputs": {"drive_command": {"channel": "force", "interpolation": "linear"} | tables.pop("input", {})},
        "measured": {"speed": {"channel": "speed", "variable": "carriage_speed", "deviation": NOISE} | tables.pop("measured", {})},
        "parameters": {n: {"start": v, "min": -10.0 if n in "pq" else 1e-3, "max": 1e3} for n, v in values.items()},
        "fit": {"regression": False, "iterations": 8},
    }
    rig = Rig(Identification(**data | tables), directory)
    plan = Log("0.csv", TIME, {"force": Channel(FORCE)})
    log = virtual_log(rig, plan, values, noise={"speed": NOISE}, seed=5)
    return identify_logs(rig, [prepared(rig.task, log, rig.units)], threads=1)


@pytest.mark.parametrize("late", [0.02, 0.022, 0.03])
def test_two_delays_in_a_row_are_a_sum(tmp_path: Path, late: float) -> None:
    """What acts late and what is shown late shift the same speed; alike in size, they look like a product."""
    result = identified(tmp_path, {"dead_time": 0.02, "speed_delay": late}, input={"delay": "dead_time"}, measured={"delay": "speed_delay"})
    (said,) = [u.text for u in result.undetermined]
    assert said in {
        f"only the sum {a} + {b} is determined; fix one of them, or give a channel whose delay is known"
        for a, b in (("dead_time", "speed_delay"), ("speed_delay", "dead_time"))
    }


@pytest.mark.parametrize(("values", "scale", "offset", "what"), [
    ({"gain": 1.1, "volts": 0.9}, "gain*volts", 0.0, {"product gain*volts", "product volts*gain"}),
    ({"gain": 1.1, "volts": 1.2}, "gain/volts", 0.0, {"ratio gain/volts", "ratio volts/gain"}),
    ({"gain": 0.5, "volts": 0.55}, "gain + volts", 0.0, {"sum gain + volts", "sum volts + gain"}),
    ({"p": 1.0, "q": 1.1}, 1.0, "p - q", {"difference p - q", "difference q - p"}),
])  # fmt: skip
def test_the_combination_that_is_determined_is_that_of_the_formula(
    tmp_path: Path, values: dict[str, float], scale: Any, offset: Any, what: set[str]
) -> None:
    result = identified(tmp_path, values, input={"scale": scale}, measured={"offset": offset})
    (said,) = [u.text for u in result.undetermined]
    assert said.removeprefix("only the ").partition(" is determined")[0] in what


@pytest.mark.parametrize(("values", "scale", "said"), [
    ({"a": 1.1, "b": 0.9, "c": 1.3}, "a*b*c", "the product {a*b*c}"),
    ({"a": 1.1, "b": 0.9, "c": 1.3}, "a*b/c", "{a*b}/c"),
    ({"a": 0.4, "b": 0.35, "c": 0.3}, "a + b + c", "the sum {a + b + c}"),
    ({"a": 0.9, "b": 0.9, "c": 0.8}, "a + b - c", "{a + b} - c"),
    ({"a": 0.5, "b": 0.6, "c": 1.2}, "(a + b)*c", "one combination of {a, b, c}"),
])  # fmt: skip
def test_one_value_of_three_is_one_sentence(tmp_path: Path, values: dict[str, float], scale: str, said: str) -> None:
    """Two null directions, which any rotation mixes: no pair of the three is determined."""
    result = identified(tmp_path, values, input={"scale": scale})
    (found,) = result.undetermined
    text = found.text.removeprefix("only ").partition(" is determined")[0]
    before, within, after = re.fullmatch(r"(.*)\{(.*)\}(.*)", said).groups()  # type: ignore[union-attr]
    assert text.startswith(before) and text.endswith(after)
    order = text[len(before) : len(text) - len(after)]
    assert sorted(re.split(r"\W+", order)) == sorted(re.split(r"\W+", within))
    assert set(re.findall(r"[*+,]", order)) == set(re.findall(r"[*+,]", within)) and found.directions == 2


def test_two_pairs_are_not_mixed(tmp_path: Path) -> None:
    """All directions of an eigenspace are alike to its decomposition; a pair has no part in the other."""
    values = {"a": 1.1, "b": 0.9, "own": 110.0, "guide": 90.0}
    result = identified(tmp_path, values, input={"scale": "a*b"}, set={"slides.carriage.viscous_friction": "own + guide"})
    said = {u.text.partition(" is determined")[0] for u in result.undetermined}
    assert len(said) == 2
    assert said & {"only the product a*b", "only the product b*a"}
    assert said & {"only the sum own + guide", "only the sum guide + own"}


def test_a_weighted_sum_is_neither_a_sum_nor_a_product(tmp_path: Path) -> None:
    values = {"own": 60.0, "guide": 80.0}
    result = identified(tmp_path, values, set={"slides.carriage.viscous_friction": "2*own + guide"})
    (said,) = result.undetermined
    assert said.text.startswith("the logs stay the same if these change together: guide +10 %, own -")
    assert said.changes["own"] == pytest.approx(-80.0 / 120.0, rel=0.01)


def test_advice_does_not_ask_for_what_the_log_has(tmp_path: Path) -> None:
    """Where the force is the input and is known, no log of it is missing; without a controller there is no reference."""
    values = {"own": 120.0, "guide": 80.0}
    result = identified(tmp_path, values, set={"slides.carriage.viscous_friction": "own + guide"})
    (said,) = [u.text for u in result.undetermined]
    assert "only the sum" in said and "coasts" in said
    assert "torque or current" not in said and "stall" not in said and "reference" not in said

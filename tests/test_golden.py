"""Nothing that the core computes changes by a bit unless golden.toml is renewed on purpose."""

import math

import numpy as np
import pytest

import golden
from conftest import run_in_build
from lostmotion import _instruction_set

SERIES = np.linspace(-1.0, 3.0, 101)
RECORDED = {"some-scenario.samples": {"twist": golden.entry(SERIES), "end": golden.entry(2.0)}}


@pytest.mark.parametrize("build", _instruction_set.builds())
def test_every_bit_is_as_recorded(build: str) -> None:
    done = run_in_build(build, golden.__file__)
    assert done.returncode == 0, (
        f"the build '{build}' does not give what golden.toml holds (CONTRIBUTING.md says when it is renewed):\n"
        f"{done.stdout}{done.stderr}"
    )


def test_a_processor_without_fused_multiply_add_gives_the_same_bits(monkeypatch) -> None:
    monkeypatch.setenv("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2,-AVX512F")
    done = run_in_build("any", golden.__file__)
    assert done.returncode == 0, done.stdout + done.stderr


def test_what_is_recorded_is_read_back_the_same(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(golden, "FILE", tmp_path / "golden.toml")
    groups = {"some-scenario.samples": {"twist": SERIES, "end": 0.1, "multipliers": [0.25, 1e-20]}}
    golden.record(groups)
    assert list(golden.differences(groups, golden.recorded())) == []
    assert float.fromhex(golden.recorded()["some-scenario.samples"]["end"]) == 0.1


def lines(series: np.ndarray, end: float = 2.0) -> list[str]:
    return list(golden.differences({"some-scenario.samples": {"twist": series, "end": end}}, RECORDED))


def test_a_last_bit_is_told_from_a_wrong_value() -> None:
    last_bit = SERIES.copy()
    last_bit[50] = np.nextafter(last_bit[50], 9.0)  # 1 + 2.2e-16; the largest is 3, whose ulp is twice that of 1
    (line,) = lines(last_bit)
    assert line.startswith("some-scenario.samples.twist: 1 of 5 recorded numbers differ, number 50 most: 1 ulp (")
    assert line.endswith("; that is 0.5 ulp of the largest")

    wrong = SERIES * 1.01  # one of them is zero
    (line,) = lines(wrong)
    assert "4 of 5 recorded numbers differ, number 100 most: " in line
    assert line.endswith(f"that is {0.03 / 2**-51:.3g} ulp of the largest")


def test_a_change_between_the_recorded_numbers_is_seen() -> None:
    changed = SERIES.copy()
    changed[7] = np.nextafter(changed[7], 9.0)
    assert lines(changed) == [
        "some-scenario.samples.twist: the numbers recorded with their values are the same, others differ"
    ]


def test_the_sign_of_zero_counts_and_the_payload_of_nan_does_not() -> None:
    assert golden.entry(np.array([0.0])) != golden.entry(np.array([-0.0]))
    other_nan = np.array([0x7FF8_0000_0000_0001], dtype="<u8").view("<f8")
    assert golden.entry(np.array([math.nan])) == golden.entry(other_nan)


def test_numbers_that_are_missing_are_counted() -> None:
    (line,) = lines(SERIES[:-1])
    assert line.startswith("some-scenario.samples.twist: 101 numbers recorded, 100 now; ")


def test_a_single_value_and_one_that_is_not_recorded_are_named() -> None:
    (line,) = lines(SERIES, end=np.nextafter(2.0, 1.0))
    assert line.startswith("some-scenario.samples.end: 1 ulp (0x1.0000000000000p+1 recorded, 0x1.fffffffffffffp+0 now")
    assert next(golden.differences({}, RECORDED)) == "some-scenario.samples.twist: is recorded and not computed"
    (line,) = golden.differences({"new.samples": {"twist": SERIES}}, {})
    assert line == "new.samples.twist: is not recorded"


@pytest.mark.parametrize(
    ("a", "b", "apart"),
    [(1.0, 1.0 + 2**-52, 1), (1.0, 1.0 - 2**-53, 1), (-5e-324, 5e-324, 2), (0.0, -0.0, 0), (1.0, 2.0, 2**52)],
)
def test_units_of_rounding_are_counted(a: float, b: float, apart: int) -> None:
    assert golden.ulps(a, b) == golden.ulps(b, a) == apart

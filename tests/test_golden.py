"""Nothing that the core computes changes by a bit unless golden.toml is renewed on purpose."""

import math

import numpy as np
import pytest
from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

import golden
from conftest import installed_builds, run_in_build, some

DISPATCHED = list(__cpu_dispatch__)
"""sets of instructions that NumPy has code of its own for, beyond those that it takes for granted"""

SERIES = np.linspace(-1.0, 3.0, 101)
RECORDED = {"some-scenario.samples": {"twist": golden.entry(SERIES), "end": golden.entry(2.0)}}


@pytest.mark.parametrize("build", installed_builds())
def test_every_bit_is_as_recorded(build: str) -> None:
    done = run_in_build(build, golden.__file__)
    assert done.returncode == 0, (
        f"the build '{build}' does not give what golden.toml holds (CONTRIBUTING.md says when it is renewed):\n{done.stdout}{done.stderr}"
    )


# NumPy's and the C library's own choice of code for a processor, reduced to that of older ones.
AVX_512 = [name for name in DISPATCHED if "512" in name or name == "X86_V4"]
PROCESSORS = {"with SSE alone": (DISPATCHED, "-FMA,-FMA4,-AVX,-AVX2,-AVX512F,-BMI2"), "without AVX-512": (AVX_512, "-AVX512F,-AVX512VL")}


@pytest.mark.parametrize("processor", list(PROCESSORS)[: some(2, 1)])  # the farthest from what runs otherwise
def test_every_processor_gives_the_same_bits(processor: str, monkeypatch) -> None:
    disabled, hidden = PROCESSORS[processor]
    monkeypatch.setenv("NPY_DISABLE_CPU_FEATURES", " ".join(disabled))
    monkeypatch.setenv("GLIBC_TUNABLES", f"glibc.cpu.hwcaps={hidden}")
    done = run_in_build(installed_builds()[0], "-W", "ignore", golden.__file__)
    assert done.returncode == 0, done.stdout + done.stderr


def test_masks_of_processors_change_what_numpy_computes(monkeypatch) -> None:
    """Otherwise the masks would show nothing. Only where this processor has features to mask."""
    script = "import numpy as np; from numpy._core._multiarray_umath import __cpu_features__ as f; print(sum(f.values()))"
    counts = []
    for disabled in ("", " ".join(DISPATCHED)):
        monkeypatch.setenv("NPY_DISABLE_CPU_FEATURES", disabled)
        counts.append(int(run_in_build(installed_builds()[0], "-W", "ignore", "-c", script).stdout))
    present = [name for name in DISPATCHED if __cpu_features__.get(name)]
    assert counts[1] <= counts[0] - len(present)


def test_what_is_recorded_is_read_back_the_same(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(golden, "FILE", tmp_path / "golden.toml")
    groups = {"some-scenario.samples": {"a.twist": SERIES, "end": 0.1, "multipliers": [0.25, 1e-20]}}
    golden.record(groups)
    assert list(golden.differences(groups, golden.recorded())) == []
    moved = {"some-scenario.samples": {"a.twist": SERIES, "end": 0.1, "multipliers": [0.25 + 1e-6, 1e-20]}}
    (line,) = golden.differences(moved, golden.recorded())
    assert line == "some-scenario.samples.multipliers: differs by 1e-06; 1e-07 is allowed"


def test_a_last_bit_and_a_value_that_is_not_recorded_are_named() -> None:
    changed = SERIES.copy()
    changed[7] = np.nextafter(changed[7], 9.0)
    found = golden.differences({"some-scenario.samples": {"twist": changed, "new": 1.0}}, RECORDED)
    assert list(found) == [
        "some-scenario.samples.twist: differs",
        "some-scenario.samples.end: is recorded and not computed",
        "some-scenario.samples.new: is not recorded",
    ]


def test_the_first_number_that_differs_from_another_build_is_shown() -> None:
    changed = SERIES.copy()
    changed[7] = np.nextafter(changed[7], -9.0)
    changed[60:] += 1e-3
    changed[80] += 1.0
    then, now = {"angle": SERIES, "same": SERIES}, {"angle": changed[:-1], "same": SERIES.copy()}
    (line,) = golden.first_differences(then, now)
    assert line.startswith("angle: 101 numbers then, 100 now; 41 of 100 differ, first number 7: 1 ulp (-0.72 then, ")
    assert "; most number 80: " in line


def test_the_sign_of_zero_counts_and_the_payload_of_nan_does_not() -> None:
    assert golden.entry(np.array([0.0])) != golden.entry(np.array([-0.0]))
    other_nan = np.array([0x7FF8_0000_0000_0001], dtype="<u8").view("<f8")
    assert golden.entry(np.array([math.nan])) == golden.entry(other_nan)


@pytest.mark.parametrize(
    ("a", "b", "apart"), [(1.0, 1.0 + 2**-52, 1), (1.0, 1.0 - 2**-53, 1), (-5e-324, 5e-324, 2), (0.0, -0.0, 0), (1.0, 2.0, 2**52)]
)
def test_units_of_rounding_are_counted(a: float, b: float, apart: int) -> None:
    assert golden.ulps(a, b) == golden.ulps(b, a) == apart

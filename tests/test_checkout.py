"""Libraries that a checkout compiles: what is said while this takes its time."""

from pathlib import Path

import pytest

from lostmotion.portable import checkout
from refusals import refused


def test_a_compilation_that_takes_time_says_so_and_one_that_fails_names_its_last_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "core" / "kernels").mkdir(parents=True)
    (tmp_path / "core" / "kernels" / "a.cpp").write_text("")
    (tmp_path / "Makefile").write_text("slow:\n\tsleep 0.7\nbad:\n\t@echo no compiler >&2; exit 3\n")
    monkeypatch.setattr(checkout, "CHECKOUT", tmp_path)
    monkeypatch.setattr(checkout, "EVERY", 0.2)
    checkout.made_here("slow", [], "the library")
    assert 2 <= capsys.readouterr().err.count("make slow compiles, or waits for another make") <= 4
    assert "make bad: failed" in refused(lambda: checkout.made_here("bad", [], "the library"))

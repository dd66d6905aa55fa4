"""Libraries that a checkout compiles: what is said while this takes its time."""

import fcntl
import shutil
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from lostmotion.portable import checkout
from refusals import refused

ROOT = Path(__file__).parents[1]


@pytest.fixture
def said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[[str], str]:
    """What is said while a checkout makes a target by these rules, at most five times a second."""
    (tmp_path / "core" / "kernels").mkdir(parents=True)
    (tmp_path / "core" / "kernels" / "a.cpp").write_text("")
    monkeypatch.setattr(checkout, "CHECKOUT", tmp_path)
    monkeypatch.setattr(checkout, "EVERY", 0.2)

    def make(rules: str) -> str:
        (tmp_path / "Makefile").write_text(f"library:\n\t{rules}\n")
        checkout.made_here("library", [], "the library")
        return capsys.readouterr().err

    return make


def test_a_compilation_says_each_time_what_it_does_and_one_that_fails_what_its_program_said_last(said: Callable[[str], str]) -> None:
    text = said("@echo [3/83] Building a.o; sleep 0.7")
    assert 2 <= text.count("s: make library: [3/83] Building a.o") <= 4
    refused(lambda: said("@echo no compiler >&2; exit 3"), reason="; its last line: no compiler")


@pytest.mark.skipif(shutil.which("flock") is None, reason="without flock no make waits for another one")
def test_a_compilation_that_waits_for_another_make_says_so(tmp_path: Path, said: Callable[[str], str]) -> None:
    (tmp_path / "build").mkdir()
    with open(tmp_path / "build" / "native.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        threading.Timer(0.7, lambda: fcntl.flock(lock, fcntl.LOCK_UN)).start()
        text = said(f"@{ROOT}/.ci/one_by_one true")
    assert 2 <= text.count("make library: waits for another make") <= 4

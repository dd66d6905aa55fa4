"""References: shortest moves within their limits, every kind against its closed form, exact derivatives."""

import itertools
import math
import pickle
import re
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import ruckig
from hypothesis import example, given, settings
from hypothesis import strategies as st

import lostmotion as lm
from conftest import ROOT
from lostmotion.control import profiles
from lostmotion.control.controller import AnyReference
from lostmotion.inputs.part import Part
from lostmotion.live_page.references import reference_view
from lostmotion.model.signals import taylor
from lostmotion.simulation.scenario import scenario_files
from refusals import refusals_of, refused

EPS = np.finfo(float).eps
DEG = math.pi / 180.0


def random_moves(count: int, decades: float) -> tuple[np.ndarray, ...]:
    """Distances of both signs, and limits of speed, acceleration and jerk, each over so many decades up and down."""
    rng = np.random.default_rng(16)
    distance, speed, acceleration, jerk = 10.0 ** rng.uniform(-decades, decades, (4, count))
    return distance * rng.choice([-1.0, 1.0], count), speed, acceleration, jerk


def each(moves: tuple[Any, ...]) -> Iterator[tuple[Any, ...]]:
    return zip(*np.broadcast_arrays(*map(np.atleast_1d, moves)), strict=True)


def segments(*moves: Any) -> np.ndarray:
    """Time, position, speed, acceleration and jerk at the beginning of each segment, of moves or of arrays of them."""
    found = [profiles.segments(*map(float, move)) for move in each(moves)]
    return np.array(found if np.ndim(moves[0]) else found[0]).T


MOVES = random_moves(20_000, 2.0)
WIDE = random_moves(5_000, 6.0)


@pytest.mark.parametrize("moves", [MOVES, WIDE, (*MOVES[:3], np.inf)], ids=["moves", "wide", "trapezoidal"])
def test_random_moves_keep_their_limits_and_hit_their_ends(moves: tuple[np.ndarray, ...]) -> None:
    distance, speed, acceleration, jerk = moves
    times, *states, jerks = segments(*moves)
    assert np.all(states[0][0] == 0.0)
    assert np.all(np.abs(states[0][-1] / distance - 1.0) <= 1e-12)
    for state in states[1:]:
        assert np.all(state[[0, -1]] == 0.0)
    # The acceleration is a straight line within a segment, and has one sign in each half, so that the ends of the segments
    # are the extremes of speed and acceleration. A limit that is reached is the product of two or three rounded factors.
    for values, limit in zip((*states[1:], jerks), (speed, acceleration, jerk), strict=True):
        assert np.all(np.abs(values) <= limit * (1.0 + 4.0 * EPS))
    assert np.all(np.sign(distance) * states[1] >= 0.0)
    assert np.all(np.diff(times, axis=0) >= 0.0)
    t, c, s, _ = np.array([profiles.segment_durations(*map(float, move)) for move in each(moves)]).T
    ends = taylor([x[:-1] for x in (*states, jerks)], np.array([t, c, t, s, t, c, t]))
    continuous = 3 if np.all(np.isfinite(moves[3])) else 2  # a trapezoidal speed has steps of acceleration
    for state, end in list(zip(states, ends, strict=False))[:continuous]:
        # Of the sum of four terms, each no larger than the largest of its kind in the move.
        assert np.all(np.abs(end - state[1:]) <= 16.0 * EPS * np.abs(state).max(axis=0))


def ruckig_duration(move: tuple[float, ...]) -> float | None:
    """Of the shortest motion from rest to rest by Ruckig; None if it finds none."""
    wanted = ruckig.InputParameter(1)
    wanted.current_position, wanted.target_position = [0.0], [move[0]]
    wanted.max_velocity, wanted.max_acceleration, wanted.max_jerk = ([limit] for limit in move[1:])
    found = ruckig.Trajectory(1)
    try:
        ruckig.Ruckig(1).calculate(wanted, found)
    except ruckig.RuckigError:
        return None
    return float(found.duration)


@pytest.mark.parametrize("moves", [MOVES, WIDE, (*MOVES[:3], np.inf)], ids=["moves", "wide", "trapezoidal"])
def test_random_moves_take_the_time_that_ruckig_finds_shortest(moves: tuple[np.ndarray, ...]) -> None:
    theirs = np.array([ruckig_duration(move) for move in zip(*np.broadcast_arrays(*moves), strict=True)], float)
    solved = np.isfinite(theirs)
    assert np.mean(solved) > 0.999  # where all is of like size it solves all, over 12 decades all but one in several thousands
    assert segments(*moves)[0, -1][solved] == pytest.approx(theirs[solved], rel=1e-14)


def test_some_limit_binds_at_every_instant_of_a_random_move() -> None:
    # What a shortest motion must do by the maximum principle; judged in the middle of segments that last.
    _, speed, acceleration, jerk = MOVES
    times, *states, jerks = segments(*MOVES)
    half = 0.5 * np.diff(times, axis=0)
    _, v, a = taylor([x[:-1] for x in (*states, jerks)], half)[:3]
    binds = (np.abs(jerks[:-1]) == jerk) | (np.abs(a) >= acceleration * (1 - 1e-9)) | (np.abs(v) >= speed * (1 - 1e-9))
    assert np.all(binds | (half <= 1e-9 * times[-1]))


# (distance, speed, acceleration, jerk, duration by its closed form)
CLOSED_FORMS = {
    "all seven segments": (10.0, 2.0, 4.0, 16.0, 10.0 / 2.0 + 2.0 / 4.0 + 4.0 / 16.0),
    "speed not reached": (1.0, 100.0, 4.0, 16.0, 0.25 + math.sqrt(0.25**2 + 4.0 * 1.0 / 4.0)),
    "acceleration not reached": (10.0, 0.5, 4.0, 16.0, 10.0 / 0.5 + 2.0 * math.sqrt(0.5 / 16.0)),
    "neither reached": (1e-3, 2.0, 4.0, 16.0, 4.0 * (1e-3 / 32.0) ** (1.0 / 3.0)),
    "tiny": (1e-15, 2.0, 4.0, 16.0, 4.0 * (1e-15 / 32.0) ** (1.0 / 3.0)),
    "huge": (-1e12, 2.0, 4.0, 16.0, 1e12 / 2.0 + 0.75),
    "speed just reached": (0.5 * 2.0 * (2.0 / 4.0 + 4.0 / 16.0) * 2.0, 2.0, 4.0, 16.0, 2.0 * 0.75),
    "acceleration just reached": (10.0, 1.0, 4.0, 16.0, 10.0 / 1.0 + 2.0 / 4.0),
    "both just reached": (0.5, 1.0, 4.0, 16.0, 1.0),
    "trapezoidal": (10.0, 2.0, 4.0, math.inf, 10.0 / 2.0 + 2.0 / 4.0),
    "triangular": (1.0, 100.0, 4.0, math.inf, 2.0 * math.sqrt(1.0 / 4.0)),
    "no way at all": (0.0, 2.0, 4.0, 16.0, 0.0),
    "no way at all, trapezoidal": (0.0, 2.0, 4.0, math.inf, 0.0),
}


@pytest.mark.parametrize("move", CLOSED_FORMS.values(), ids=CLOSED_FORMS)
def test_the_duration_of_a_move_is_its_closed_form(move: tuple[float, ...]) -> None:
    found = segments(*move[:4])
    assert np.all(np.isfinite(found))
    assert found[0, -1] == pytest.approx(move[4], rel=1e-14)
    assert found[1, -1] == move[0]
    # A segment that a move does not have takes no time.
    without = {"speed not reached": [3], "acceleration not reached": [1, 5], "neither reached": [1, 3, 5]}
    for name, places in without.items():
        assert move is not CLOSED_FORMS[name] or np.flatnonzero(np.diff(found[0]) == 0.0).tolist() == places


# --- references ---
LIST = lm.PositionReference(
    start="10 deg",
    begin="0.1 s",
    speed="90 deg/s",
    acceleration="360 deg/s^2",
    jerk="7200 deg/s^3",
    dwell="0.2 s",
    moves=[{"to": "100 deg"}, {"to": "-20 deg", "speed": "10 deg/s", "dwell": "1 s"}, {"to": "-20 deg"}, {"to": "-19.9 deg"}],
)


def test_a_list_of_moves_goes_from_rest_to_rest_with_its_dwells() -> None:
    between = LIST.intervals()
    # All seven segments; without the largest acceleration; no way at all; with jerk alone.
    durations = [1.0 + 0.25 + 0.05, 12.0 + 2.0 * math.sqrt(10.0 / 7200.0), 0.0, 4.0 * (0.1 / 14400.0) ** (1.0 / 3.0)]
    assert [end - begin for begin, end in between] == pytest.approx(durations, rel=1e-13)
    assert [begin for begin, _ in between] == pytest.approx([0.1, *[e + w for (_, e), w in zip(between, (0.2, 1.0, 0.2), strict=False)]])
    assert LIST.duration == between[-1][1] + 0.2
    positions = [10.0 * DEG, 100.0 * DEG, -20.0 * DEG, -20.0 * DEG, -19.9 * DEG]
    for (begin, end), origin, to in zip(between, positions, positions[1:], strict=False):
        value, rate, second, _ = LIST.at([begin, end, end + 0.1])
        assert value.tolist() == pytest.approx([origin, to, to], rel=1e-15)
        assert np.all(rate == 0.0)
        assert np.all(second == 0.0)


def test_a_list_of_moves_is_made_of_the_segments_of_each() -> None:
    (begin, end), (then, _) = LIST.intervals()[:2]
    t = np.linspace(begin, end, 500)
    wanted = segments(90 * DEG, 90 * DEG, 360 * DEG, 7200 * DEG)
    k = np.clip(np.searchsorted(begin + wanted[0], t, side="right") - 1, 0, 7)
    exact = taylor([row[k] for row in wanted[1:]], t - begin - wanted[0][k])
    for found, values in zip(LIST.at(t), exact, strict=True):
        assert found == pytest.approx(values + (10 * DEG if values is exact[0] else 0.0), rel=1e-12, abs=1e-12)
    assert np.all(LIST.at(np.linspace(end, then, 20)[:-1])[0] == 100 * DEG)


def test_instants_of_moves_rise_and_pieces_of_no_duration_are_left_out() -> None:
    times = [piece[0] for piece in LIST.pieces()]
    assert times[0] == 0.0
    assert all(a < b for a, b in itertools.pairwise(times))
    assert len(times) == 1 + 8 + 6 + 1 + 5  # at the start; all seven segments; no largest acceleration; none; only jerk


def test_jumps_between_pieces_are_those_of_rounded_instants() -> None:
    rng = np.random.default_rng(3)
    for _ in range(200):
        limits = dict(zip(("speed", "acceleration", "jerk"), 10.0 ** rng.uniform(-1, 2, 3), strict=True))
        moves = [{"to": x} for x in rng.normal(0.0, 3.0, 6)]
        pieces = lm.PositionReference(begin=0.3, dwell=0.1, moves=moves, **limits).pieces()
        scale = np.array([10.0, *limits.values()])  # positions are below 10 rad
        for (begin, *state), (end, *after) in itertools.pairwise(pieces):
            jump = np.abs(np.array(taylor(state, end - begin))[:3] - after[:3])
            assert np.all(jump <= 16.0 * EPS * scale[:3] + 4.0 * EPS * end * scale[1:])


KINDS: dict[str, tuple[lm.PositionReference | lm.control.SpeedReference | lm.control.TorqueReference, Callable[[np.ndarray], list[np.ndarray]]]] = {
    "constant": (
        lm.control.TorqueReference.model_validate("3 N*m"),
        lambda t: [0 * t + 3.0, 0 * t, 0 * t, 0 * t],
    ),
    "step": (
        lm.control.SpeedReference(mean=1.0, steps=[{"height": "60 rpm", "time": 0.5}]),
        lambda t: [1.0 + 2 * np.pi * (t >= 0.5), 0 * t, 0 * t, 0 * t],
    ),
    "ramp": (
        lm.PositionReference(ramps=[{"rise": "180 deg", "duration": 0.5, "begin": 0.25}]),
        lambda t: [np.pi * np.clip((t - 0.25) / 0.5, 0, 1), 2 * np.pi * ((t >= 0.25) & (t < 0.75)), 0 * t, 0 * t],
    ),
    "sines": (
        lm.PositionReference(mean=0.2, amplitude=0.1, frequency=2, phase=0.3, sines=[{"amplitude": 0.05, "frequency": 7}]),
        lambda t: [
            0.2 * (n == 0)
            + sum(
                A * (2 * np.pi * f) ** n * np.sin(2 * np.pi * f * t + p + n * np.pi / 2)
                for A, f, p in ((0.1, 2, 0.3), (0.05, 7, 0.0))
            )
            for n in range(4)
        ],
    ),
    "linear series": (
        lm.control.SpeedReference(samples={"times": [0.25, 0.5, 1.0], "values": [1, 3, 0]}),
        lambda t: [
            np.interp(t, [0.25, 0.5, 1.0], [1, 3, 0]),
            np.select([t < 0.25, t < 0.5, t < 1.0], [0.0, 8.0, -6.0], 0.0),
            0 * t,
            0 * t,
        ],
    ),
    # A spline with not-a-knot conditions through points of a cubic is that cubic.
    "cubic series": (
        lm.PositionReference(
            samples={
                "times": (x := [0.0, 0.1, 0.3, 0.6, 1.1]),
                "values": [1 - 2 * t + 3 * t**2 - 4 * t**3 for t in x],
                "interpolation": "cubic",
            }
        ),
        lambda t: [1 - 2 * t + 3 * t**2 - 4 * t**3, -2 + 6 * t - 12 * t**2, 6 - 24 * t, 0 * t - 24],
    ),
}  # fmt: skip


@pytest.mark.parametrize(("reference", "exact"), KINDS.values(), ids=KINDS)
def test_each_kind_of_reference_is_its_closed_form(reference, exact) -> None:
    t = np.arange(0.0, 1.05, 1.0 / 64.0)  # on the breakpoints too, where the limit from the right is wanted
    for found, wanted in zip(reference.at(t), exact(t), strict=True):
        # A derivative of order n of a series is a difference of values over a power of its least interval, 0.1 s.
        assert found == pytest.approx(wanted, rel=1e-12, abs=1e-11 * max(1.0, np.abs(wanted).max()))


SUM = lm.PositionReference(
    **LIST.model_dump(exclude={"samples"}),
    samples={"times": [0.5, 1, 2, 4, 5], "values": [0, 0.3, 0.1, -0.2, 0.4], "interpolation": "cubic"},
).model_copy(update={"amplitude": 0.02, "frequency": 3.0, "ramps": [{"rise": 0.3, "duration": 2}]})


def test_derivatives_are_those_that_finite_differences_show() -> None:
    h = 1e-5
    breaks = np.array([piece[0] for piece in SUM.pieces()])
    t = np.random.default_rng(2).uniform(h, 16.0, 5000)
    t = t[np.abs(t[:, None] - breaks).min(axis=1) > h]
    at, before, after = SUM.at(t), SUM.at(t - h), SUM.at(t + h)
    highest = [float(np.abs(x).max()) for x in at] + [0.02 * (6 * math.pi) ** 4]
    for n in range(3):
        difference = (after[n] - before[n]) / (2 * h)
        # A difference errs by h^2/6 times the third next derivative, and by the rounding of values and instants over h.
        curvature = highest[n + 3] if n < 2 else 0.02 * (6 * math.pi) ** 5
        error = h * h / 6.0 * curvature + 4.0 * EPS * (highest[n] + 16.0 * highest[n + 1]) / h
        assert np.all(np.abs(difference - at[n + 1]) <= error)


def test_a_sum_is_the_sum_of_its_parts() -> None:
    t = np.linspace(0.0, 16.0, 999)
    rest = SUM.model_copy(update=dict.fromkeys(("moves", "samples"), ()) | {"samples": None, "start": 0.0, "begin": 0.0, "dwell": 0.0, "speed": None, "acceleration": None, "jerk": None})  # fmt: skip
    series = lm.PositionReference(samples=SUM.samples)
    for whole, *parts in zip(SUM.at(t), LIST.at(t), rest.at(t), series.at(t), strict=True):
        assert whole == pytest.approx(sum(parts), abs=1e-12 * np.abs(whole).max())


def test_a_cubic_series_has_continuous_speed_and_acceleration_and_stays_at_its_ends() -> None:
    rng = np.random.default_rng(5)
    times = 0.4 + np.cumsum(rng.uniform(0.05, 0.2, 40))
    values = rng.normal(size=40)
    reference = lm.PositionReference(samples={"times": times, "values": values, "interpolation": "cubic"})
    pieces = reference.pieces()
    assert [p[0] for p in pieces] == [0.0, *times]
    assert [p[1] for p in pieces] == pytest.approx([values[0], *values], rel=1e-15)
    for (begin, *state), (end, *after) in itertools.pairwise(pieces[1:-1]):
        # The size of a derivative of such a curve is that of the values over powers of the least interval.
        for n, (a, b) in enumerate(zip(taylor(state, end - begin)[:3], after[:3], strict=True)):
            assert a == pytest.approx(b, abs=1e-12 * 3.0 * 4.0**n / 0.05**n)
    assert reference.at([0.0, 0.39])[0].tolist() == [values[0]] * 2
    assert [x.item() for x in reference.at(99.0)] == [values[-1], 0.0, 0.0, 0.0]


def test_pieces_and_sines_are_all_there_is() -> None:
    # As the controller takes them: value + rate s + second s^2/2 + third s^3/6, and the sines.
    pieces, sines = SUM.pieces(), SUM.sine_list()
    for t in np.random.default_rng(1).uniform(0.0, 16.0, 300):
        begin, value, rate, second, third = [p for p in pieces if p[0] <= t][-1]
        s = t - begin
        wanted = value + rate * s + second * s**2 / 2 + third * s**3 / 6
        wanted += sum(a * math.sin(2 * math.pi * f * t + p) for a, f, p in sines)
        assert SUM.at(t)[0] == pytest.approx(wanted, rel=1e-13, abs=1e-14)


@pytest.mark.parametrize("reference", [LIST, SUM, *(reference for reference, _ in KINDS.values())])
def test_references_survive_json_and_pickling(reference) -> None:
    for copy in (type(reference).model_validate_json(reference.model_dump_json()), pickle.loads(pickle.dumps(reference))):
        assert copy == reference
        assert copy.pieces() == reference.pieces()


# --- files ---
class Tables(Part):
    """A controller with nothing but a reference."""

    reference: AnyReference


def test_a_series_of_a_reference_is_read_from_a_file_in_the_unit_of_its_kind(tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text("time [ms],value [deg]\n0,0\n500,90\n")

    def reference(**table: object) -> object:
        data = {"controller": {"reference": table}}
        scenario_files.read_series_files(data, tmp_path / "s.toml", scenario_files.units_of_series)
        return Tables(**data["controller"]).reference

    found = reference(kind="position", samples={"file": "points.csv", "interpolation": "cubic"})
    assert isinstance(found, lm.PositionReference)
    assert found.samples is not None
    assert found.samples.values == pytest.approx((0.0, math.pi / 2))
    assert found.samples.interpolation == "cubic"
    for table, sentence in (
        ({"kind": "speed", "samples": {"file": "points.csv"}}, "(deg); it must be a value in rad/s"),
        ({"kind": "torque", "samples": {"file": "points.csv"}}, "(deg); it must be a value in N*m"),
        ({"samples": {"file": "points.csv"}}, "may hold N*m or rad or rad/s; give controller.reference.kind too"),
        ({"kind": "position", "samples": {"file": 3}}, "reference.samples.file: 3 must be the name of a CSV file"),
        ({"kind": "position", "samples": {"file": "points.csv", "times": [1]}}, "leaves no room for times"),
        ({"kind": "speeed", "samples": {"file": "points.csv"}}, 'did you mean "speed"?'),
        ({}, "lacks kind, which says what it is"),
    ):
        with pytest.raises(lm.InputError) as caught:
            reference(**table)
        assert sentence in str(caught.value)


def test_the_page_on_references_is_true(capsys: pytest.CaptureFixture[str]) -> None:
    page = (ROOT / "docs" / "references.md").read_text()
    code, table = (re.search(rf"```{kind}\n(.*?)```", page, re.S)[1] for kind in ("python", "toml"))
    names: dict[str, object] = {}
    exec(code, names)
    assert lm.PositionReference(**tomllib.loads(table)) == names["reference"]
    # 0.85 s = D/v + v/a + a/j of the first move, half of which is done in the middle of it.
    (begin, end), _ = names["reference"].intervals()
    assert (begin, end) == pytest.approx((0.0, 0.85))
    assert np.concatenate([names[x] for x in ("position", "speed", "acceleration", "jerk")]) == pytest.approx(
        [0, 45 * DEG, 90 * DEG, 0, 180 * DEG, 0, 0, 0, 0, 7200 * DEG, 0, 0], abs=1e-9
    )
    assert capsys.readouterr().out


# --- bad input ---
GOOD = {"speed": 1.0, "acceleration": 2.0, "jerk": 30.0, "moves": [{"to": 1.0}]}
BAD = [
    ({"speed": 0.0}, "speed: 0.0 must be greater than 0"),
    ({"acceleration": -1}, "acceleration: -1.0 must be greater than 0"),
    ({"jerk": "-3 rad/s^3"}, 'jerk: "-3 rad/s^3" must be greater than 0'),
    ({"jerk": "3 rad/s^2"}, 'jerk: "3 rad/s^2" has the unit of something else (rad/s^2); it must be a value in rad/s^3'),
    ({"acceleration": "3 m/s^2"}, 'acceleration: "3 m/s^2" has the unit of something else'),
    ({"acceleration": "3 1/s^2"}, 'acceleration: may mean turns or radians; write "3 rev/s^2" or "3 rad/s^2"'),
    ({"speed": math.nan}, "speed: nan must be a finite number"),
    ({"speed": None}, ": the position reference lacks speed of moves[0]; give it there, or beside moves for all of them"),
    ({"acceleration": None}, ": lacks acceleration of moves[0]"),
    ({"moves": []}, ": the position reference has speed but no moves; add moves = [{ to = 1.0 }], or leave it out"),
    ({"moves": [], "speed": None, "acceleration": None, "jerk": None, "start": 3}, ": has start but no moves"),
    ({"moves": [], "speed": None, "acceleration": None, "jerk": None, "dwell": 3}, ": has dwell but no moves"),
    ({"moves": [{}]}, "moves[0].to: is missing; add it"),
    ({"moves": [{"to": 1, "velocity": 2}]}, "moves[0].velocity: is not known"),
    ({"moves": [{"to": 1}, {"to": "1 rad/s"}]}, 'moves[1].to: "1 rad/s" has the unit of something else'),
    ({"moves": [{"to": 1, "dwell": -1}]}, "moves[0].dwell: -1.0 must be at least 0"),
    ({"moves": [{"to": 1, "jerk": 0}]}, "moves[0].jerk: 0.0 must be greater than 0"),
    ({"begin": -1}, "begin: -1.0 must be at least 0"),
    ({"mean": 1.0}, ": has mean = 1 and moves between positions; give start in place of mean"),
    ({"steps": [{"height": 1}]}, ": has steps, jumps of position that exceed every limit of speed; give moves"),
    ({"moves": [], "steps": [{"height": 1}]}, ": has steps, jumps of position that exceed every limit of speed; give moves"),
    ({"moves": [{"to": 1e308}, {"to": -1e308}]}, ": has moves[1] from "),
    ({"begin": 1e15}, ": has moves[0] from 1e+15 s to 1e+15 s, an interval that numbers cannot resolve"),
    ({"moves": [{"to": 1e-9}], "begin": 1e9}, ": has moves[0] from 1e+09 s to 1e+09 s, an interval that numbers cannot"),
    ({"samples": {"times": [0, 2, 1], "values": [0, 1, 2]}}, "samples: times must rise, but times[2] = 1.0 follows 2.0"),
    ({"samples": {"times": [0, 2], "values": [0]}}, "samples: has 2 times and 1 values"),
    ({"samples": {"times": [0, 2], "values": [0, "1 N*m"]}}, "samples.values[1]"),
    ({"samples": {"times": [0, 2], "values": [0, 1], "interpolation": "spline"}}, 'samples.interpolation: must be one of "linear", "cubic"'),
    ({"samples": {"times": [0, 1e-320], "values": [0, 1e300]}}, ": a derivative beyond the range of numbers"),
    ({"samples": {"times": [0, 1e-320, 1, 2], "values": [0, 1e300, 1, 2], "interpolation": "cubic"}}, ": overflow as a cubic"),
    ({"amplitude": 1.0}, ": the position reference lacks frequency"),
    ({"chirp": {}}, "chirp: is not known"),
]  # fmt: skip


test_a_reference_that_cannot_be_is_refused_in_one_line = refusals_of(lambda change: lm.PositionReference(**GOOD | change), *BAD)


@pytest.mark.parametrize("time", [-1.0, math.nan, math.inf, "1 s", None, [0.0, -1e-9], [[0.0], [1.0, 2.0]]])
def test_a_reference_is_asked_at_times_from_0_on(time: object) -> None:
    refused(lambda: LIST.at(time), reason="time: ")


extremes = st.floats(allow_subnormal=True) | st.sampled_from([0.0, 1e-320, 1e-300, 1e300, 1.7e308]) | st.none()
positive = st.floats(min_value=0.0, exclude_min=True, allow_infinity=False)
move = st.fixed_dictionaries({"to": st.floats(-1e3, 1e3) | extremes}, optional={"speed": positive, "dwell": extremes})


@settings(max_examples=400, deadline=None)
@given(
    table=st.fixed_dictionaries(
        {"moves": st.lists(move, max_size=3)},
        optional=dict.fromkeys(("speed", "acceleration", "jerk"), positive | extremes)
        | dict.fromkeys(("start", "begin", "dwell", "mean", "amplitude", "frequency"), extremes),
    )
)
def test_any_limits_and_moves_are_refused_in_one_plain_line_or_end_where_they_should(table) -> None:
    try:
        reference = lm.PositionReference(**table)
    except lm.InputError as error:
        assert "\n" not in str(error)
        assert not re.search(r"Input should|https?:|pydantic|NoneType|dtype|array", str(error))
        return
    pieces = reference.pieces()
    assert np.all(np.isfinite(pieces))
    assert all(a[0] < b[0] for a, b in itertools.pairwise(pieces))
    if reference.moves:
        assert pieces[-1][1:] == (reference.moves[-1].to, 0.0, 0.0, 0.0)


@settings(max_examples=200, deadline=None)
@given(
    times=st.lists(st.floats(0.0, 1e6) | extremes, max_size=6).map(lambda x: x if None in x else sorted(x)),
    values=st.lists(st.floats(-1e6, 1e6) | extremes, max_size=6),
    interpolation=st.sampled_from(["linear", "cubic"]),
)
@example(times=[0.0, 1.0, 4e14], values=[0.0, 0.0, 0.0], interpolation="cubic")
def test_any_series_is_refused_in_one_plain_line_or_passes_through_its_points(times, values, interpolation) -> None:
    try:
        reference = lm.control.TorqueReference(samples={"times": times, "values": values, "interpolation": interpolation})
    except lm.InputError as error:
        assert "\n" not in str(error)
        assert not re.search(r"Input should|https?:|pydantic|NoneType|dtype|array|dydx", str(error))
        return
    assert reference.at(times)[0] == pytest.approx(values, rel=1e-14)


# --- moves of a given duration ---
COEFFICIENTS = {  # peak speed, acceleration and jerk of a move by 1 in 1 s: VDI 2143-1; R. L. Norton, Cam Design, table 3-3
    "parabola": (2.0, 4.0, None),
    "least_jerk": (2.0, 8.0, 32.0),
    "harmonic": (1.5708, 4.9348, 15.503),
    "cycloidal": (2.0, 6.2832, 39.478),
    "fifth_order": (1.875, 5.7735, 60.0),
    "seventh_order": (2.1875, 7.5132, 52.5),
    "modified_sine": (1.7596, 5.5280, 69.466),
    "modified_trapezoid": (2.0, 4.8881, 61.426),
}


@pytest.mark.parametrize("law", COEFFICIENTS)
def test_a_timed_move_has_the_published_coefficients_of_its_law(law: str) -> None:
    distance, duration = math.radians(90.0), 0.4
    move = {"to": distance, "duration": duration, "law": law}
    reference = lm.PositionReference(moves=[move, {**move, "to": 0.0}], dwell="0.6 s")
    assert reference.intervals() == [(0.0, 0.4), (1.0, 1.4)]
    value, *derivatives = reference.at(np.linspace(0.0, duration, 10_241)[:-1])
    for n, (found, expected) in enumerate(zip(derivatives, COEFFICIENTS[law], strict=True), 1):
        if expected is not None:  # pieces of constant jerk: it is 1.2 % below a jerk that peaks at an end
            peak = np.abs(found).max() * duration**n / distance
            assert peak == pytest.approx(expected, rel=1.3e-2 if n == 3 else 3e-4)
    t = np.linspace(0.0, duration, 10_241)[:-1]
    assert value == pytest.approx(distance - value[::-1], abs=1e-3)  # symmetric, over a step of 39 us
    assert np.gradient(value, t)[1:-1] == pytest.approx(derivatives[0][1:-1], abs=1e-3)
    assert [float(reference.at(x)[0]) for x in (0.5, 1.5)] == [distance, 0.0]
    if law == "fifth_order":
        x = t / duration
        assert value == pytest.approx(distance * (10.0 * x**3 - 15.0 * x**4 + 6.0 * x**5), abs=1e-4)
        assert derivatives[0] == pytest.approx(30.0 * distance / duration * (x * (1.0 - x)) ** 2, abs=1e-3)


def test_a_duration_that_limits_forbid_names_the_least_one() -> None:
    """The peak speed 1.875 D/T is 1 rad/s at T = 1.875 s, the peak acceleration 5.7735 D/T^2 is 4 rad/s^2 at 1.2014 s."""
    move = {"to": 1.0, "duration": 1.0, "law": "fifth_order"}
    for limit, least in (({"speed": 1.0}, 1.875), ({"acceleration": 4.0}, 1.2014)):
        with pytest.raises(lm.InputError, match=f"at least {least:.3f}"):
            lm.PositionReference(moves=[move], **limit)
        lm.PositionReference(moves=[{**move, "duration": 1.001 * least}], **limit)
    for wrong in ({"moves": [{"to": 1.0, "duration": 1.0}]}, {"law": "parabola"}):
        with pytest.raises(lm.InputError, match="law"):
            lm.PositionReference(**wrong)


def test_an_inertia_that_is_moved_by_a_law_takes_its_peak_acceleration() -> None:
    """J C_a D/T^2, with C_a = 5.5280 of the modified sine; the live page draws the same move."""
    motion = {"moves": [{"to": "90 deg", "duration": "0.4 s", "law": "modified_sine"}]}
    table = {"shafts": {"table": {"inertia": 0.02, "motion": motion}}, "simulation": {"duration": 0.5, "sample_interval": 1e-4}}
    scenario = lm.Scenario(**table)
    torque = lm.simulate(scenario)["table_drive_torque"]
    assert float(np.abs(torque).max()) == pytest.approx(0.02 * 5.528 * math.radians(90.0) / 0.16, rel=3e-4)
    axis = lm.load("position-axis").replace(**{"controller.reference": {"kind": "position", **motion}})
    view = reference_view(axis.controller.reference, 1.0)
    assert view is not None
    assert view["moves"] is None
    assert len(view["courses"][0]) == len(axis.controller.reference.pieces())


def test_a_timed_move_is_repeated_both_ways_where_settling_is_judged() -> None:
    move = {"to": "40 deg", "duration": "0.9 s"}
    reference = {"kind": "position", "dwell": "0.6 s", "law": "modified_sine", "moves": [move]}
    report = lm.commission(lm.load("position-axis").replace(**{"controller.reference": reference}))
    assert report.moves is not None
    spans = report.moves.reference.intervals()
    assert len(spans) >= 4
    assert [end - begin for begin, end in spans] == pytest.approx([0.9] * len(spans))

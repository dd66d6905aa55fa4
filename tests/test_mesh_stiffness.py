"""The stiffness of a mesh over the angle: parametric resonance against Floquet's theory, energy, and what files may say."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

import lostmotion as lm
from lostmotion.reports.run import summary
from refusals import refusals_of
from tables import gear_between

TEETH, CONTACT_RATIO, FEWER = 20, 1.6, 0.6
STIFFNESS, INERTIA, RATIO, TWIST = 200.0, 1e-3, 2.0, 1e-3
MESH = {"teeth": TEETH, "contact_ratio": CONTACT_RATIO, "fewer_pairs": FEWER}


def matrices(damping: float) -> tuple[np.ndarray, np.ndarray]:
    """Of (twist, its rate) about a shaft that turns evenly, with more pairs in mesh and with fewer."""
    more, fewer = (np.array([[0.0, 1.0], [-factor * STIFFNESS / INERTIA, -damping / INERTIA]]) for factor in (1.0, FEWER))
    return more, fewer


def monodromy(period: float, damping: float) -> np.ndarray:
    """Of one mesh period that begins in the middle of the more pairs: a product of matrix exponentials."""
    more, fewer = matrices(damping)
    half = expm(more * (0.5 * (CONTACT_RATIO - 1.0) * period))
    return half @ expm(fewer * ((2.0 - CONTACT_RATIO) * period)) @ half


def even(period: float, damping: float, twist: float, rate: float, periods: int, *, heavy: bool = False) -> lm.Scenario:
    """A shaft of even speed, given or of a large inertia, that turns a free one through the mesh."""
    speed = 2.0 * math.pi / (TEETH * period)
    given, free = {"inertia": 1e-4, "speed": {"mean": speed}}, {"inertia": 10.0}
    speeds = {"b": speed / RATIO - rate} | ({"a": speed} if heavy else {})
    gear = {"input": "a", "output": "b", "ratio": RATIO, "stiffness": {"kind": "linear", "stiffness": STIFFNESS}}
    return lm.Scenario(
        shafts={"a": free if heavy else given, "b": {"inertia": INERTIA}},
        gears={"mesh": gear | {"mesh_damping": damping, "mesh_stiffness": MESH}},
        initial={"speeds": speeds, "twists": {"mesh": twist}, "angles": {"a": 0.0}},
        simulation={"duration": periods * period, "sample_interval": period},
    )


def motion(period: float, damping: float, twist: float, rate: float, periods: int) -> np.ndarray:
    """Twist and rate of the twist after each period."""
    result = lm.simulate(even(period, damping, twist, rate, periods))
    speed = 2.0 * math.pi / (TEETH * period) / RATIO
    return np.stack([result["mesh_twist"].values, speed - result["b_speed"].values])


NATURAL = math.sqrt(STIFFNESS / INERTIA)  # rad/s


@pytest.mark.parametrize("damping", [0.0, 0.02])
@pytest.mark.parametrize("turns", [0.31, 0.45, 0.5, 0.55, 0.9, 1.0, 1.7])
def test_growth_per_mesh_period_is_the_floquet_multiplier_of_meissners_equation(turns: float, damping: float) -> None:
    """turns: of the natural vibration in a mesh period; at 0.5 and near 1 it is resonant."""
    period, periods = turns * 2.0 * math.pi / NATURAL, 12
    one, other = motion(period, damping, TWIST, 0.0, periods), motion(period, damping, 0.0, TWIST * NATURAL, periods)
    found = np.column_stack([one[:, 1] / TWIST, other[:, 1] / (TWIST * NATURAL)])
    expected = monodromy(period, damping)
    multipliers = [np.sort_complex(np.linalg.eigvals(matrix)) for matrix in (found, expected)]
    assert np.allclose(*multipliers, rtol=1e-9, atol=0.0)
    state = np.array([TWIST, 0.0])
    for k in range(1, periods + 1):
        state = expected @ state
        size = np.array([1.0, NATURAL]) * np.hypot(state[0], state[1] / NATURAL)
        assert np.all(np.abs(one[:, k] - state) <= 1e-9 * size), k


def half_trace(period: float) -> float:
    """cosh of the Floquet exponent without damping, in closed form; resonant beyond -1 and 1."""
    w, v = NATURAL, NATURAL * math.sqrt(FEWER)
    a, b = w * (CONTACT_RATIO - 1.0) * period, v * (2.0 - CONTACT_RATIO) * period
    return math.cos(a) * math.cos(b) - 0.5 * (w / v + v / w) * math.sin(a) * math.sin(b)


def test_boundaries_of_parametric_resonance_are_where_the_closed_form_says() -> None:
    low, high = 0.3 * 2.0 * math.pi / NATURAL, 0.52 * 2.0 * math.pi / NATURAL
    assert half_trace(low) > -1.0 > half_trace(high)
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if half_trace(middle) < -1.0 else (middle, high)
    for share, resonant in ((1.0 - 1e-4, False), (1.0 + 1e-4, True)):
        one, other = (motion(share * low, 0.0, *x, 1)[:, 1] for x in ((TWIST, 0.0), (0.0, TWIST * NATURAL)))
        found = np.column_stack([one / TWIST, other / (TWIST * NATURAL)])
        largest = max(abs(np.linalg.eigvals(found)))
        assert largest == pytest.approx(1.0, abs=1e-9) if not resonant else largest > 1.001


def test_a_step_gives_the_energy_of_the_spring_times_the_step_and_every_step_is_an_event() -> None:
    """Both shafts turn evenly, so the twist stays: one turn and a half of a mesh period, of two steps each."""
    speed = 10.0
    gear = {"input": "a", "output": "b", "ratio": RATIO, "stiffness": {"kind": "linear", "stiffness": STIFFNESS}}
    scenario = lm.Scenario(
        shafts={"a": {"inertia": 1e-4, "speed": {"mean": speed}}, "b": {"inertia": INERTIA, "speed": {"mean": speed / RATIO}}},
        gears={"mesh": gear | {"mesh_stiffness": MESH}},
        initial={"twists": {"mesh": TWIST}, "angles": {"a": 0.0}},
        simulation={"duration": 2.0 * math.pi * (1.0 + 0.5 / TEETH) / speed, "sample_interval": 1e-3},
    )
    result = lm.simulate(scenario, energy=True)
    assert result.attrs["switching_count"] == 2 * TEETH + 1
    assert set(lm.switchings_of(result)["cause"].values) == {lm.simulation.runs.switchings.MESH_STEP}
    assert f"steps of the mesh stiffness: {2 * TEETH + 1} events; in a turn of the input shaft mesh {2 * TEETH}" in (summary(result))
    ledger = lm.energy_of(result)
    stored = 0.5 * STIFFNESS * TWIST**2
    assert ledger["mesh: parametric work"] == pytest.approx((FEWER - 1.0) * stored, rel=1e-9)
    assert ledger["stored_change"] == pytest.approx((FEWER - 1.0) * stored, rel=1e-9)
    torque = result["mesh_output_torque"].values
    assert set(np.round(torque / (STIFFNESS * TWIST), 9)) == {1.0, FEWER}
    assert abs(ledger["residual"]) <= 1e-9 * ledger["turned_over"]


def test_the_short_form_is_the_long_form_and_its_ledger_closes() -> None:
    scenario = lm.load("paper-2dof-nl-large").replace(
        **{
            "gearbox.mesh_stiffness": {"teeth": 12, "contact_ratio": 1.4, "fewer_pairs": 0.8},
            "simulation.duration": 0.2,
            "simulation.sample_interval": 1e-5,
        }
    )
    short, long = lm.simulate(scenario, energy=True), lm.simulate(scenario.long(), energy=True)
    assert np.array_equal(short["load_speed"].values, long["load_speed"].values)
    ledger = lm.energy_of(short)
    assert ledger["parametric_work"] == lm.energy_of(long)["gearbox: parametric work"] != 0.0
    assert abs(ledger["residual"]) <= 1e-9 * ledger["turned_over"]
    assert "parametric work" in summary(short)
    # A step wherever the motor passes the end of a segment, which fine samples show.
    turned = 90.0 * (short["load_angle"] + short["twist"]).values
    period, angles, _ = scenario.gearbox.mesh_stiffness.curve()
    segment = np.floor(turned[:, None] / period - np.array(angles) / period).sum(axis=1)
    steps = int(np.sum(lm.switchings_of(short)["cause"].values == lm.simulation.runs.switchings.MESH_STEP))
    assert steps == int(np.abs(np.diff(segment)).sum()) > 50


def test_derivatives_cross_the_steps() -> None:
    scenario = even(0.4 * 2.0 * math.pi / NATURAL, 0.02, TWIST, 0.0, 7, heavy=True)
    key = "shafts.b.inertia"
    derivative = lm.simulate(scenario, sensitivities=[key])["mesh_twist_sensitivity"].sel(parameter=key).values
    h = 1e-5 * INERTIA
    beside = [lm.simulate(scenario.replace(**{key: INERTIA + s * h}))["mesh_twist"].values for s in (1, -1)]
    assert np.allclose(derivative, (beside[0] - beside[1]) / (2.0 * h), rtol=0.0, atol=1e-7 * np.max(np.abs(derivative)))


def test_a_linear_model_has_the_stiffness_of_its_angle() -> None:
    scenario = even(0.01, 0.0, TWIST, 0.0, 2, heavy=True)
    for time, factor in ((0.001, 1.0), (0.005, FEWER), (0.009, 1.0)):
        model = lm.linearize(scenario, time=time)
        row, column = model.states.index("b_speed"), model.states.index("mesh_twist")
        assert model.A[row, column] == pytest.approx(factor * STIFFNESS / INERTIA, rel=1e-12)
    with pytest.raises(lm.InputError, match="a mesh stiffness over the angle"):
        lm.linearize(scenario)


def test_pairs_and_contact_ratio_say_the_same() -> None:
    by_ratio = lm.model.MeshStiffness(**MESH)
    pairs = [[0.0, 1.0], [0.3, FEWER], [0.7, 1.0]]
    by_pairs = lm.model.MeshStiffness(teeth=TEETH, pairs=pairs)
    assert np.allclose(by_ratio.segments(), by_pairs.segments(), rtol=1e-15)
    assert by_ratio.mean() == pytest.approx(0.6 + 0.4 * FEWER)
    assert by_ratio.steps() == 2
    period = 2.0 * math.pi / TEETH
    assert by_ratio.curve() == (period, pytest.approx([0.3 * period, 0.7 * period]), [FEWER, 1.0])
    turned = lm.model.MeshStiffness(teeth=TEETH, pairs=pairs, phase=0.7 * period)
    assert turned.curve() == (period, pytest.approx([0.0, 0.4 * period]), [FEWER, 1.0])


test_what_is_no_mesh_is_refused_in_one_line = refusals_of(
    lambda mesh, k=1.0: lm.Scenario(shafts={"a": {"inertia": 1.0}, "b": {"inertia": 1.0}}, gears={"g": gear_between("a", "b", 2, k, mesh_stiffness=mesh)}),
    ({"teeth": 20}, "gears.g.mesh_stiffness: contact_ratio and fewer_pairs, or pairs"),
    ({"teeth": 20, "contact_ratio": 1.5}, "gears.g.mesh_stiffness: give both"),
    (MESH | {"pairs": [[0.0, 1.0]]}, "gears.g.mesh_stiffness: or pairs in place of both"),
    (MESH | {"contact_ratio": 2.0}, "gears.g.mesh_stiffness: number of pairs never changes"),
    ({"teeth": 20, "pairs": [[0.1, 1.0]]}, "gears.g.mesh_stiffness: the first must be 0"),
    ({"teeth": 20, "pairs": [[0.0, 1.0], [0.6, 0.7], [0.5, 0.8]]}, "gears.g.mesh_stiffness: shares must rise"),
    ({"teeth": 20, "pairs": [[0.0, 1.0], [1.0, 0.7]]}, "gears.g.mesh_stiffness: below 1"),
    ({"teeth": 0, "pairs": [[0.0, 1.0]]}, "gears.g.mesh_stiffness.teeth"),
    ({"teeth": 20, "pairs": [[0.0, 0.0]]}, "gears.g.mesh_stiffness.pairs[0][1]"),
    (MESH | {"fewer_pairs": 1.2}, "gears.g.mesh_stiffness.fewer_pairs"),
    (MESH, None, "gears.g: rigid"),
)  # fmt: skip

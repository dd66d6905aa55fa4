"""Periodic motions and frequency responses of drive trains: closed forms, long transients, the classic drive."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import lostmotion as lm
from lostmotion.cli import app
from refusals import refusals_of
from tables import gear_between, torque_source

RUN = {"duration": 1.0, "sample_interval": 1e-3}
ROTOR = 1e-9  # [kg m2]

# Motor and table, a soft stage with backlash and a stiff one with hysteresis, friction on every shaft.
TWO_STAGES: dict[str, Any] = {
    "shafts": {
        "motor": {"friction_torque": 0.02},
        "middle": {"inertia": 2e-4, "friction_torque": 0.03, "viscous_friction": 1e-3},
        "table": {"inertia": 0.5, "friction_torque": 6.0, "viscous_friction": 0.05, "torque": {"mean": 0.7}},
    },
    "motors": {"m": torque_source(1e-4, "motor", rated_torque=1.0)},
    "gears": {
        "belt": gear_between("motor", "middle", 2.0, {"kind": "curve", "slopes": [40.0], "backlash": 4e-3}),
        "gearbox": gear_between("middle", "table", 30.0, 2e4, rated_output_torque=50.0, hysteresis={"efficiency": 0.9}),
    },
    "command": {"m": {"amplitude": 0.2, "frequency": 1.0}},
    "simulation": RUN,
}


def arm(**motor: Any) -> lm.Scenario:
    """An arm that gravity pulls at, turned by a torque."""
    return lm.Scenario(
        shafts={"arm": {"inertia": 1.0, "viscous_friction": 0.5}},
        motors={"m": {"shaft": "arm", "kind": "torque_source", "rotor_inertia": ROTOR, "rated_torque": 1.0}},
        gravity={"weight": {"shaft": "arm", "mass": 1.0, "radius": 1.0 / 9.80665, "error": 1e-3}},
        command={"m": motor},
        simulation=RUN,
    )


@pytest.mark.parametrize("name", ["paper-2dof-nl-large", "paper-2dof-l-large", "catalogue-robot-joint"])
def test_a_drive_in_the_long_form_has_the_same_motion_and_response_to_the_last_bit(name: str) -> None:
    drive = lm.load(name)
    assert isinstance(drive, lm.Scenario)
    train = drive.long()
    names = {"motor_speed": "motor_speed", "load_speed": "load_speed", "output_torque": "gearbox_output_torque"}
    one, two = lm.periodic_motion(drive), lm.periodic_motion(train)
    for short, long in names.items():
        assert np.array_equal(one[short], two[long])
    multipliers = [[m for m in x.attrs["multipliers_real"] if m not in (0.0, 1.0)] for x in (one, two)]
    assert multipliers[0] == multipliers[1]  # a train without hysteresis has no component that is always zero, or as it was
    of_drive = lm.frequency_response(drive, [0.5, 5.0], [0.025, 1.0])
    of_train = lm.frequency_response(train, [0.5, 5.0], [0.025, 1.0])
    for short, long in names.items():
        assert np.array_equal(of_drive["harmonics"].sel(output=short), of_train["harmonics"].sel(output=long))
    for key in ("motor_power", "load_power", "gear_loss", "efficiency", "angle_advance", "residual"):
        assert np.array_equal(of_drive[key], of_train[key], equal_nan=True)
    assert lm.response.bandwidth(drive, 1.0) == lm.response.bandwidth(train, 1.0)


def test_a_chain_of_four_masses_follows_its_transfer_function_over_four_decades() -> None:
    inertias, friction = [1e-3, 4e-4, 2e-3, 1e-2], [2e-3, 1e-3, 3e-3, 5e-3]
    stiffness, ratios = [30.0, 200.0, 80.0], [1.0, 2.0, 0.5]
    shafts = {f"s{k}": {"inertia": J, "viscous_friction": b} for k, (J, b) in enumerate(zip(inertias, friction, strict=True))}
    shafts["s3"]["torque"] = {"mean": 0.0}  # type: ignore[assignment]
    gears = {f"g{k}": gear_between(f"s{k}", f"s{k + 1}", i, c) for k, (c, i) in enumerate(zip(stiffness, ratios, strict=True))}
    motors = {"m": {"shaft": "s0", "kind": "torque_source", "rotor_inertia": 1e-5, "rated_torque": 0.5}}
    chain = lm.Scenario(shafts=shafts, motors=motors, gears=gears, simulation=RUN)
    frequencies = np.geomspace(0.05, 500.0, 25)

    def expected(force: np.ndarray) -> np.ndarray:
        """Speeds of the shafts, over frequency."""
        columns = []
        for f in frequencies:
            s = 2j * math.pi * f
            Z = np.diag([(J + (1e-5 if k == 0 else 0.0)) * s + b for k, (J, b) in enumerate(zip(inertias, friction, strict=True))]).astype(
                complex
            )
            for k, (c, i) in enumerate(zip(stiffness, ratios, strict=True)):
                twist = np.zeros(4)  # rate of the twist by the speeds
                twist[k], twist[k + 1] = 1.0 / i, -1.0
                Z += c / s * np.outer(twist, twist)
            columns.append(np.linalg.solve(Z, force))
        return np.array(columns).T

    for source, force in (("m_command", [0.5, 0, 0, 0]), ("s3_load_torque", [0, 0, 0, -1.0])):
        response = lm.frequency_response(chain, list(frequencies), 1.0, source=source)
        assert set(response["reason"].values.ravel()) == {""}
        for k, speeds in enumerate(expected(np.array(force, dtype=complex))):
            found = response["response"].sel(output=f"s{k}_speed").values[0]
            assert np.max(np.abs(found - speeds) / np.abs(speeds)) < 1e-10


def test_shooting_on_two_stages_with_backlash_agrees_with_a_long_transient() -> None:
    scenario = lm.Scenario(**TWO_STAGES)
    motion = lm.periodic_motion(scenario)
    assert motion.attrs["stable"] and motion.attrs["residual"] < 1e-10
    assert (motion["table_contact"].values == 0.0).any()  # it stops on its way
    assert np.ptp(motion["belt_twist"].values) > 4e-3  # through all of the gap
    samples, periods = motion.sizes["time"], 100
    interval = float(motion.attrs["period"]) / samples
    long = lm.simulate(scenario.replace(**{"simulation.duration": float(periods), "simulation.sample_interval": interval}))
    for name in ("motor_speed", "middle_speed", "table_speed", "belt_twist", "gearbox_twist", "m_torque"):
        last = long[name].values[(periods - 1) * samples : periods * samples]
        assert np.allclose(last, motion[name].values, rtol=0.0, atol=1e-9 * np.max(np.abs(last))), name


def test_an_arm_that_turns_over_each_period_moves_periodically() -> None:
    # The mean torque is what viscous friction takes at one turn a period; the sine keeps the arm in step.
    period = 2.0
    scenario = arm(mean=0.5 * 2.0 * math.pi / period, amplitude=1.0, frequency=1.0 / period)
    start = lm.TrainInitial(speeds={"arm": 2.0 * math.pi / period})
    motion = lm.periodic_motion(scenario, start=start)
    assert motion.attrs["angle_advance"] == pytest.approx(2.0 * math.pi, abs=1e-9)
    assert motion.attrs["residual"] < 1e-10
    assert motion.attrs["stable"]
    begin = {name: motion.attrs[f"start_arm_{name}"] for name in ("speed", "angle")}
    run = lm.simulate(
        scenario.replace(
            **{"initial.speeds": {"arm": begin["speed"]}, "initial.angles": {"arm": begin["angle"]}, "simulation.duration": 3.0 * period}
        )
    )
    speed, angle, each = run["arm_speed"].values, run["arm_angle"].values, round(period / RUN["sample_interval"])
    assert np.max(np.abs(speed[each:] - speed[:-each])) < 1e-9
    assert np.max(np.abs(angle[each:] - angle[:-each] - 2.0 * math.pi)) < 1e-9
    # Liouville: the product of the multipliers is the decay of an area, exp(-b T/J), whatever gravity does.
    multipliers = np.array(motion.attrs["multipliers_real"]) + 1j * np.array(motion.attrs["multipliers_imag"])
    own = multipliers[np.abs(multipliers - 1.0) > 1e-9]  # 1 is that of the torque source, which is no state
    assert np.prod(own).real == pytest.approx(math.exp(-0.5 * period / (1.0 + ROTOR)), rel=1e-12)


def test_newton_keeps_the_assembly_of_shafts_whose_angles_both_matter() -> None:
    # Cogging on the motor, gravity on the arm, a soft gear between them: twist = motor angle/ratio - arm angle, always.
    scenario = lm.Scenario(
        shafts={"motor": {"viscous_friction": 2e-3}, "arm": {"inertia": 0.2, "viscous_friction": 0.3}},
        motors={"m": {"shaft": "motor", "kind": "torque_source", "rotor_inertia": 1e-3, "rated_torque": 1.0}},
        gears={"gear": {"input": "motor", "output": "arm", "ratio": 10.0, "stiffness": {"kind": "linear", "stiffness": 80.0}}},
        gravity={"weight": {"shaft": "arm", "mass": 1.0, "radius": 0.2, "error": 1e-2}},
        angle_torques={"cogging": {"shaft": "motor", "kind": "sine", "amplitude": 0.02, "order": 7, "error": 1e-3}},
        command={"m": {"mean": 0.05, "amplitude": 0.2, "frequency": 2.0}},
        simulation=RUN,
    )
    motion = lm.periodic_motion(scenario)
    assert motion.attrs["newton_steps"] > 0
    offset = motion["motor_angle"] / 10.0 - motion["arm_angle"] - motion["gear_twist"]
    # Angles are modulo the period of the torques on them: a seventh of a turn of the motor, through the ratio a seventieth.
    assert np.max(np.abs(np.remainder(offset.values + 1e-9, 2.0 * math.pi / 70.0))) < 2e-9
    long = lm.simulate(scenario.replace(**{"simulation.duration": 60.5, "simulation.sample_interval": 0.5 / 2048}))
    for name in ("motor_speed", "arm_speed", "gear_twist"):
        last = long[name].values[-2049:-1]
        assert np.allclose(last, motion[name].values, rtol=0.0, atol=1e-8 * np.max(np.abs(last)))


def test_several_threads_give_the_same_bits() -> None:
    scenario = lm.Scenario(**TWO_STAGES)
    one, three = (lm.frequency_response(scenario, [1.0, 9.0], [0.3, 0.6], threads=n) for n in (1, 3))
    assert one.identical(three)


REFUSED = [
    (lambda t: lm.frequency_response(t, [1.0], [0.1]), ": source is missing, and there is not one motor alone; name an input: "),
    (lambda t: lm.frequency_response(t, [1.0], [0.1], source="command"), ': source "command" is not known; it must be '),
    (lambda t: lm.response.bandwidth(t, 0.1, source="left_command", output="load_speed"), ': output "load_speed" is not known'),
    (lambda t: lm.frequency_response(t, [1.0], [0.1], source="left_command", mean_command=0.1), ": mean_command: there are several"),
    (lambda t: lm.periodic_motion(t, 0.1), ": command: there are several"),
    (lm.periodic_motion, ": needs at least one sine"),
]


test_what_a_response_of_a_train_refuses = refusals_of(
    lambda call: call(
        lm.Scenario(
            **{k: v for k, v in TWO_STAGES.items() if k != "command"}
            | {"motors": dict.fromkeys(("left", "right"), TWO_STAGES["motors"]["m"])}
        )
    ),
    *REFUSED,
)


def test_rest_is_the_same_start_in_both_words() -> None:
    scenario = lm.Scenario(**TWO_STAGES)
    assert lm.periodic_motion(scenario, start=lm.Initial()).equals(lm.periodic_motion(scenario, start=lm.TrainInitial()))


def test_different_starts_lead_to_one_motion_of_a_train_once() -> None:
    starts = [lm.TrainInitial(), lm.TrainInitial(speeds={"motor": 3.0})]
    assert len(lm.response.periodic_motions(lm.Scenario(**TWO_STAGES), starts=starts)) == 1


def test_the_command_draws_the_response_of_a_train(tmp_path: Path) -> None:
    words = [
        "response",
        "belt-before-gearbox",
        "--amplitudes",
        "0.2,0.8",
        "--frequencies",
        "1.0..20:3",
        "-o",
        str(tmp_path),
        "--figures",
        "png",
    ]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    assert "6 of 6 motions found" in done.output
    assert (tmp_path / "bode.png").stat().st_size > 10_000
    assert (tmp_path / "maps.png").exists()
    assert "Joint speed, by amplitude of the servo command" in (tmp_path / "bode.csv").read_text().replace("_", " ")
    bad = CliRunner().invoke(app, [*words, "--input", "motor_command"])
    assert bad.exit_code != 0
    assert isinstance(bad.exception, lm.InputError) or "--input motor_command" in bad.output

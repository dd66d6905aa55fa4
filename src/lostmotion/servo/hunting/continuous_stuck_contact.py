"""One stuck contact under a continuous controller: the two linear regimes, in coordinates in which slips begin on a line.

Deviations from the state of rest without friction obey ``y' = A y`` while the contact slips forward, if the torque
``T_C`` that friction takes is added to the integrator. While it is stuck, an integrator winds up at a rate in
proportion to the error ``e``; all else settles. A slip then begins at ``y = e q + (T_S - T_C) p``. Here `q` is the
settled state of unit error with a contact torque of 0, and `p` the settled state of a contact torque of 1 without
error.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ... import _core
from ...errors import InputError
from ...model.shaft_ratio import turns
from ...model.torsion import Rigid
from ...response.linearisation import LinearModel
from ...simulation.forms.train_tables import TrainInitial
from ...simulation.scenario.scenario import Scenario
from ..linear_regimes import case_at, model_at
from .limit_cycles import UndrivenLoop

if TYPE_CHECKING:
    from ...model.train import DriveTrain

SLIP_SPEED = 1e-9  # [rad/s] or [m/s], at which the matrices of the slip are taken
NONE = 1e-9  # of the largest singular value, below which one is none
ILL = 1e9  # condition number of the modes, above which rounding is not small


class UndecidableError(Exception):
    """Reason why the map does not describe an axis."""


class AtRestError(Exception):
    """Reason why no settled stuck state ever breaks away."""


@dataclass(frozen=True)
class StickSlip:
    """Slip and stuck interval of one contact, in modal coordinates of the slip; rows give outputs over them."""

    name: str
    slip_rates: np.ndarray  # eigenvalues of the slip
    rounding: float  # relative error of what is computed by modes
    q: np.ndarray
    p: np.ndarray
    speed: np.ndarray
    error: np.ndarray  # component along q: the error, once it is stuck
    torque: np.ndarray  # component along p: the contact torque, once all has settled
    held: np.ndarray  # contact torque that holds it
    command: np.ndarray
    transients: np.ndarray  # components along the modes of the stuck regime that settle (mode, state)
    stuck_rates: np.ndarray  # their eigenvalues
    held_of_transients: np.ndarray
    command_of_transients: np.ndarray
    freed: np.ndarray  # state that a transient adds at the break-away, with the contact torque kept (state, mode)
    ramp: float  # kappa, by which the contact torque rises per error and time [N m/(rad s)]
    sliding: float  # T_C
    breakaway: float  # T_S
    command_per_torque: float
    command_per_error: float
    limit: float  # limit of the command, less the command at rest without friction

    @property
    def excess(self) -> float:
        """T_S - T_C."""
        return self.breakaway - self.sliding


def stick_slip(scenario: Scenario) -> StickSlip:
    """The regimes of a scenario with one continuous position controller.

    Raises InputError: there is no such controller.
    Raises UndecidableError: the axis has other contacts or segments, an unstable loop, or winds up otherwise than in
        proportion to the error.
    Raises AtRestError: nothing winds up while the contact is stuck, or its limit keeps the controller from freeing it.
    """
    motor, loop = _motor(scenario), UndrivenLoop.of(scenario)
    if scenario.continuous()[motor].firmware is not None:
        raise UndecidableError(f"the firmware of {motor} is no linear law")
    if reasons := list(others(scenario.train())):
        raise UndecidableError(f"the slip is not one linear regime: it has {', '.join(reasons)}")
    shaft, breakaway = only_contact(scenario)
    still, forward, reverse = slow_regimes(scenario, shaft)
    if [m.contacts[scenario.train().variable(shaft, "contact")] for m in (still, forward, reverse)] != [0, 1, -1]:
        raise UndecidableError("at small speeds the contact does not slip as one linear regime")
    return _Builder(loop, motor, shaft, still, forward, reverse).build(breakaway)


def _motor(scenario: Scenario) -> str:
    found = scenario.continuous()
    if len(found) != 1 or scenario.axes():
        raise InputError(
            f"hunting_certificate: the scenario has {len(found)} continuous and {len(scenario.axes())} sampled controllers; "
            "the map is that of one continuous position controller"
        )
    ((motor, controller),) = found.items()
    if controller.reference.kind != "position":
        raise InputError(
            f"{controller.reference.kind}; the map is that of a position controller",
            f"controllers.{motor}.reference.kind",
        )
    return motor


def only_contact(scenario: Scenario, state: TrainInitial | None = None) -> tuple[str, float]:
    """Shaft of the only dry contact, and the torque that it holds in a state, or at the start of the scenario.

    Raises UndecidableError: there is none, or there are several.
    """
    contacts = _core.explain_at(case_at(scenario, state), 0.0)["contacts"]
    dry = [contact for contact in contacts if math.isfinite(contact["capacity_forward"])]
    if not dry:
        raise UndecidableError("it has no dry contact that could stick")
    if len(dry) > 1:
        raise UndecidableError(
            f"it has {len(dry)} dry contacts, {', '.join(contact['name'] for contact in dry)}, and the map is that of one"
        )
    name, ahead, back = (dry[0][key] for key in ("name", "capacity_forward", "capacity_backward"))
    shaft = scenario.train().shaft_of(name, "contact")
    if not shaft or ahead != back:
        raise UndecidableError(f"{name} is not the dry friction of a shaft, the same in both directions")
    if ahead == 0.0:
        raise UndecidableError(
            f"the friction of {name} grows with the load alone, and the map is that of a constant one"
        )
    return shaft, ahead


def others(train: DriveTrain) -> Iterator[str]:
    """Elements with which a slip is more than one linear regime."""
    for name, shaft in train.shafts.items():
        if shaft.friction()["speeds"]:
            yield f"friction of {name} that varies with speed"
        if shaft.drag is not None:
            yield f"drag of {name}"
        if shaft.end_stops is not None:
            yield f"end stops of {name}"
    for name, gear in train.gears.items():
        if isinstance(gear.stiffness, Rigid):
            if gear.stiffness.strikes:
                yield f"backlash of {name}"
        elif not gear.stiffness.is_linear:
            yield f"several segments of {name}"
        if gear.housing is not None:
            yield f"the housing of {name}, which turns"
        if gear.transmission_error is not None:
            yield f"transmission error of {name}"
    for key, element in (*train.on_shafts(), *train.couplings()):
        if not getattr(element, "is_linear", False):
            yield key


def slow_regimes(scenario: Scenario, shaft: str) -> tuple[LinearModel, ...]:
    """Regimes in which a shaft, with all that gears join to it, is at rest, and turns slowly forward and in reverse.

    Raises UndecidableError: it slips forward otherwise than in reverse.
    """
    ratios = {name: turns(scenario.train(), name, shaft) for name in scenario.train().shafts}
    found = []
    for speed in (0.0, SLIP_SPEED, -SLIP_SPEED):
        speeds = {name: speed * i for name, i in ratios.items() if i is not None and speed != 0.0}
        found.append(model_at(scenario, TrainInitial(speeds=speeds)))
    if not np.allclose(found[1].A, found[2].A, rtol=NONE, atol=0.0):
        raise UndecidableError("it slips forward otherwise than in reverse")
    return tuple(found)


class _Builder:
    """Takes the coordinates of the module's description from the models of the three regimes."""

    def __init__(
        self, loop: UndrivenLoop, motor: str, shaft: str, still: LinearModel, forward: LinearModel, reverse: LinearModel
    ) -> None:
        self.loop, self.motor, self.shaft = loop, motor, shaft
        self.train = loop.scenario.train()
        self.still, self.forward = still, forward
        self.friction = 0.5 * (forward.rate - reverse.rate)
        self.constant = 0.5 * (forward.rate + reverse.rate)
        self.scale = _balance(forward.A)
        A = forward.A / self.scale[:, None] * self.scale
        self.basis = np.eye(len(A))
        # Rigid gears leave combinations of the states that never change: they are left out, one after the other.
        while (kept := _null(self.basis.T @ A.T @ self.basis)).shape[1]:
            self.basis = self.basis @ _null(kept.T)
        self.A = self.basis.T @ A @ self.basis
        self.stuck = self.basis.T @ (still.A / self.scale[:, None] * self.scale) @ self.basis

    def row(self, name: str, *, model: LinearModel | None = None) -> np.ndarray:
        model = self.forward if model is None else model
        if name in model.states:
            row = np.eye(len(model.states))[model.states.index(name)]
        else:
            row = model.C[model.outputs.index(name)]
        return np.asarray(row * self.scale @ self.basis)

    def build(self, breakaway: float) -> StickSlip:
        rates, modes = np.linalg.eig(self.A)
        if rates.real.max() >= 0.0:
            raise UndecidableError("the linear loop is unstable while the contact slips")
        condition = float(np.linalg.cond(modes))
        if condition > ILL:
            raise UndecidableError(f"the modes of the slip are too near to each other (condition {condition:.1e})")
        inverse = np.linalg.inv(modes)
        held, error = (
            self.row(self.train.variable(self.shaft, "contact_torque"), model=self.still),
            self.row(self.train.variable(self.motor, "error")),
        )
        p, q, ramp, S, stuck_rates = self.settled(held, error)
        whole = np.linalg.inv(np.column_stack([p, q, self.unit_speed(), S]))
        command, freed = self.row(self.train.variable(self.motor, "command")), S - np.outer(p, held @ S)
        sliding, rest = self.sliding(p), self.command_at_rest()
        sliding = breakaway if abs(breakaway - sliding) <= NONE * breakaway else sliding
        motor = self.loop.scenario.train().motors[self.motor]
        limit = self.loop.scenario.continuous()[self.motor].output_limit(motor) - abs(rest)
        if abs(command @ p) * breakaway > limit + 2.0 * abs(rest):
            raise AtRestError("the limit of the controller is below what frees the contact, so that it stays stuck")
        return StickSlip(
            name=self.train.variable(self.shaft, "contact"),
            slip_rates=rates,
            rounding=1e-14 * condition,
            q=inverse @ q,
            p=inverse @ p,
            speed=self.row(self.train.variable(self.shaft, "speed")) @ modes,
            torque=whole[0] @ modes,
            error=whole[1] @ modes,
            held=held @ modes,
            command=command @ modes,
            transients=whole[3:] @ modes,
            stuck_rates=stuck_rates,
            held_of_transients=held @ S,
            command_of_transients=command @ S,
            freed=inverse @ freed,
            ramp=ramp,
            sliding=sliding,
            breakaway=breakaway,
            command_per_torque=float(command @ p),
            command_per_error=float(command @ q),
            limit=limit,
        )

    def unit_speed(self) -> np.ndarray:
        """The direction that the stuck regime leaves out."""
        speed = self.row(self.train.variable(self.shaft, "speed"))
        return np.asarray(speed / (speed @ speed))

    def settled(
        self, held: np.ndarray, error: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, float, np.ndarray, np.ndarray]:
        """p, q, the rate of the ramp, and the modes of the stuck regime that settle, with their eigenvalues."""
        within = _null(self.row(self.train.variable(self.shaft, "speed"))[None, :])  # the contact does not move
        A = within.T @ self.stuck @ within
        p = within @ _null(A)
        if p.shape[1] == _null(A @ A, float(np.linalg.norm(A)) ** 2).shape[1] and np.linalg.eigvals(
            A
        ).real.max() <= NONE * np.linalg.norm(A):
            raise AtRestError(
                "no integrator winds up while the contact is stuck, so that it stays stuck once all has settled"
            )
        if p.shape[1] != 1 or abs(held @ p[:, 0]) == 0.0 or abs(error @ p[:, 0]) > NONE * np.linalg.norm(error):
            raise UndecidableError("what winds up while the contact is stuck is not one integrator")
        p = p[:, 0] / (held @ p[:, 0])
        n = len(p)
        # A q = kappa p, error q = 1, held q = 0.
        left = np.block(
            [[self.stuck, -p[:, None]], [error[None, :], np.zeros((1, 1))], [held[None, :], np.zeros((1, 1))]]
        )
        left = np.vstack([left, np.append(self.row(self.train.variable(self.shaft, "speed")), 0.0)])
        right = np.concatenate([np.zeros(n), [1.0, 0.0, 0.0]])
        solved, *_ = np.linalg.lstsq(left, right, rcond=None)
        if np.linalg.norm(left @ solved - right) > 1e-6 or not solved[-1] > 0.0:
            raise UndecidableError(
                "the integrator does not wind up in proportion to the error while the contact is stuck"
            )
        twice = A @ A
        U, *_ = np.linalg.svd(twice)
        rank = len(A) - 2
        rates, vectors = np.linalg.eig(U[:, :rank].T @ A @ U[:, :rank])
        if rank and rates.real.max() >= 0.0:
            raise UndecidableError("the drive does not settle while the contact is stuck")
        return p, solved[:-1], float(solved[-1]), within @ U[:, :rank] @ vectors, rates

    def sliding(self, p: np.ndarray) -> float:
        """T_C, with which p keeps the slip in equilibrium."""
        push, pull = self.A @ p, self.basis.T @ (self.friction / self.scale)
        return float(-(push @ pull) / (push @ push))

    def command_at_rest(self) -> float:
        """Command that keeps the state of rest without friction under the constant inputs."""
        signals = self.loop.scenario.signals()
        values = np.array([signals[name].breakpoint_list()[-1][1] for name in self.loop.core.input_names()])
        model = self.forward
        state, *_ = np.linalg.lstsq(
            model.A / self.scale[:, None], -(self.constant + model.B @ values) / self.scale, rcond=None
        )
        k = model.outputs.index(self.train.variable(self.motor, "command"))
        return float(model.C[k] @ state + model.D[k] @ values + model.offset[k])


def _null(A: np.ndarray, size: float | None = None) -> np.ndarray:
    """Orthonormal columns that A takes to 0, with regard to a size of its entries."""
    _, sizes, right = np.linalg.svd(A)
    rank = int(np.sum(sizes > NONE * (sizes.max(initial=0.0) if size is None else size)))
    return np.asarray(right[rank:].T)


def _balance(A: np.ndarray) -> np.ndarray:
    """Units of the states in which rows and columns of a matrix are about as large."""
    scale = np.ones(len(A))
    for _ in range(20):
        for k in range(len(A)):
            B = np.abs(A) / scale[:, None] * scale
            row, column = B[k].sum() - B[k, k], B[:, k].sum() - B[k, k]
            if row > 0.0 and column > 0.0:
                scale[k] *= 2.0 ** round(0.5 * math.log2(row / column))
    return scale

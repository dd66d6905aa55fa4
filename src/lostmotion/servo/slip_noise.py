"""The rest of a fast slip under a quantised encoder, with each reading within half a step of the angle.

Once the speed exceeds what all readings to come can take from it, slip and controller go on as a linear system with a
bounded disturbance. Its effect on an output is at most the sum of the magnitudes of the responses to each reading.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..response.stick_slip import UndecidableError
from .sampled_slip import SampledSlip
from .slip_boxes import Boxes, bend_of, need_within_limits

LONGEST = 3000  # ticks of a slip
SETTLING = 600  # ticks of a stuck interval that are looked at
READING = 0.5 * (1.0 + 1e-9)  # of a step, by which the reading may differ from the angle


@dataclass
class Noise:
    """Responses to readings since an instant: a column for each, times the largest difference."""

    of: SampledSlip
    columns: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        self.columns = np.zeros((len(self.of.held), 0))

    def on(self, row: np.ndarray) -> np.ndarray:
        """Largest effect on outputs."""
        return np.asarray(np.abs(row @ self.columns).sum(axis=-1))

    def sample(self, matrix: np.ndarray, column: np.ndarray) -> None:
        """Goes on over a tick and takes a reading."""
        new = column * READING * abs(self.of.quantum)
        self.columns = np.column_stack([matrix @ self.columns, new])


def loudest(of: SampledSlip) -> float:
    """Largest speed that the readings of a long slip can take or add."""
    noise = Noise(of)
    for tick in range(1, LONGEST):
        noise.sample(of.linear[tick % of.frame] @ of.slip, of.samples[tick % of.frame][1])
        if tick > of.frame and np.abs(noise.columns[:, 0]).max() <= 1e-3 * np.abs(noise.columns).max():
            break
    return float(noise.on(of.slip[1]))


def finish(of: SampledSlip, boxes: Boxes, tick: int) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest angles at which fast forward slips end, from states after the sample at a tick of the frame.

    Raises
    ------
    UndecidableError
        A limit of the controller may act, or the contact may break away again before all has settled.
    """
    n, count = len(of.held), len(boxes)
    noise, low, high = Noise(of), np.full(count, np.inf), np.full(count, -np.inf)
    alive, angle, speed = np.arange(count), np.eye(n)[0], np.eye(n)[1]
    for _ in range(LONGEST):
        after = boxes.moved(of.slip, of.push)
        first, last = boxes.range_of(speed), after.range_of(speed)
        loud = float(noise.on(of.slip[1]))
        bend = bend_of(of, boxes, noise.on)
        may = last[0] - loud <= bend
        if may.any():
            most = np.maximum(np.maximum(first[1], last[1]), 0.0) + max(loud, float(noise.on(speed))) + bend
            some, turned = boxes.take(may), of.tick * most[may]
            _stays_stuck(of, some, noise, turned, tick)
            least, top = some.range_of(angle)
            off = float(noise.on(angle))
            low[alive[may]] = np.minimum(low[alive[may]], least - off)
            high[alive[may]] = np.maximum(high[alive[may]], top + off + turned)
        going = last[1] + loud > 0.0
        boxes, alive = after.take(going), alive[going]
        if not len(boxes):
            return low, high
        tick = (tick + 1) % of.frame
        matrix = of.linear[tick]
        boxes = boxes.moved(matrix)
        noise.sample(matrix @ of.slip, of.samples[tick][1])
        need_within_limits(of, boxes, noise.on)
    raise UndecidableError("a slip is not shown to end")


def _stays_stuck(of: SampledSlip, boxes: Boxes, noise: Noise, turned: np.ndarray, tick: int) -> None:
    """Refuses stops after which the torque may free the contact before all but the integrator has settled."""
    if of.ramp.ticks > SETTLING:
        raise UndecidableError("the controller settles too slowly while the contact is stuck")
    rows, readings = _held_rows(of, tick)
    middle = np.abs(boxes.centre @ rows.T)
    spread = np.abs(np.einsum("in,bnk->bik", rows, boxes.spread)).sum(axis=2)
    most = middle + spread + noise.on(rows) + np.abs(rows[:, 0]) * turned[:, None] + readings
    if most.max() >= of.breakaway:
        raise UndecidableError("the contact may break away again before the stuck interval has settled")


def _held_rows(of: SampledSlip, tick: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows of the torque at the samples of a stuck interval over the state before it, and what the constant reading adds at most."""
    n = len(of.held)
    matrix, constant = np.eye(n), np.zeros(n)
    matrix[1] = 0.0
    rows, readings = [of.held @ matrix], [0.0]
    for k in range(1, of.ramp.ticks + 1):
        one = of.linear[(tick + k) % of.frame] @ of.stuck
        matrix, constant = one @ matrix, one @ constant + of.samples[(tick + k) % of.frame][1]
        rows.append(of.held @ matrix)
        readings.append(abs(float(of.held @ constant)) * READING * abs(of.quantum))
    return np.array(rows), np.array(readings)

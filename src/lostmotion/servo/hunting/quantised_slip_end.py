"""The rest of a fast slip under a quantised encoder, with each reading within half a step of the angle.

Once the speed exceeds what all readings to come can take from it, slip and controller go on as a linear system with a
bounded disturbance. Its effect on an output is at most the sum of the magnitudes of the responses to each reading.
"""

from dataclasses import dataclass, field

import numpy as np

from .continuous_stuck_contact import UndecidableError
from .sampled_stuck_contact import SampledSlip
from .state_boxes import Boxes, bend_of, need_within_limits

LONGEST = 3000  # ticks of a slip
SETTLING = 600  # ticks of a stuck interval that are looked at
READING = 0.5 * (1.0 + 1e-9)  # of a step, by which the reading may differ from the angle


@dataclass
class Noise:
    """Responses to readings since an instant: a column for each, times the largest difference."""

    contact: SampledSlip
    columns: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        self.columns = np.zeros((len(self.contact.held), 0))

    def on(self, row: np.ndarray) -> np.ndarray:
        """Largest effect on outputs."""
        return np.asarray(np.abs(row @ self.columns).sum(axis=-1))

    def sample(self, matrix: np.ndarray, column: np.ndarray) -> None:
        """Goes on over a tick and takes a reading."""
        new = column * READING * abs(self.contact.quantum)
        self.columns = np.column_stack([matrix @ self.columns, new])


def loudest(contact: SampledSlip) -> float:
    """Largest speed that the readings of a long slip can take or add."""
    noise = Noise(contact)
    for tick in range(1, LONGEST):
        noise.sample(contact.linear[tick % contact.frame] @ contact.slip, contact.samples[tick % contact.frame][1])
        if tick > contact.frame and np.abs(noise.columns[:, 0]).max() <= 1e-3 * np.abs(noise.columns).max():
            break
    return float(noise.on(contact.slip[1]))


def finish(contact: SampledSlip, boxes: Boxes, tick: int) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest angles at which fast forward slips end, from states after the sample at a tick of the frame.

    Raises UndecidableError: a limit of the controller may act, or the contact may break away again before all has settled.
    """
    n, count = len(contact.held), len(boxes)
    noise, low, high = Noise(contact), np.full(count, np.inf), np.full(count, -np.inf)
    alive, angle, speed = np.arange(count), np.eye(n)[0], np.eye(n)[1]
    passed = np.full(count, np.inf)  # angle of the tick before
    for _ in range(LONGEST):
        after = boxes.moved(contact.slip, contact.push)
        first, last = boxes.range_of(speed), after.range_of(speed)
        loud = float(noise.on(contact.slip[1]))
        bend = bend_of(contact, boxes, noise.on)
        may = last[0] - loud <= bend
        most = contact.tick * (
            np.maximum(np.maximum(first[1], last[1]), 0.0) + max(loud, float(noise.on(speed))) + bend
        )
        if may.any():
            some, turned = boxes.take(may), most[may]
            _stays_stuck(contact, some, noise, turned, passed[may], tick)
            least, top = some.range_of(angle)
            off = float(noise.on(angle))
            low[alive[may]] = np.minimum(low[alive[may]], least - off)
            high[alive[may]] = np.maximum(high[alive[may]], top + off + turned)
        going = last[1] + loud > 0.0
        boxes, alive, passed = after.take(going), alive[going], most[going]
        if not len(boxes):
            return low, high
        tick = (tick + 1) % contact.frame
        matrix = contact.linear[tick]
        boxes = boxes.moved(matrix)
        noise.sample(matrix @ contact.slip, contact.samples[tick][1])
        need_within_limits(contact, boxes, noise.on)
    raise UndecidableError("a slip is not shown to end")


def _stays_stuck(
    contact: SampledSlip, boxes: Boxes, noise: Noise, turned: np.ndarray, passed: np.ndarray, tick: int
) -> None:
    """Refuses stops after which the torque may free the contact before all but the integrator has settled.

    turned, passed: largest angles from the last sample to the stop, and in the tick before.
    """
    if contact.ramp.ticks > SETTLING:
        raise UndecidableError("the controller settles too slowly while the contact is stuck")
    rows, readings = _held_rows(contact, tick)
    spread = np.abs(np.einsum("in,bnk->bik", rows, boxes.spread)).sum(axis=2) + np.abs(rows[:, 0]) * turned[:, None]
    effects = np.column_stack([rows @ noise.columns, readings])
    most = READING * abs(contact.quantum)
    falls = np.minimum(np.stack([passed, turned]), 2.0 * most) / (most or 1.0)
    for way in (1.0, -1.0):
        torques = way * (boxes.centre @ rows.T) + spread + _one_way(way * effects, falls)
        if torques.max() >= contact.breakaway:
            raise UndecidableError("the contact may break away again before the stuck interval has settled")


def _one_way(effects: np.ndarray, falls: np.ndarray) -> np.ndarray:
    """Largest sum of effects of readings in a slip forward, (box, row).

    Each reading differs from the angle by ``n``, from -1 to 1. As no reading is below the one before, ``n`` falls by no more than the
    angle has grown, ``f``. With any ``t`` above 0, ``a n + a' n' <= t f + |a - t| + |a' + t|``, where n' follows n.

    effects: ``a`` of each row and reading, the last for the stuck interval.
    falls: ``f`` of each box, from the last but two readings to the last but one, and from there to the last.
    """
    kept, total = effects.copy(), np.zeros((falls.shape[1], len(effects)))
    for k, fall in ((-1, falls[1]), (-2, falls[0])):
        if kept.shape[1] >= 1 - k:
            t = np.clip(np.minimum(-kept[:, k], kept[:, k - 1]), 0.0, None)
            kept[:, k] += t
            kept[:, k - 1] -= t
            total += t * fall[:, None]
    return np.asarray(total + np.abs(kept).sum(axis=1))


def _held_rows(contact: SampledSlip, tick: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows of the torque at the samples of a stuck interval over the state before it, and the effect of the constant reading."""
    n = len(contact.held)
    matrix, constant = np.eye(n), np.zeros(n)
    matrix[1] = 0.0
    rows, readings = [contact.held @ matrix], [0.0]
    for k in range(1, contact.ramp.ticks + 1):
        one = contact.linear[(tick + k) % contact.frame] @ contact.stuck
        matrix, constant = one @ matrix, one @ constant + contact.samples[(tick + k) % contact.frame][1]
        rows.append(contact.held @ matrix)
        readings.append(float(contact.held @ constant) * READING * abs(contact.quantum))
    return np.array(rows), np.array(readings)

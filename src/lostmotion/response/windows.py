"""Instants of a sine whose periods fit the sample times of controllers."""

from dataclasses import dataclass

import numpy as np

TOGETHER = 10  # periods that may be taken as one, so that they fit
NEAR = 1e-3  # relative distance of a frequency from that which is asked for, within which fewer periods are preferred
EXACT = 1e-9  # the same, below which it counts as that which is asked for
SAMPLES = 256  # a period, at least, of what is looked at


@dataclass(frozen=True)
class Window:
    """Some periods of a sine that take as long as some frames, the time after which all sample times of controllers repeat."""

    asked: float  # frequency that was asked for [Hz]
    tick: float  # base tick of the controllers [s]
    frame: int  # ticks
    periods: int
    frames: int
    stride: int  # ticks from sample to sample
    points: int  # samples in a tick, if stride is 1

    @property
    def ticks(self) -> int:
        return self.frames * self.frame

    @property
    def frequency(self) -> float:
        """[Hz]"""
        return self.periods / (self.ticks * self.tick)

    @property
    def samples(self) -> int:
        return self.ticks * self.points // self.stride

    @property
    def offsets(self) -> np.ndarray:
        """Ticks from the beginning to each sample: halfway between two ticks, where nothing jumps."""
        return np.asarray((np.arange(self.samples) * self.stride + 0.5) / self.points)

    def angle(self, offsets: np.ndarray) -> np.ndarray:
        """Angle of the sine after a number of sample instants, modulo whole turns [rad]."""
        return np.asarray(2.0 * np.pi * (np.mod(self.periods * offsets, self.ticks) / self.ticks))


def fitting(frequency: float, tick: float, frame: int) -> Window:
    """The window of the frequency that is nearest.

    frequency: [Hz].
    tick: base tick [s].
    frame: in ticks.
    """
    length = 1.0 / (frequency * frame * tick)  # of a period, in frames
    every = max(int(length / SAMPLES), 1)  # frames from sample to sample

    def off(k: int, unit: int = 1) -> tuple[int, float]:
        """Frames for k periods, and how far the frequency is off then."""
        n = max(unit * round(k * length / unit), unit)
        return n, abs(k * length / n - 1.0)

    k = next((k for k in range(1, TOGETHER + 1) if off(k)[1] <= EXACT), 0)
    if not k and every > 1:
        frames = off(1, every)[0]  # the samples of a long period fit as well
        return Window(frequency, tick, frame, 1, frames, every * frame, 1)
    k = k or next((k for k in range(1, TOGETHER + 1) if off(k)[1] <= NEAR), 0)
    k = k or min(range(1, TOGETHER + 1), key=lambda k: off(k)[1])
    frames = off(k)[0]
    if frames >= SAMPLES * k:
        every = next(q for q in range(every, 0, -1) if frames % q == 0)
        return Window(frequency, tick, frame, k, frames, every * frame, 1)
    points = -(-SAMPLES * k // (frames * frame))
    return Window(frequency, tick, frame, k, frames, 1, points)

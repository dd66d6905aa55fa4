"""Screening of logs: what cannot be used is dropped or refused, and what looks wrong is noted, each with its reason."""

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from ...errors import InputError
from ...units.practical import counted
from ..readers.log import Log

GLITCH = 8.0  # times the usual change between samples (99th percentile), there and back within two samples
CLOCK = 0.3  # share of repeated time stamps from which on the clock is taken to be coarse
PAUSE = 5.0  # times the usual interval between samples, that is noted as a pause
LIMIT = 0.2  # share of samples at the largest value, from which on a channel is taken to saturate
LONG = 60.0  # [s] between samples, beyond which times are taken to be in another unit
LONGEST = 1e5  # [s] of a log
HUGE = 1e30  # beyond which a value is none
STALL = 0.1  # share of the samples in which no channel changes, from which on it is noted
SLOW = 10.0  # samples for each change of a channel that otherwise changes, from which on it is called slow
WRAP = 20.0  # times the usual change between samples (99th percentile), that does not come back: a counter that wraps
SAME = 0.1  # share by which jumps of one counter may differ: it moves while it wraps
NOISY = 0.9  # share of samples at which a channel changes, from which on one that does not is taken to be frozen
FROZEN = 20  # samples in a row
MOTION = ("rad", "m", "rad/s", "m/s")  # units of channels that show whether the rig moves
MOVING = 0.2  # of the usual change of another channel of the motion, from which on the rig moves in a stretch
SLOWER = (
    0.7  # of the change before, up to which a motion comes to rest: with a constant deceleration it is at most a third
)
CONTRADICTION = 0.03  # share by which the mean of a channel may depart from what the header says


def screened(log: Log, measured: Iterable[str], inputs: Iterable[str], stated: dict[str, str] | None = None) -> Log:
    """A log that can be compared with a run: its time rises, its channels are numbers.

    measured: channels that are compared: glitches in them become NaN as missing values are, and all others keep the sample.
    inputs: channels that act on the rig, or that switch it: samples in which one is missing are dropped.
    stated: keys of the header, and the channels that ought to agree with them.
    """
    measured, inputs = list(measured), list(inputs)
    for name in (*measured, *inputs):
        log.values(name)
    if len(log.time) < 10:
        raise InputError(f"has {len(log.time)} samples; 10 at least are needed, leave the file out", where=log.name)
    log = _in_seconds(_rising(log))
    log = _numbers(log, measured, inputs)
    for name in measured:
        log = _without_glitches(log, name, name in inputs)
        there = log.values(name)[np.isfinite(log.values(name))]
        if np.ptp(there) == 0.0:
            log = log.noted(f"{name} stays at {there[0]:.6g} all through; it says nothing of the motion")
    for name in measured:
        log = _noted(log, name, measured)
    log = _stalls(log)
    for key, channel in (stated or {}).items():
        log = _compared(log, key, channel)
    return log


def _rising(log: Log) -> Log:
    """Time stamps that rise: samples that are not finite or go back are dropped, and samples of a coarse clock are spread."""
    finite = np.isfinite(log.time)
    if not finite.all():
        log = log.only(finite, f"dropped {counted(np.sum(~finite), 'sample')} without a time")
    if len(log.time) < 10:
        raise InputError(f"has times in {len(log.time)} samples only; 10 at least are needed", where=log.name)
    step = np.diff(log.time)
    back = step < 0.0
    if back.any():
        highest = np.maximum.accumulate(log.time)
        kept = log.time >= highest
        if np.mean(kept) < 0.9:
            raise InputError(
                f"its time goes back at sample {int(np.argmax(back)) + 1} ({log.time[int(np.argmax(back)) + 1]:.6g} s) and "
                f"{np.mean(~kept):.0%} of the samples lie before earlier ones; sort or split the file",
                where=log.name,
            )
        log = log.only(
            kept,
            f"dropped {counted(int(np.sum(~kept)), 'sample')} whose time goes back, the first near {log.time[int(np.argmax(back))]:.6g} s",
        )
    same = np.diff(log.time) == 0.0
    share = float(np.mean(same))
    if share == 1.0:
        raise InputError(f"all samples have the time {log.time[0]:.6g} s; the clock stood still", where=log.name)
    if share >= CLOCK:
        return _spread(log)
    if same.any():
        kept = np.concatenate([[True], ~same])
        log = log.only(kept, f"dropped {counted(np.sum(same), 'sample')} with the time stamp of the sample before")
    long = np.diff(log.time) > PAUSE * np.median(np.diff(log.time))
    if long.any():
        k = int(np.argmax(np.diff(log.time)))
        log = log.noted(
            f"{counted(np.sum(long), 'pause')} in the samples, the longest of {np.diff(log.time)[k]:.4g} s at {log.time[k]:.4g} s"
        )
    return log


def _in_seconds(log: Log) -> Log:
    """The log, with a note or an error where its times are hardly in seconds."""
    if log.duration > LONGEST or log.interval > LONG:
        raise InputError(
            f"its times go from {log.time[0]:.6g} to {log.time[-1]:.6g} s in steps of {log.interval:.4g} s; "
            f"times are read in s: give their unit, or split the file where the clock jumps",
            where=log.name,
        )
    if log.interval >= 1.0:
        return log.noted(f"its samples are {log.interval:.4g} s apart; times are read in s")
    return log


def _spread(log: Log) -> Log:
    """Samples between two ticks of a coarse clock, at equal distances."""
    first = np.concatenate([[True], np.diff(log.time) > 0.0])
    starts = np.flatnonzero(first)
    tick = float(np.median(np.diff(log.time[starts])))
    ends = np.append(log.time[starts][1:], log.time[starts][-1] + tick)
    index = np.cumsum(first) - 1
    within = np.arange(len(log.time)) - starts[index]
    count = np.diff(np.append(starts, len(log.time)))
    time = (
        log.time[starts][index]
        + (np.minimum(ends, log.time[starts] + tick) - log.time[starts])[index] * within / count[index]
    )
    return Log(log.name, time, log.channels, log.header, log.notes).noted(
        f"the clock moves in steps of {tick:.4g} s with {np.mean(count):.1f} samples each; the samples are spread over them"
    )


def _numbers(log: Log, measured: list[str], inputs: list[str]) -> Log:
    """The log with NaN where a measured channel is not a number, and without samples in which an input is not a number."""
    for name in dict.fromkeys((*inputs, *measured)):
        bad = ~(np.abs(log.values(name)) < HUGE)
        if bad.all():
            raise InputError(
                f"channel {name} has no number in any sample; leave the file out, or name another channel",
                where=log.name,
            )
        if np.mean(bad) > 0.5:
            raise InputError(
                f"channel {name} has no number in {np.mean(bad):.0%} of the samples; leave the file out", where=log.name
            )
        if bad.any():
            log = _without(
                log, name, bad, name in inputs, f"{counted(np.sum(bad), 'sample')} in which {name} is not a number"
            )
    return log


def _without(log: Log, name: str, bad: np.ndarray, acts: bool, note: str) -> Log:
    """The log without some samples of a channel: without the whole samples if the channel acts, else with NaN in the channel alone."""
    if acts:
        return log.only(~bad, f"dropped {note}")
    channel = log.channels[name]
    masked = replace(channel, values=np.where(bad, np.nan, channel.values))
    return replace(log, channels={**log.channels, name: masked}).noted(
        f"the residuals of {note} are left out; inputs keep these samples"
    )


def _without_glitches(log: Log, name: str, acts: bool) -> Log:
    """The log without single samples that jump away and back."""
    there = np.flatnonzero(np.isfinite(log.values(name)))
    x = log.values(name)[there]
    step = np.diff(x)
    away = np.minimum(np.abs(step[:-1]), np.abs(step[1:]))
    returns = (np.sign(step[:-1]) * np.sign(step[1:]) < 0.0) & (np.abs(step[:-1] + step[1:]) < 0.5 * away)
    # Steps there and back do not tell what is usual: a few glitches would hide each other.
    calm = np.ones(len(step), dtype=bool)
    calm[:-1] &= ~returns
    calm[1:] &= ~returns
    usual = float(np.percentile(np.abs(step[calm]), 99.0)) if calm.any() else 0.0
    if usual == 0.0:
        usual = float(np.percentile(np.abs(step), 99.0)) if len(step) else 0.0
    if usual == 0.0:
        return log
    found = there[1:-1][returns & (away > GLITCH * usual)]
    if not len(found):
        return log
    glitch = np.zeros(len(log.time), dtype=bool)
    glitch[found] = True
    k, count = int(found[0]), len(found)
    note = f"{count} glitch{'es' if count > 1 else ''} of {name}, the first at {log.time[k]:.4g} s"
    return _without(log, name, glitch, acts, f"{note} ({log.values(name)[k]:.6g})")


def _noted(log: Log, name: str, measured: Sequence[str]) -> Log:
    """Notes on a channel that wraps, is frozen for a while, ends at a limit, or is slower than its samples."""
    x = log.values(name)[np.isfinite(log.values(name))]
    if (period := wrapped_by(x)) is not None:
        log = log.noted(
            f"{name} jumps by {period:.6g} between two samples, as a counter that wraps; unwrap it in the file"
        )
    others = [c.values for n in measured if n != name and (c := log.channels[n]).unit in MOTION]
    if stretches := frozen_stretches(log.values(name), others):
        begin, end = max(stretches, key=lambda s: s[1] - s[0])
        more = f" and {len(stretches) - 1} times more" if len(stretches) > 1 else ""
        text = f"{name} is {log.values(name)[begin]:.6g} from {log.time[begin]:.4g} to {log.time[end - 1]:.4g} s{more}, in the middle of"
        log = log.noted(f"{text} a motion; the sensor may have been frozen")
    changes = int(np.sum(np.diff(x) != 0.0))
    if changes <= SLOW:
        return log
    at_top = np.abs(x) == np.max(np.abs(x))
    plateaus = int(np.sum(at_top[1:] & ~at_top[:-1]))
    if np.mean(at_top) > LIMIT and plateaus > 2:
        text = f"{name} is at its largest value {np.max(np.abs(x)):.6g} in {np.mean(at_top):.0%} of the samples, {plateaus} times; it may saturate"
        log = log.noted(text)
    moved = np.flatnonzero(np.diff(x) != 0.0)
    if len(x) > SLOW * changes and np.max(np.diff(moved), initial=0) < 3.0 * np.median(np.diff(moved)):
        text = f"{name} changes only {changes / log.duration:.3g} times in a second, and is sampled {1 / log.interval:.4g} times"
        log = log.noted(text)
    return log


def wrapped_by(x: np.ndarray) -> float | None:
    """Period of a counter that wraps, from jumps of one size that do not come back; None without such jumps."""
    there = x[np.isfinite(x)]
    step = np.diff(there)
    if len(step) < 10:
        return None
    usual = float(np.percentile(np.abs(step), 95.0))
    jumps = np.abs(step) > WRAP * max(usual, 1e-300)
    size = np.abs(step[jumps])
    if not len(size) or usual == 0.0 or np.ptp(size) > SAME * np.max(size) or np.max(size) < 0.5 * np.ptp(there):
        return None
    # The change over the jump, without what the motion adds to it on both sides.
    at = np.flatnonzero(jumps)
    sides = np.array([np.mean([*step[max(k - 2, 0) : k], *step[k + 1 : k + 3]]) for k in at.tolist()])
    period = float(np.mean(np.abs(step[at] - sides)))
    for whole in (2.0 * np.pi, np.pi, 360.0, 1.0):
        if abs(period - whole) < SAME * whole:
            return float(whole)
    return period


def constant_stretches(x: np.ndarray) -> list[tuple[int, int]]:
    """(begin, end) of samples at which a channel stays exactly the same, though it changes at nearly all others."""
    moved = np.diff(x) != 0.0
    edges = np.concatenate([[-1], np.flatnonzero(moved), [len(moved)]])
    found = [(int(a) + 1, int(b) + 1) for a, b in itertools.pairwise(edges) if b - a > FROZEN]
    within = sum(end - begin - 1 for begin, end in found)
    if not found or np.sum(moved) < NOISY * (len(moved) - within):
        return []
    return found


def frozen_stretches(x: np.ndarray, others: Sequence[np.ndarray] = ()) -> list[tuple[int, int]]:
    """Constant stretches in the middle of a motion; a load that comes to rest and begins to move again is not frozen.

    others: other channels that show the motion: if they change as usual in a stretch the sensor is frozen, else the
        load is at rest.
    """
    return [stretch for stretch in constant_stretches(x) if not _at_rest(x, *stretch, others)]


def _at_rest(x: np.ndarray, begin: int, end: int, others: Sequence[np.ndarray]) -> bool:
    """Whether a channel is constant since nothing moves: it slows down before and speeds up behind, and has no noise elsewhere."""
    if others:
        return not any(_moves(other, begin, end) for other in others)
    step = np.abs(np.diff(x))
    if not np.any(step > 0.0):
        return True  # the same all through, maybe with gaps, which has a note of its own
    jumped = begin > 0 and step[begin - 1] > 2.0 * float(
        np.nanmax(np.delete(step, [begin - 1, min(end, len(x) - 1) - 1]))
    )
    if abs(x[begin]) <= 1e-9 * float(np.nanmax(np.abs(x))) and not jumped:
        return True  # a speed of zero, or an angle that has not left its zero
    # A sensor that was frozen jumps by what the motion has gone on meanwhile; one that follows a load at rest goes on slowly.
    ends = [step[k] for k in (begin - 1, end - 1) if 0 <= k < len(step)]
    if end < len(x) and max(ends) <= np.nanmedian(step[step > 0.0]):
        return True
    moving = x.copy()
    for first, last in constant_stretches(x):
        moving[first:last] = np.nan
    second, third = (float(np.nanmedian(np.abs(np.diff(moving, order)))) for order in (2, 3))
    # Third differences of white noise are 1.8 times the second ones; the differences of a smooth motion are far smaller.
    resolution = float(np.min(step[step > 0.0]))
    if third > 0.9 * second and second > 4.0 * resolution:
        return False
    stops = begin < 2 or step[begin - 1] <= SLOWER * step[begin - 2] + 1.01 * resolution
    starts = end + 1 >= len(x) or step[end - 1] <= step[end] + 1.01 * resolution
    return bool(stops and starts)


def _moves(x: np.ndarray, begin: int, end: int) -> bool:
    """Whether a channel changes in a stretch as it does elsewhere."""
    step = np.abs(np.diff(x))
    within, elsewhere = step[begin : end - 1], np.concatenate([step[:begin], step[end:]])
    return bool(np.nanmedian(within) > MOVING * np.nanmedian(elsewhere)) if len(elsewhere) else False


def _stalls(log: Log) -> Log:
    """A note where no channel at all changes for long."""
    moved = np.zeros(len(log.time) - 1, dtype=bool)
    for channel in log.channels.values():
        moved |= np.diff(channel.values) != 0.0
    edges = np.concatenate([[-1], np.flatnonzero(moved), [len(moved)]])
    longest = int(np.argmax(np.diff(edges)))
    count = int(np.diff(edges)[longest])
    if moved.any() and count > STALL * len(log.time) and count > 20:
        return log.noted(
            f"no channel changes in {count} samples from {log.time[edges[longest] + 1]:.4g} s on; it rests, or the recorder has stalled"
        )
    return log


def _compared(log: Log, key: str, channel: str) -> Log:
    """A note where the header contradicts a channel."""
    if key not in log.header or channel not in log.channels:
        return log
    said, mean = log.header[key], float(np.nanmean(log.values(channel)))
    if not isinstance(said, int | float) or abs(mean - said) <= CONTRADICTION * max(abs(mean), abs(said)):
        return log
    return log.noted(
        f"the header says {key} = {said:.6g}, the channel {channel} is {mean:.6g} on average; formulas that name {key} take the header"
    )

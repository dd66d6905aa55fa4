"""Sample times of loops, which nest."""

from ..errors import InputError

MAX_SAMPLES = 1_000_000  # of the shortest sample time in another


def whole_multiple(time: float, base: float, key: str) -> int:
    """Whole number by which a sample time is a multiple of `base`. Raises InputError: it is no whole multiple."""
    samples = round(time / base)
    if samples < 1 or samples > MAX_SAMPLES or not abs(samples * base - time) <= 1e-9 * time:
        near = max(1, min(samples, MAX_SAMPLES)) * base
        raise InputError(
            f"{time:g} s is no whole multiple of the sample time {base:g} s; take {near:g} s, or another sample time",
            key,
        )
    return samples

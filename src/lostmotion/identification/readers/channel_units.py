"""Units of channels, and their factors to SI."""

from contextlib import suppress

from ...errors import InputError
from ...units.conversion import si_factor, si_value

KINDS = ("rad", "rad/s", "N*m", "A", "V", "N", "m", "m/s", "s", "K", "rad/s^2", "m/s^2", "W", "Pa")


def channel_unit(written: str, of_file: str, unit: str, where: str) -> tuple[float, str]:
    """(what one of the unit of a channel is in SI, the SI unit).

    written: as the identification file says; if empty, `of_file` holds, and if that is empty, the channel is in SI.
    unit: SI unit of what it is compared with; units of another kind are read as what they are, for a `scale` to turn them.
    """
    text = (written or of_file).strip()
    if text in ("", "-", "1", "bool"):
        return 1.0, "" if text else unit
    problem: ValueError | None = None
    for kind in dict.fromkeys((unit, *KINDS)):
        if kind in ("", "1"):
            continue
        try:
            return si_value(f"1 {text}", kind), kind
        except ValueError as error:
            problem = problem or error
    with suppress(ValueError):
        return si_factor(text), "SI"
    raise InputError(
        f"the unit {text!r} is not known ({problem}); write it with measured or inputs ... unit", where=where
    )


def is_unit(text: str) -> bool:
    """Whether a text is a unit of a channel."""
    try:
        channel_unit(text, "", "", "")
    except InputError:
        return False
    return True

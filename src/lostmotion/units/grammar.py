"""The units that may be written, and how products of them are read: a closed list, so that no prefix is guessed."""

import difflib
import re
import unicodedata
from functools import cache
from itertools import product as pairs

from .unit_table import PREFIXES, UNITS

Product = dict[str, int]  # unit of the table: its power

# Symbol: unit of the table, and the prefixes that are in use with it.
PREFIXED = {
    "N": ("newton", "u m c d da k M"),
    "m": ("meter", "n u m c d"),
    "Pa": ("pascal", "k M G"),
    "g": ("gram", "m k"),
    "s": ("second", "n u m"),
    "rad": ("radian", "n u m"),
    "Hz": ("hertz", "m k M"),
    "V": ("volt", "u m k"),
    "A": ("ampere", "u m k"),
    "Ω": ("ohm", "u m k M"),
    "ohm": ("ohm", "u m k M"),
    "H": ("henry", "n u m"),
    "W": ("watt", "m k"),
    "K": ("kelvin", "m"),
    "St": ("stokes", "c"),
    "rev": ("revolution", "k"),
}
# How a mass is read where only a force gives the quantity: (mass, force) of the table.
FORCE_OF = {"pound": "force_pound", "ounce": "force_ounce", "kilogram": "kilogram_force", "gram": "force_gram"}

_SAME = str.maketrans(
    {
        "″": '"',
        "′": "'",
        **dict.fromkeys("−–‐‑﹣", "-"),
        **dict.fromkeys("·⋅∙•×✕", "*"),
        **dict.fromkeys("\u200b\u2060\ufeff", ""),
    }
)
_POWERS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻", "0123456789+-")
_POWER = r"\s*(?:\^|\*\*)\s*(?:\(\s*([+-]?[0-9]+)\s*\)|([+-]?[0-9]+))"
_FACTOR = re.compile(rf"([A-Za-zΩ°%‰'\"]+)(?:{_POWER}|([+-]?[0-9]+))?")
_JOIN = re.compile(r"\s*(/)\s*|\s*[*.]\s*|-(?=[A-Za-z])|\s+(?=[A-Za-zΩ°(])")
_POWER_OF_GROUP = re.compile(_POWER)


def plain(text: str) -> str:
    """The text with one spelling for each meaning: spaces, minus, product, prime, micro, raised digits, deg C, arc min."""
    text = re.sub("[⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻]+", lambda power: "^" + power.group().translate(_POWERS), text)
    text = " ".join(unicodedata.normalize("NFKC", text.translate(_SAME)).replace("μ", "u").split())
    text = re.sub("^([+-]) (?=[0-9.])|(?<=[A-Za-z])[.]$", r"\1", text)
    text = re.sub("(?<![A-Za-z])(?:°|deg)[.]? ?([CF])(?![A-Za-z])", r"deg\1", text)
    return re.sub("(?<![A-Za-z])arc[ -](min|sec)", r"arc\1", text)


class UnknownUnitError(ValueError):
    """A symbol that is no unit here, or a unit that cannot be read as a whole (empty symbol)."""

    def __init__(self, symbol: str = "") -> None:
        super().__init__(symbol)
        self.symbol = symbol


@cache
def symbols() -> dict[str, Product]:
    """All symbols that stand for a unit or, written together, for a product of units."""
    found: dict[str, Product] = {}
    for symbol, (name, prefixes) in PREFIXED.items():
        found[symbol] = {name: 1}
        found |= {p + symbol: {PREFIXES[p][0] + name: 1} for p in prefixes.split()}
    for name, (_, _, spellings) in UNITS.items():
        found |= {spelling: {name: 1} for spelling in spellings.split()}
    found |= {"rpm": {"revolution": 1, "minute": -1}, "krpm": {"kilorevolution": 1, "minute": -1}}
    found |= {"rps": {"revolution": 1, "second": -1}}
    lengths, forces = ("m", "cm", "mm"), [f for f in found if f.endswith("N")]
    together = [*pairs(forces, lengths), *pairs(("kg", "kgf", "kp", "g", "gf"), lengths)]
    for weight, length in pairs(("lb", "lbf", "oz", "ozf"), ("in", "ft")):
        together += [(weight, length), (length, weight)]
    together += [("V", "s"), ("mV", "s")]
    for a, b in together:
        if a + b not in found and a + b not in ("gm", "gfm"):  # gm is also written for gram
            found[a + b] = found[a] | found[b]
    found |= {f + "ms": found[f] | {"meter": 1, "second": 1} for f in ("N", "mN")}
    return found


@cache
def _by_lower_case() -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for symbol in symbols():
        found.setdefault(symbol.lower(), []).append(symbol)
    return found


def _symbol(text: str) -> Product:
    """Exactly as listed, or in other case where only one unit can be meant."""
    known = symbols()
    if text in known:
        return known[text]
    candidates = _by_lower_case().get(text.lower(), []) if len(text) > 1 else []
    if text.startswith("M"):  # which is mega, and never milli
        candidates = [c for c in candidates if not any(name.startswith("milli") for name in known[c])]
    if not candidates or any(known[c] != known[candidates[0]] for c in candidates):
        raise UnknownUnitError(text)
    return known[candidates[0]]


def near(symbol: str) -> list[str]:
    """Known symbols that are spelled alike, one for each unit: spellings in other case, else the nearest."""
    alike = _by_lower_case().get(symbol.lower(), [])
    if not alike and len(symbol) > 1:
        likeness = {s: difflib.SequenceMatcher(None, symbol.lower(), s.lower()).ratio() for s in symbols()}
        alike = sorted((s for s in likeness if likeness[s] >= 0.6), key=lambda s: -likeness[s])
    return [s for k, s in enumerate(alike) if not any(symbols()[s] == symbols()[other] for other in alike[:k])]


def read_unit(text: str) -> Product:
    """The powers of the units in a product such as ``N*m/arcmin``, ``kg cm^2``, ``min-1`` or ``V/(rad/s)``.

    A slash divides by the next factor alone, as in every programming language. The text is `plain`.
    """
    text = re.sub(r"^(1\s*)?/", "1/", text)
    found: Product = {}
    place, sign = (2, -1) if text.startswith("1/") else (0, 1)
    place += len(text[place:]) - len(text[place:].lstrip())
    while True:
        factor, place = _factor(text, place)
        for name, power in factor.items():
            found[name] = found.get(name, 0) + sign * power
        if place == len(text):
            return {name: power for name, power in found.items() if power}
        join = _JOIN.match(text, place)
        if join is None:
            raise UnknownUnitError
        place, sign = join.end(), -1 if join[1] else 1


def read_si(unit: str) -> Product:
    """The same of the SI unit of a result or a key: 1 is a plain number, and joule is none that is written in files."""
    return {"joule": 1} if unit == "J" else read_unit(unit) if unit != "1" else {}


def _factor(text: str, place: int) -> tuple[Product, int]:
    """One unit, or a product in brackets, with its power, and where it ends."""
    if text.startswith("(", place):
        end = _closing(text, place)
        inner, place, power = read_unit(text[place + 1 : end].strip()), end + 1, 1
        if raised := _POWER_OF_GROUP.match(text, place):
            power, place = int(raised[1] or raised[2]), raised.end()
        return {name: n * power for name, n in inner.items()}, place
    factor = _FACTOR.match(text, place)
    if factor is None:
        raise UnknownUnitError
    # In a product that is written together, the power belongs to its last unit: kgcm2 is kg*cm^2.
    *first, last = _symbol(factor[1]).items()
    power = int(factor[2] or factor[3] or factor[4] or 1)
    return dict([*first, (last[0], last[1] * power)]), factor.end()


def _closing(text: str, place: int) -> int:
    depth = 0
    for k in range(place, len(text)):
        depth += {"(": 1, ")": -1}.get(text[k], 0)
        if depth == 0:
            return k
    raise UnknownUnitError


@cache
def _spelling_of() -> dict[tuple[str, int], str]:
    found: dict[tuple[str, int], str] = {}
    for symbol, units in symbols().items():
        if len(units) == 1:
            found.setdefault(next(iter(units.items())), symbol)
    return found


def written(units: Product) -> str:
    """A product as text that `read_unit` reads."""

    def powers(sign: int) -> list[str]:
        chosen = ((_spelling_of()[name, 1], sign * n) for name, n in units.items() if sign * n > 0)
        return [symbol if n == 1 else f"{symbol}^{n}" for symbol, n in chosen]

    over = "".join("/" + symbol for symbol in powers(-1))
    return ("*".join(powers(1)) or "1") + over

"""Changes of files: of their bytes, and of the tables of TOML and JSON files."""

from __future__ import annotations

import copy
from random import Random
from typing import Any

NUMBERS = (0, 1, -1, 0.0, -0.0, 1e-300, 5e-324, 1e300, 1.7e308, -1e9, 1e-9, 1e9, 0.5, 2, 3, 100, 2**31, 2**63, 10**400)
NUMBERS += (float("nan"), float("inf"), -float("inf"))
TEXTS = (
    "",
    " ",
    "0",
    "1 rpm",
    "-5 N*m",
    "3 kg*m^2",
    "1e400 N*m",
    "2 arcmin",
    "1 s",
    "0.7 Hz",
    "1/0 s",
    "9**9**9",
    "1 foo",
    "nan",
    "inf N*m",
    "x" * 5000,
    "\x1b]0;title\x07",
    "é\u202e中",
    "a.b.c",
    "../x",
    "constant",
    "curve",
    "linear",
    "rigid",
    "dc",
    "loss_map",
    "mean(load_speed)",
    "position-axis",
    "schaeffler-rt1-h-20-100",
)
PIECES = (b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"[[", b"]", b"'''", b'"', b"= ", b"\r", b"1e999", b"-", b"\xf0\x9f", b"{}", b"#")


def value(random: Random) -> Any:
    """Any value that a TOML file may have, of those that are likely to be wrong."""
    match random.randrange(9):
        case 0 | 1 | 2:
            return random.choice(NUMBERS)
        case 3 | 4:
            return random.choice(TEXTS)
        case 5:
            return random.random() < 0.5
        case 6:
            return [value(random) for _ in range(random.randrange(4))]
        case 7:
            return {random.choice(("mean", "kind", "inertia", "x y", "")): value(random)}
    return random.choice((-1, 1)) * 10.0 ** random.uniform(-12, 12)


def places(data: Any, where: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Keys and indices of all values within."""
    entries = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    return [place for key, inner in entries for place in ((*where, key), *places(inner, (*where, key)))]


def at(data: Any, place: tuple[Any, ...]) -> Any:
    """The value at a place."""
    for key in place:
        data = data[key]
    return data


def tables(random: Random, data: Any, others: list[Any], *, changes: int = 3) -> Any:
    """A copy with up to some changes: values replaced, scaled, dropped, renamed, exchanged, or taken from others."""
    data = copy.deepcopy(data)
    for _ in range(random.randint(1, changes)):
        if not (known := places(data)):
            break
        *parent, key = random.choice(known)
        _change(random, at(data, tuple(parent)), key, data, random.choice(others))
    return data


def _change(random: Random, node: Any, key: Any, data: Any, other: Any) -> None:
    old = node[key]
    match random.randrange(10):
        case 0:
            del node[key]
        case 1 if isinstance(node, dict):
            node[misspelt(random, str(key))] = node.pop(key)
        case 2:
            node[key] = copy.deepcopy(at(data, random.choice(places(data))))
        case 3:
            node[key] = copy.deepcopy(at(other, random.choice(places(other))))
        case 4 if isinstance(node, dict):
            place = random.choice(places(other))
            node[place[-1] if isinstance(place[-1], str) else "0"] = copy.deepcopy(at(other, place))
        case 5 if isinstance(node, list):
            random.shuffle(node)
        case 6 if isinstance(node, list):
            node.insert(key, old)
        case 7 | 8 | 9 if isinstance(old, int | float) and not isinstance(old, bool):
            node[key] = old * random.choice((-1.0, 0.0, 1e-6, 1e-3, 0.5, 2.0, 10.0, 1e3, 1e6, 1e12))
        case _:
            node[key] = value(random)


def misspelt(random: Random, text: str) -> str:
    """A text with one letter dropped, doubled or replaced."""
    k = random.randrange(len(text) + 1)
    return text[:k] + random.choice(("", "x", text[k : k + 1] * 2, "_", " ")) + text[k + 1 :]


def content(random: Random, text: bytes, other: bytes = b"", *, changes: int = 4) -> bytes:
    """Bytes with up to some changes: flipped, cut out, repeated, inserted, cut off, or spliced with others."""
    data = bytearray(text)
    for _ in range(random.randint(1, changes)):
        a = random.randrange(len(data) + 1)
        b = min(len(data), a + random.choice((1, 1, 2, 4, 8, 100, 1000)))
        match random.randrange(9):
            case 0 | 1 | 2 if b > a:
                data[a] = random.choice((data[a] ^ 1 << random.randrange(8), 0, 255, random.randrange(256)))
            case 3:
                del data[a:b]
            case 4:
                data[a:a] = data[a:b]
            case 5:
                data[a:a] = random.choice(PIECES)
            case 6 if random.random() < 0.3:
                del data[a:]
            case 7 if other:
                c = random.randrange(len(other))
                data[a:b] = other[c : c + b - a]
            case 8:
                data[a:b] = random.choice((0, 1, -1, 2**31 - 1, 2**62)).to_bytes(8, "little", signed=True)[: b - a]
    return bytes(data)

"""Messages for values that a part refuses, in one line: the key, the value and what would be right."""

from __future__ import annotations

import datetime
import difflib
import json
import re
from collections.abc import Collection, Iterable, Mapping
from decimal import Decimal
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from ..errors import InputError, Problem
from ..units.scalars import scalar
from .schema import follow, keys_within, unit_in_schema

if TYPE_CHECKING:
    from pydantic import ValidationError

MAX_PROBLEMS = 5  # problems that one line names in full
MAX_READ = 1000  # problems that are told apart; of more only the number is given
MAX_LENGTH = 60  # characters of a value that is shown
MAX_NAME = 100  # characters of a name that another one is looked for
MAX_NEAR = 20  # places, or misspelt keys, that are looked at for what was meant
MAX_LISTED = 120  # characters of a list of names
MAX_LINE = 240  # characters of several problems in one line
WORD_CUTOFF = 0.7  # least likeness of two words, above which one is taken for the other, misspelt
JOINED_CUTOFF = 0.92  # of two names, where words run together or fall apart


def refusal(error: ValidationError, schema: Mapping[str, Any], subject: str, given: Any = None) -> InputError:
    """The error of a failed validation. Names all keys that are missing, and no key that follows from a misspelt one.

    schema: JSON Schema of the part that was to be made.
    subject: subject of a message on the whole, such as ``"the scenario"``.
    given: what it was to be made of, so that a value is shown as it was written.
    """
    found = error.errors(include_url=False)
    problems = [_Problem(p, schema, given) for p in found[:MAX_READ]]
    # A list whose entries are refused is not also too short.
    inside = {p.keys[:n] for p in problems for n in range(len(p.keys))}
    problems = [p for p in problems if p.kind != "too_short" or p.keys not in inside]
    # Where a value may be of two types, it is refused by each of them; only what is wrong with it as the first is said.
    problems = list({p.name: p for p in reversed(problems)}.values())[::-1]
    misspelt = [p for p in problems if p.kind == "extra_forbidden"]
    missing = [p for p in problems if p.kind == "missing"]
    if missing:
        meant = {(*p.keys[:-1], p.near()) for p in misspelt[:MAX_NEAR]}
        missing = [p for p in missing if p.keys not in meant]
    others = [p for p in problems if p.kind not in ("extra_forbidden", "missing")]
    said = [p.problem(subject) for p in misspelt[:MAX_PROBLEMS]]
    if missing:
        names = tuple(shortened(p.name, MAX_LINE) for p in missing)
        told = names if len(", ".join(names)) <= MAX_LISTED else (listed(names),)
        said.append(Problem(told, "is missing; add it" if len(names) == 1 else "are missing; add them"))
    said += [p.problem(subject) for p in others[:MAX_PROBLEMS]]
    total = len(misspelt) + bool(missing) + len(others) + max(0, len(found) - MAX_READ)
    fitting = [k for k in range(1, MAX_PROBLEMS + 1) if k == 1 or len(str(InputError(problems=said[:k]))) <= MAX_LINE]
    said = said[: fitting[-1]]
    return InputError(problems=said, more=max(0, total - len(said)))


def unknown_key(key: str, known: Iterable[str], inner: Iterable[str] = ()) -> str:
    """Message for an unknown key.

    inner: dotted keys of the tables within, where the key may belong.
    """
    known, inner = sorted(known), list(inner)
    if key == "rigid" and any(path.startswith("stiffness") for path in (*known, *inner)):
        return "is a key of data sheets; a gear without stiffness is rigid, so leave both out"
    together = [path for path in inner if path.replace(".", "_") == key]
    if same := together or [path for path in inner if path.rpartition(".")[2] == key]:
        return f"is not known here; it is written as {' or '.join(same[:MAX_NEAR])}"
    if not nearest(key, known):
        last = {path.rpartition(".")[2]: path for path in reversed(inner)}
        if near := nearest(key, last):
            return f"is not known here; did you mean {last[near]}?"
    return "is not known; " + did_you_mean(key, known, f"known here: {', '.join(known)}")


def chosen_motor(name: str | None, motors: Collection[str], what: str, without: str) -> str:
    """The motor that is meant: the one of this name, or the only one.

    what: such as "steppers".
    without: what is wrong where there is none.

    Raises InputError: there is none, there are several, or the name is none of them.
    """
    if not motors:
        raise InputError(without)
    if name is None and len(motors) > 1:
        raise InputError(f"there are several {what}; give one of {', '.join(motors)}", "motor")
    if name is not None and name not in motors:
        known = did_you_mean(name, motors, f"the {what} are {', '.join(motors)}")
        raise InputError(f"{shown(name)} is none of the {what}; {known}", "motor")
    return name or next(iter(motors))


def did_you_mean(given: str, choices: Iterable[str], otherwise: str) -> str:
    """The choice that was misspelt as what was given; if none was, what to say otherwise."""
    near = nearest(given, choices)
    return f"did you mean {near}?" if near else beginning(otherwise)


def names_like(given: str, names: Iterable[str], otherwise: str, count: int = 3) -> str:
    """Suggestions as in `did_you_mean`, for names of files and records; a part of a name may be missing."""
    near = difflib.get_close_matches(given[:MAX_NAME], list(names), n=count, cutoff=0.5)
    return f"did you mean {' or '.join(near)}?" if near else beginning(otherwise)


def listed(names: Iterable[str]) -> str:
    """Names in a row; of more than fit into a message the first."""
    return beginning(", ".join(names))


def beginning(text: str) -> str:
    """A text that ends in a list of names; of a long list the first, and how many are left out."""
    if len(text) <= MAX_LISTED:
        return text
    first = text[:MAX_LISTED].rpartition(", ")[0]
    return f"{first} and {text.count(', ', len(first))} more" if first else shortened(text, MAX_LISTED)


def nearest(given: str, choices: Iterable[str]) -> str:
    """The choice that was misspelt as what was given; empty if none was.

    A name with another word in it, or with one more, names another quantity: backlash is no added_backlash, and a
    rated_current no rated_torque. One that is related to something else, or to nothing, is meant: steps are
    steps_per_revolution, as are steps_per_rev.
    """
    if len(given) > MAX_NAME:
        return ""
    wanted = _words(given)
    likeness = {choice: _likeness(wanted, _words(choice)) for choice in choices if len(choice) <= MAX_NAME}
    best = max(likeness, key=lambda choice: likeness[choice], default="")
    if best and likeness[best] > 0.0:
        return best
    head = [*wanted[: wanted.index("per")], "per"] if "per" in wanted else [*wanted, "per"]
    related = [choice for choice in likeness if _words(choice)[: len(head)] == head]
    return related[0] if len(related) == 1 else ""


def _words(name: str) -> list[str]:
    """The words of a name, in lower case. Anything but letters and digits separates words, and a capital begins one."""
    parted = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name)
    return re.split(r"[^a-z0-9]+", parted.lower())


def _likeness(given: list[str], choice: list[str]) -> float:
    """0 where they have other words; else the line of all of them."""
    joined = difflib.SequenceMatcher(None, "".join(given), "".join(choice))
    if joined.real_quick_ratio() < WORD_CUTOFF:
        return 0.0
    if len(given) != len(choice):
        return joined.ratio() if joined.ratio() >= JOINED_CUTOFF else 0.0
    for a, b in ((given, choice), (sorted(given), sorted(choice))):
        ratios = [difflib.SequenceMatcher(None, x, y).ratio() for x, y in zip(a, b, strict=True)]
        if min(ratios) >= WORD_CUTOFF:
            return sum(ratios) / len(ratios)
    return 0.0


def shown(value: Any) -> str:
    """A value as a TOML file has it, shortened if it is long."""
    return shortened(_toml(value))


def shortened(text: str, length: int = MAX_LENGTH) -> str:
    """A text that is not too long for a message."""
    return text if len(text) < length else text[: length - 3] + "..."


def _toml(value: Any) -> str:
    value = scalar(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return repr(float(value))
    if isinstance(value, datetime.date | datetime.time):
        return value.isoformat()
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml(x)}" for key, x in value.items()) + " }"
    if isinstance(value, Decimal | Fraction):
        return str(value)
    if getattr(value, "size", MAX_LENGTH) < MAX_LENGTH and hasattr(value, "dtype"):  # an array
        array = value.to_numpy() if hasattr(value, "to_numpy") else value
        listed = array.tolist() if hasattr(array, "tolist") else None
        return _toml(listed) if isinstance(listed, list | int | float | complex) else "the given array"
    if hasattr(value, "dtype"):
        return f"the given array of {' x '.join(map(str, value.shape))} entries"
    text = repr(value)
    # What describes itself by its class, or in several lines, says nothing to a reader of one.
    return "the given object" if text.startswith("<") or "\n" in text or " at 0x" in text else text


class _Problem:
    """One problem of a failed validation."""

    def __init__(self, problem: Any, schema: Mapping[str, Any], given: Any) -> None:
        self.kind: str = problem["type"]
        self.context = problem.get("ctx", {})
        self.keys, self.nodes = follow(schema, problem["loc"], self.kind == "extra_forbidden")
        written = _at(given, self.keys)
        self.value = written if isinstance(written, str) else problem["input"]
        self.schema = schema
        self.name = re.sub(r"\.(\[)", r"\1", ".".join(f"[{k}]" if isinstance(k, int) else str(k) for k in self.keys))

    def known(self) -> list[str]:
        """Keys of the table that the problem is about."""
        return sorted({key for node in self.nodes for key in node.get("properties", {})})

    def near(self) -> str:
        """The known key that was misspelt as this one; empty if none was."""
        return nearest(str(self.keys[-1]), self.known())

    def inner(self) -> list[str]:
        """Dotted keys of the tables within the table that the problem is about."""
        table = [str(key) for key in self.keys[:-1]]
        return [".".join((*table, *path)) for path in keys_within(self.schema, self.nodes)]

    def problem(self, subject: str) -> Problem:
        text, refused = self._text(), self.context.get("error")
        if self.keys:
            return Problem((shortened(self.name, MAX_LINE),), text)
        if not isinstance(refused, InputError):
            return Problem((), f"{subject} {text}")
        return refused.problems[0] if [p.sentence() for p in refused.problems] == [text] else Problem((), text)

    def _text(self) -> str:
        if self.kind == "extra_forbidden":
            key = str(self.keys[-1])
            if kinds := self._kinds(key):
                return f"is a key of kind {' or '.join(map(shown, kinds))}, and this table has another; leave it out"
            return unknown_key(key, self.known(), self.inner())
        if self.kind in ("value_error", "assertion_error"):
            text = str(self.context["error"])
            return (
                text
                if isinstance(self.value, Mapping) and not text.startswith("must be")
                else f"{shown(self.value)} {text}"
            )
        if self.kind == "union_tag_invalid":
            return f"kind {shown(self.context['tag'])} must be {_one_of(self._kinds(), self.context['tag'])}"
        if self.kind == "union_tag_not_found":
            return f"lacks kind, which says what it is; it must be {_one_of(self._kinds())}"
        return f"{shown(self.value)} {self._wanted()}"

    def _kinds(self, key: str | None = None) -> list[str]:
        """The kinds that the table may have, or the kinds that have a key, whatever kind it is given."""
        if key is None:
            kinds = [kind for node in self.nodes for kind in node.get("discriminator", {}).get("mapping", {})]
            if kinds:
                return list(dict.fromkeys(kinds))
        nodes = self.nodes if key is None else follow(self.schema, self.keys[:-1])[1]
        said = [
            p.get("kind", {}).get("const") for node in nodes if (p := node.get("properties", {})) and key in (None, *p)
        ]
        return list(dict.fromkeys(kind for kind in said if kind is not None))

    def _wanted(self) -> str:
        """Required form of a value, by the kind of its problem."""
        c = self.context
        match self.kind:
            case "greater_than":
                return f"must be greater than {c['gt']:g}"
            case "greater_than_equal":
                return f"must be at least {c['ge']:g}"
            case "less_than":
                return f"must be less than {c['lt']:g}"
            case "less_than_equal":
                text = f"must be at most {c['le']:g}"
                if c["le"] == 1 and isinstance(self.value, int | float) and 1.0 < self.value <= 100.0:
                    text += f'; write {self.value / 100.0:g}, or "{self.value:g} %"'
                elif isinstance(self.value, int | float) and any(unit_in_schema(n) == "rad" for n in self.nodes):
                    text += f' rad; write "{self.value:g} deg" if degrees are meant'
                return text
            case "finite_number":
                return "must be a finite number"
            case "literal_error" | "enum":
                choices = [x for n in self.nodes for x in n.get("enum", [n["const"]] if "const" in n else [])]
                return f"must be {_one_of(choices, self.value)}"
            case "too_short":
                return f"has {_entries(len(self.value))}; it needs at least {c['min_length']}"
            case "too_long":
                return f"has too many entries; it may have {c['max_length']}"
            case "string_pattern_mismatch":
                return f"must consist of {next(n['description'] for n in self.nodes if 'description' in n)}"
        for beginning, wanted in _WANTED.items():
            if self.kind.startswith(beginning):
                return wanted
        if self.kind in ("model_type", "model_attributes_type", "dict_type", "mapping_type"):
            keys = f" with some of the keys {listed(self.known())}" if self.known() else ""
            return f"must be a table{keys}"
        return "is not valid JSON" if self.kind == "json_invalid" else "cannot be used here"


_WANTED = {
    "float_": "must be a number",
    "int_": "must be a whole number",
    "bool_": "must be true or false",
    "string_": "must be text, in quotes",
    "tuple_": "must be a list, in square brackets",
    "list_": "must be a list, in square brackets",
}


def _entries(count: int) -> str:
    return "1 entry" if count == 1 else f"{count} entries"


def _one_of(choices: list[str], value: Any = "") -> str:
    near = difflib.get_close_matches(str(value), choices, n=1)
    listed = ", ".join(f'"{choice}"' for choice in choices)
    return (f"one of {listed}" if len(choices) > 1 else listed) + (f'; did you mean "{near[0]}"?' if near else "")


def _at(given: Any, keys: tuple[int | str, ...]) -> Any:
    """Value at these keys; None if there is none."""
    for key in keys:
        try:
            given = given[key]
        except (KeyError, IndexError, TypeError):
            return None
    return given

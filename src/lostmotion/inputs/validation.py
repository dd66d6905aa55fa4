"""What is wrong with a value that a part refuses, in one line: the key, the value and what would be right."""

from __future__ import annotations

import datetime
import difflib
import json
import re
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from .schema import follow

if TYPE_CHECKING:
    from pydantic import ValidationError

MAX_PROBLEMS = 5  # problems that one line names in full
MAX_LENGTH = 60  # characters of a value that is shown


def describe(error: ValidationError, schema: Mapping[str, Any], subject: str, given: Any = None) -> str:
    """One line for a failed validation. Names all keys that are missing, and no key that follows from a misspelt one.

    Parameters
    ----------
    schema
        JSON Schema of the part that was to be made.
    subject
        What it is, as in ``"the scenario"``, for what is wrong with all of it.
    given
        What it was to be made of, so that a value is shown as it was written.
    """
    problems = [_Problem(p, schema, given) for p in error.errors(include_url=False)]
    # A list whose entries are refused is not also too short.
    problems = [
        p
        for p in problems
        if p.kind != "too_short" or not any(q is not p and q.keys[: len(p.keys)] == p.keys for q in problems)
    ]
    # Where a value may be of two types, it is refused by each of them.
    problems = [p for n, p in enumerate(problems) if p.name not in {q.name for q in problems[:n]}]
    misspelt = [p for p in problems if p.kind == "extra_forbidden"]
    meant = {(*p.keys[:-1], p.near()) for p in misspelt}
    missing = [p.name for p in problems if p.kind == "missing" and p.keys not in meant]
    # Of a value that may be one of two types only what is wrong with it as the first.
    others = list({p.keys: p for p in reversed(problems) if p.kind not in ("extra_forbidden", "missing")}.values())[
        ::-1
    ]
    texts = [p.sentence(subject) for p in misspelt]
    if missing:
        texts.append(
            f"key {missing[0]}: is missing; add it"
            if len(missing) == 1
            else f"keys {', '.join(missing)}: are missing; add them"
        )
    texts += [p.sentence(subject) for p in others]
    more = f"; and {len(texts) - MAX_PROBLEMS} more" if len(texts) > MAX_PROBLEMS else ""
    return "; ".join(texts[:MAX_PROBLEMS]) + more


def unknown_key(key: str, known: Iterable[str]) -> str:
    """What is said of a key that is none of those that are known."""
    known = sorted(known)
    return "is not known; " + did_you_mean(key, known, f"known here: {', '.join(known)}")


def did_you_mean(given: str, choices: Iterable[str], otherwise: str, count: int = 1) -> str:
    """The choices, at most so many, that are spelled most like what was given; if none is near, what to say otherwise."""
    near = difflib.get_close_matches(given, list(choices), n=count, cutoff=0.6 if count == 1 else 0.5)
    return f"did you mean {' or '.join(near)}?" if near else otherwise


def shown(value: Any) -> str:
    """A value as a TOML file has it, shortened if it is long."""
    text = _toml(value)
    return text if len(text) < MAX_LENGTH else text[: MAX_LENGTH - 3] + "..."


def _toml(value: Any) -> str:
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
    if hasattr(value, "tolist"):  # an array
        return _toml(value.tolist())
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
        self.name = re.sub(r"\.(\[)", r"\1", ".".join(f"[{k}]" if isinstance(k, int) else str(k) for k in self.keys))

    def known(self) -> list[str]:
        """Keys of the table that the problem is about."""
        return sorted({key for node in self.nodes for key in node.get("properties", {})})

    def near(self) -> str:
        """The known key that is spelled most like this one; empty if none is."""
        return next(iter(difflib.get_close_matches(str(self.keys[-1]), self.known(), n=1)), "")

    def sentence(self, subject: str) -> str:
        text = self._text()
        if not self.keys:
            return text if isinstance(self.context.get("error"), InputError) else f"{subject} {text}"
        return f"key {self.name}: {text}"

    def _text(self) -> str:
        if self.kind == "extra_forbidden":
            return unknown_key(str(self.keys[-1]), self.known())
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

    def _kinds(self) -> list[str]:
        kinds = [kind for node in self.nodes for kind in node.get("discriminator", {}).get("mapping", {})]
        if not kinds:
            said = [node.get("properties", {}).get("kind", {}).get("const") for node in self.nodes]
            kinds = [kind for kind in said if kind is not None]
        return list(dict.fromkeys(kinds))

    def _wanted(self) -> str:
        """What a value must be, by the kind of its problem."""
        c = self.context
        match self.kind:
            case "greater_than":
                return f"must be greater than {c['gt']:g}"
            case "greater_than_equal":
                return f"must be at least {c['ge']:g}"
            case "less_than":
                return f"must be less than {c['lt']:g}"
            case "less_than_equal":
                return f"must be at most {c['le']:g}"
            case "finite_number":
                return "must be a finite number"
            case "literal_error" | "enum":
                choices = re.findall("'([^']*)'", c["expected"])
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
            keys = f" with some of the keys {', '.join(self.known())}" if self.known() else ""
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
    """What stands at these keys; None if nothing does."""
    for key in keys:
        try:
            given = given[key]
        except (KeyError, IndexError, TypeError):
            return None
    return given

"""Expressions of the result variables that a study stores of each run, read by a grammar of their own.

An expression is parsed, and each of its parts turned into an entry of the tables of `study_functions`; a part that is none of
the listed ones is refused. The text is never run as Python.
"""

import ast
import operator
from collections.abc import Callable, Mapping
from functools import lru_cache, reduce
from typing import Any, NamedTuple

import numpy as np

from ...inputs.expression_trees import ARITHMETIC, COMPARISONS, syntax_tree
from ...inputs.refusal_messages import MAX_LISTED, listed, nearest, shortened
from .functions import BANDWIDTH, FUNCTIONS, METHODS, REDUCTIONS, Function, FunctionParameter
from .measures import Measure, measure, plain, power, product, text_of, total
from .vocabulary import OF_THE_RUN, Vocabulary

Names = Mapping[str, Any]
"""values by name: variables (run, time), `energy` (entry -> runs), `bandwidth` (a function of the amplitude)"""

LOGIC: dict[type[ast.operator], Callable[[Any, Any], Any]] = {ast.BitAnd: operator.and_, ast.BitOr: operator.or_}
# What is not in the grammar but may be tried, and what to write instead.
INSTEAD = {
    ast.BoolOp: "and, or; write & and |, with each comparison in brackets",
    ast.Not: "not; write ~",
    ast.IfExp: "if ... else; write .where(condition, other)",
    ast.Subscript: "[ ]; write .sel(time=0.5), .isel(time=-1) or .where(condition)",
    ast.JoinedStr: "text",
    ast.Lambda: "a function of its own",
    ast.NamedExpr: "a name of its own",
}


class Term(NamedTuple):
    """One part of an expression."""

    measure: Measure
    value: Callable[[Names], Any]
    number: float | int | None = None  # its value, if it is a written number


LEFT_OUT = Term(Measure(), lambda _: None)


class Expression:
    """An expression of the result variables, as `keep` has it.

    text: as written.
    vocabulary: what it may name.
    """

    def __init__(self, text: str, vocabulary: Vocabulary) -> None:
        self.text, shown = text, shortened(text, MAX_LISTED)
        tree = syntax_tree(text, "an expression", "split it into several columns")
        self.names = frozenset(node.id for node in ast.walk(tree) if isinstance(node, ast.Name))  # all that it names
        known = {name for name, _ in vocabulary.variables}
        for name in sorted(self.names - FUNCTIONS.keys() - set(vocabulary.of_the_run) - known):
            raise _unknown(name, shown, vocabulary)
        reader = _Reader(shown, vocabulary)
        self._term = reader.read(tree)
        if self._term.measure.over_time:
            raise ValueError(f"{shown!r} leaves a value for each instant; reduce it, as in peak({shown})")
        self.instants = tuple(reader.instants)  # instants [s] that it reads by .sel(time=...)
        self.indices = tuple(reader.indices)  # samples that it reads by .isel(time=...)
        self.variables = (self.names & known) | ({vocabulary.command} if "ideal_speed" in self.names else frozenset())
        """the result variables that it needs"""
        units = dict.fromkeys(unit for _, unit in vocabulary.variables)
        self.unit = text_of(self._term.measure, ("1", *units, "J", "Hz", "N*m/rad"))
        """unit of the values, ``"1"`` for a plain number; empty where it cannot be determined"""
        self.reduction: tuple[str, str] | None = None
        """reduction and variable, if it is nothing else, so that the core can do it"""
        match tree:
            case ast.Call(ast.Name(reduction), [ast.Name(variable)], []):
                if reduction in REDUCTIONS and variable in vocabulary.channels:
                    self.reduction = reduction, variable

    def values(self, names: Names, runs: int) -> np.ndarray:
        """Values for each of several runs, shape (runs,), from variables (run, time) and values of the runs."""
        with np.errstate(all="ignore"):
            value = self._term.value(names)
        return np.broadcast_to(np.asarray(value, dtype=float), (runs,))


@lru_cache(maxsize=1000)
def read_expression(text: str, vocabulary: Vocabulary) -> Expression:
    """The expression of a text; each is read once."""
    return Expression(text, vocabulary)


def _unknown(name: str, text: str, vocabulary: Vocabulary) -> ValueError:
    if name in OF_THE_RUN:
        return ValueError(f"{name} in {text!r} is of one commanded motor that turns the last shaft through gears")
    choice = listed((*FUNCTIONS, *vocabulary.of_the_run))
    near = nearest(name, [v for v, _ in vocabulary.variables])
    hint = f"; did you mean {near}?" if near else ""
    return ValueError(f"{name!r} in {text!r} is neither a result variable nor one of {choice}{hint}")


class _Reader:
    """Turns a syntax tree into terms: the whole grammar."""

    def __init__(self, text: str, vocabulary: Vocabulary) -> None:
        self.text = text
        self.units = dict(vocabulary.variables) | {"time": "s", "ideal_speed": "rad/s"}
        self.energies = [name for name, _ in vocabulary.energies]
        self.instants: list[float] = []
        self.indices: list[int] = []

    def refuse(self, what: str) -> ValueError:
        return ValueError(f"{self.text!r} must not use {what}")

    def read(self, node: ast.expr) -> Term:
        match node:
            case ast.Constant(bool() | str() | bytes() | complex() | None):
                raise self.refuse(f"{node.value!r}; write numbers and names of result variables")
            case ast.Constant(int() | float() as number):
                return self.number(number)
            case ast.Name(name):
                return self.name(name)
            case ast.Attribute(ast.Name("energy"), entry):
                if entry not in self.energies:
                    raise ValueError(f"energy.{entry} is none of {listed(self.energies)}")
                return Term(measure("J"), lambda names: names["energy"][entry])
            case ast.UnaryOp():
                return self.unary(node)
            case ast.BinOp():
                return self.binary(node)
            case ast.Compare():
                return self.comparison(node)
            case ast.Call():
                return self.call(node)
            case ast.Attribute(_, name):
                raise self.refuse(f".{name}; methods are called, and are {listed(METHODS)}")
        raise self.refuse(INSTEAD.get(type(node), "this; it has numbers, names, operators, functions and methods only"))

    def number(self, number: float) -> Term:
        try:
            finite = np.isfinite(float(number))
        except OverflowError:
            finite = False
        if not finite:
            raise ValueError(f"{self.text[:40]!r} has a number that is too large")
        return Term(Measure(), lambda _: number, number)

    def name(self, name: str) -> Term:
        if name in FUNCTIONS or name == "bandwidth":
            raise self.refuse(f"{name} without its brackets; write {name}(...)")
        if name == "energy":
            raise self.refuse(f"energy alone; name an entry, such as energy.{self.energies[0]}")
        return Term(measure(self.units[name], over_time=True), lambda names: names[name])

    def unary(self, node: ast.UnaryOp) -> Term:
        if isinstance(node.op, ast.Not):
            raise self.refuse(INSTEAD[ast.Not])
        a = self.read(node.operand)
        if isinstance(node.op, ast.Invert):
            self.must_be_boolean("~", a)
            return Term(a.measure, lambda names: ~a.value(names))
        sign = -1 if isinstance(node.op, ast.USub) else 1
        own = plain(a.measure) if a.measure.boolean else a.measure
        return Term(own, lambda names: sign * _numeric(a.value(names)), None if a.number is None else sign * a.number)

    def binary(self, node: ast.BinOp) -> Term:
        a, b = self.read(node.left), self.read(node.right)
        if how := LOGIC.get(type(node.op)):
            self.must_be_boolean("&" if isinstance(node.op, ast.BitAnd) else "|", a, b)
            return Term(plain(a.measure, b.measure, boolean=True), lambda names: how(a.value(names), b.value(names)))
        if type(node.op) not in ARITHMETIC:
            raise self.refuse("this operator; there are + - * / ** & | ~ and comparisons")
        arithmetic = ARITHMETIC[type(node.op)]
        match node.op:
            case ast.Mult():
                own = product(a.measure, b.measure)
            case ast.Div():
                own = product(a.measure, b.measure, -1)
            case ast.Pow():
                own = power(a.measure, b.number, b.measure)
            case _:
                own = total(a.measure, b.measure)
        return Term(own, lambda names: _combine(arithmetic, a.value(names), b.value(names)))

    def comparison(self, node: ast.Compare) -> Term:
        terms = [self.read(n) for n in (node.left, *node.comparators)]
        if unknown := [op for op in node.ops if type(op) not in COMPARISONS]:
            raise self.refuse(f"{type(unknown[0]).__name__.lower()}; comparisons are < <= > >= == !=")
        how = [COMPARISONS[type(op)] for op in node.ops]

        def value(names: Names) -> Any:
            values = [t.value(names) for t in terms]
            return reduce(operator.and_, [_combine(f, a, b) for f, a, b in zip(how, values, values[1:], strict=False)])

        return Term(plain(*(t.measure for t in terms), boolean=True), value)

    def must_be_boolean(self, sign: str, *terms: Term) -> None:
        if not all(t.measure.boolean for t in terms):
            raise ValueError(f"{self.text!r}: {sign} joins comparisons, each in brackets, as in (a > 0) & (b < 1)")

    # --- calls ---

    def call(self, node: ast.Call) -> Term:
        match node.func:
            case ast.Name("bandwidth"):
                given = self.arguments("bandwidth", BANDWIDTH, node.args, node.keywords)
                return Term(measure("Hz"), lambda names: names["bandwidth"](*_values(given, names)))
            case ast.Name(name) if name in FUNCTIONS:
                return self.function(name, FUNCTIONS[name], node.args, node.keywords)
            case ast.Attribute(_, name) if name not in METHODS:
                raise self.refuse(f".{name}; the methods are {listed(METHODS)}")
            case ast.Attribute(receiver, name):
                return self.function(f".{name}", METHODS[name], [receiver, *node.args], node.keywords)
        raise self.refuse("this call; functions are called by their name")

    def function(self, name: str, function: Function, args: list[ast.expr], keywords: list[ast.keyword]) -> Term:
        given = self.arguments(name, function.parameters, args, keywords)
        own = function.of_measures(*(term.measure for term in given))
        return Term(own, lambda names: function.of_values(*_values(given, names)))

    def arguments(
        self, name: str, parameters: tuple[FunctionParameter, ...], args: list[ast.expr], keywords: list[ast.keyword]
    ) -> list[Term]:
        """The terms in the order of the parameters; texts, which only say what holds anyway, are checked and left out."""
        by_name = {p.name: p for p in parameters}
        shown = f"{name}({', '.join(p.name for p in parameters)})"
        if len(args) > len(parameters):
            raise ValueError(f"{self.text!r}: {shown} has no room for {len(args)} arguments")
        nodes = {p.name: a for p, a in zip(parameters, args, strict=False)}
        for keyword in keywords:
            if keyword.arg not in by_name or keyword.arg in nodes:
                raise ValueError(f"{self.text!r}: {shown} does not take {keyword.arg or '**'} here")
            nodes[keyword.arg] = keyword.value
        for p in parameters:
            if p.needed and p.name not in nodes:
                raise ValueError(f"{self.text!r}: {shown} needs {p.name}")
        last = max((k for k, p in enumerate(parameters) if p.name in nodes), default=-1)
        found = [self.argument(name, p, nodes[p.name]) if p.name in nodes else LEFT_OUT for p in parameters[: last + 1]]
        return [term for term in found if term is not None]

    def argument(self, function: str, parameter: FunctionParameter, node: ast.expr) -> Term | None:
        kind = parameter.kind
        here = f"{self.text!r}: {parameter.name} of {function}"
        if kind in ("time", "nearest"):
            if not (isinstance(node, ast.Constant) and node.value == kind):
                raise ValueError(f"{here} must be {kind!r}; leave it out")
            return None
        term = self.read(node)
        if kind in ("share", "index", "instant"):
            if term.number is None or (kind == "index" and not isinstance(term.number, int)):
                raise ValueError(f"{here} must be a {'whole ' if kind == 'index' else ''}number, written out")
            if kind == "share" and not 0.0 <= term.number <= 1.0:
                raise ValueError(f"{here} must lie between 0 and 1")
            self.note(kind, term.number)
        elif kind == "condition" and not (term.measure.boolean and term.measure.over_time):
            raise ValueError(f"{here} must be a comparison of variables over time, as in motor_power > 0")
        elif kind == "series" and not term.measure.over_time:
            raise ValueError(f"{here} must be a variable over time; this is one value for each run")
        elif kind == "of a run" and term.measure.over_time:
            raise ValueError(f"{here} must be one value for each run; this is a variable over time")
        if kind != "condition" and term.measure.boolean:
            return Term(plain(term.measure), lambda names: _numeric(term.value(names)))
        return term

    def note(self, kind: str, number: float) -> None:
        if kind == "instant":
            self.instants.append(float(number))
        elif kind == "index":
            self.indices.append(int(number))


def _values(given: list[Term], names: Names) -> list[Any]:
    return [term.value(names) for term in given]


def _numeric(x: Any) -> Any:
    """Outcomes of comparisons as 0 and 1."""
    return x.astype(float) if np.asarray(x).dtype.kind == "b" else x


def _combine(how: Callable[[Any, Any], Any], a: Any, b: Any) -> Any:
    """Arithmetic and comparisons as of floating-point numbers: a division by 0 gives infinity, and no number grows without limit."""
    a, b = _numeric(a), _numeric(b)
    if isinstance(a, int | float) and isinstance(b, int | float):
        a, b = np.float64(a), np.float64(b)
    return how(a, b)

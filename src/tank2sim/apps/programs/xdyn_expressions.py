"""Equations in the grammar of xdyn's manoeuvring forces: ``+ - * / ^``, brackets, and cos, sin, exp, abs, log, sqrt.

xdyn drops without a word what it cannot read, above all a sign in front of a name. So a negative is ``0 - a``. What the
grammar does not have is written with what it has, exactly: max(a, 0) is (a + abs(a))/2, the sign of a is
a/(abs(a) + 1e-200), and an angle is halved four times before its series.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import casadi as ca

from tank2sim.native.operations import FUNCTIONS, instructions

_ADD, _MUL, _POW, _ATOM = range(4)

_INLINE = 3
"""Operations up to which a term used twice is repeated and not named (project choice: v' r'^2 stays readable)."""

_TINY = "1e-200"  # Added to denominators against division by zero; beyond 1e-184 it changes no digit

_WORD = re.compile(r"[A-Za-z]\w*")

# An angle by the tangent of its 16th part: at a quarter turn the rest is 1e-13
_SERIES = "16*({0} - {0}^3/3 + {0}^5/5 - {0}^7/7 + {0}^9/9 - {0}^11/11)"

RESERVED = frozenset("X Y Z K M N t g nu rho model name commands cos sin exp abs log sqrt".split())
"""Names that xdyn has a meaning for."""

XDYN_STATES = {f"motion.{name}": f"{name}(t)" for name in "x y psi u v r phi p".split()}
"""State of a model to its spelling."""


@dataclass(frozen=True)
class XdynTerm:
    """An expression as text."""

    text: str
    level: int = _ATOM  # How tightly its last operation binds: 0 sum, 1 product, 2 power, 3 name, number or call
    weight: int = 0  # Number of operations
    opposite: XdynTerm | None = None  # If the text is ``0 - a``: a

    def within(self, level: int) -> str:
        """The text, in brackets if it binds less tightly than `level`."""
        return self.text if self.level >= level else f"({self.text})"


def number_term(value: float) -> XdynTerm:
    """A number; a negative one as ``0 - a``."""
    text = repr(abs(value)).removesuffix(".0")
    return _negative(XdynTerm(text)) if value < 0 else XdynTerm(text)


def _negative(a: XdynTerm) -> XdynTerm:
    return a.opposite or XdynTerm(f"0 - {a.within(_MUL)}", _ADD, a.weight + 1, a)


def _sum(a: XdynTerm, b: XdynTerm) -> XdynTerm:
    if "0" in (a.text, b.text):
        return b if a.text == "0" else a
    if b.opposite:
        return _difference(a, b.opposite)
    if a.opposite:
        return _difference(b, a.opposite)
    return XdynTerm(f"{a.text} + {b.text}", _ADD, a.weight + b.weight + 1)


def _difference(a: XdynTerm, b: XdynTerm) -> XdynTerm:
    if "0" in (a.text, b.text):
        return a if b.text == "0" else _negative(b)
    if b.opposite:
        return _sum(a, b.opposite)
    if a.opposite:
        return _negative(_sum(a.opposite, b))
    return XdynTerm(f"{a.text} - {b.within(_MUL)}", _ADD, a.weight + b.weight + 1)


def _product(a: XdynTerm, b: XdynTerm, mark: str = "*") -> XdynTerm:
    if a.opposite:
        return _negative(_product(a.opposite, b, mark))
    if b.opposite:
        return _negative(_product(a, b.opposite, mark))
    return XdynTerm(f"{a.within(_MUL)}{mark}{b.within(_MUL if mark == '*' else _POW)}", _MUL, a.weight + b.weight + 1)


def _quotient(a: XdynTerm, b: XdynTerm) -> XdynTerm:
    return _product(a, b, "/")


def _power(a: XdynTerm, b: XdynTerm) -> XdynTerm:
    return XdynTerm(f"{a.within(_ATOM)}^{b.within(_ATOM)}", _POW, a.weight + b.weight + 1)


def _called(function: str) -> Callable[[XdynTerm], XdynTerm]:
    return lambda a: XdynTerm(f"{function}({a.text})", _ATOM, a.weight + _INLINE + 1)


_ONE, _TWO = XdynTerm("1"), XdynTerm("2")
_UNARY: Mapping[int, Callable[[XdynTerm], XdynTerm]] = {
    ca.OP_ASSIGN: lambda a: a,
    ca.OP_NEG: _negative,
    ca.OP_SQ: lambda a: _power(a, _TWO),
    ca.OP_TWICE: lambda a: _product(_TWO, a),
    ca.OP_INV: lambda a: _quotient(_ONE, a),
    **{op: _called(FUNCTIONS[op]) for op in (ca.OP_COS, ca.OP_SIN, ca.OP_EXP, ca.OP_LOG, ca.OP_SQRT)},
    ca.OP_FABS: _called("abs"),
}
_BINARY: Mapping[int, Callable[[XdynTerm, XdynTerm], XdynTerm]] = {
    ca.OP_ADD: _sum,
    ca.OP_SUB: _difference,
    ca.OP_MUL: _product,
    ca.OP_DIV: _quotient,
    ca.OP_POW: _power,
    ca.OP_CONSTPOW: _power,
    ca.OP_AND: _product,
}
# Comparisons by the sign {0} of the difference
_COMPARED = {
    ca.OP_LT: "{0}*(1 + {0})/2",
    ca.OP_LE: "1 - {0}*({0} - 1)/2",
    ca.OP_EQ: "1 - {0}^2",
    ca.OP_NE: "{0}^2",
}
_TRUTHS = (*_COMPARED, ca.OP_NOT, ca.OP_AND, ca.OP_OR)  # Operations whose value is 0 or 1


@dataclass
class Definitions:
    """Named expressions in an order in which each uses only those before it."""

    taken: set[str] = field(default_factory=lambda: set(RESERVED))  # Names that are in use
    texts: dict[str, str] = field(default_factory=dict)  # Name to expression

    def new_name(self, wanted: str) -> str:
        """A name of letters, digits and underscores that resembles `wanted` and is not in use, which it then is."""
        stem = re.sub(r"\W+", "_", wanted.removeprefix("derivatives.").removeprefix("mmg."), flags=re.ASCII).strip("_")
        stem = stem if stem[:1].isalpha() else f"n_{stem}"
        name, count = stem, 1
        while name in self.taken:
            count += 1
            name = f"{stem}_{count}"
        self.taken.add(name)
        return name

    def define(self, wanted: str, term: XdynTerm) -> XdynTerm:
        """The term under a name of its own."""
        name = self.new_name(wanted)
        self.texts[name] = term.text
        return XdynTerm(name)

    def used_by(self, names: Iterable[str]) -> set[str]:
        """All words in the expressions of these names, and in the expressions of their words."""
        found: set[str] = set()
        waiting = list(names)
        while waiting:
            name = waiting.pop()
            if name not in found:
                found.add(name)
                waiting += _WORD.findall(self.texts.get(name, ""))
        return found

    def _named(self, stem: str, term: XdynTerm) -> XdynTerm:
        return term if term.level == _ATOM and term.weight == 0 else self.define(stem, term)

    def _sign(self, stem: str, a: XdynTerm) -> XdynTerm:
        """-1, 0 or 1."""
        a = self._named(stem, a)
        return self.define(f"{stem}_sign", XdynTerm(f"{a.text}/(abs({a.text}) + {_TINY})"))

    def _angle(self, stem: str, y: XdynTerm, x: XdynTerm) -> XdynTerm:
        """atan2(y, x), whose quarter turns about the axis of x are halved four times before their series."""
        ahead = x.text == "1" or (x.level == _ATOM and x.text.startswith("sqrt("))
        y, x = self._named(stem, y), self._named(stem, x)
        size = x.text if ahead else f"abs({x.text})"
        half = XdynTerm(f"{y.text}/(sqrt({x.text}^2 + {y.text}^2) + {size} + {_TINY})")
        tangent = self.define(f"{stem}_tan2", half).text
        for part in (4, 8, 16):
            tangent = self.define(f"{stem}_tan{part}", XdynTerm(f"{tangent}/(1 + sqrt(1 + {tangent}^2))")).text
        angle = XdynTerm(_SERIES.format(tangent), _MUL, 12)
        if ahead:
            return angle
        acute, across, along = self.define(stem, angle).text, self._sign(stem, y).text, self._sign(stem, x).text
        astern = f"{along}*({along} - 1)/2"
        turned = f"{math.pi!r}*(1 - {across}*({across} - 1)) - 2*{acute}"
        return XdynTerm(f"{acute} + {astern}*({turned})", _ADD, 12)

    def _extreme(self, stem: str, a: XdynTerm, b: XdynTerm, mark: str) -> XdynTerm:
        """The greater (`mark` +) or lesser (-) of two."""
        if a.text == "0":
            a, b = b, a
        a, b = self._named(stem, a), self._named(stem, b)
        between = a if b.text == "0" else XdynTerm(f"{a.text} - {b.text}", _ADD)
        both = a.text if b.text == "0" else f"{a.text} + {b.text}"
        return XdynTerm(f"({both} {mark} abs({between.text}))/2", _MUL, _INLINE + 3)

    def _truth(self, stem: str, a: XdynTerm, *, truth: bool) -> XdynTerm:
        """0 or 1, as `a` is if it is a `truth`."""
        return a if truth else _power(self._sign(stem, a), _TWO)

    def _arc(self, stem: str, a: XdynTerm, op: int) -> XdynTerm:
        """asin(a) or acos(a)."""
        a = self._named(stem, a)
        other = XdynTerm(f"sqrt(1 - {a.text}^2)", _ATOM, _INLINE + 1)
        return self._angle(stem, *((a, other) if op == ca.OP_ASIN else (other, a)))

    def _tan(self, stem: str, a: XdynTerm) -> XdynTerm:
        a = self._named(stem, a)
        return XdynTerm(f"sin({a.text})/cos({a.text})", _MUL, _INLINE + 1)

    def _tanh(self, stem: str, a: XdynTerm) -> XdynTerm:
        a = self._named(stem, a)
        fallen = self.define(stem, XdynTerm(f"exp(0 - 2*abs({a.text}))")).text
        return _product(self._sign(stem, a), XdynTerm(f"(1 - {fallen})/(1 + {fallen})", _MUL, _INLINE + 1))

    def _composed(self, op: int, stem: str, a: XdynTerm, b: XdynTerm, *, truth: bool) -> XdynTerm:
        """An operation that the grammar does not have; `truth` where a is 0 or 1."""
        if op in _COMPARED:
            sign = self._sign(stem, _difference(b, a)).text
            return self.define(stem, XdynTerm(_COMPARED[op].format(sign)))
        forms: Mapping[int, Callable[[], XdynTerm]] = {
            ca.OP_FMAX: lambda: self._extreme(stem, a, b, "+"),
            ca.OP_FMIN: lambda: self._extreme(stem, a, b, "-"),
            ca.OP_SIGN: lambda: self._sign(stem, a),
            ca.OP_NOT: lambda: _difference(_ONE, self._truth(stem, a, truth=truth)),
            ca.OP_OR: lambda: _difference(_sum(a, b), _product(a, b)),
            ca.OP_IF_ELSE_ZERO: lambda: _product(self._truth(stem, a, truth=truth), b),
            ca.OP_ATAN2: lambda: self._angle(stem, a, b),
            ca.OP_ATAN: lambda: self._angle(stem, a, _ONE),
            ca.OP_ASIN: lambda: self._arc(stem, a, op),
            ca.OP_ACOS: lambda: self._arc(stem, a, op),
            ca.OP_TAN: lambda: self._tan(stem, a),
            ca.OP_TANH: lambda: self._tanh(stem, a),
        }
        if op not in forms:
            raise ValueError(f"operation {op} of CasADi has no spelling in xdyn")
        return forms[op]()

    def add(
        self, symbols: Sequence[ca.SX], spelt: Sequence[str], wanted: Mapping[str, ca.SX], numbers: Mapping[str, float]
    ) -> None:
        """Define expressions of `symbols`, which are spelt `spelt`; parts that are used often get names, too.

        `wanted`: Name to expression; each may hold symbols that are spelt as a name before it; `numbers`: Spelling of
        constants to their value: longer terms of these alone become numbers.

        Raises ValueError: An operation has no spelling in xdyn.
        """
        function = ca.Function("f", [ca.vcat(symbols)], list(wanted.values()), {"cse": True})
        nodes, names = _nodes(function), list(wanted)
        self.taken.update(wanted)
        uses = Counter(source for node in nodes for source in node.sources)
        outputs = {node.sources[0]: names[node.output] for node in reversed(nodes) if node.op == ca.OP_OUTPUT}
        terms: list[XdynTerm] = []
        constant: list[bool] = []
        for k, node in enumerate(nodes):
            stem, into = names[node.output], [terms[source] for source in node.sources]
            fixed = all(constant[source] for source in node.sources)
            if node.op == ca.OP_OUTPUT:
                (term,) = into
                self.texts.setdefault(stem, term.text)
            elif node.op == ca.OP_INPUT:
                term = XdynTerm(spelt[node.place])
                fixed = term.text in numbers
            elif node.op == ca.OP_CONST:
                term = number_term(node.constant)
            else:
                before = len(self.texts)
                term = self._operation(nodes, k, stem, into)
                if fixed:
                    term = self._folded(term, before, numbers)
                elif k in outputs:
                    self.texts[outputs[k]] = term.text
                    term = XdynTerm(outputs[k])
                elif uses[k] > 1 and term.weight > _INLINE:
                    term = self.define(stem, term)
            terms.append(term)
            constant.append(fixed)

    def _operation(self, nodes: Sequence[_Node], k: int, stem: str, into: Sequence[XdynTerm]) -> XdynTerm:
        op, sources = nodes[k].op, nodes[k].sources
        if op in _UNARY:
            return _UNARY[op](into[0])
        if op in _BINARY:
            return _BINARY[op](*into)
        condition, last = nodes[sources[0]], nodes[sources[-1]]
        if op == ca.OP_IF_ELSE_ZERO and last.op == ca.OP_MUL and sources[0] in last.sources:
            return into[1]  # c*a is zero without c anyway
        return self._composed(op, stem, into[0], into[-1], truth=condition.op in _TRUTHS)

    def _folded(self, term: XdynTerm, before: int, numbers: Mapping[str, float]) -> XdynTerm:
        """A term of constants, as a number if it is long or has definitions of its own (those after `before`)."""
        parts = dict(list(self.texts.items())[before:])
        named = any(name in numbers for name in _WORD.findall(term.text))
        if named and not parts and term.weight <= _INLINE:
            return term
        for name in parts:
            del self.texts[name]
            self.taken.remove(name)
        return number_term(float(read_expressions({**parts, "folded value": term.text}, numbers)["folded value"]))


class _Node(NamedTuple):
    """An instruction of a function: its operation, its sources and the output for which it is, all by their number."""

    op: int
    sources: tuple[int, ...]
    place: int
    output: int
    constant: float


def _nodes(function: ca.Function) -> list[_Node]:
    """The instructions of a function of one vector."""
    steps = list(instructions(function))
    outputs, following = [0] * len(steps), 0
    for k in reversed(range(len(steps))):
        following = steps[k].to[0] if steps[k].operation == ca.OP_OUTPUT else following
        outputs[k] = following
    nodes: list[_Node] = []
    made: dict[int, int] = {}
    for k, (op, to, given, constant) in enumerate(steps):
        known = () if op in (ca.OP_INPUT, ca.OP_CONST) else given[:1] if op == ca.OP_OUTPUT else given
        sources = tuple(made[place] for place in known)
        if op != ca.OP_OUTPUT:
            made[to[0]] = k
        nodes.append(_Node(op, sources, given[1] if op == ca.OP_INPUT else 0, outputs[k], constant))
    return nodes


def read_expressions(texts: Mapping[str, str], known: Mapping[str, Any]) -> dict[str, ca.SX]:
    """The values of written expressions, read back: each in names of `known` or of those before it.

    `texts`: Name to expression; `known`: ``u`` and the other states to a function of time, commands and numbers to
    their symbol or value.
    """
    functions = {"cos": ca.cos, "sin": ca.sin, "exp": ca.exp, "abs": ca.fabs, "log": ca.log, "sqrt": ca.sqrt}
    values: dict[str, Any] = {"__builtins__": {}, **functions, **known}
    for name, text in texts.items():
        values[name] = eval(text.replace("^", "**"), values)
    return {name: ca.SX(values[name]) for name in texts}

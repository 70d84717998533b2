"""Bounds of numbers that a user gives, stated once for functions of the API and options of the command line."""

from __future__ import annotations

import builtins
import functools
import inspect
import math
import os
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, ClassVar, Literal, ParamSpec, TypeVar, Union, get_args, get_origin

from tank2sim.errors import ArgumentError, close_name

_P = ParamSpec("_P")
_T = TypeVar("_T")


@dataclass(frozen=True)
class ArgumentBounds:
    """Lowest and highest value of a number; without one there is none.

    Parameters
    ----------
    low, high : float, optional
    above : bool
        The lowest value itself is out of bounds.
    whole : bool
        It is a whole number.
    """

    low: float | None = None
    high: float | None = None
    above: bool = False
    whole: bool = False

    __is_annotated_types_grouped_metadata__: ClassVar[Literal[True]] = True

    def __iter__(self) -> Iterator[object]:
        """The same bounds as pydantic takes them, so that a key of a file may have the type of an argument."""
        from annotated_types import Ge, Gt, Le

        if self.low is not None:
            yield Gt(self.low) if self.above else Ge(self.low)
        if self.high is not None:
            yield Le(self.high)

    @property
    def words(self) -> str:
        """The expected value in words: ``a number above 0``."""
        kind = "a whole number" if self.whole else "a finite number"
        lowest = "" if self.low is None else f" above {self.low:g}" if self.above else f" from {self.low:,.10g}"
        highest = "" if self.high is None else f" up to {self.high:,.10g}"
        return f"{kind}{lowest}{highest}"

    def hold(self, number: float) -> bool:
        """Whether a number is finite and within the bounds."""
        low, high = self.low, self.high
        too_low = low is not None and (number <= low if self.above else number < low)
        return not too_low and (high is None or number <= high) and _finite(number)

    def checked(self, name: str, value: object) -> float | int:
        """The number as Python has it; numbers of NumPy are taken, text, truth values and arrays are not.

        Raises
        ------
        InputError
            It is not such a number.
        """
        number: Any = value
        if hasattr(number, "dtype") and not number.shape:  # a number of NumPy
            number = number.item()
        if isinstance(number, float) and self.whole and number.is_integer():
            number = int(number)
        if not isinstance(number, int if self.whole else int | float) or isinstance(number, bool):
            raise ArgumentError(name, "", f"is {_short(value)}", f"give {self.words}")
        assert isinstance(number, int | float)
        if not self.hold(number):
            raise ArgumentError(name, "", f"is {_short(value)}", f"give {self.words}")
        return number


def _finite(number: float) -> bool:
    try:
        return math.isfinite(number)
    except OverflowError:  # an integer beyond all floats
        return False


def _short(value: object) -> str:
    """A value in a few words."""
    if isinstance(value, int | float | str) or value is None:
        text = "an integer of many digits" if isinstance(value, int) and abs(value) >= 10**20 else repr(value)
    else:
        text = f"of the type {type(value).__name__}"
    return text if len(text) <= 60 else f"{text[:57]}..."


# What a number is, in the annotations of functions; its unit is in the parameter's name.
NumberArgument = Annotated[float, ArgumentBounds()]
PositiveArgument = Annotated[float, ArgumentBounds(0, above=True)]
NonNegativeArgument = Annotated[float, ArgumentBounds(0)]
AngleArgument = Annotated[float, ArgumentBounds(-360, 360)]
TuningRange = Annotated[float, ArgumentBounds(0, 100, above=True)]
"""Standard errors."""
Percent = Annotated[float, ArgumentBounds(0, 1000)]
PositivePercent = Annotated[float, ArgumentBounds(0, 1000, above=True)]
Scatter = Annotated[float, ArgumentBounds(0, 10, above=True)]
DrawsArgument = Annotated[int, ArgumentBounds(0, 1000, whole=True)]
Seed = Annotated[int, ArgumentBounds(0, whole=True)]
MOST_EFFECTS = 4
"""Effects that a search names at most. Project choice: a day of trials rarely determines more parameters."""
Effects = Annotated[int, ArgumentBounds(1, MOST_EFFECTS, whole=True)]
FalseDiscovery = Annotated[float, ArgumentBounds(0.01, 0.5)]
"""Probability with which an effect that is named alone may be wrong: from the one that even the surest name has
(:data:`tank2sim.gap.search.decision.SUREST`) to a guess."""
FALSE_DISCOVERY = 0.2
"""That probability where none is given. Project choice: a name that is wrong more often than once in five is given with
what else it could be."""
Count = Annotated[int, ArgumentBounds(1, whole=True)]
ENSEMBLE = ArgumentBounds(0, 10_000_000, whole=True)
"""Ships of an ensemble. Project choice: a day of computing."""
EnsembleSize = Annotated[int, ENSEMBLE]
SmallEnsemble = Annotated[int, ArgumentBounds(0, 100_000, whole=True)]
"""Ships that are each simulated on trials. Project choice: a day of computing."""
PROCESSES = "processes"
"""Executor: processes of this machine."""
VALIDATION_MEMBERS = 40
"""Ships of an ensemble for deviations of figures: their deviation has an uncertainty of about 15 %. Project choice."""
REQUIRED_PERCENT = 20.0
"""Default U_reqd in per cent of the measured figure: project choice."""
DEFAULT_MEMBERS = 2000
"""Size of an ensemble where none is given: the share below a quantile of 5 % is known to 0.5 %. Project choice."""
GuessedShips = Annotated[int, ArgumentBounds(100, 1_000_000, whole=True)]
DrawsOfChain = Annotated[int, ArgumentBounds(10, 1_000_000, whole=True)]


def bounds_of(kind: Any) -> ArgumentBounds | None:
    """The bounds of a type of this module; None if it has none.

    Parameters
    ----------
    kind : type
        ``AngleArgument``, for example.
    """
    return next((part for part in get_args(kind) if isinstance(part, ArgumentBounds)), None)


def range_of(kind: Any) -> tuple[float, float]:
    """Lowest and highest value of a type of :mod:`tank2sim.quantities`, for example ``WindSpeed``.

    Raises
    ------
    ValueError
        It is not bounded on both sides.
    """
    bounds = bounds_of(kind)
    if bounds is None or bounds.low is None or bounds.high is None:
        raise ValueError(f"{kind} is not bounded")
    return bounds.low, bounds.high


def checked(function: Callable[_P, _T]) -> Callable[_P, _T]:
    """A function whose arguments are checked by their annotations: what they are, and the bounds of numbers.

    An annotation with a name that is known to type checkers alone is not checked.

    Raises
    ------
    InputError
        When it is called with something else; it names the argument.
    """
    signature = inspect.signature(function)

    @functools.cache
    def kinds() -> dict[str, Any]:
        return {name: annotated_kind(one.annotation, function) for name, one in signature.parameters.items()}

    @functools.wraps(function)
    def call(*args: _P.args, **options: _P.kwargs) -> _T:
        bound = signature.bind(*args, **options)
        for name, value in bound.arguments.items():
            bound.arguments[name] = _as_kind(name, value, kinds()[name])
        return function(*bound.args, **bound.kwargs)

    return call


def refuse_set(function: Callable[..., Any], given: Mapping[str, Any], problem: str, *, taken: Collection[str]) -> None:
    """Raise ArgumentError for an argument of a function, none of `taken`, that differs from its default.

    Parameters
    ----------
    function : callable
    given : mapping
        Value of each of its arguments.
    problem : str
        Why it is refused.
    taken : collection of str
        Arguments that may have any value.
    """
    for name, one in inspect.signature(function).parameters.items():
        value = tuple(given[name]) if isinstance(given[name], list) else given[name]
        if name not in taken and value != one.default:
            raise ArgumentError(name, "", problem, "leave it out")


def chosen_names(argument: str, given: str | Sequence[str], known: Iterable[str]) -> tuple[str, ...]:
    """The `known` names that are given, in their order.

    Parameters
    ----------
    argument : str
        For messages.
    given : str or sequence of str
        Names, with commas between them in a text; ``"none"`` gives an empty list.
    known : iterable of str

    Raises
    ------
    InputError
        A name is unknown or repeated.
    """
    text, names = given if isinstance(given, str) else ",".join(given), tuple(known)
    words = [word for word in map(str.strip, text.split(",")) if word not in ("", "none")]
    for word in words:
        if word not in names or words.count(word) > 1:
            remedy = f"take any of {', '.join(names)}, once each"
            raise ArgumentError(argument, "", f"{word!r} is unknown, or is repeated", remedy)
    return tuple(name for name in names if name in words)


def numbers_in(text: str, counts: Collection[int] = ()) -> list[float]:
    """Finite numbers of a `text` with commas; none unless all are such, and as many as one of the `counts`."""
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        return []
    fits = not counts or len(numbers) in counts
    return numbers if fits and all(map(math.isfinite, numbers)) else []


class UnknownType(type):
    """A type that only type checkers know, with whatever members it has."""

    def __getattr__(cls, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return UnknownType(name, (), {})

    def __getitem__(cls, parts: Any) -> Any:
        return cls


class _Names(dict[str, Any]):
    def __missing__(self, name: str) -> Any:
        return UnknownType(name, (), {})


def annotated_kind(annotation: object, function: Callable[..., Any]) -> Any:
    """The type that an annotation of a function names; what only type checkers know is an :class:`UnknownType`.

    Parameters
    ----------
    annotation : object
    function : callable
    """
    if not isinstance(annotation, str):
        return Any if annotation is inspect.Parameter.empty else annotation
    names = vars(builtins) | globals() | inspect.unwrap(function).__globals__
    return eval(annotation, {}, _Names(names))


def _as_kind(name: str, value: Any, kind: Any) -> Any:
    """A value as its kind has it. Raises InputError, which names it, if it is of another kind."""
    if get_origin(kind) in (Union, UnionType):
        faults = []
        for part in get_args(kind):
            try:
                return _as_kind(name, value, part)
            except ArgumentError as fault:
                faults.append(fault)
        chosen = sorted(faults, key=lambda each: (not each.place, not each.remedy.startswith("give a")))[0]
        words = list(dict.fromkeys(_in_words(kind)))
        several = chosen.remedy.startswith("give a") and len(words) > 1
        remedy = f"give {', '.join(words[:-1])} or {words[-1]}" if several else chosen.remedy
        raise ArgumentError(chosen.source, chosen.place, chosen.problem, remedy)
    if get_origin(kind) is Annotated:
        bounds = bounds_of(kind)
        return _as_kind(name, value, get_args(kind)[0]) if bounds is None else bounds.checked(name, value)
    origin, parts = get_origin(kind) or kind, get_args(kind)
    if origin is Literal:
        if not isinstance(value, str | int) or value not in parts:
            known = [str(part) for part in parts]
            remedy = close_name(value, known) if isinstance(value, str) else f"known are: {', '.join(known)}"
            raise ArgumentError(name, "", f"is {_short(value)}", remedy)
        return value
    if origin is float:
        return ArgumentBounds().checked(name, value)
    if not _is_a(value, origin):
        raise ArgumentError(name, "", f"is {_short(value)}", f"give {' or '.join(_in_words(kind))}")
    if origin is Sequence and parts and isinstance(value, list | tuple):
        return type(value)(_item(name, place, item, parts[0]) for place, item in enumerate(value))
    if origin is Mapping and parts:
        keys, items = parts
        return {_as_kind(name, key, keys): _as_kind(f"{name}: {key}", item, items) for key, item in value.items()}
    return value


def _item(name: str, place: int, value: Any, kind: Any) -> Any:
    """An item of a list as its kind has it; a fault says which item."""
    try:
        return _as_kind(name, value, kind)
    except ArgumentError as fault:
        raise ArgumentError(name, fault.place or f"[{place}]", fault.problem, fault.remedy) from None


_WORDS = {
    **{"str": "a text", "Path": "a path", "Mapping": "a mapping", "Sequence": "a list", "NoneType": "nothing"},
    **{"float": "a number", "int": "a whole number", "Array": "an array"},
}
"""Words for types in messages."""


def _in_words(kind: Any) -> list[str]:
    """A kind in words: ``a text``, ``a path``, ``a DataFrame``."""
    if get_origin(kind) in (Union, UnionType):
        parts = [part for part in get_args(kind) if part is not type(None)]
        single = [word for part in parts if get_origin(part) is not Sequence for word in _in_words(part)]
        return [*single, *["a list of them" if single else "a list"][: len(parts) - len(single)]]
    if get_origin(kind) is Annotated:
        bounds = bounds_of(kind)
        return _in_words(get_args(kind)[0]) if bounds is None else ["a whole number" if bounds.whole else "a number"]
    called = getattr(get_origin(kind) or kind, "__name__", str(kind))
    return [_WORDS.get(called, f"{'an' if called[0] in 'AEIOU' else 'a'} {called}")]


def _is_a(value: Any, kind: Any) -> bool:
    """Whether a value is of a kind; of one that cannot be asked for, everything is."""
    if isinstance(kind, UnknownType):
        return not isinstance(value, int | float | str | bytes | list | tuple | dict | None)
    if kind is Path:
        return isinstance(value, os.PathLike)
    if kind is Sequence:  # arrays, series, views and sets do as well; a data frame would be the names of its columns
        return isinstance(value, Iterable) and not isinstance(value, str | bytes) and not hasattr(value, "columns")
    if kind is None:
        return value is None
    try:
        return isinstance(value, kind)
    except TypeError:
        return True

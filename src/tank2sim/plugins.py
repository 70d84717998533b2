"""Effects, commands, kinds of cards, readers and structures of apps and other packages, found by entry points.

Each kind has a :class:`Registry`: a mapping from name to value that holds the built-in values and, read once when it is
first used, values from installed packages. An entry point has the name of its value::

    [project.entry-points."tank2sim.effects"]
    bow_thruster = "my_package:BOW_THRUSTER"

A package that is faulty gives a :class:`PluginWarning` of one line where all values are listed, and an
:class:`~tank2sim.errors.InputError` with the same words where its value is asked for.
"""

from __future__ import annotations

import difflib
import functools
import importlib
import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any, ParamSpec, Protocol, TypeVar

from tank2sim.errors import InputError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

REMEDY = "repair the package or uninstall it"

_NAME = re.compile(r"[a-z][a-z0-9_]*(\.[a-z][a-z0-9_]*)?")

P = ParamSpec("P")
R = TypeVar("R")


class PluginWarning(UserWarning):
    """A value of another package cannot be used; the text is one line."""


class NamedValue(Protocol):
    """An entry of a registry: a frozen dataclass with a name."""

    @property
    def name(self) -> str:
        """Name under which it is found."""


_Value = TypeVar("_Value", bound=NamedValue)


@dataclass(frozen=True)
class Origin:
    """Where a value of another package is from.

    Parameters
    ----------
    distribution : str
        Name and version of the installed package.
    place : str
        The entry point: its group and name.
    """

    distribution: str
    place: str

    def fault(self, problem: str, remedy: str = REMEDY) -> InputError:
        """The error that names distribution and entry point."""
        return InputError(self.distribution, self.place, problem, remedy)

    def guarded(self, function: Callable[P, R]) -> Callable[P, R]:
        """The function, with whatever it raises turned into an InputError that names the package."""

        @functools.wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> R:
            try:
                return function(*args, **kwargs)
            except InputError:
                raise
            except Exception as error:
                raise self.fault(f"failed: {_in_short(error)}") from error

        return call


def _no_fault(value: Any) -> str:
    return ""


def _itself(value: Any) -> Any:
    return value


class Registry(Mapping[str, _Value]):
    """Built-in values and values from installed packages, by name, the built-in ones first.

    Parameters
    ----------
    group : str
        Of the entry points, ``tank2sim.effects``.
    builtin : iterable or mapping
        Values in their order, or ``module:attribute`` by name, which is loaded when its value is asked for.
    kind : type
        What an entry point must give: a frozen dataclass. What its functions raise, in the value itself and in the
        parts that its tuples hold, is turned into an InputError that names the package.
    reserved : iterable of str
        Names that no package may take, in addition to the names in `builtin`.
    fault : callable, optional
        ``fault(value) -> str``: what is wrong with the value of a package, "" if nothing.
    value_of : callable, optional
        Converts a loaded entry point to a value; by default it is the value.

    Notes
    -----
    ``registry[name]`` and ``registry.get(name)`` raise InputError for an entry point that cannot be used. Iteration and
    ``in`` pass over it; the first of them gives a :class:`PluginWarning`.
    """

    def __init__(
        self,
        group: str,
        builtin: Iterable[_Value] | Mapping[str, str],
        kind: type[_Value],
        *,
        reserved: Iterable[str] = (),
        fault: Callable[[_Value], str] = _no_fault,
        value_of: Callable[[Any], Any] = _itself,
    ):
        self.group, self.kind, self.fault, self.value_of = group, kind, fault, value_of
        self._builtin: dict[str, _Value | str] = (
            dict(builtin) if isinstance(builtin, Mapping) else {value.name: value for value in builtin}
        )
        self.reserved = frozenset(reserved) | set(self._builtin)
        self._origins: dict[str, Origin] = {}
        self._found: Mapping[str, _Value | InputError] | None = None
        self._warned: set[str] = set()

    def __getitem__(self, name: str) -> _Value:
        if name not in self._builtin:
            self._warned.add(name)  # the error says it
            plugins = self._plugins()
            if name not in self._builtin:
                found = plugins[name]
                if isinstance(found, InputError):
                    raise found
                return found
        value = self._builtin[name]
        if isinstance(value, str):
            module, _, attribute = value.partition(":")
            value = self._builtin[name] = self.value_of(getattr(importlib.import_module(module), attribute))
        return value

    def __contains__(self, name: object) -> bool:
        return name in self._builtin or any(name == each for each in self)

    def __iter__(self) -> Iterator[str]:
        plugins = self._plugins()
        yield from self._builtin
        yield from (name for name, found in plugins.items() if not isinstance(found, InputError))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def names(self) -> tuple[str, ...]:
        """All names, also of entry points that cannot be used: asking for such a value says why."""
        plugins = self._plugins()
        return (*self._builtin, *(name for name in plugins if name not in self.reserved))

    def remedy(self, name: str) -> str:
        """Remedy for an unknown name: the nearest one, or the list of all."""
        if close := difflib.get_close_matches(name, self, n=1):
            return f"did you mean {close[0]}?"
        return f"known are: {', '.join(self)}; or install the package that has it"

    def origin(self, name: str) -> Origin | None:
        """The package that a value is from; None if it is built in."""
        return None if name in self._builtin else self._origins.get(name)

    def _plugins(self) -> Mapping[str, _Value | InputError]:
        """Values of packages by name, or why they cannot be used; values of tank2sim's own apps become built in."""
        if self._found is None:
            found: dict[str, _Value | InputError] = {}
            entries = list(entry_points(self.group))
            self._builtin |= {entry.name: entry.value for entry in entries if _is_own(entry)}
            self.reserved |= set(self._builtin)
            for entry in (entry for entry in entries if not _is_own(entry)):
                distribution = f"{entry.dist.name} {entry.dist.version}" if entry.dist else "an unknown package"
                origin = Origin(distribution, f"entry point {self.group}: {entry.name}")
                other = self._origins.setdefault(entry.name, origin)
                if entry.name in self.reserved:
                    found[entry.name] = origin.fault("its name is built in, and that one is used", "give it another")
                elif other != origin:
                    problem = f"{other.distribution} has an entry point of this name, too"
                    found[entry.name] = origin.fault(problem, "uninstall one of the two")
                elif entry.name not in found:  # a package may be found twice on the path
                    found[entry.name] = self._loaded(entry, origin)
            self._found = found
        for name, each in self._found.items():
            if isinstance(each, InputError) and name not in self._warned:
                self._warned.add(name)
                warnings.warn(str(each), PluginWarning, stacklevel=3)
        return self._found

    def _loaded(self, entry: EntryPoint, origin: Origin) -> _Value | InputError:
        try:
            value = self.value_of(entry.load())
        except Exception as error:
            return origin.fault(f"cannot be loaded: {_in_short(error)}")
        kind = f"tank2sim {self.kind.__name__}"
        if not isinstance(value, self.kind):
            return origin.fault(f"gives a {type(value).__name__}, and a {kind} was expected")
        if value.name != entry.name or not _NAME.fullmatch(entry.name):
            remedy = "give both the same name, of small letters, digits and _"
            return origin.fault(f"gives a {kind} with the name {value.name!r}", remedy)
        try:
            problem = self.fault(value)
        except Exception as error:
            problem = _in_short(error)
        return origin.fault(f"gives a faulty {kind}: {problem}") if problem else _guarded(value, origin)


def _is_own(entry: EntryPoint) -> bool:
    """Whether an entry point is one of tank2sim's own apps."""
    return entry.value.startswith("tank2sim.")


def entry_points(group: str) -> Iterable[EntryPoint]:
    """Entry points of installed packages."""
    from importlib import metadata  # takes as long as all of the rest: not for a command that asks for no plugin

    return metadata.entry_points(group=group)


def _guarded(value: Any, origin: Origin) -> Any:
    """A value whose functions, and the functions of values in it, are :meth:`Origin.guarded`."""
    if isinstance(value, type):
        return value
    if isinstance(value, tuple):
        return tuple(_guarded(each, origin) for each in value)
    if is_dataclass(value) and not isinstance(value, type):
        return replace(value, **{each.name: _guarded(getattr(value, each.name), origin) for each in fields(value)})
    return origin.guarded(value) if callable(value) else value


def _in_short(error: BaseException) -> str:
    """Kind and text of an error, in one line."""
    return " ".join(f"{type(error).__name__}: {error}".split())

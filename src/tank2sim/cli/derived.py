"""The command of a verb: arguments, options, bounds, choices and help from its signature and its docstring."""

from __future__ import annotations

import inspect
import os
import re
import sys
import types
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import click
from click.core import ParameterSource
from docstring_parser import Docstring, DocstringStyle, parse

from tank2sim import arguments
from tank2sim.api.commands import variants_of
from tank2sim.api.verbs import Output, Verb, Written
from tank2sim.errors import InputError
from tank2sim.escaping import one_line
from tank2sim.files import JSON, PAGE, PICTURE, STANDARD_OUTPUT, folder_made, refuse_doubled, refuse_other_ending
from tank2sim.units import in_words


class OutputFile(click.Path):
    """A file to be written, whose name ends as files of its kind do (:mod:`tank2sim.files`); a folder has no ending."""

    def __init__(self, endings: Sequence[str] | None, **more: Any) -> None:
        super().__init__(path_type=Path, **more)
        self.endings = endings

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """As of any parameter. Raises InputError if the name ends as files of another kind do."""
        path = Path(os.fsdecode(super().convert(value, param, ctx)))
        if self.endings == JSON and str(path) == "-":
            return STANDARD_OUTPUT
        if self.endings is not None:
            refuse_other_ending(path, self.endings)
        return path


class VerbCommand(click.Command):
    """A command whose options that take several words take all up to the next option: ``--holdout A B -o C``."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Give each of the words an option of its own, as click has it."""
        several = {name for one in self.params if isinstance(one, click.Option) and one.multiple for name in one.opts}
        spread: list[str] = []
        taking = ""
        for word, following in pairwise([*args, "-"]):
            if word in several and following.startswith("-") and not _numbers(following):
                raise click.UsageError(f"{word} is followed by nothing", ctx)
            numbers = _numbers(word)
            if word.startswith("-") and not numbers:
                taking = word if word in several else ""
                spread += [] if taking else [word]
            elif taking:
                spread += [part for value in numbers or [word] for part in (taking, value)]
            else:
                spread.append(word)
        return super().parse_args(ctx, spread)


def _numbers(word: str) -> list[str]:
    """The numbers of a word like ``25,-30``; empty if it is anything else."""
    parts = word.split(",")
    try:
        list(map(float, parts))
    except ValueError:
        return []
    return parts


def command_of(verb: Verb) -> click.Command:
    """Return the command of a verb."""
    others = variants_of(verb)
    own, takers = _parameters_of_variants(verb, others)
    documented, _ = _documented(verb.function)
    usual = f"By default CARD is {verb.default_ship}." if verb.default_ship else ""
    text = "\n\n".join(filter(None, (documented.short_description, documented.long_description, usual)))
    if inspect.signature(verb.function).return_annotation == "str":
        return VerbCommand(verb.name, params=[*own.values()], callback=lambda **given: _print(verb, given), help=text)
    switches = [
        _option([f"--{flag}"], is_flag=True, help=f"Instead: {other.words}.")
        for flag, other in others.items()
        if not other.takes and not _argument_of(flag, other)
    ]

    def run(**given: Any) -> int:
        first = next(iter(own), "")
        chosen = next((flag for flag, other in others.items() if _is_chosen(flag, other, given, first)), "")
        for named, flags in takers.items():
            if chosen not in flags and named != first and _was_given(named):
                problem = (
                    f"does not go with {_either([chosen], others)}" if chosen else f"needs {_either(flags, others)}"
                )
                raise InputError(own[named].opts[0], "", problem, "leave it out" if chosen else "add it")
        if (called := others.get(chosen, verb)).takes:
            given[next(iter(inspect.signature(called.function).parameters))] = given[first]
        return _run(called, given)

    drawn = any(one.charts for one in (verb, *others.values()))
    params = [*own.values(), *switches, *_shared_options(verb, own.values(), drawn)]
    return VerbCommand(verb.name, params=params, callback=run, help=text)


def _parameters_of_variants(
    verb: Verb, others: Mapping[str, Verb]
) -> tuple[dict[str, click.Parameter], dict[str, list[str]]]:
    """Arguments and options of a verb and its variants by name, and the variants that take each ("" is the verb)."""
    own: dict[str, click.Parameter] = {}
    takers: dict[str, list[str]] = {}
    for flag, each in {"": verb, **others}.items():
        for parameter in _own_parameters(each):
            if isinstance(parameter, click.Option) or not (flag and each.takes):
                own.setdefault(parameter.name or "", parameter)
                takers.setdefault(parameter.name or "", []).append(flag)
    for named, flags in takers.items():
        parameter = own[named]
        if "" not in flags and isinstance(parameter, click.Option):
            parameter.required = False
            if needed := [flag for flag in flags if f"--{flag}" not in parameter.opts]:
                parameter.help = f"{parameter.help} [only with {_either(needed, others)}]"
    return own, takers


def _shared_options(verb: Verb, own: Iterable[click.Parameter], drawn: bool) -> list[click.Option]:
    """The options of every command that shows a result; -o is the page where a command writes no file of its own.

    `drawn`: whether a result may have charts, for --plot.
    """
    plot = _option(["--plot"], type=OutputFile(PICTURE), metavar="FILE|DIR", help="Draw the main chart (.png, .svg, "
                   ".pdf), or each chart and the page into a folder.")  # fmt: skip
    main = [] if any("-o" in parameter.opts for parameter in own) else ["-o"]
    return [
        _option([*main, "--page"], type=OutputFile(PAGE), metavar="FILE.html", help="Write the page.",
                required=verb.page_required),
        *([plot] if drawn else []),
        _option(["--json"], type=OutputFile(JSON), metavar="FILE", help="Write the full result; - is standard output."),
        _option(["--quiet"], is_flag=True, help="Print doubts and errors alone."),
        _option(["--verbose"], is_flag=True, help="Print every table."),
    ]  # fmt: skip


def _own_parameters(verb: Verb) -> Iterator[click.Parameter]:
    """Arguments and options of a verb and its outputs."""
    helps = _documented(verb.function)[1]
    for one in _arguments(verb.function):
        yield from _parameters(one, helps, verb)
    for output in verb.outputs:
        yield from _output_parameters(output)


def _argument_of(flag: str, verb: Verb) -> str:
    """The argument of a variant whose option chooses it; empty if it is chosen by a flag."""
    return next((argument for argument, option in verb.options.items() if option == f"--{flag}"), "")


def _is_chosen(flag: str, verb: Verb, given: Mapping[str, Any], first: str) -> bool:
    """Whether the command line asks for a variant."""
    return verb.takes(given[first]) if verb.takes else bool(given[_argument_of(flag, verb) or flag])


def _either(flags: Sequence[str], others: Mapping[str, Verb]) -> str:
    """Variants in words: ``--tune or --through``."""
    kinds = [f"a {flag.replace('_', ' ')}" if others[flag].takes else f"--{flag}" for flag in flags]
    return " or ".join(kinds)


def _was_given(name: str) -> bool:
    context = click.get_current_context()
    on_line = context.get_parameter_source(name) is ParameterSource.COMMANDLINE
    return on_line and context.params[name] not in (None, ())


def _documented(function: Callable[..., Any]) -> tuple[Docstring, dict[str, str]]:
    """The docstring of a function, and the description of each parameter in plain text."""
    plain = re.sub(r":\w+:`[.~]?(?:[\w.]+\.)?(\w+)`|``?", lambda found: found[1] or "", function.__doc__ or "")
    documented = parse(plain, style=DocstringStyle.NUMPYDOC)
    words = {one.arg_name: " ".join((one.description or "").split()) for one in documented.params}
    return documented, {name.strip(): text for names, text in words.items() for name in names.split(",")}


def _arguments(function: Callable[..., Any]) -> Iterator[tuple[inspect.Parameter, Any]]:
    """Parameters of a function with their types, None left out; progress reports are given by the command line."""
    for one in inspect.signature(function).parameters.values():
        if one.annotation != "Progress":
            yield one, arguments.annotated_kind(one.annotation, function)


def _parts(kind: Any) -> list[Any]:
    """The alternatives of a type, without None."""
    parts = get_args(kind) if get_origin(kind) in (Union, types.UnionType) else (kind,)
    return [part for part in parts if part is not type(None)]


def _several(kind: Any) -> Any:
    """The sequence among the alternatives of a type that takes several words; None without one."""
    parts = _parts(kind)
    words = any(one in parts for one in (str, Path, float, int))
    sequences = [part for part in parts if get_origin(part) is Sequence]
    return next((one for one in sequences if not words or {str, Path} & set(_parts(get_args(one)[0]))), None)


def _first_list(function: Callable[..., Any]) -> str:
    """The first positional argument of a function that takes several words; empty without one."""
    lists = (
        one.name
        for one, kind in _arguments(function)
        if one.kind is not one.KEYWORD_ONLY and _several(kind) is not None
    )
    return next(lists, "")


def _is_of(name: str, kind: Any) -> bool:
    return any(getattr(part, "__name__", "") == name for part in _parts(kind))


def _parameters(argument: tuple[inspect.Parameter, Any], helps: Mapping[str, str], verb: Verb) -> list[click.Parameter]:
    """The argument or the options of one parameter of a verb."""
    one, kind = argument
    if _is_of("Vessel", kind):
        return _vessel_parameters(one, helps.get(one.name, ""), verb)
    if written := _written(kind):
        return [_written_option(one, written, helps.get(one.name, ""))]
    by_position = one.kind is not one.KEYWORD_ONLY and one.name not in verb.options
    required, several = one.default is one.empty, _several(kind)
    if by_position and (required or one.name == _first_list(verb.function)):
        return [click.Argument([one.name], nargs=-1 if several else 1, required=required, type=_type(kind, several))]
    words = "; ".join(f"{choice}: {text}" for choice, text in verb.choices.get(one.name, {}).items())
    return [_value_option(one, kind, " ".join(filter(None, (helps.get(one.name), words))), verb)]


def _vessel_parameters(one: inspect.Parameter, words: str, verb: Verb) -> list[click.Parameter]:
    """The card of a verb, and the changes of its values; of a further card, an option."""
    required = one.default is one.empty
    if not required or one.kind is one.KEYWORD_ONLY:
        return [_option([f"--{one.name}"], metavar="CARD", required=required, help=words)]
    change = _option(["--set"], name="set", multiple=True, metavar="KEY=VALUE", help="A value in place of the "
                     "card's, by dotted key: derivatives.Yv=-0.012.")  # fmt: skip
    if usual := verb.default_ship:
        return [click.Argument([one.name], metavar="[CARD]", required=False, default=usual), change]
    return [click.Argument([one.name], metavar="CARD"), change]


def _written_option(one: inspect.Parameter, written: Written, words: str) -> click.Option:
    """The option of an argument that names a file to be written."""
    names = ["-o", "--output"] if one.name == "output" else [f"--{one.name.replace('_', '-')}"]
    usual = None if one.default is one.empty else one.default
    settings: dict[str, Any] = {"default": usual, "show_default": True}
    if not usual:
        settings = {"required": usual is None and (written.by_function or one.default is one.empty)}
    return _option(names, type=OutputFile(written.endings), metavar=written.metavar, help=words, **settings)


def _value_option(one: inspect.Parameter, kind: Any, words: str, verb: Verb) -> click.Option:
    """The option of an argument that is a flag, a choice, a number, a text, or several of these."""
    stem, unit = _stem(one.name)
    option = verb.options.get(one.name) or f"--{stem.replace('_', '-')}"
    names = list(dict.fromkeys((option, verb.options.get(one.name) or f"--{one.name.replace('_', '-')}")))
    several, read = _several(kind), one.name in verb.texts
    several = several or (read and any(get_origin(part) is Mapping for part in _parts(kind)))
    default = None if one.default is one.empty else one.default
    if several and isinstance(default, str):
        default = (default,)
    settings: dict[str, Any] = {"help": words}
    settings |= {"required": True} if one.default is one.empty else {"default": default}
    if kind is bool:
        flags = [f"{option}/--no-{option[2:]}"] if one.default else names
        return _option(flags, name=one.name, is_flag=True, **settings)
    metavar = stem.upper() if several or read else None
    if unit and not read:
        metavar = unit.upper().replace("/", "P").replace(" ", "")
    settings |= {"multiple": bool(several), "metavar": f"{metavar} ..." if several else metavar}
    if not read:
        settings |= {"type": _type(kind, several), "show_default": default not in (None, "", ())}
    return _option(names, name=one.name, **settings)


def _written(kind: Any) -> Written | None:
    """The mark of an argument that names a file to be written."""
    marks = (mark for part in _parts(kind) if get_origin(part) is Annotated for mark in get_args(part))
    return next((mark for mark in marks if isinstance(mark, Written)), None)


def _stem(name: str) -> tuple[str, str]:
    words, unit = in_words(name)
    return (words.replace(" ", "_"), unit) if unit else (name, "")


def _type(kind: Any, several: Any) -> Any:
    """The click type of a type; of a sequence, of its items."""
    parts = _parts(get_args(several)[0]) if several else _parts(kind)
    for part in parts:
        if (limits := arguments.bounds_of(part)) is not None and get_origin(part) is Annotated:
            return _number(limits)
        if get_origin(part) is Literal:
            choices = [str(choice) for choice in get_args(part)]
            return click.Choice(choices)
    if Path in parts:
        return click.Path(path_type=Path)
    return str if str in parts else next((part for part in parts if part in (int, float)), str)


class _Number(click.FloatRange):
    """A number between bounds; the message about any other text says how it is written."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        try:
            float(value)
        except ValueError:
            self.fail(f"{value!r} is not a number; write it without a unit, and with a point for decimals", param, ctx)
        return super().convert(value, param, ctx)


class _WholeNumber(click.IntRange):
    """A whole number between bounds; the message about any other text says so."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        try:
            int(value)
        except ValueError:
            self.fail(f"{value!r} is not a whole number", param, ctx)
        return super().convert(value, param, ctx)


def _number(limits: arguments.ArgumentBounds) -> Any:
    if limits == arguments.ArgumentBounds():
        return float
    if limits.whole:
        return _WholeNumber(
            None if limits.low is None else int(limits.low), None if limits.high is None else int(limits.high)
        )
    return _Number(limits.low, limits.high, min_open=limits.above)


def _option(names: Sequence[str], *, name: str = "", **settings: Any) -> click.Option:
    own = name or names[-1].lstrip("-").replace("-", "_")
    return click.Option([*names, own], **settings)


def _output_parameters(output: Output) -> list[click.Parameter]:
    """The option of an output, and options of its keyword arguments."""
    names = [output.option, "--output"] if output.option == "-o" else [output.option]
    where = _option(names, type=OutputFile(output.endings), metavar=output.metavar, help=output.help,
                    required=output.required)  # fmt: skip
    found: list[click.Parameter] = [where]
    _, helps = _documented(output.write)
    for one, kind in _arguments(output.write):
        if one.kind is inspect.Parameter.KEYWORD_ONLY:
            found += _parameters((one, kind), helps, Verb(output.write, "", ""))
    return found


def _print(verb: Verb, given: Mapping[str, Any]) -> None:
    """Call a verb whose result is a text, and print it."""
    click.echo(verb.function(**_values_for(verb.function, given, verb.texts, (), [])))


def _run(verb: Verb, given: dict[str, Any]) -> int:
    """Call a verb with what the command line gave, write its files, and print its result."""
    from tank2sim.cli.console import show_notices, show_result, write_outputs
    from tank2sim.cli.naming import in_options, options_of
    from tank2sim.cli.progress import showing_stages

    values, changes = dict(given), given.get("set", ())
    named = [_value_of(output, values) for output in verb.outputs]
    folders = [path for output, path in zip(verb.outputs, named, strict=True) if path and output.is_folder(path)]
    outputs = [path for path in (*named, values["page"], values["json"]) if path is not None and path not in folders]
    refuse_doubled(outputs)
    _refuse_unplaced(outputs, [values.get("plot"), *named])
    _refuse_idle(output for output, path in zip(verb.outputs, named, strict=True) if path is None)
    inputs: list[Path] = []
    with ExitStack() as stack:
        for folder in folders:
            stack.enter_context(folder_made(folder))
        call = _values_for(verb.function, values, verb.texts, changes, inputs)
        if "report" in inspect.signature(verb.function).parameters:
            call["report"] = stack.enter_context(showing_stages(verb.words))
        result, contents = _with_outputs(verb, verb.function(**call), values, inputs, stack)
    given_files = {name: values.get(name) for name in ("page", "plot", "json")}
    written = write_outputs(result, contents, [*inputs, *result.inputs], **given_files)
    words = partial(in_options, options=options_of(click.get_current_context().command))
    all_written = [*result.written, *written]
    show_result(result, all_written, quiet=values["quiet"], verbose=values["verbose"], words=words)
    if not values["quiet"]:
        pairs = zip(verb.outputs, named, strict=True)
        show_notices(filter(None, (one.unwritten(result) for one, path in pairs if one.unwritten and not path)))
    for fault in result.faults:
        print(f"tank2sim: {one_line(words(fault))}", file=sys.stderr)
    code: int = result.exit_code
    return code


def _with_outputs(
    verb: Verb, result: Any, values: Mapping[str, Any], inputs: list[Path], stack: ExitStack
) -> tuple[Any, dict[Path, str | bytes]]:
    """The result, or the one that an output made of it, and the contents of the files that were asked for."""
    from tank2sim.cli.progress import showing_stages

    contents: dict[Path, str | bytes] = {}
    marks = (_written(kind) for _, kind in _arguments(verb.function))
    if any(mark and not mark.by_function for mark in marks):
        contents |= result.files
    for output in verb.outputs:
        if (path := _value_of(output, values)) is None:
            continue
        own = {one.name for one, _ in _arguments(output.write) if one.kind is inspect.Parameter.KEYWORD_ONLY}
        options = _values_for(output.write, {name: values[name] for name in own}, {}, (), inputs)
        if "report" in inspect.signature(output.write).parameters:
            options["report"] = stack.enter_context(showing_stages("writing"))
        made = output.write(result, path, **options)
        if not isinstance(made, Mapping):
            result, made = made, made.files
        refuse_doubled([*contents, *made])
        contents |= made
    return result, contents


def _refuse_unplaced(outputs: Iterable[Path], made: Sequence[Path | None]) -> None:
    """Refuse, before work that takes long, files in folders that neither exist nor are `made` with the outputs."""
    for path in outputs:
        if not path.parent.is_dir() and path.parent not in made:
            raise InputError(path, "", "cannot be written: its folder does not exist", "give one that exists")


def _refuse_idle(outputs: Iterable[Output]) -> None:
    """Refuse options of files that are not written."""
    for output in outputs:
        for option in _output_parameters(output)[1:]:
            if _was_given(option.name or ""):
                raise InputError(option.opts[0], "", f"needs {output.option}", "add it")


def _value_of(output: Output, values: Mapping[str, Any]) -> Path | None:
    """Where an output goes, if it was asked for."""
    name = "output" if output.option == "-o" else output.option.lstrip("-").replace("-", "_")
    path: Path | None = values.get(name)
    return path


def _values_for(
    function: Callable[..., Any],
    values: Mapping[str, Any],
    texts: Mapping[str, Callable[[Any], Any]],
    changes: Sequence[str],
    inputs: list[Path],
) -> dict[str, Any]:
    """The arguments of a function from the options; files that are read are added to `inputs`."""
    call: dict[str, Any] = {}
    for one, kind in _arguments(function):
        if one.name not in values or (value := values[one.name]) is None or value == ():
            continue
        if _is_of("Vessel", kind):
            value = _vessel(value, changes if one.default is one.empty else ())
            inputs.append(Path(value.card.source))
        elif one.name in texts:
            value = texts[one.name](value)
        elif _literal(kind):
            value = next(choice for choice in _literal(kind) if str(choice) == value)
        if not _written(kind):
            inputs += [path for path in (value if isinstance(value, tuple) else (value,)) if isinstance(path, Path)]
        call[one.name] = value
    return call


def _vessel(card: Path | str, changes: Sequence[str]) -> Any:
    """The vessel of a card with values changed on the command line."""
    from tank2sim.cards import read_card
    from tank2sim.cli.overrides import parse_changes
    from tank2sim.dynamics.vessel import Vessel

    return Vessel(read_card(card, parse_changes(changes)))


def _literal(kind: Any) -> tuple[Any, ...]:
    return next((get_args(part) for part in _parts(kind) if get_origin(part) is Literal), ())

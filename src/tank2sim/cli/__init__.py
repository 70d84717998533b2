"""The command line, whose commands are derived from functions of the API.

Every command ends 0 (done), 1 (`check` only: it failed) or 2 (bad input: one line on the error stream).
"""

from __future__ import annotations

import contextlib
import errno
import os
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import click

from tank2sim import __version__
from tank2sim.api.commands import VERBS
from tank2sim.errors import ArgumentError, InputError, close_name
from tank2sim.escaping import one_line
from tank2sim.memory import keep_freed_memory
from tank2sim.plugins import PluginWarning

GROUPS = {
    "Measure": ("design", "log", "run", "reduce", "tow", "yaw", "audit", "signals"),
    "Identify": ("identify", "gap", "guess", "validate", "compare", "trials"),
    "Study": ("simulate", "stability", "autopilot", "influence", "glide"),
    "Export": ("convert", "convention", "export", "check", "serve"),
    "Show": ("ships", "poster", "pilotcard", "steer", "report", "open", "demo"),
}
"""Commands by what people do; other packages' come last."""

COMMANDS = tuple(name for names in GROUPS.values() for name in names)
"""Names of the commands of tank2sim."""


def _groups() -> dict[str, list[tuple[str, str]]]:
    """Commands with a few words each, by group."""
    groups = {title: [(name, VERBS[name].words) for name in names] for title, names in GROUPS.items()}
    if others := [(name, verb.words) for name, verb in VERBS.items() if name not in COMMANDS]:
        groups["Of other packages"] = others
    return groups


class _Commands(click.Group):
    """Commands are imported when they are called, so that ``tank2sim ships`` does not wait for CasADi."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return [name for commands in _groups().values() for name, _ in commands]

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        width = max(map(len, self.list_commands(ctx)))
        for title, commands in _groups().items():
            with formatter.section(title):
                formatter.write_dl([(name.ljust(width), words) for name, words in commands])

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in VERBS.names():
            return None
        from tank2sim.cli.derived import command_of

        return command_of(VERBS[cmd_name])

    def invoke(self, ctx: click.Context) -> Any:
        """As of any group; arguments of the API are called by the options that set them."""
        try:
            return super().invoke(ctx)
        except InputError as fault:
            if (command := self.get_command(ctx, ctx.invoked_subcommand or "")) is None:
                raise
            raise _in_options(fault, command) from None

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and not args[0].startswith("-") and args[0] not in (known := VERBS.names()):
            remedy = close_name(args[0], known)
            raise click.UsageError(f"{args[0]!r} is not a command; {remedy}", ctx)
        return super().resolve_command(ctx, args)


def _in_options(fault: InputError, command: click.Command) -> InputError:
    """A fault with options in place of arguments; place and problem of a file name columns and keys, and stay."""
    from tank2sim.cli.naming import in_options, options_of

    options = options_of(command)
    source, problem = fault.source, fault.problem
    if isinstance(fault, ArgumentError):
        source, problem = _option_of(command, source), in_options(problem, options)
    return InputError(source, fault.place, problem, in_options(fault.remedy, options))


def _option_of(command: click.Command, argument: str) -> str:
    """The option of a command that sets an argument, whose name may have a unit: ``--duration`` of ``duration_s``."""
    named = [(name, param.opts[0]) for param in command.params for name in _names(param)]
    found = [(name, option) for name, option in named if argument == name or argument.startswith(f"{name}_")]
    return max(found, key=lambda pair: len(pair[0]), default=("", argument))[1]


def _names(param: click.Parameter) -> list[str]:
    """Names of a parameter as arguments have them."""
    return [param.name or "", *(option.lstrip("-").replace("-", "_").lower() for option in param.opts)]


@click.group(
    cls=_Commands,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
)
@click.version_option(__version__, prog_name="tank2sim")
@click.pass_context
def tank2sim(ctx: click.Context) -> None:
    """From what a towing tank or a sea trial measured to a verified ship model inside a simulator."""
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())


def main() -> None:
    """Entry point of ``tank2sim``: runs a command and ends the process with its exit code."""
    _open_closed_streams()
    keep_freed_memory()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # as Ctrl-C, so that nothing is left half-written
    with warnings.catch_warnings():
        warnings.showwarning = partial(_show_warning, warnings.showwarning)
        code = _run()
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        _silence()
    except OSError as error:
        code = code or _unwritable(error)
        _silence()
    sys.exit(code)


def _open_closed_streams() -> None:
    """Give a process that was started without standard streams (``>&-``) ones that go nowhere.

    The next file that it opened would else be standard output, and what is printed would be written into it.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            nowhere = os.open(os.devnull, os.O_RDWR)
            if nowhere != number:
                os.dup2(nowhere, number)
                os.close(nowhere)
            setattr(sys, name, os.fdopen(number, "w" if number else "r", encoding="utf-8"))


def _run() -> int:
    try:
        result = tank2sim.main(prog_name="tank2sim", standalone_mode=False)
    except InputError as error:
        return _refuse(str(error))
    except click.UsageError as error:
        where = error.ctx.command_path if error.ctx else "tank2sim"
        return _refuse(f"{error.format_message().rstrip('.')}; see {where} --help")
    except click.ClickException as error:
        return _refuse(error.format_message())
    except (click.Abort, KeyboardInterrupt):
        return _refuse("interrupted; nothing is left half-written", code=130)
    except BrokenPipeError:
        return 0
    except SystemExit as error:
        # No command exits by itself: click and rich do, with 1, when the reader of the output has gone away.
        if error.code == 1:
            return 0
        raise
    except Exception as error:
        if isinstance(error, OSError) and error.errno == errno.ENOSPC:
            return _unwritable(error)
        with tempfile.NamedTemporaryFile("w", prefix="tank2sim-", suffix=".log", delete=False) as log:
            traceback.print_exc(file=log)
        message = " ".join(str(error).split())[:200]
        return _refuse(
            f"a fault of the program, not of yours: {type(error).__name__}: {message}; please report {Path(log.name)}"
        )
    return result if isinstance(result, int) else 0


def _show_warning(usual: Callable[..., None], message: Warning | str, category: type[Warning], *more: Any) -> None:
    """Show a warning of a faulty plugin as one line, any other as usual."""
    if issubclass(category, PluginWarning):
        print(f"tank2sim: warning: {message}", file=sys.stderr)
    else:
        usual(message, category, *more)


def _silence() -> None:
    """Let what standard output still holds go nowhere: the interpreter would fail at it on its way out."""
    with contextlib.suppress(OSError, ValueError):
        output = sys.stdout.fileno()
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, output)
        os.close(nowhere)


def _unwritable(error: OSError) -> int:
    place = error.filename or "the output"
    return _refuse(f"{place} cannot be written ({error.strerror}); make room, or send the output elsewhere")


def _refuse(message: str, code: int = 2) -> int:
    with contextlib.suppress(OSError):  # the error stream may be full or closed: the exit code still says it
        print(f"tank2sim: {one_line(message)}", file=sys.stderr)
    return code

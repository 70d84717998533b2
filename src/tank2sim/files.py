"""Files are written whole or not at all."""

from __future__ import annotations

import json
import math
import os
import re
import stat
import sys
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tank2sim.errors import InputError

STANDARD_OUTPUT = Path("-")
"""This very object as a target of :func:`write_together` is standard output; any other path called - is refused."""

BYTE_ORDER_MARK = "\ufeff"
"""Byte order mark that some editors put before UTF-8 text."""


def write_whole(path: Path, content: str | bytes, *, inputs: Iterable[Path] = ()) -> None:
    """Write a file so that a reader sees the old content or the complete new one, never a part.

    Raises
    ------
    InputError
        As :func:`write_together`.
    """
    write_together({path: content}, inputs=inputs)


def write_together(
    contents: Mapping[Path, str | bytes], *, inputs: Iterable[Path] = (), outputs: Iterable[Path | None] = ()
) -> None:
    """Write several files, all or none: first all as temporary files next to their targets, then all are renamed.

    A link keeps pointing where it does, and its target is replaced; what is not a regular file (a device, a pipe)
    cannot be replaced and is written to.

    Parameters
    ----------
    contents : mapping
        Path to the file that is to be there.
    inputs : paths, optional
        Files that were read, which must not be overwritten; those that do not exist are passed over.
    outputs : paths, optional
        The outputs as the user gave them, None for those left out: a mapping cannot show that one was given twice.

    Raises
    ------
    InputError
        One of the targets is an input, is given twice or is a folder, or its folder is missing or cannot be written,
        or its name ends like a file of another kind; then nothing has been written.
    """
    targets = [_target(path if isinstance(path, Path) else Path(path)) for path in contents]
    _refuse_doubled(targets)
    refuse_doubled(outputs)
    _refuse_inputs(targets, [Path(path) for path in inputs])
    ready: list[tuple[Path, _Target]] = []
    direct: list[tuple[bytes, _Target]] = []
    try:
        for target, content in zip(targets, contents.values(), strict=True):
            data = content.encode("utf-8") if isinstance(content, str) else content
            if target.replaceable:
                refuse_other_ending(target.given, _endings_of(data))
            if target.replaceable:
                ready.append((_temporary(target, data), target))
            else:
                direct.append((data, target))
        for data, target in direct:
            with _as_input_error(target.given):
                if target.given is STANDARD_OUTPUT:
                    sys.stdout.write(data.decode("utf-8"))
                    continue
                with target.path.open("wb") as stream:
                    stream.write(data)
        for temporary, target in ready:
            with _as_input_error(target.given):
                temporary.replace(target.path)
    finally:
        for temporary, _ in ready:
            temporary.unlink(missing_ok=True)


def refuse_doubled(outputs: Iterable[Path | None]) -> None:
    """Refuse outputs (None: not written) if two are the same file; called before long work.

    Raises
    ------
    InputError
        One is given twice or is a folder.
    """
    _refuse_doubled([_target(path) for path in outputs if path is not None])


@dataclass(frozen=True)
class _Target:
    """Where a file is written: the name given, the path behind its links, and whether a file can be renamed to it."""

    given: Path
    path: Path
    replaceable: bool


def _target(given: Path) -> _Target:
    if given is STANDARD_OUTPUT:
        if sys.__stdout__ is None:  # the process was started without one
            raise InputError(given, "", "is standard output, which is closed", "give --json the name of a file")
        return _Target(given, given, False)
    if given.name == "-" and given.parent == Path():
        raise InputError(given, "", "is not the name of a file", "only --json writes to standard output")
    with _as_input_error(given):
        try:
            mode = given.stat().st_mode
        except FileNotFoundError:
            return _Target(given, _without_links(given), True)
        if stat.S_ISDIR(mode):
            raise InputError(given, "", "is a folder, and a file is to be written there", "give the name of a file")
        # The links of /dev/stdout lead to no path when it is a pipe: what is not a regular file keeps its name.
        regular = stat.S_ISREG(mode)
        return _Target(given, _without_links(given) if regular else given, regular)


def _without_links(path: Path) -> Path:
    return Path(os.path.realpath(path))


def _refuse_doubled(targets: Sequence[_Target]) -> None:
    seen: set[Path] = set()
    for target in targets:
        if target.replaceable and target.path in seen:
            raise InputError(target.given, "", "is given for two outputs", "give each a file of its own")
        seen.add(target.path)


def _refuse_inputs(targets: Sequence[_Target], inputs: Sequence[Path]) -> None:
    for target in targets:
        for path in inputs:
            if target.replaceable and _same(target.path, path):
                remedy = "give the output another name"
                raise InputError(target.given, "", f"is an input ({path}), which would be overwritten", remedy)


def _same(first: Path, second: Path) -> bool:
    try:
        return os.path.samefile(first, second)
    except OSError:
        return False  # one of them does not exist


@contextmanager
def _as_input_error(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        remedy = "choose a folder that exists and that you may write to"
        raise InputError(path, "", f"cannot be written ({error.strerror})", remedy) from None


def _temporary(target: _Target, data: bytes) -> Path:
    temporary = None
    with _as_input_error(target.given):
        try:
            # Not named after the target: its name may already be as long as the file system allows.
            handle, name = tempfile.mkstemp(prefix=".tank2sim-", dir=target.path.parent)
            temporary = Path(name)
            with os.fdopen(handle, "wb") as stream:
                stream.write(data)
            os.chmod(temporary, 0o666 & ~_umask())
        except OSError:
            if temporary is not None:
                temporary.unlink(missing_ok=True)
            raise
    return temporary


def read_bytes(path: str | Path) -> bytes:
    """Content of a file or pipe.

    Raises
    ------
    InputError
        It is a folder, or a device, which may have no end.
    OSError
        It cannot be read.
    """
    refuse_device(Path(path))
    refuse_folder(Path(path))
    return Path(path).read_bytes()


def first_bytes(path: Path, size: int) -> bytes:
    """The first bytes of a file, `size` at most.

    Raises
    ------
    InputError
        The file is missing or cannot be read.
    """
    try:
        with path.open("rb") as file:
            return file.read(size)
    except FileNotFoundError:
        raise InputError(path, "", "the file does not exist", "check the name") from None
    except OSError as error:
        raise InputError(path, "", f"cannot be read ({error.strerror})", "check the name and its permissions") from None


def refuse_device(path: Path) -> None:
    """Raise InputError if a path is a device, which may have no end."""
    if path.is_char_device() or path.is_block_device():
        raise InputError(path, "", "is a device and may have no end", "give a file")


def refuse_folder(path: Path) -> None:
    """Raise InputError if a path is a folder."""
    if path.is_dir():
        raise InputError(path, "", "is a folder, and a file was expected", "give the file in it")


def refuse_missing(path: Path) -> None:
    """Raise InputError if no file has this name, or a folder has it."""
    refuse_folder(path)
    if not path.exists():
        raise InputError(path, "", "the file does not exist", "check the name")


def read_text(path: Path) -> str:
    """Text of a UTF-8 file; a byte order mark is dropped, and every line ends in a line feed.

    Raises
    ------
    InputError
        The file is missing, unreadable, or not UTF-8.
    """
    return read_exact_text(path).removeprefix(BYTE_ORDER_MARK).replace("\r\n", "\n").replace("\r", "\n")


def read_exact_text(path: Path) -> str:
    """Text of a UTF-8 file unchanged, which encodes to the same bytes again. Raises as :func:`read_text`."""
    try:
        return read_all_bytes(path).decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(path, f"byte {error.start}", "is not UTF-8 text", "save it as UTF-8") from None


def read_all_bytes(path: Path) -> bytes:
    """Content of a file or pipe.

    Raises
    ------
    InputError
        It is missing or unreadable.
    """
    try:
        return read_bytes(path)
    except FileNotFoundError:
        raise InputError(path, "", "the file does not exist", "check the name") from None
    except OSError as error:
        raise InputError(path, "", f"cannot be read ({error.strerror})", "check the name and its permissions") from None


_DEEPEST = 100
"""Lists and objects within each other that a file may have. Project choice: ten times as deep as any result, a tenth of
what ends a recursion."""


def refuse_deep(content: object, source: Path | str) -> None:
    """Refuse a document whose lists and objects are nested so deeply that no function can go through it.

    Raises
    ------
    InputError
        It is nested more than :data:`_DEEPEST` deep.
    """
    level = [content]
    for _ in range(_DEEPEST):
        inner = [each.values() if isinstance(each, dict) else each for each in level if isinstance(each, dict | list)]
        if not inner:
            return
        level = [item for items in inner for item in items]
    raise InputError(source, "", f"is nested more than {_DEEPEST} deep", "write it without so many brackets")


def parsed_json(text: str, source: Path | str, remedy: str) -> Any:
    """The content of a JSON text that a user gave; `remedy` says what to give.

    Raises
    ------
    InputError
        It is not JSON, is nested too deeply, or holds what no page or file can: half of a character.
    """
    try:
        content = json.loads(text)
        refuse_deep(content, source)
        json.dumps(content, ensure_ascii=False).encode()
    except json.JSONDecodeError as error:
        raise InputError(source, f"line {error.lineno}", f"is not JSON ({error.msg})", remedy) from None
    except UnicodeEncodeError:
        problem = "holds half of a character (a lone surrogate, \\ud800 to \\udfff)"
        raise InputError(source, "", problem, remedy) from None
    except RecursionError:
        raise InputError(source, "", "is nested too deeply", remedy) from None
    except ValueError:
        raise InputError(source, "", "is not JSON: an integer has thousands of digits", remedy) from None
    return content


@contextmanager
def named_in(source: Path | str, file: Path) -> Iterator[None]:
    """While a file is read because another one, `source`, names it: a refusal does not quote a foreign file.

    Who writes a campaign or a card may name any file of this machine; what is in one outside the folder of `source` is
    not shown. The message has the name and the line.

    Raises
    ------
    InputError
        As raised within, without what it quotes if the file is foreign; or the file is a device or a pipe.
    """
    if file.exists() and not file.is_file():
        raise InputError(file, "", f"is not a file, and {source} names it", "name a file")
    try:
        yield
    except InputError as fault:
        if file.resolve().is_relative_to(Path(source).parent.resolve()) or not file.is_file():
            raise
        line = re.match(r"line \d+", fault.place)
        problem = f"cannot be used; it is outside the folder of {source}, which names it, and is not quoted here"
        remedy = "put a copy into that folder to see what is wrong with it"
        raise InputError(file, line[0] if line else "", problem, remedy) from None


def writable_folder(path: Path) -> Path:
    """Make a folder (and its parents) if need be, and make sure that files can be put there.

    Raises
    ------
    InputError
        It cannot be made or written.
    """
    path = Path(path)
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            pass
    except OSError as error:
        raise InputError(
            path, "", f"is not a folder that can be written ({error.strerror})", "choose another with -o"
        ) from None
    return path


@contextmanager
def folder_made(path: Path) -> Iterator[None]:
    """A folder for outputs, made before the long work that fills it, and removed if that fails.

    Raises
    ------
    InputError
        It cannot be made or written.
    """
    made = not path.exists()
    writable_folder(path)
    try:
        yield
    except BaseException:
        if made:
            with suppress(OSError):
                path.rmdir()
        raise


def _umask() -> int:
    value = os.umask(0)
    os.umask(value)
    return value


PAGE, PICTURE, CARD, TABLE, JSON = (".html", ".htm"), (".png", ".svg", ".pdf"), (".toml",), (".csv", ".txt"), (".json",)
FMU, SYSTEM, MATLAB, PYTHON, MODEL = (".fmu",), (".ssp",), (".m",), (".py",), (".sdf", ".xml", ".world")
"""How the names of files of each kind end. Any other ending, and none, is taken for any kind."""

_TEXTS = {*CARD, *TABLE, *MATLAB, *PYTHON, *MODEL}
_ENDINGS = {
    *PAGE,
    *PICTURE,
    *JSON,
    *FMU,
    *SYSTEM,
    *_TEXTS,
    ".zip",
    ".xlsx",
    ".jpg",
    ".jpeg",
    ".gif",
    ".tif",
    ".tiff",
    ".bmp",
    ".eps",
    ".ps",
}
_ENDINGS |= {".parquet", ".feather", ".h5", ".hdf5", ".mat", ".xls", ".ods", ".gz", ".docx", ".md"}
_BEGINNINGS: tuple[tuple[bytes, tuple[str, ...]], ...] = (
    (rb"\x89PNG", (".png",)),
    (rb"%PDF-", (".pdf",)),
    (rb"<svg", (".svg",)),
    (rb"PK\x03\x04", (*FMU, *SYSTEM, ".zip")),
    (rb"(?i)<!doctype html", PAGE),
    (rb"\{", JSON),
    (rb"<", (*MODEL, *PAGE, ".svg")),
    (rb"function \[", MATLAB),
    (rb'"""', PYTHON),
    (rb"""(?:[^\n]*\n)*?format = ["']tank2sim-""", CARD),
    (rb"# [^\n]*\n\n", (".md", *sorted(_TEXTS))),
)
"""How contents begin, and how the names of their files end."""


def names_folder(path: Path) -> bool:
    """Whether a name, of a file or of a folder, is a folder's: it has no ending, or the folder exists."""
    return not path.suffix or path.is_dir()


def refuse_other_ending(path: Path, endings: Iterable[str]) -> None:
    """Refuse a name that ends as files of another kind do.

    Raises
    ------
    InputError
        It ends like a known kind of file, and none of `endings`; those that are possible are named.
    """
    ending, possible = path.suffix.lower(), list(endings)
    if ending in _ENDINGS and ending not in possible:
        remedy = f"let its name end in {' or '.join(possible)}" if possible else "give the name of a folder"
        raise InputError(path, "", f"ends in {ending}, and something else is written there", remedy)


def _endings_of(content: bytes) -> Iterable[str]:
    """Endings of the names of files with this content."""
    head = content[:4096].removeprefix(BYTE_ORDER_MARK.encode()).lstrip()
    return next((endings for begins, endings in _BEGINNINGS if re.match(begins, head)), sorted(_TEXTS))


SCHEMA_VERSION = 1
"""Version of the JSON of all results: it grows when a key is removed or changes its meaning. Project choice."""


def schema_name(command: str) -> str:
    """Return the name of the schema of a command's JSON, its ``schema``: ``tank2sim/simulate/1``."""
    return f"tank2sim/{command}/{SCHEMA_VERSION}"


def schema_command(schema: object) -> str | None:
    """Return the command whose JSON has a schema; None if this version does not know the schema."""
    package, _, remaining = str(schema).partition("/")
    command, _, version = remaining.partition("/")
    return command if (package, version) == ("tank2sim", str(SCHEMA_VERSION)) and command else None


def json_text(values: Mapping[str, object]) -> str:
    """Return the text of a JSON file with these values (:func:`plain_json`)."""
    return json.dumps(plain_json(values), indent=1, ensure_ascii=False) + "\n"


def plain_json(value: Any) -> Any:
    """A result as JSON holds it: arrays become lists, and what is not a finite number becomes None."""
    match value:
        case Mapping():
            return {str(key): plain_json(item) for key, item in value.items()}
        case _ if hasattr(value, "tolist"):  # arrays and numbers of NumPy
            return plain_json(value.tolist())
        case list() | tuple():
            return [plain_json(item) for item in value]
        case float():
            return value if math.isfinite(value) else None
        case Path():
            return str(value)
        case _:
            return value

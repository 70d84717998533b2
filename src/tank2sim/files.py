"""Files are written whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from pathlib import Path

from tank2sim.errors import InputError


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file so that a reader sees the old content or the complete new one, never a part.

    Raises
    ------
    InputError
        The folder is missing, or cannot be written.
    """
    write_together({path: content})


def write_together(contents: Mapping[Path, str | bytes]) -> None:
    """Write several files, all or none: first all as temporary files beside their targets, then all are renamed.

    Raises
    ------
    InputError
        One of the folders is missing or cannot be written; then nothing has been written.
    """
    ready: list[tuple[Path, Path]] = []
    try:
        for path, content in contents.items():
            ready.append((_temporary(Path(path), content), Path(path)))
        for temporary, path in ready:
            temporary.replace(path)
    finally:
        for temporary, _ in ready:
            temporary.unlink(missing_ok=True)


def _temporary(path: Path, content: str | bytes) -> Path:
    if path.is_dir():
        raise InputError(path, "", "is a folder, and a file is to be written there", "give the name of a file")
    data = content.encode("utf-8") if isinstance(content, str) else content
    temporary = None
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
        temporary = Path(name)
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
        os.chmod(temporary, 0o666 & ~_umask())
    except OSError as error:
        if temporary is not None:
            temporary.unlink(missing_ok=True)
        remedy = "choose a folder that exists and that you may write to"
        raise InputError(path, "", f"cannot be written ({error.strerror})", remedy) from None
    return temporary


def read_text(path: Path) -> str:
    """Text of a UTF-8 file (a byte order mark is dropped).

    Raises
    ------
    InputError
        The file is missing, unreadable, or not UTF-8.
    """
    try:
        return Path(path).read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise InputError(path, "", "there is no such file", "check the name") from None
    except UnicodeDecodeError as error:
        raise InputError(path, f"byte {error.start}", "is not UTF-8 text", "save it as UTF-8") from None
    except OSError as error:
        raise InputError(path, "", f"cannot be read ({error.strerror})", "check the name and its permissions") from None


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
            path, "", f"is no folder that can be written ({error.strerror})", "choose another with -o"
        ) from None
    return path


def _umask() -> int:
    value = os.umask(0)
    os.umask(value)
    return value

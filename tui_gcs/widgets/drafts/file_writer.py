"""Where an edited file may be saved, and writing it so that a crash leaves either the old file or the new one."""

import os
from pathlib import Path

import tui_gcs
from tui_gcs.core.base.file_replacement import replace_file

PACKAGE = Path(tui_gcs.__file__).resolve().parent


class SaveError(Exception):
    """A file was not saved: one line with the file and the reason."""


def why_not_own(path: str) -> str:
    """Return why a working copy cannot be saved to its own file `path`; "" if it can."""
    if not path:
        return "it has no file yet"
    file = Path(path).expanduser()
    if not file.is_absolute():
        return f"{path} is no full path"
    if PACKAGE in file.resolve().parents:
        return "the shipped scenario stays as it is"
    if not file.is_file():
        return f"{path} is not there any more"
    if not os.access(file, os.W_OK) or not os.access(file.resolve().parent, os.W_OK):
        return f"{path} is not writable"
    return ""


def suggested(path: str) -> str:
    """Return a path to suggest where the old one cannot be used."""
    return str(Path.cwd() / (Path(path).name or "scenario.toml"))


def destination(typed: str) -> Path:
    """Return the file that an operator typed.

    Raises:     SaveError: it cannot be a file of the operator.
    """
    if not typed.strip():
        raise SaveError("type a path, or Esc")
    if "\0" in typed:
        raise SaveError("a path has no NUL character")
    try:
        path = Path(typed.strip()).expanduser().absolute()
        real = path.resolve()
        if PACKAGE in real.parents:
            raise SaveError("inside the installed package: choose another place")
        if real.is_dir():
            raise SaveError(f"{path} is a directory")
        if real.exists() and not real.is_file():
            raise SaveError(f"{path} is no regular file")
        if not real.parent.is_dir():
            raise SaveError(f"{path.parent} is no directory")
    except (OSError, RuntimeError) as error:  # RuntimeError: no such user's home, or links in a circle
        raise SaveError(f"{typed.strip()}: {_reason(error)}") from error
    return path


def read_existing(path: Path) -> str | None:
    """Return the content of a file; None if there is none, "" if it is not text."""
    try:
        return path.read_bytes().decode("utf-8", "replace")
    except FileNotFoundError:
        return None
    except OSError:
        return ""


def write(path: Path, text: str) -> None:
    """Replace the content of a file as a whole; a link stays a link, and permissions stay.

    Raises:     SaveError: it could not be written; the old file is unchanged.
    """
    try:
        replace_file(path, text.encode("utf-8"))
    except OSError as error:
        raise SaveError(f"{path} was not written: {_reason(error)}") from error


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error)

"""Private files: readable by the operator alone, checked before they are read, replaced as a whole."""

import os
import stat
from pathlib import Path

MAX_BYTES = 1 << 20
"""Larger files are not read: key files are far smaller."""


class KeyStoreError(Exception):
    """Keys cannot be read, written or used; one line with what, why and what to do, and no secret."""


def make_private(directory: Path) -> None:
    """Make a directory with mode 0700 if it is missing, and check it. Raises KeyStoreError."""
    try:
        directory.mkdir(parents=True, exist_ok=True, mode=0o700)
    except OSError as error:
        raise KeyStoreError(f"{directory}: cannot be made ({error.strerror})") from None
    check_private(directory)


def check_private(directory: Path) -> None:
    """Raise KeyStoreError unless this is a directory that only we can read."""
    try:
        info = directory.lstat()
    except OSError as error:
        raise KeyStoreError(f"{directory}: {error.strerror}") from None
    if not stat.S_ISDIR(info.st_mode):
        raise KeyStoreError(f"{directory}: is not a directory (a link?); move it away")
    _check_owner(directory, info, 0o700)


def read_private(path: Path) -> bytes | None:
    """Return the bytes of a file that only we can read; None if there is none. Raises KeyStoreError."""
    try:
        # No link is followed and no pipe waited for; the checks below are made on the open file, not on its name.
        handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    except FileNotFoundError:
        return None
    except OSError as error:
        why = "is a link; put the file itself there" if path.is_symlink() else error.strerror
        raise KeyStoreError(f"{path}: {why}") from None
    with os.fdopen(handle, "rb") as file:
        info = os.fstat(file.fileno())
        if not stat.S_ISREG(info.st_mode):
            raise KeyStoreError(f"{path}: is not a file; move it away")
        _check_owner(path, info, 0o600)
        if info.st_size > MAX_BYTES:
            raise KeyStoreError(f"{path}: {info.st_size} bytes, at most {MAX_BYTES} are read; move it away")
        try:
            return file.read(MAX_BYTES)
        except OSError as error:
            raise KeyStoreError(f"{path}: {error.strerror}") from None


def write_private(path: Path, data: bytes, *, sync: bool = True) -> None:
    """Replace a file as a whole, mode 0600; with `sync` it is on the disk afterwards. Raises KeyStoreError."""
    new = path.with_name(path.name + ".new")
    try:
        # A crash may have left it. It is made anew with O_EXCL, so that no planted link is written through.
        new.unlink(missing_ok=True)
        handle = os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
        with os.fdopen(handle, "wb") as file:
            file.write(data)
            file.flush()
            if sync:
                os.fsync(file.fileno())
        new.replace(path)
        if sync:
            # The rename itself is on the disk only once the directory is.
            _sync_directory(path.parent)
    except OSError as error:
        raise KeyStoreError(f"{path}: cannot be written ({error.strerror})") from None


def _sync_directory(directory: Path) -> None:
    handle = os.open(directory, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _check_owner(path: Path, info: os.stat_result, mode: int) -> None:
    if info.st_uid != os.geteuid():
        raise KeyStoreError(f"{path}: belongs to another user (uid {info.st_uid}); keys must be your own")
    if stat.S_IMODE(info.st_mode) & 0o077:
        raise KeyStoreError(
            f"{path}: open to others (mode {stat.S_IMODE(info.st_mode):04o}), its keys may be known to them; "
            f"replace the keys, or if nobody else has read them: chmod {mode:o} {path}"
        )

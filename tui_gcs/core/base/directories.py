"""Directories of a station of each kind. SIM and LIVE never share a directory, a socket or a lock.

Runtime (socket, lock, this run's configuration): `$TUI_GCS_RUNTIME_DIR`, else `$XDG_RUNTIME_DIR/tui-gcs`, else a
directory of our own in the system's temporary directory. State (logs): `$TUI_GCS_STATE_DIR`, else
`$XDG_STATE_HOME/tui-gcs`, else `~/.local/state/tui-gcs`.

No other user may be able to rename or replace them: a station that finds no key store takes unsigned frames.
"""

import fcntl
import grp
import os
import pwd
import stat
import tempfile
from pathlib import Path
from typing import IO

from tui_gcs.core.base.run_kind import RunKind

SOCKET_PATH_MAX = 100
"""Bytes in a Unix socket path that every system takes (104 on macOS, 108 on Linux, with room for a suffix)."""
STATE_FILE, EARLIER_STATE_FILE = "memory.json", "memory-earlier.json"
"""Files in the runtime directory: the state of the present station, and what one left that was killed with its
supervisor."""
SUPERVISOR_LOCK, STATION_LOCK = "lock", "station.lock"
"""Files in the runtime directory, held with flock for as long as the process lives."""


RUNTIME, STATE = "TUI_GCS_RUNTIME_DIR", "TUI_GCS_STATE_DIR"
"""The variables that name the directories."""


class ConfigError(Exception):
    """A directory cannot be used: one line with what, why and what to do."""


def runtime_dir(kind: RunKind) -> Path:
    """Return the 0700 directory of this kind's socket, lock and run files; it is made if missing.

    Raises:
        ConfigError: other users could change it, it is a link, cannot be written, or is too long for a socket.
    """
    named = os.environ.get(RUNTIME)
    if named:
        base = Path(named)
    elif os.environ.get("XDG_RUNTIME_DIR"):
        base = Path(os.environ["XDG_RUNTIME_DIR"]) / "tui-gcs"
    else:
        base = Path(tempfile.gettempdir()) / f"tui-gcs-{os.getuid()}"
    directory = base / kind.lower()
    for part in (base, directory):
        _private(part, RUNTIME)
    _check_parents(base, RUNTIME)
    if len(os.fsencode(socket_path(kind, directory))) > SOCKET_PATH_MAX:
        raise ConfigError(f"{directory}: too long for a socket; set {RUNTIME} to a shorter path")
    return directory


def socket_path(kind: RunKind, directory: Path | None = None) -> Path:
    """Return the path of the station's bus socket."""
    return (directory or runtime_dir(kind)) / "bus"


def state_dir(kind: RunKind) -> Path:
    """Return the 0700 directory of this kind's logs and keys, which is made if missing.

    Raises:
        ConfigError: other users could change it, it is a link, or cannot be written.
    """
    named = os.environ.get(STATE)
    base = Path(named) if named else Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local/state") / "tui-gcs"
    try:
        base.mkdir(parents=True, exist_ok=True, mode=0o700)
    except OSError as error:
        raise ConfigError(f"{base}: cannot be made ({error.strerror}); set {STATE}") from None
    directory = base / kind.lower()
    _private(directory, STATE)
    _check_parents(directory, STATE)
    return directory


def try_lock(lock: IO[str]) -> bool:
    """Lock an open file for this process; False if another process holds it."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _private(directory: Path, variable: str) -> None:
    """Make `directory` if it is missing, and check that it is ours alone; `variable` names another one."""
    try:
        directory.mkdir(parents=True, exist_ok=True, mode=0o700)
        # lstat: a link could lead into a directory of another user.
        info = directory.lstat()
    except OSError as error:
        raise ConfigError(f"{directory}: cannot be made ({error.strerror}); set {variable}") from None
    if not stat.S_ISDIR(info.st_mode):
        raise ConfigError(f"{directory}: is not a directory (a link?); remove it or set {variable}")
    if info.st_uid != os.getuid():
        raise ConfigError(f"{directory}: belongs to another user; set {variable} to a directory of your own")
    if not os.access(directory, os.W_OK | os.X_OK):
        raise ConfigError(f"{directory}: cannot be written; set {variable} to a directory that can")
    if stat.S_IMODE(info.st_mode) & 0o077:
        # Ours, but open to other users.
        directory.chmod(0o700)


def _check_parents(directory: Path, variable: str) -> None:
    """Raise `ConfigError` if another user could rename `directory` or one that it lies in."""
    for parent in {*directory.absolute().parents, *directory.resolve().parents}:
        info = parent.stat()
        if info.st_uid not in (0, os.getuid()):
            raise ConfigError(f"{parent}: belongs to another user, who could replace {directory}; set {variable}")
        # In a sticky directory such as /tmp only the owner of an entry renames it.
        if info.st_mode & stat.S_ISVTX:
            continue
        if info.st_mode & stat.S_IWOTH:
            raise ConfigError(
                f"{parent}: every user may write there and replace {directory}: chmod o-w it or set {variable}"
            )
        if info.st_mode & stat.S_IWGRP and not _is_private_group(info.st_gid, info.st_uid):
            raise ConfigError(
                f"{parent}: its group may write there and replace {directory}: chmod g-w it or set {variable}"
            )


def _is_private_group(group: int, user: int) -> bool:
    """Whether a group is that user's alone: it has the user's name and no other member.

    Many systems give each user such a group and a umask of 002, so that most directories of a home are group-writable.
    """
    try:
        found, owner = grp.getgrgid(group), pwd.getpwuid(user).pw_name
    except KeyError:
        return False
    return found.gr_name == owner and set(found.gr_mem) <= {owner}

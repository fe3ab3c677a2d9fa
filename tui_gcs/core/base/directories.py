"""Directories of a station of each kind. SIM and LIVE never share a directory, a socket or a lock.

Runtime (socket, lock, this run's configuration): `$TUI_GCS_RUNTIME_DIR`, else `$XDG_RUNTIME_DIR/tui-gcs`, else a
directory of our own in the system's temporary directory. State (logs): `$TUI_GCS_STATE_DIR`, else
`$XDG_STATE_HOME/tui-gcs`, else `~/.local/state/tui-gcs`.
"""

import fcntl
import os
import stat
import tempfile
from pathlib import Path
from typing import IO

from tui_gcs.core.base.run_kind import RunKind

SOCKET_PATH_MAX = 100
"""Bytes in a Unix socket path that every system takes (104 on macOS, 108 on Linux, with room for a suffix)."""
SUPERVISOR_LOCK, STATION_LOCK = "lock", "station.lock"
"""Files in the runtime directory, held with flock for as long as the process lives."""


class ConfigError(Exception):
    """A directory cannot be used: one line with what, why and what to do."""


def runtime_dir(kind: RunKind) -> Path:
    """Return the 0700 directory of this kind's socket, lock and run files; it is made if missing.

    Raises:
        ConfigError: it belongs to another user, is a link, or is too long for a socket.
    """
    named = os.environ.get("TUI_GCS_RUNTIME_DIR")
    if named:
        base = Path(named)
    elif os.environ.get("XDG_RUNTIME_DIR"):
        base = Path(os.environ["XDG_RUNTIME_DIR"]) / "tui-gcs"
    else:
        base = Path(tempfile.gettempdir()) / f"tui-gcs-{os.getuid()}"
    directory = base / kind.lower()
    for part in (base, directory):
        _private(part)
    if len(os.fsencode(socket_path(kind, directory))) > SOCKET_PATH_MAX:
        raise ConfigError(f"{directory}: too long for a socket; set TUI_GCS_RUNTIME_DIR to a shorter path")
    return directory


def socket_path(kind: RunKind, directory: Path | None = None) -> Path:
    """Return the path of the station's bus socket."""
    return (directory or runtime_dir(kind)) / "bus"


def state_dir(kind: RunKind) -> Path:
    """Return the 0700 directory of this kind's logs, which is made if missing. Raises ConfigError."""
    named = os.environ.get("TUI_GCS_STATE_DIR")
    base = Path(named) if named else Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local/state") / "tui-gcs"
    try:
        base.mkdir(parents=True, exist_ok=True, mode=0o700)
    except OSError as error:
        raise ConfigError(f"{base}: cannot be made ({error.strerror}); set TUI_GCS_STATE_DIR") from None
    directory = base / kind.lower()
    _private(directory)
    return directory


def try_lock(lock: IO[str]) -> bool:
    """Lock an open file for this process; False if another process holds it."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _private(directory: Path) -> None:
    try:
        directory.mkdir(parents=True, exist_ok=True, mode=0o700)
        # lstat: a link could lead into a directory of another user.
        info = directory.lstat()
    except OSError as error:
        raise ConfigError(f"{directory}: cannot be made ({error.strerror}); set TUI_GCS_RUNTIME_DIR") from None
    if not stat.S_ISDIR(info.st_mode):
        raise ConfigError(f"{directory}: is not a directory (a link?); remove it or set TUI_GCS_RUNTIME_DIR")
    if info.st_uid != os.getuid():
        raise ConfigError(f"{directory}: belongs to another user; set TUI_GCS_RUNTIME_DIR to a directory of your own")
    if stat.S_IMODE(info.st_mode) & 0o077:
        # Ours, but open to other users.
        directory.chmod(0o700)

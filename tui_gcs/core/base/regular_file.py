"""Regular files: opening what an operator names without waiting for a pipe or reading a device for ever."""

import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO


def open_plain(path: Path) -> BinaryIO:
    """Open a regular file for reading; returns at once, whatever is at that path.

    Raises:
        OSError: it cannot be opened, or is something else; its `strerror` is the reason in words.
        ValueError: no file can have that name.
    """
    # O_NONBLOCK: a pipe would be waited for, and a directory or device is refused below.
    file = os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb")
    mode = os.fstat(file.fileno()).st_mode
    if stat.S_ISREG(mode):
        return file
    file.close()
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    raise OSError(errno.EINVAL, "not a file")


def check_writable(path: Path) -> None:
    """Raise unless a file can be written at that path; its contents are not touched.

    Raises:
        OSError: it cannot; its `strerror` is the reason.
        ValueError: no file can have that name.
    """
    # Opening a pipe without a reader would block. /dev/stdout and /dev/fd/63 are open in this process already.
    if path.is_fifo() and path.parent.parts[:2] not in ((os.sep, "dev"), (os.sep, "proc")):
        raise OSError(errno.EINVAL, "a pipe without a reader")
    os.close(os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_NONBLOCK | os.O_CLOEXEC, 0o666))

"""Safe files: data from vehicles is written only below one directory of ours, under names that cannot lead elsewhere.

Everything is done relative to a descriptor of that directory, so that it cannot be exchanged meanwhile; nothing is
written through a link, and a download never overwrites a file (docs/threats.md B.6-88…93).
"""

import fcntl
import os
import re
import stat
import weakref
from pathlib import Path

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}")
_DEVICES = frozenset({"con", "prn", "aux", "nul", *(f"{port}{n}" for port in ("com", "lpt") for n in range(10))})
"""Device names of Windows, where a log may be copied to."""
_NEW = os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
RESERVED_BYTES = 512 << 20
"""Space on the disk that no download may take: the station writes its own logs there."""
MAX_SAME_NAMES = 1000
"""Numbered files of one name."""


class FileRefused(Exception):
    """A file cannot be read or written like this: one line with what and why."""


def safe_name(text: str) -> str | None:
    """Return the last part of a path from a vehicle if it can be a file name here; None if not."""
    base = re.split(r"[/\\]", text)[-1]
    if not _NAME.fullmatch(base) or base.endswith(".") or base.split(".")[0].lower() in _DEVICES:
        return None
    return base


class SafeFolder:
    """One 0700 directory of ours; all access goes through its descriptor."""

    def __init__(self, path: Path) -> None:
        """Open the directory, which is made if missing. Raises FileRefused."""
        self.path = path
        try:
            path.mkdir(parents=True, exist_ok=True, mode=0o700)
            self._fd = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
        except OSError as error:
            raise FileRefused(f"{path}: {error.strerror} (a link?)") from None
        self._release = weakref.finalize(self, os.close, self._fd)
        info = os.fstat(self._fd)
        if info.st_uid != os.geteuid() or info.st_mode & 0o022:
            self.close()
            raise FileRefused(f"{path}: not ours alone")

    def close(self) -> None:
        """Close the descriptor; a folder that is garbage collected closes it, too."""
        self._release()

    def __enter__(self) -> "SafeFolder":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def free_bytes(self) -> int:
        """The space that is left for us on the directory's disk."""
        found = os.fstatvfs(self._fd)
        return found.f_bavail * found.f_frsize

    def room_bytes(self) -> int:
        """The part of the free space that a download may take."""
        return max(0, self.free_bytes() - RESERVED_BYTES)

    def read(self, name: str, max_bytes: int) -> bytes | None:
        """Return the contents of a file of ours; None if there is none, or it is no regular file or too long."""
        try:
            fd = os.open(_checked(name), os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, dir_fd=self._fd)
        except OSError:
            return None
        with os.fdopen(fd, "rb") as file:
            info = os.fstat(fd)
            plain = stat.S_ISREG(info.st_mode) and info.st_uid == os.geteuid() and info.st_size <= max_bytes
            return file.read(max_bytes) if plain else None

    def replace(self, name: str, data: bytes) -> None:
        """Write a small file of ours as a whole. Raises FileRefused."""
        new = f"{_checked(name)}.new"
        try:
            self._unlink(new)
            fd = os.open(new, os.O_WRONLY | _NEW, 0o600, dir_fd=self._fd)
            with os.fdopen(fd, "wb") as file:
                file.write(data)
            os.rename(new, name, src_dir_fd=self._fd, dst_dir_fd=self._fd)
        except OSError as error:
            self._unlink(new)
            raise FileRefused(f"{name}: cannot be written ({error.strerror})") from None

    def remove(self, name: str) -> None:
        """Remove a file of ours, if it exists."""
        self._unlink(_checked(name))

    def lock(self, name: str) -> int | None:
        """Return a descriptor that holds the lock file `name` until it is closed; None if another process holds it."""
        try:
            fd = os.open(_checked(name), os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600, dir_fd=self._fd)
        except OSError:
            return None
        try:
            fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(fd)
            return None
        return fd

    def names(self) -> list[str]:
        """Return the names of regular files, the oldest first."""
        with os.scandir(self._fd) as entries:
            files = [
                (e.stat(follow_symlinks=False).st_mtime, e.name) for e in entries if e.is_file(follow_symlinks=False)
            ]
        return [name for _, name in sorted(files)]

    def part(self, name: str, *, resume: bool = False) -> "PartFile":
        """Begin to write `name`, or continue the part that exists of it. Raises FileRefused."""
        part = f"{_checked(name)}.part"
        try:
            if not resume:
                self._unlink(part, plain_only=True)
                fd = os.open(part, os.O_RDWR | _NEW, 0o600, dir_fd=self._fd)
            else:
                fd = os.open(part, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, dir_fd=self._fd)
        except OSError as error:
            raise FileRefused(f"{part}: {error.strerror} (a link?)") from None
        info = os.fstat(fd)
        if not stat.S_ISREG(info.st_mode) or info.st_nlink != 1 or info.st_uid != os.geteuid():
            os.close(fd)
            raise FileRefused(f"{part}: not a plain file of ours")
        return PartFile(self, name, fd)

    def settle(self, part: str, name: str, suffix: str = "") -> str:
        """Give the finished `part`.part its name, or the next free one; return that. Raises FileRefused."""
        stem, dot, ending = _checked(name).partition(".")
        for number in range(1, MAX_SAME_NAMES):
            final = (name if number == 1 else f"{stem}-{number}{dot}{ending}") + suffix
            try:
                # A hard link fails if the name exists, so that a download never replaces a file; a rename would.
                os.link(f"{part}.part", final, src_dir_fd=self._fd, dst_dir_fd=self._fd, follow_symlinks=False)
            except FileExistsError:
                continue
            except OSError as error:
                raise FileRefused(f"{final}: {error.strerror}") from None
            self._unlink(f"{part}.part")
            return final
        raise FileRefused(f"{name}: there are {MAX_SAME_NAMES} of that name")

    def _unlink(self, name: str, *, plain_only: bool = False) -> None:
        try:
            # A link or pipe was planted there: it is left, and O_EXCL refuses to open it.
            if plain_only and not stat.S_ISREG(os.stat(name, dir_fd=self._fd, follow_symlinks=False).st_mode):
                return
            os.unlink(name, dir_fd=self._fd)
        except FileNotFoundError:
            return


class PartFile:
    """A file while it is written. Writing raises OSError, e.g. when the disk is full."""

    def __init__(self, folder: SafeFolder, name: str, fd: int) -> None:
        """Write to `fd`, which is open for reading and writing."""
        self._folder, self._name, self._fd = folder, name, fd

    def write(self, offset: int, data: bytes) -> None:
        """Write `data` at `offset`."""
        done = 0
        while done < len(data):
            done += os.pwrite(self._fd, data[done:], offset + done)

    def read(self, offset: int, size: int) -> bytes:
        """Return up to `size` bytes at `offset`."""
        return os.pread(self._fd, size, offset)

    @property
    def size(self) -> int:
        """Length in bytes, gaps included."""
        return os.fstat(self._fd).st_size

    def cut(self, size: int) -> None:
        """Remove what lies behind `size` bytes."""
        os.ftruncate(self._fd, size)

    def keep(self) -> None:
        """Close the file and leave the part, to be resumed."""
        os.close(self._fd)

    def discard(self) -> None:
        """Close and remove the part."""
        os.close(self._fd)
        self._folder.remove(f"{self._name}.part")

    def finish(self, name: str = "", *, bad: bool = False) -> str:
        """Close the complete file and return the name it was given: its own, or `name`.

        With `bad` its contents are not what they should be, and ".bad" is added.

        Raises:
            FileRefused: it cannot have that name; the part stays.
        """
        os.close(self._fd)
        return self._folder.settle(self._name, name or self._name, ".bad" if bad else "")


def _checked(name: str) -> str:
    """Return `name` if it is a safe file name: the last check of names made by this program. Raises FileRefused."""
    if safe_name(name) != name:
        raise FileRefused("not a name that is written here")
    return name

"""The file tree of a vehicle, in memory.

Nothing here touches a disk. Errors are OSErrors with the errno that the vehicle would report.
"""

import errno
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from importlib import resources

MAX_FILE_BYTES = 1 << 20
MAX_FILES = 100
"""Limits for files that a station writes: a vehicle's card is finite, and so is this computer's memory."""


def fail(number: int) -> OSError:
    """Return the error with this errno."""
    return OSError(number, errno.errorcode.get(number, ""))


def normal(path: str) -> str:
    """Return a path without leading, trailing and doubled slashes; "" is the root.

    Raises:
        OSError: The path contains "..".
    """
    parts = [part for part in path.split("/") if part not in ("", ".")]
    if ".." in parts:
        raise fail(errno.ENOENT)
    return "/".join(parts)


@dataclass(frozen=True)
class GeneratedFile:
    """A file with bytes that are generated when they are read."""

    size: Callable[[], int]
    read: Callable[[int, int], bytes]
    """Returns bytes from an offset and a count."""


@dataclass
class FileTree:
    """Directories and files of one vehicle; listings are in the order of insertion."""

    directories: set[str] = field(default_factory=lambda: {""})
    files: dict[str, bytes | GeneratedFile] = field(default_factory=dict)
    order: list[str] = field(default_factory=list)
    """Paths in the order of insertion."""
    filled: bool = False
    """The file server has put in the files that such a vehicle has."""

    def add(self, path: str, content: bytes | GeneratedFile | None = None) -> None:
        """Add a file, or a directory if there is no content."""
        if content is None:
            self.directories.add(path)
        else:
            self.files[path] = content
        if path not in self.order:
            self.order.append(path)

    def names(self, directory: str) -> list[str]:
        """Return the paths directly in a directory.

        Raises:
            OSError: There is no such directory.
        """
        directory = normal(directory)
        if directory not in self.directories:
            raise fail(errno.ENOENT)
        return [path for path in self.order if path.rpartition("/")[0] == directory and path]

    def size(self, path: str) -> int:
        """Return the size of a file; a directory has 4096.

        Raises:
            OSError: The path does not exist.
        """
        path = normal(path)
        if path in self.directories:
            return 4096
        content = self._content(path)
        return len(content) if isinstance(content, bytes) else content.size()

    def _content(self, path: str) -> bytes | GeneratedFile:
        if path not in self.files:
            raise fail(errno.ENOENT)
        return self.files[path]

    def read(self, path: str, offset: int, count: int) -> bytes:
        """Return bytes of a file.

        Raises:
            OSError: The path is a directory, or does not exist.
        """
        path = normal(path)
        if path in self.directories:
            raise fail(errno.EISDIR)
        content = self._content(path)
        return content[offset : offset + count] if isinstance(content, bytes) else content.read(offset, count)

    def create(self, path: str, *, truncate: bool) -> None:
        """Make a file that may be written, or empty one.

        Raises:
            OSError: Its directory does not exist, or there are too many files.
        """
        path = normal(path)
        if path in self.directories:
            raise fail(errno.EISDIR)
        if path.rpartition("/")[0] not in self.directories:
            raise fail(errno.ENOENT)
        if path not in self.files and len(self.files) >= MAX_FILES:
            raise fail(errno.ENOSPC)
        if truncate or path not in self.files:
            self.add(path, b"")

    def write(self, path: str, offset: int, data: bytes) -> None:
        """Put bytes into a file.

        Raises:
            OSError: The file gets too long, does not exist, or is generated.
        """
        path = normal(path)
        content = self._content(path)
        if not isinstance(content, bytes):
            raise fail(errno.EACCES)
        if offset + len(data) > MAX_FILE_BYTES:
            raise fail(errno.ENOSPC)
        self.files[path] = content[:offset].ljust(offset, b"\0") + data + content[offset + len(data) :]

    def truncate(self, path: str, length: int) -> None:
        """Cut or extend a file.

        Raises:
            OSError: The file does not exist, or is generated.
        """
        self.write(path, min(length, MAX_FILE_BYTES), b"")
        content = self.files[normal(path)]
        if isinstance(content, bytes):
            self.files[normal(path)] = content[:length]

    def remove(self, path: str) -> None:
        """Remove a file.

        Raises:
            OSError: The file does not exist.
        """
        path = normal(path)
        self._content(path)
        del self.files[path]
        self.order.remove(path)

    def make_directory(self, path: str) -> None:
        """Make a directory.

        Raises:
            OSError: The path exists, its parent does not, or there are too many directories.
        """
        path = normal(path)
        if path in self.directories or path in self.files:
            raise fail(errno.EEXIST)
        if path.rpartition("/")[0] not in self.directories:
            raise fail(errno.ENOENT)
        if len(self.directories) >= MAX_FILES:
            raise fail(errno.ENOSPC)
        self.add(path)

    def remove_directory(self, path: str) -> None:
        """Remove an empty directory.

        Raises:
            OSError: The directory does not exist, or is not empty.
        """
        path = normal(path)
        if path not in self.directories or not path:
            raise fail(errno.ENOENT)
        if self.names(path):
            raise fail(errno.ENOTEMPTY)
        self.directories.discard(path)
        self.order.remove(path)

    def rename(self, old: str, new: str) -> None:
        """Rename a file.

        Raises:
            OSError: The file does not exist, or the new directory does not.
        """
        old, new = normal(old), normal(new)
        content = self._content(old)
        if new.rpartition("/")[0] not in self.directories:
            raise fail(errno.ENOENT)
        self.remove(old)
        self.add(new, content)


@cache
def packaged(name: str) -> bytes:
    """Return the bytes of a file in `sitl/data`."""
    return (resources.files("sitl") / "data" / name).read_bytes()

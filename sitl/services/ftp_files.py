"""Files that a vehicle serves: a tree in memory per vehicle.

Nothing here ever touches a disk. Problems are OSErrors with the errno that the vehicle would report.
"""

import errno
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from importlib import resources

MAX_FILE_BYTES = 1 << 20
MAX_FILES = 100
"""What a station may write; a vehicle's card is not endless either."""


def fail(number: int) -> OSError:
    """The error that ends a request."""
    return OSError(number, errno.errorcode.get(number, ""))


def normal(path: str) -> str:
    """Without slashes around; `.` is the root.

    Raises:
        OSError: Ways that lead upwards.
    """
    parts = [part for part in path.split("/") if part not in ("", ".")]
    if ".." in parts:
        raise fail(errno.ENOENT)
    return "/".join(parts)


@dataclass(frozen=True)
class Made:
    """A file whose bytes are made when they are read."""

    size: Callable[[], int]
    read: Callable[[int, int], bytes]
    """Offset and count."""


@dataclass
class Tree:
    """Directories and files; the order of listings is that of insertion."""

    directories: set[str] = field(default_factory=lambda: {""})
    files: dict[str, bytes | Made] = field(default_factory=dict)
    order: list[str] = field(default_factory=list)
    """Names for listings, by insertion."""

    def add(self, path: str, content: bytes | Made | None = None) -> None:
        """A file, or a directory when there is no content."""
        if content is None:
            self.directories.add(path)
        else:
            self.files[path] = content
        if path not in self.order:
            self.order.append(path)

    def names(self, directory: str) -> list[str]:
        """Paths directly in a directory.

        Raises:
            OSError: There is no such directory.
        """
        directory = normal(directory)
        if directory not in self.directories:
            raise fail(errno.ENOENT)
        return [path for path in self.order if path.rpartition("/")[0] == directory and path]

    def size(self, path: str) -> int:
        """Of a file; a directory has 4096.

        Raises:
            OSError: There is neither.
        """
        path = normal(path)
        if path in self.directories:
            return 4096
        content = self._content(path)
        return len(content) if isinstance(content, bytes) else content.size()

    def _content(self, path: str) -> bytes | Made:
        if path not in self.files:
            raise fail(errno.ENOENT)
        return self.files[path]

    def read(self, path: str, offset: int, count: int) -> bytes:
        """Bytes of a file.

        Raises:
            OSError: It is a directory, or is gone.
        """
        path = normal(path)
        if path in self.directories:
            raise fail(errno.EISDIR)
        content = self._content(path)
        return content[offset : offset + count] if isinstance(content, bytes) else content.read(offset, count)

    def create(self, path: str, *, truncate: bool) -> None:
        """Open for writing.

        Raises:
            OSError: No directory for it, too many files.
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
            OSError: Too long, or none of ours.
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
            OSError: As `write`.
        """
        self.write(path, min(length, MAX_FILE_BYTES), b"")
        content = self.files[normal(path)]
        if isinstance(content, bytes):
            self.files[normal(path)] = content[:length]

    def remove(self, path: str) -> None:
        """Remove a file.

        Raises:
            OSError: There is none.
        """
        path = normal(path)
        self._content(path)
        del self.files[path]
        self.order.remove(path)

    def make_directory(self, path: str) -> None:
        """Make a directory.

        Raises:
            OSError: It exists, or there is no place for it.
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
            OSError: There is none, or it is not empty.
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
            OSError: There is none, or no place for it.
        """
        old, new = normal(old), normal(new)
        content = self._content(old)
        if new.rpartition("/")[0] not in self.directories:
            raise fail(errno.ENOENT)
        self.remove(old)
        self.add(new, content)


@cache
def packaged(name: str) -> bytes:
    """A file of `sitl/data`."""
    return (resources.files("sitl") / "data" / name).read_bytes()

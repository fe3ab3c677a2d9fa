"""Autosave: work in progress on disk, in a file per running program, so that it survives a crash."""

import os
from pathlib import Path

from tui_gcs.core.base.safe_files import FileRefused, SafeFolder

MAX_FILES = 32
"""This many programs may edit the same kind of work at once."""


class Autosave:
    """One file of work in progress. Another process takes over the file of one that died."""

    def __init__(self, path: Path, name: str) -> None:
        """Take a file that no program holds, the oldest with work in it first. Raises FileRefused."""
        self._folder = SafeFolder(path)
        self._name, self._lock = "", -1
        there = [file for file in self._folder.names() if file in _files(name)]
        waiting = []
        for file in [*there, *(file for file in _files(name) if file not in there)]:
            # A lock is released by the system when its process dies, so an unlocked file with work in it belongs to a
            # dead program.
            lock = self._folder.lock(f"{file}.lock")
            if lock is None:
                continue
            if not self._name:
                self._name, self._lock = file, lock
                continue
            os.close(lock)
            if file not in there:
                break  # all further ones are empty, too
            waiting.append(path / file)
        self.waiting: tuple[Path, ...] = tuple(waiting)
        """Files of other programs that died; they stay for the next program that starts."""
        if not self._name:
            raise FileRefused(f"{path}: {MAX_FILES} others hold all files for work in progress, or it locks none")

    def read(self, max_bytes: int) -> bytes | None:
        """Return the saved work; None if there is none."""
        return self._folder.read(self._name, max_bytes)

    def write(self, data: bytes) -> None:
        """Save this work. Raises FileRefused."""
        self._folder.replace(self._name, data)

    def set_aside(self, data: bytes) -> Path:
        """Move work that cannot be read here, `data`, to another file and return its path. Raises FileRefused."""
        aside = f"{self._name}.unread"
        self._folder.replace(aside, data)
        self.forget()
        return self._folder.path / aside

    def forget(self) -> None:
        """Remove the saved work: it is saved elsewhere, or not wanted."""
        self._folder.remove(self._name)

    def close(self) -> None:
        """Release the file; saved work stays for the next program."""
        os.close(self._lock)
        self._folder.close()


def _files(name: str) -> list[str]:
    return [f"{name}-autosave-{number}.json" for number in range(1, MAX_FILES + 1)]

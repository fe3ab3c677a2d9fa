"""Work in progress, kept against crashes: every program that edits holds a file of its own, as long as it lives."""

import os
from pathlib import Path

from tui_gcs.core.base.safe_files import FileRefused, SafeFolder

MAX_FILES = 32
"""So many programs may edit the same kind of work at once."""


class Autosave:
    """One file of work among those of others; another process takes over what this one leaves when it dies."""

    def __init__(self, path: Path, name: str) -> None:
        """Take a file that nobody holds, the oldest with work in it first. Raises FileRefused."""
        self._folder = SafeFolder(path)
        self._name, self._lock = "", -1
        there = [file for file in self._folder.names() if file in _files(name)]
        waiting = []
        for file in [*there, *(file for file in _files(name) if file not in there)]:
            lock = self._folder.lock(f"{file}.lock")
            if lock is None:
                continue
            if not self._name:
                self._name, self._lock = file, lock
                continue
            os.close(lock)
            if file not in there:
                break  # the next ones are empty, too
            waiting.append(path / file)
        self.waiting: tuple[Path, ...] = tuple(waiting)
        """Work of others that died: it stays for the next one who comes."""
        if not self._name:
            raise FileRefused(f"{path}: {MAX_FILES} others hold all files for work in progress, or it locks none")

    def read(self, max_bytes: int) -> bytes | None:
        """What is kept; None: nothing."""
        return self._folder.read(self._name, max_bytes)

    def write(self, data: bytes) -> None:
        """Keep this. Raises FileRefused."""
        self._folder.replace(self._name, data)

    def set_aside(self, data: bytes) -> Path:
        """Have what is kept, `data`, elsewhere, for it makes no sense here; where. Raises FileRefused."""
        aside = f"{self._name}.unread"
        self._folder.replace(aside, data)
        self.forget()
        return self._folder.path / aside

    def forget(self) -> None:
        """It is saved elsewhere, or not wanted."""
        self._folder.remove(self._name)

    def close(self) -> None:
        """What is kept waits for the next program."""
        os.close(self._lock)
        self._folder.close()


def _files(name: str) -> list[str]:
    return [f"{name}-autosave-{number}.json" for number in range(1, MAX_FILES + 1)]

"""Names that the operator marked as favourites, kept in a small file of this computer."""

import json
from pathlib import Path

MAX_BYTES = 100_000
MAX_NAMES = 500


class Favourites:
    """A set of names on disk, or in memory only without a path."""

    def __init__(self, path: Path | None) -> None:
        """Read the names kept at `path`; a damaged file counts as empty and is replaced at the next change."""
        self._path = path
        self.names: set[str] = set(_read(path)) if path is not None else set()

    def toggle(self, name: str) -> str:
        """Mark a name, or take its mark away; return a line about it, with the reason if it could not be kept."""
        if name in self.names:
            self.names.discard(name)
            words = f"{name} is no favourite any more"
        elif len(self.names) >= MAX_NAMES:
            return f"{MAX_NAMES} favourites are marked already: take one away first"
        else:
            self.names.add(name)
            words = f"{name} is a favourite"
        if self._path is None:
            return words
        # Replaced as a whole, so that another console never reads half a file.
        new = self._path.with_suffix(".new")
        try:
            new.write_text(json.dumps(sorted(self.names)), encoding="utf-8")
            new.replace(self._path)
        except OSError as error:
            return f"{words}, until this console ends: {self._path} cannot be written ({error.strerror})"
        return words


def _read(path: Path) -> list[str]:
    try:
        if path.stat().st_size > MAX_BYTES:
            return []
        held = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return []
    return [name for name in held if isinstance(name, str)][:MAX_NAMES] if isinstance(held, list) else []

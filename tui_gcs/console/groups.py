"""Groups of vehicles that the operator saved by name: on disk, for each fleet, which is the name of its scenario."""

import json
from pathlib import Path
from typing import Any

MAX_BYTES = 200_000
MAX_GROUPS = 100
"""Groups that one fleet may have."""
Groups = dict[str, tuple[int, ...]]


class GroupsError(Exception):
    """Groups could not be read or kept; the text is one line for the operator."""


class GroupFile:
    """One small JSON file, read anew each time, because another console may have changed it."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def of(self, fleet: str) -> Groups:
        """Return the vehicles of each group of one fleet, by name. Raises `GroupsError`."""
        return {
            name: tuple(sorted({v for v in vehicles if isinstance(v, int)}))
            for name, vehicles in self._read().get(fleet, {}).items()
            if isinstance(vehicles, list)
        }

    def keep(self, fleet: str, name: str, vehicles: tuple[int, ...]) -> None:
        """Keep a group, or forget one without vehicles. Raises `GroupsError`."""
        held = self._read()
        groups = held.setdefault(fleet, {})
        if vehicles:
            groups[name] = list(vehicles)
        else:
            groups.pop(name, None)
        if len(groups) > MAX_GROUPS:
            raise GroupsError(f"{MAX_GROUPS} groups are kept already: NAME=none forgets one")
        # Replaced as a whole, so that another console never reads half a file.
        new = self._path.with_suffix(".new")
        try:
            new.write_text(json.dumps(held, indent=1), encoding="utf-8")
            new.replace(self._path)
        except OSError as error:
            raise GroupsError(f"{self._path}: cannot be written ({error.strerror})") from None

    def _read(self) -> dict[str, dict[str, Any]]:
        try:
            if self._path.stat().st_size > MAX_BYTES:
                raise GroupsError(f"{self._path}: longer than {MAX_BYTES} bytes: those are no groups")
            held = json.loads(self._path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            return {}
        except OSError as error:
            raise GroupsError(f"{self._path}: cannot be read ({error.strerror})") from None
        except ValueError:
            raise GroupsError(f"{self._path}: is damaged; mend it or remove it") from None
        if not isinstance(held, dict) or not all(isinstance(groups, dict) for groups in held.values()):
            raise GroupsError(f"{self._path}: is damaged; mend it or remove it")
        return held

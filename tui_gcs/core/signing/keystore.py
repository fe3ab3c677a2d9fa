"""Key store: the operator's signing keys on disk, and which vehicle signs with which.

One file, `keys.json`, lies in a directory of its own inside the state directory of LIVE or SIM, so that a simulation
never loads a real key. Nothing is read from a file that other users could have read or written. No error text contains
a secret.
"""

import fcntl
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec

from tui_gcs.core.base.directories import ConfigError, state_dir
from tui_gcs.core.base.run_kind import RunKind
from tui_gcs.core.mavlink.signing import ZERO_KEY, SigningError, SigningKey
from tui_gcs.core.signing.private_files import (
    KeyStoreError,
    check_private,
    make_private,
    read_private,
    write_private,
)

__all__ = ["KeyStore", "KeyStoreError", "check_vehicle", "open_store", "vehicle_name"]

FILE, LOCK = "keys.json", "keys.lock"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,31}")
_NETWORK = re.compile(r"[a-z0-9-]{0,16}")


class _Stored(msgspec.Struct, forbid_unknown_fields=True):
    """The contents of `keys.json`."""

    keys: dict[str, str]
    """Keys as 64 hex digits, by name."""
    vehicles: list[tuple[str, int, str]]
    """(network, system id, name of the key) per vehicle with a key."""

    def __repr__(self) -> str:
        return f"_Stored({list(self.keys)})"


class KeyStore:
    """Keys by name and by vehicle. Every change is written at once; changes by other processes come with `reload`."""

    def __init__(self, directory: Path) -> None:
        """Use `directory`, which is made with mode 0700 if missing.

        Raises:
            KeyStoreError: it or its file is open to other users, of another user, a link, or damaged.
        """
        self.directory = directory
        self._path = directory / FILE
        self._keys: dict[str, SigningKey] = {}
        self._vehicles: dict[tuple[str, int], str] = {}
        self._seen: tuple[int, int, int] | None = None
        make_private(directory)
        self.reload()

    def __repr__(self) -> str:
        return f"KeyStore({str(self.directory)!r}, {len(self._keys)} keys)"

    @property
    def keys(self) -> list[SigningKey]:
        """All keys, by name."""
        return [self._keys[name] for name in sorted(self._keys)]

    def key(self, name: str) -> SigningKey:
        """Return the key of that name. Raises KeyStoreError."""
        if name not in self._keys:
            raise KeyStoreError(f"no key named {name[:40]!r} in {self.directory}; `tui-gcs keys list` shows them")
        return self._keys[name]

    def key_of(self, network: str, system: int) -> SigningKey | None:
        """Return the key that this vehicle signs with; None if it has none."""
        name = self._vehicles.get((network, system))
        return None if name is None else self._keys[name]

    def vehicles_of(self, name: str) -> list[tuple[str, int]]:
        """Return (network, system id) of the vehicles that sign with this key."""
        return sorted(vehicle for vehicle, key in self._vehicles.items() if key == name)

    def changed(self) -> bool:
        """Return whether the file changed since it was read: one `stat`, cheap enough for every second."""
        return _signature(self._path) != self._seen

    def reload(self) -> None:
        """Read the file again.

        Raises:
            KeyStoreError: the file cannot be used; the keys stay as they were.
        """
        check_private(self.directory)
        seen = _signature(self._path)
        data = read_private(self._path)
        keys, vehicles = ({}, {}) if data is None else self._parse(data)
        self._keys, self._vehicles, self._seen = keys, vehicles, seen

    def add(self, key: SigningKey) -> None:
        """Keep a new key. Raises KeyStoreError for a bad or used name, a known key, or the zero key."""
        if not _NAME.fullmatch(key.name):
            raise KeyStoreError(f"key name {key.name[:40]!r}: must be 1 to 32 of A-Z, a-z, 0-9, '.', '_' and '-'")
        # Anyone can sign with the zero key, and PX4 does so while signing is off.
        if key.secret == ZERO_KEY:
            raise KeyStoreError(f"key {key.name}: all zero, which is no secret; use another key")
        with self._changing():
            if key.name in self._keys:
                raise KeyStoreError(f"there is a key named {key.name} already; remove it first or take another name")
            for other in self._keys.values():
                if other.secret == key.secret:
                    raise KeyStoreError(f"this key is here already, as {other.name}; assign that one")
            self._keys[key.name] = key

    def remove(self, name: str) -> None:
        """Remove a key; its vehicles then have none. Raises KeyStoreError."""
        with self._changing():
            self.key(name)
            del self._keys[name]
            self._vehicles = {vehicle: key for vehicle, key in self._vehicles.items() if key != name}

    def assign(self, name: str, network: str, system: int) -> None:
        """Make this vehicle sign with that key, and with no other. Raises KeyStoreError."""
        check_vehicle(network, system)
        with self._changing():
            self.key(name)
            self._vehicles[network, system] = name

    def unassign(self, network: str, system: int) -> None:
        """Take the key from this vehicle. Raises KeyStoreError if it has none."""
        with self._changing():
            if (network, system) not in self._vehicles:
                raise KeyStoreError(f"vehicle {vehicle_name(network, system)} has no key")
            del self._vehicles[network, system]

    @contextmanager
    def _changing(self) -> Iterator[None]:
        """Read the file, let the caller change the keys, write them. After an error the keys are as before."""
        # Another process may have changed the file: read and write under one lock.
        with self._locked():
            self.reload()
            before = dict(self._keys), dict(self._vehicles)
            try:
                yield
                stored = _Stored(
                    keys={name: key.secret.hex() for name, key in sorted(self._keys.items())},
                    vehicles=[(*vehicle, name) for vehicle, name in sorted(self._vehicles.items())],
                )
                write_private(self._path, msgspec.json.encode(stored))
            except KeyStoreError:
                self._keys, self._vehicles = before
                raise
            self._seen = _signature(self._path)

    @contextmanager
    def _locked(self) -> Iterator[None]:
        path = self.directory / LOCK
        try:
            lock = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
        except OSError as error:
            raise KeyStoreError(f"{path}: {error.strerror}") from None
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(lock)
            raise KeyStoreError(f"{self.directory}: being written by another tui-gcs; try again") from None
        try:
            yield
        finally:
            os.close(lock)

    def _parse(self, data: bytes) -> tuple[dict[str, SigningKey], dict[tuple[str, int], str]]:
        damaged = KeyStoreError(f"{self._path}: damaged; restore it from a backup, or remove it and add the keys again")
        try:
            stored = msgspec.json.decode(data, type=_Stored)
            keys = {name: SigningKey(name, bytes.fromhex(secret)) for name, secret in stored.keys.items()}
        except (msgspec.MsgspecError, SigningError, ValueError):
            raise damaged from None
        vehicles = {(network, system): name for network, system, name in stored.vehicles}
        if not (all(map(_NAME.fullmatch, keys)) and all(name in keys for name in vehicles.values())):
            raise damaged
        return keys, vehicles


def open_store(kind: RunKind) -> KeyStore:
    """Return the keys for vehicles of this kind. Raises KeyStoreError."""
    try:
        return KeyStore(state_dir(kind) / "keys")
    except ConfigError as error:
        raise KeyStoreError(str(error)) from None


def vehicle_name(network: str, system: int) -> str:
    """Return how a vehicle is written where networks matter: "7", or "north/7"."""
    return f"{network}/{system}" if network else str(system)


def check_vehicle(network: str, system: int) -> None:
    """Raise KeyStoreError if no vehicle can have this network and system id."""
    if not _NETWORK.fullmatch(network):
        raise KeyStoreError(f"network {network[:40]!r}: must be 1 to 16 of a-z, 0-9 and '-'")
    if not 1 <= system <= 255:
        raise KeyStoreError(f"vehicle {system}: a MAVLink system id is 1 to 255")


def _signature(path: Path) -> tuple[int, int, int] | None:
    try:
        info = path.stat(follow_symlinks=False)
    except OSError:
        return None
    return info.st_ino, info.st_mtime_ns, info.st_size

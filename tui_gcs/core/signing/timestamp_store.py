"""Timestamp store: the last signing time we used and how far every stream had come, kept over a restart.

It is written at most once a second and without waiting for the disk, so that a crash of the station loses nothing. A
second copy is forced to the disk every 30 s for the case that the machine loses power and the first file is torn.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import msgspec

from tui_gcs.core.mavlink.signing import MAX_TIMESTAMP, STORE_EVERY_S, ZERO_KEY, SignatureVerifier, SigningError
from tui_gcs.core.signing.private_files import KeyStoreError, make_private, read_private, write_private

FILE, SAFE_FILE = "timestamps.json", "timestamps-safe.json"
SYNC_EVERY_S = 30.0
"""The MAVLink signing guide asks for a minute at most."""


class _Holder(msgspec.Struct, forbid_unknown_fields=True):
    """The stored values of one key holder."""

    clock: Annotated[int, msgspec.Meta(ge=0, le=MAX_TIMESTAMP)]
    """`SigningClock.last`, 10 µs ticks."""
    streams: dict[str, Any]
    """The result of `SignatureVerifier.streams`."""


class TimestampStore:
    """Keeps signing clocks and streams in the directory of the keys; never raises once it is open."""

    def __init__(self, directory: Path) -> None:
        """Read what an earlier station left in `directory`.

        Raises:
            KeyStoreError: the files are open to other users, of another user, links, or both damaged.
        """
        self.error = ""
        """Why the files cannot be written at present; "" if they can."""
        self._path, self._safe_path = directory / FILE, directory / SAFE_FILE
        self._written = b""
        self._next_write_s = self._next_sync_s = float("-inf")
        make_private(directory)
        self.stored = self._read()
        """By key holder: {"clock": `SigningClock.last`, "streams": `SignatureVerifier.streams()`}."""

    def tick(self, now_s: float, to_store: Callable[[], dict[str, Any]]) -> None:
        """Write what `to_store` returns (as `stored`), if a second has passed since the last time."""
        if now_s < self._next_write_s:
            return
        self._next_write_s = now_s + STORE_EVERY_S
        sync = now_s >= self._next_sync_s
        self.write(to_store(), sync=sync)
        if sync and not self.error:
            self._next_sync_s = now_s + SYNC_EVERY_S

    def write(self, stored: dict[str, Any], *, sync: bool = True) -> None:
        """Write now; with `sync`, as at the end of a station, wait for the disk."""
        data = msgspec.json.encode(stored)
        try:
            if data != self._written:
                write_private(self._path, data, sync=False)
                self._written = data
            if sync:
                write_private(self._safe_path, data)
        except KeyStoreError as error:
            self.error = str(error)
        else:
            self.error = ""

    def _read(self) -> dict[str, Any]:
        """Return the newer file, else the copy. The copy may be older: `restore` adds that to its margin."""
        data, safe = read_private(self._path), read_private(self._safe_path)
        stored = _parse(data)
        if stored is None and safe is not None:
            stored = _parse(safe)
            for holder in (stored or {}).values():
                # The copy may lack what was accepted since it was forced to the disk.
                holder["streams"]["late_s"] = SYNC_EVERY_S
        if stored is None and not (data is None and safe is None):
            raise KeyStoreError(
                f"{self._path}: damaged, and its copy too; remove both: for a minute recordings may then pass as new"
            )
        return stored or {}


def _parse(data: bytes | None) -> dict[str, Any] | None:
    """Return `TimestampStore.stored`; None if `data` is missing or cannot be used."""
    if data is None:
        return None
    try:
        holders = msgspec.json.decode(data, type=dict[str, _Holder])
        for holder in holders.values():
            SignatureVerifier(ZERO_KEY).restore(holder.streams)
    except (msgspec.MsgspecError, SigningError):
        return None
    return {name: {"clock": holder.clock, "streams": holder.streams} for name, holder in holders.items()}

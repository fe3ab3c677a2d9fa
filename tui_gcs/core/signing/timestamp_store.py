"""What a restart has to remember of signing: the last time we signed with, and how far every stream had come.

Written at most once a second and without waiting for the disk, so that a crash of the station costs nothing. A second
copy is forced to the disk every 30 s for the case that the machine loses power and the first is torn.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import msgspec

from tui_gcs.core.mavlink.signing import MAX_TIMESTAMP, STORE_EVERY_S, ZERO_KEY, SignatureVerifier, SigningError
from tui_gcs.core.signing.private_files import KeyStoreError, make_private, read_private, write_private

FILE, SAFE_FILE = "timestamps.json", "timestamps-safe.json"
SYNC_EVERY_S = 30.0
"""The standard asks for a minute at most."""


class _Holder(msgspec.Struct, forbid_unknown_fields=True):
    """What is remembered of one key holder."""

    clock: Annotated[int, msgspec.Meta(ge=0, le=MAX_TIMESTAMP)]
    """`SigningClock.last`."""
    streams: dict[str, Any]
    """`SignatureVerifier.streams()`."""


class TimestampStore:
    """Keeps clocks and streams in the directory of the keys; never raises once it is open."""

    def __init__(self, directory: Path) -> None:
        """Read what an earlier station left.

        Raises:
            KeyStoreError: the files are open to others, somebody else's, links, or both damaged.
        """
        self.error = ""
        """Why it cannot be written just now; empty if it can."""
        self._path, self._safe_path = directory / FILE, directory / SAFE_FILE
        self._written = b""
        self._next_write_s = self._next_sync_s = float("-inf")
        make_private(directory)
        self.stored = self._read()
        """By key holder: {"clock": SigningClock.last, "streams": Verifier.streams()}."""

    def tick(self, now_s: float, to_store: Callable[[], dict[str, Any]]) -> None:
        """Write what `to_store` gives (the form of `stored`), if a second has passed since the last time."""
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
        """The newer file, else the copy, which may be older by what `restore` then adds to its margin."""
        data, safe = read_private(self._path), read_private(self._safe_path)
        stored = _parse(data)
        if stored is None and safe is not None:
            stored = _parse(safe)
            for holder in (stored or {}).values():
                holder["streams"]["late_s"] = SYNC_EVERY_S
        if stored is None and not (data is None and safe is None):
            raise KeyStoreError(
                f"{self._path}: damaged, and its copy too; remove both: for a minute recordings may then pass as new"
            )
        return stored or {}


def _parse(data: bytes | None) -> dict[str, Any] | None:
    """What `TimestampStore.stored` is to be; None if there is nothing, or nothing that can be used."""
    if data is None:
        return None
    try:
        holders = msgspec.json.decode(data, type=dict[str, _Holder])
        for holder in holders.values():
            SignatureVerifier(ZERO_KEY).restore(holder.streams)
    except (msgspec.MsgspecError, SigningError):
        return None
    return {name: {"clock": holder.clock, "streams": holder.streams} for name, holder in holders.items()}

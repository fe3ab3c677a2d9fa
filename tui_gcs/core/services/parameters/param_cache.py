"""A cache on disk of the parameters of vehicles that report a checksum of them (PX4): unchanged ones are not fetched.

There is one small file for each vehicle. Its name is made of a hash, never of text from the vehicle. Its contents count
only for the same autopilot, version, hardware id and checksum.
"""

import hashlib
import zlib
from dataclasses import dataclass

import msgspec

from tui_gcs.core.base.safe_files import FileRefused, SafeFolder
from tui_gcs.core.base.text import clean
from tui_gcs.core.services.parameters.param_values import Number, Parameter, param_type

FORMAT = 1
MAX_BYTES = 1 << 19
MAX_FILES = 300
"""How many vehicles are kept; those stored longest ago are removed first."""


@dataclass(frozen=True)
class CacheKey:
    """The vehicle and firmware that a set of parameters belongs to."""

    autopilot: int
    version: str
    """Everything that distinguishes one firmware from another."""
    uid: str
    """The hardware id as hex digits; never empty."""

    @property
    def file_name(self) -> str:
        """The name of the file that holds them."""
        return f"params-{hashlib.sha256(f'{self.autopilot} {self.uid}'.encode()).hexdigest()[:32]}"


class _StoredParams(msgspec.Struct, array_like=True, forbid_unknown_fields=True):
    format: int
    autopilot: int
    version: str
    uid: str
    checksum: int
    params: list[tuple[str, Number, int, Number | None]]


class ParamCache:
    """Reads and writes the cached parameters. A file that cannot be read or written costs only a fetch."""

    def __init__(self, folder: SafeFolder) -> None:
        """Use `folder`, which must hold nothing but caches."""
        self._folder = folder
        self.error = ""
        """Why the last `save` failed, "" if none did."""

    def load(self, key: CacheKey, checksum: int) -> list[Parameter] | None:
        """Return the parameters kept for `key` if their checksum is still `checksum`, else None."""
        # A file that was cut off by a crash has a wrong CRC and counts as none.
        held = self._folder.read(key.file_name, MAX_BYTES)
        if held is None or zlib.crc32(held[4:]).to_bytes(4, "little") != held[:4]:
            return None
        try:
            stored = msgspec.msgpack.decode(held[4:], type=_StoredParams)
        except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
            return None
        whose = (stored.format, stored.autopilot, stored.version, stored.uid, stored.checksum)
        if whose != (FORMAT, key.autopilot, key.version, key.uid, checksum):
            return None
        kinds = {number: param_type(number) for _, _, number, _ in stored.params}
        return [
            Parameter(clean(name, 64), value, kind, default)
            for name, value, number, default in stored.params
            if (kind := kinds[number]) is not None
        ]

    def save(self, key: CacheKey, checksum: int, params: list[Parameter]) -> None:
        """Store the parameters of a vehicle, in place of its former ones."""
        rows = [(str(p.name), p.value, int(p.type), p.default) for p in params]
        body = msgspec.msgpack.encode(_StoredParams(FORMAT, key.autopilot, key.version, key.uid, checksum, rows))
        try:
            self._folder.replace(key.file_name, zlib.crc32(body).to_bytes(4, "little") + body)
            old = [name for name in self._folder.names() if name.startswith("params-")]
            for name in old[:-MAX_FILES]:
                self._folder.remove(name)
        except (FileRefused, OSError) as error:
            self.error = str(error)

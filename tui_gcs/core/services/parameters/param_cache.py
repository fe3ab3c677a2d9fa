"""Parameters of vehicles that tell a checksum of them, kept on disk: what has not changed is not fetched again.

One small file per vehicle. Its name is made of a hash, never of what the vehicle said; what it holds is believed only
for the same autopilot, version, hardware id and checksum.
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
"""Vehicles; the ones that were stored longest ago go first."""


@dataclass(frozen=True)
class CacheKey:
    """Whose parameters."""

    autopilot: int
    version: str
    """All that tells one firmware from another."""
    uid: str
    """Hardware id as hex; never empty."""

    @property
    def file_name(self) -> str:
        """Where they are."""
        return f"params-{hashlib.sha256(f'{self.autopilot} {self.uid}'.encode()).hexdigest()[:32]}"


class _StoredParams(msgspec.Struct, array_like=True, forbid_unknown_fields=True):
    format: int
    autopilot: int
    version: str
    uid: str
    checksum: int
    params: list[tuple[str, Number, int, Number | None]]


class ParamCache:
    """Reads and writes them. What prevents it, prevents it: then everything is fetched."""

    def __init__(self, folder: SafeFolder) -> None:
        """`folder` is for nothing else than caches."""
        self._folder = folder
        self.error = ""
        """Why the newest could not be stored."""

    def load(self, key: CacheKey, checksum: int) -> list[Parameter] | None:
        """What is kept for `key`, if its checksum is still that."""
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
        """Keep them, in place of what there was of that vehicle."""
        rows = [(str(p.name), p.value, int(p.type), p.default) for p in params]
        body = msgspec.msgpack.encode(_StoredParams(FORMAT, key.autopilot, key.version, key.uid, checksum, rows))
        try:
            self._folder.replace(key.file_name, zlib.crc32(body).to_bytes(4, "little") + body)
            old = [name for name in self._folder.names() if name.startswith("params-")]
            for name in old[:-MAX_FILES]:
                self._folder.remove(name)
        except (FileRefused, OSError) as error:
            self.error = str(error)

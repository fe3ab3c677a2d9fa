"""All parameters of a vehicle: the cheapest way that works (mavlink.md D).

1. PX4: its checksum; if it is that of what we keep on disk, that is all.
2. The packed file, by FTP.
3. One message each.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.services.files.ftp import FtpReaderJob
from tui_gcs.core.services.files.ftp_read import MemorySink
from tui_gcs.core.services.parameters.param_cache import CacheKey
from tui_gcs.core.services.parameters.param_list import ParamLister
from tui_gcs.core.services.parameters.param_pack import MOST_BYTES, ParamPackError, parse_pack
from tui_gcs.core.services.parameters.param_values import Param
from tui_gcs.core.uplink.jobs import Job

if TYPE_CHECKING:
    from tui_gcs.core.services.parameters.param_service import ParamService

HASH_TRIES, HASH_WAIT_S = 3, 1.0
FTP_TRIES = 5
"""Of the first question: a vehicle without files is silent, and there are other ways."""


class ParamFetchJob(FtpReaderJob):
    """Fetches all parameters into the service's table."""

    def __init__(self, service: "ParamService", vehicle: int, on_done: Callable[[Job], None] | None = None) -> None:
        """Nothing is asked before its turn."""
        super().__init__(service.ftp, vehicle, "parameters", on_done)
        self._service = service
        self.way = ""
        """How they came: "cache", "file" or "list"."""
        self.notes: list[str] = []
        """Why ways before that did not work."""
        self._vehicle: Vehicle | None = None
        self._next: Callable[[], None] | None = None
        self._hash_name = ""
        self._hash: int | None = None
        self._hash_tries = self._hash_due_s = 0.0
        self._hashing: Callable[[int | None], None] | None = None
        self._paths: list[str] = []
        self._lister: ParamLister | None = None

    # ---------------------------------------------------------------- job

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """See `Job`."""
        self._vehicle = vehicle
        ways = self._service.ways(vehicle)
        self._paths = list(ways.packed)
        self._hash_name = ways.hash_name
        if self._hash_name:
            self._ask_hash(self._compare)
        else:
            self._begin_file()

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """See `Job`."""
        if self._hashing is not None and now >= self._hash_due_s:
            self._repeat_hash(now)
        super().tick(vehicle, now)
        if self._lister is not None:
            self._lister.tick(now)
            self._look_list()

    def heard(self, param: Param | None, name: str, index: int, count: int, bits: bytes) -> None:
        """The service heard a PARAM_VALUE; `param` is None for the checksum."""
        if name == self._hash_name and self._hashing is not None:
            then, self._hashing = self._hashing, None
            then(int.from_bytes(bits, "little"))
        if param is not None and self._lister is not None:
            self._lister.hear(name, index, count, self._service.now)
            self._look_list()

    # ---------------------------------------------------------------- checksum

    def _ask_hash(self, then: Callable[[int | None], None]) -> None:
        self._hashing, self._hash_tries, self._hash_due_s = then, 0, 0.0
        self._repeat_hash(self._service.now)

    def _repeat_hash(self, now: float) -> None:
        if self._hash_tries >= HASH_TRIES and self._hashing is not None:
            then, self._hashing = self._hashing, None
            then(None)
            return
        self._hash_tries += 1
        self._hash_due_s = now + HASH_WAIT_S
        self._service.ask_name(self.vehicle, self._hash_name)

    def _compare(self, checksum: int | None) -> None:
        key = self._key()
        self._hash = checksum
        kept = self._service.cache.load(key, checksum) if self._service.cache and key and checksum is not None else None
        if kept:
            self._fill(kept, "cache")
            self.finish()
        else:
            self._begin_file()

    def _key(self) -> CacheKey | None:
        return self._service.cache_key(self._vehicle) if self._vehicle is not None else None

    def _store(self) -> None:
        """Keep what was fetched, if nothing changed meanwhile."""
        if self._hash is None or self._key() is None or self._service.cache is None:
            self.finish()
        else:
            self._ask_hash(self._store_if_same)

    def _store_if_same(self, checksum: int | None) -> None:
        key, cache = self._key(), self._service.cache
        if checksum is not None and checksum == self._hash and key is not None and cache is not None:
            cache.save(key, checksum, list(self._service.table(self.vehicle).params.values()))
        self.finish()

    def _fill(self, params: list[Param], way: str) -> None:
        self.way = way
        self._service.table(self.vehicle).fill(params)
        self.done = self.total = len(params)

    # ---------------------------------------------------------------- file

    def _begin_file(self) -> None:
        if not self._paths or self._vehicle is None:
            self._begin_list()
            return
        sink = MemorySink()
        self._reader = self._ftp.reader(
            self._vehicle,
            self._paths.pop(0),
            sink,
            lambda error: self._file_over(error, bytes(sink.data)),
            max_bytes=MOST_BYTES,
            first_tries=FTP_TRIES,
        )
        self._reader.begin()

    def _file_over(self, error: str, data: bytes) -> None:
        nak = self._reader.nak if self._reader is not None else 0
        self._reader = None
        if not error:
            try:
                self._fill(parse_pack(data).params, "file")
            except ParamPackError as broken:
                error = str(broken)
        if error:
            self.notes.append(f"file: {error}")
            if not nak:
                self._paths.clear()  # it would not be better with the next
            self._begin_file()
        else:
            self._store()

    # ---------------------------------------------------------------- list

    def _begin_list(self) -> None:
        self._ftp.end(self.vehicle)
        self.done = self.total = 0
        self._lister = ParamLister(
            lambda: self._service.ask_list(self.vehicle),
            lambda index: self._service.ask_index(self.vehicle, index),
            self._service.now,
            slow=self._vehicle is not None and self._service.context.is_slow(self._vehicle.link),
        )

    def _look_list(self) -> None:
        lister = self._lister
        if lister is None:
            return
        self.done, self.total = len(lister.names), lister.count
        if not lister.over:
            return
        self._lister = None
        if lister.error:
            self.finish("; ".join([*self.notes, f"list: {lister.error}"]))
            return
        self.way = "list"
        table = self._service.table(self.vehicle)
        for name in set(table.params) - lister.names:
            del table.params[name]  # of another firmware, or a name that only went by
        table.complete = True
        self._store()

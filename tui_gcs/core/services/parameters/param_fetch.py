"""Fetching all parameters of a vehicle in the cheapest way that works (docs/autopilots.md D).

1. PX4 reports a checksum: if the cache on disk has those parameters, nothing else is fetched.
2. ArduPilot serves them as a packed file by FTP.
3. Any autopilot sends a list, one message each (`ParamLister`).
"""

from collections.abc import Callable

from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.services.files.ftp_read import MemorySink
from tui_gcs.core.services.files.ftp_sessions import FtpReaderJob, FtpSessions
from tui_gcs.core.services.parameters.param_cache import CacheKey
from tui_gcs.core.services.parameters.param_channel import ParamChannel
from tui_gcs.core.services.parameters.param_pack import MAX_BYTES, ParamPackError, parse_pack
from tui_gcs.core.services.parameters.param_values import Parameter
from tui_gcs.core.uplink.jobs import Job

HASH_TRIES, HASH_WAIT_S = 3, 1.0
FTP_TRIES = 5
"""How often the first FTP request is sent: a vehicle without files is silent, and there are other ways."""
# ArduPilot answers questions by name with this index, and PX4 its hash: no progress of the list.
NO_INDEX = 65535
# ArduPilot has 1,327 parameters, PX4 886 (measured); the count is an uint16 that a forger may set.
MAX_COUNT = 4096
LIST_TRIES = 4
FIRST_WAIT_S, SLOW_FIRST_WAIT_S = 3.0, 6.0
"""How long the first value may take: ArduPilot needs up to 4.5 s for all of them while it boots."""
QUIET_S, SLOW_QUIET_S = 0.7, 2.5
"""Silence after which the stream is over; PX4 sends 8 values a second over a radio (docs/autopilots.md C4)."""
# QGroundControl has 10 questions in flight, too (docs/autopilots.md C4).
AT_ONCE, SLOW_AT_ONCE = 10, 3
ASK_GAP_S, SLOW_ASK_GAP_S = 0.25, 1.5
"""How long an answer is waited for before an index is requested again."""
MAX_VAIN_REQUESTS = 200
"""How many requests in a row may bring nothing new."""
RELIST_GAP_S = 10.0
"""How often all are requested again when their number changes (docs/threats.md B.6-67)."""
MAX_DURATION_S = 900.0


class ParamFetchJob(FtpReaderJob):
    """Fetches all parameters into the channel's table."""

    def __init__(
        self, channel: ParamChannel, ftp: FtpSessions, vehicle: int, on_done: Callable[[Job], None] | None = None
    ) -> None:
        super().__init__(ftp, vehicle, "parameters", on_done)
        self._channel = channel
        self.way = ""
        """How they arrived: "cache", "file" or "list"."""
        self.notes: list[str] = []
        """Why the ways tried before failed."""
        self._vehicle: Vehicle | None = None
        self._hash_name = ""
        self._hash: int | None = None
        self._hash_tries = self._hash_due_s = 0.0
        self._hashing: Callable[[int | None], None] | None = None
        self._paths: list[str] = []
        self._lister: ParamLister | None = None

    def begin(self, vehicle: Vehicle, now: float) -> None:
        """Request the checksum, or the file where the autopilot has none."""
        self._vehicle = vehicle
        ways = self._channel.ways(vehicle)
        self._paths = list(ways.packed)
        self._hash_name = ways.hash_name
        if self._hash_name:
            self._ask_hash(self._compare)
        else:
            self._begin_file()

    def tick(self, vehicle: Vehicle, now: float) -> None:
        """Repeat what is not answered."""
        if self._hashing is not None and now >= self._hash_due_s:
            self._repeat_hash(now)
        super().tick(vehicle, now)
        if self._lister is not None:
            self._lister.tick(now)
            self._look_list()

    def on_value(self, param: Parameter | None, name: str, index: int, count: int, bits: bytes) -> None:
        """Take a PARAM_VALUE; `param` is None for the checksum."""
        if name == self._hash_name and self._hashing is not None:
            then, self._hashing = self._hashing, None
            then(int.from_bytes(bits, "little"))
        if param is not None and self._lister is not None:
            self._lister.on_value(name, index, count, self._channel.now)
            self._look_list()

    def _ask_hash(self, then: Callable[[int | None], None]) -> None:
        self._hashing, self._hash_tries, self._hash_due_s = then, 0, 0.0
        self._repeat_hash(self._channel.now)

    def _repeat_hash(self, now: float) -> None:
        if self._hash_tries >= HASH_TRIES and self._hashing is not None:
            then, self._hashing = self._hashing, None
            then(None)
            return
        self._hash_tries += 1
        self._hash_due_s = now + HASH_WAIT_S
        self._channel.ask_name(self.vehicle, self._hash_name)

    def _compare(self, checksum: int | None) -> None:
        key = self._key()
        self._hash = checksum
        kept = self._channel.cache.load(key, checksum) if self._channel.cache and key and checksum is not None else None
        if kept:
            self._fill(kept, "cache")
            self.finish()
        else:
            self._begin_file()

    def _key(self) -> CacheKey | None:
        return self._channel.cache_key(self._vehicle) if self._vehicle is not None else None

    def _store(self) -> None:
        """Store what was fetched in the cache, if nothing changed meanwhile."""
        if self._hash is None or self._key() is None or self._channel.cache is None:
            self.finish()
        else:
            self._ask_hash(self._store_if_same)

    def _store_if_same(self, checksum: int | None) -> None:
        key, cache = self._key(), self._channel.cache
        # Only an unchanged checksum proves that nothing changed while it was fetched.
        if checksum is not None and checksum == self._hash and key is not None and cache is not None:
            cache.save(key, checksum, list(self._channel.table(self.vehicle).params.values()))
        self.finish()

    def _fill(self, params: list[Parameter], way: str) -> None:
        self.way = way
        self._channel.table(self.vehicle).fill(params)
        self.done = self.total = len(params)

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
            max_bytes=MAX_BYTES,
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
            # Without any answer the vehicle has no file server at all.
            if not nak:
                self._paths.clear()  # silence: the next path would fail, too
            self._begin_file()
        else:
            self._store()

    def _begin_list(self) -> None:
        self._ftp.end(self.vehicle)
        self.done = self.total = 0
        self._lister = ParamLister(
            lambda: self._channel.ask_list(self.vehicle),
            lambda index: self._channel.ask_index(self.vehicle, index),
            self._channel.now,
            slow=self._vehicle is not None and self._channel.context.is_slow(self._vehicle.link),
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
        table = self._channel.table(self.vehicle)
        for name in set(table.params) - lister.names:
            # Of another firmware, or reported outside of the list.
            del table.params[name]
        table.complete = True
        self._store()


class ParamLister:
    """Decides which indices to request next; `over` at the end, with `error` if values are missing.

    Names count, not indices: PX4's indices shift when more parameters come into use. A value with index 65535 answers
    another request (docs/autopilots.md C4).
    """

    def __init__(
        self, ask_list: Callable[[], None], ask_index: Callable[[int], None], now: float, *, slow: bool
    ) -> None:
        """Request the list at once.

        Args:
            ask_list: Sends PARAM_REQUEST_LIST.
            ask_index: Sends PARAM_REQUEST_READ for an index.
            now: Station time in seconds.
            slow: Whether the link is a telemetry radio.
        """
        self._ask_list, self._ask_index = ask_list, ask_index
        self._begun_s = now
        self._first_s = SLOW_FIRST_WAIT_S if slow else FIRST_WAIT_S
        self._quiet_s = SLOW_QUIET_S if slow else QUIET_S
        self._at_once = SLOW_AT_ONCE if slow else AT_ONCE
        self.count = 0
        """The number of parameters, as the vehicle announced it last."""
        self.names: set[str] = set()
        self._seen: set[int] = set()
        self._asked_s: dict[int, float] = {}
        """The indices that were requested and not answered, and when they are due again."""
        self._due_s = now + self._first_s
        self._lists = 1
        self._listed_s = now
        self._ask_gap_s = SLOW_ASK_GAP_S if slow else ASK_GAP_S
        self._vain = 0
        self._shifted = False
        self.over = False
        self.error = ""
        ask_list()

    def on_value(self, name: str, index: int, count: int, now: float) -> None:
        """Take a PARAM_VALUE of the list."""
        if self.over or index == NO_INDEX:
            return
        # PX4's count grows when more parameters come into use, and indices shift with it.
        if count != self.count:
            self._shifted = self.count > 0
            self.count = count
        new = name not in self.names or index not in self._seen
        # A vehicle may send names without end (docs/threats.md B.6-69).
        if len(self.names) < MAX_COUNT:
            self.names.add(name)
        if index < min(count, MAX_COUNT):
            self._seen.add(index)
        if not new or self._look_whole():
            return
        self._vain = 0
        if self._asked_s.pop(index, None) is not None:
            self._ask_more(now)
        elif not self._asked_s:
            self._due_s = now + self._quiet_s

    def tick(self, now: float) -> None:
        """Request again what did not arrive."""
        if self.over or now < self._due_s:
            return
        if now - self._begun_s > MAX_DURATION_S:
            self._end("it took too long")
        elif not self._seen and not self.names:
            self._list_again(now, "no answer")
        else:
            self._ask_more(now)

    def _look_whole(self) -> bool:
        """Whether all have arrived; ends the list then."""
        whole = 0 < self.count <= len(self.names) and (not self._shifted or len(self._seen) >= self.count)
        if whole and len(self._seen) >= self.count:
            self._end("")
        return self.over

    def _ask_more(self, now: float) -> None:
        """Keep some requests under way, for the first indices that are missing."""
        missing = [i for i in range(min(self.count, MAX_COUNT)) if i not in self._seen]
        # All indices came, but not as many names: they shifted under way.
        if not missing:
            self._asked_s.clear()
            self._relist(now)
            return
        for index in missing[: self._at_once]:
            if now >= self._asked_s.get(index, 0.0):
                self._vain += 1
                self._asked_s[index] = now + self._ask_gap_s
                self._ask_index(index)
        if self._vain > MAX_VAIN_REQUESTS:
            self._end(f"{len(self.names)} of {self.count} came")
        self._due_s = min(self._asked_s.values(), default=now + self._quiet_s)

    def _relist(self, now: float) -> None:
        if self.count > MAX_COUNT:
            self._end(f"{self.count} parameters are announced, at most {MAX_COUNT} are taken")
        # A count that keeps changing must not make us request lists without end (docs/threats.md B.6-67).
        elif now - self._listed_s < RELIST_GAP_S:
            self._due_s = self._listed_s + RELIST_GAP_S
        else:
            self._seen.clear()
            self._list_again(now, "the number of parameters keeps changing")

    def _list_again(self, now: float, why: str) -> None:
        if self._lists >= LIST_TRIES:
            self._end(why)
            return
        self._lists += 1
        self._listed_s = now
        self._shifted = False
        self._due_s = now + self._first_s
        self._ask_list()

    def _end(self, error: str) -> None:
        self.over, self.error = True, error

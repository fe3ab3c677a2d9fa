"""Reading a file: a burst from the first gap on, then what was lost block by block, until the very end.

The announced size is never believed (ArduPilot: always wrong for @PARAM, 1048576 for @MISSION). A file ends where a
read reports its end. Where packets of a burst were lost, the end that the burst reports proves nothing, so a read has
to confirm it.
"""

from collections.abc import Callable
from typing import Protocol

from tui_gcs.core.services.files.byte_ranges import ByteRanges
from tui_gcs.core.services.files.ftp_codec import Nak, Op, Packet
from tui_gcs.core.services.files.ftp_dialogue import FtpDialogue

MAX_BYTES = 64 << 20
"""The most of a file that is read, whatever size the vehicle announces (docs/threats.md B.6-89)."""
WINDOW_BYTES = 512 << 10
"""Data farther than this behind the first gap are dropped: two bursts of the longest kind."""
WIDE_GAP_BLOCKS = 64
"""A longer gap is requested by another burst, though ArduPilot's burst then repeats what follows the gap."""
# A vehicle may be gone in the middle of a file: it is not asked for ever.
MAX_SILENT_BURSTS = 20
MAX_WAITS, SESSION_WAIT_S = 4, 3.3
"""ArduPilot gives another station's session away after 3 s without a request."""
MIN_BYTES, PROGRESS_PERIOD_S = 300, 30.0
"""A vehicle that sends fewer bytes than this in this time would keep the reader busy for ever."""


class Sink(Protocol):
    """Takes the bytes of a file."""

    def write(self, offset: int, data: bytes) -> None:
        """Store `data` at `offset`. Raises OSError."""
        ...


class MemorySink:
    """A `Sink` that keeps the bytes in memory."""

    def __init__(self) -> None:
        self.data = bytearray()

    def write(self, offset: int, data: bytes) -> None:
        """Store `data` at `offset`. Gaps are filled with zeros; they are never longer than the reader's window."""
        if offset > len(self.data):
            self.data.extend(bytes(offset - len(self.data)))
        self.data[offset : offset + len(data)] = data


def check_path(path: str) -> str:
    """Return why that path is never requested, or ""."""
    raw = path.encode("utf-8", "replace")
    if not path or len(raw) > 230 or not path.isprintable():
        return "not a path: empty, too long, or with characters that cannot be seen"
    # PX4's simulator leaves its directory by "..".
    return "a path with .. is never asked for" if ".." in path.split("/") else ""


class FtpReader:
    """Reads one file within a dialogue. `on_end` is called once, with "" or why it failed."""

    def __init__(
        self,
        dialogue: FtpDialogue,
        path: str,
        sink: Sink,
        on_end: Callable[[str], None],
        *,
        now: Callable[[], float],
        max_bytes: int = MAX_BYTES,
        ranges: ByteRanges | None = None,
    ) -> None:
        """Prepare to read.

        Args:
            dialogue: Sends the requests; its `on_burst` is taken over.
            path: The path on the vehicle.
            sink: Where the bytes go.
            on_end: Called once with "" or why it failed.
            now: Station time in seconds.
            max_bytes: A longer file is an error.
            ranges: The bytes that the sink holds already.
        """
        self._dialogue = dialogue
        self._path = path
        self._sink = sink
        self._on_end = on_end
        self._now = now
        self._max_bytes = min(max_bytes, MAX_BYTES)
        self.ranges = ranges if ranges is not None else ByteRanges()
        self.announced = 0
        """The size that the vehicle announced, 0 if it is not plausible. It is only displayed."""
        self.nak = 0
        """The vehicle's error code if it refused to open the file, else 0."""
        self.too_large = False
        """It ended because the file is longer than what may be read."""
        self._end: int | None = None
        self._requested_at = 0
        self._near_end = False
        """A burst reported the end of the file: what may still be missing is requested by reads."""
        self._no_burst = False
        self._open = self.over = False
        self._silent = self._waits = self._wrong = 0
        self._mark_s, self._mark_held = now(), 0
        dialogue.on_burst = self._on_packet

    def begin(self) -> None:
        """Reset the session, which another station may have left open, and open the file."""
        # ArduPilot and PX4 have one session for all stations (docs/autopilots.md C10).
        self._dialogue.ask(Op.RESET, lambda reply: self.fail("no answer") if reply is None else self.start())

    def start(self) -> None:
        """Open the file. The session must have been reset."""
        why = check_path(self._path)
        if why:
            self._finish(why)
            return
        path = self._path.encode()
        self._dialogue.new_session()
        self._dialogue.ask(Op.OPEN_READ, self._on_open, data=path)

    def tick(self) -> None:
        """Repeat what is not answered, and give up when too little comes."""
        self._dialogue.tick()
        now = self._now()
        if not self.over and now - self._mark_s >= PROGRESS_PERIOD_S:
            if self._open and self.ranges.held - self._mark_held < MIN_BYTES:
                self.fail(f"only {self.ranges.held - self._mark_held} bytes in {PROGRESS_PERIOD_S:.0f} s")
            self._mark_s, self._mark_held = now, self.ranges.held

    def fail(self, why: str) -> None:
        """End with an error; the vehicle's session is closed without waiting."""
        if not self.over:
            if self._open:
                self._dialogue.terminate_quietly()
            self._finish(why)

    def abort(self) -> None:
        """Close the session without calling `on_end`."""
        self.over = True
        self._dialogue.terminate_quietly()

    def _on_open(self, reply: Packet | None) -> None:
        if reply is None:
            self._finish("no answer")
        elif reply.nak in (Nak.SESSION, Nak.NO_SESSIONS) and self._waits < MAX_WAITS:
            self._waits += 1
            self._dialogue.wait(SESSION_WAIT_S, self.begin)
        elif reply.nak:
            self.nak = reply.nak
            self._finish(reply.why)
        else:
            size = reply.number or 0
            # A vehicle may announce 4 GiB (docs/threats.md B.6-89).
            self.announced = size if size <= self._max_bytes else 0
            self._open = True
            self._mark_s, self._mark_held = self._now(), self.ranges.held
            self._next()

    def _finish(self, error: str) -> None:
        if not self.over:
            self.over, self._open = True, False
            self._dialogue.on_burst = None
            self._on_end(error)

    def _next(self) -> None:
        """Request the first gap, or close the file if there is none."""
        if self.over:
            return
        if self._end is not None and self.ranges.covers(self._end):
            self._open = False
            self._dialogue.ask(Op.TERMINATE, lambda _: self._finish(""), tries=5)
            return
        start, stop = self.ranges.first_gap()
        if stop is None:
            stop = self._end
        wide = not self._near_end if stop is None else stop - start > WIDE_GAP_BLOCKS * self._dialogue.block
        self._requested_at = start
        # A burst is quicker for long gaps; for short ones single reads are, because a burst repeats what follows the
        # gap.
        burst = wide and not self._no_burst
        self._dialogue.ask(
            Op.BURST if burst else Op.READ,
            self._on_burst_over if burst else self._on_read,
            offset=start,
            # ArduPilot's @PARAM needs one block size per handle.
            size=self._dialogue.block,
        )

    def _on_packet(self, packet: Packet) -> None:
        if self._open and packet.data and self._store(packet.offset, packet.data):
            self._silent = 0

    def _on_burst_over(self, reply: Packet | None) -> None:
        if reply is None:
            self._silent += 1
            if self._silent >= MAX_SILENT_BURSTS:
                self.fail("no answer")
                return
        # This server knows no bursts: read block by block.
        elif reply.nak == Nak.UNKNOWN_COMMAND:
            self._no_burst = True
        elif reply.nak == Nak.EOF:
            self._near_end = True
            if reply.offset > self._requested_at and reply.offset >= self.ranges.end:
                # Only ArduPilot reports where; elsewhere a read finds it.
                self._end = reply.offset
        elif reply.nak:
            self.fail(reply.why)
            return
        self._next()

    def _on_read(self, reply: Packet | None) -> None:
        if reply is None:
            self.fail("no answer")
        elif reply.nak == Nak.EOF or (not reply.nak and not reply.data):
            # The end lies before bytes that were read already: the file has become shorter.
            if self.ranges.end > self._requested_at:
                self.fail("it changed while it was read")
                return
            self._end = self._requested_at
            self._next()
        elif reply.nak:
            self.fail(reply.why)
        elif reply.offset != self._requested_at:
            self._wrong += 1
            if self._wrong > MAX_SILENT_BURSTS:
                self.fail("answers are for other places of the file")
            else:
                self._next()
        elif self._store(reply.offset, reply.data):
            self._near_end = self._near_end and self._end is not None
            self._next()

    def _store(self, offset: int, data: bytes) -> bool:
        """Store some bytes. False if they were not taken."""
        start, _ = self.ranges.first_gap()
        if offset + len(data) > self._max_bytes and offset <= start + WINDOW_BYTES:
            self.too_large = True
            self.fail(f"larger than {self._max_bytes} bytes: not read on")
            return False
        # Far offsets would make a file with holes of any size on the disk (docs/threats.md B.6-89).
        if offset > start + WINDOW_BYTES:
            self._dialogue.ignored["file data far beyond what was asked"] += 1
            return False
        if self._end is not None and offset + len(data) > self._end:
            # The file goes on behind the end that was reported.
            self._end, self._near_end = None, False
        if self.ranges.add(offset, offset + len(data)):
            try:
                self._sink.write(offset, data)
            except OSError as error:
                self.fail(f"cannot be written here: {error.strerror or error}")
                return False
        return True

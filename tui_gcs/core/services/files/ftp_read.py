"""Reading a file: a burst from where the first gap begins, then what was lost, block by block, until its very end.

The announced size is never believed (ArduPilot: always wrong for @PARAM, 1048576 for @MISSION): a file ends where a
read says so. Where packets of a burst were lost its end proves nothing, so that a read has to confirm it.
"""

from collections.abc import Callable
from typing import Protocol

from tui_gcs.core.services.files.byte_ranges import ByteRanges
from tui_gcs.core.services.files.ftp_codec import Nak, Op, Packet
from tui_gcs.core.services.files.ftp_dialogue import FtpDialogue

MAX_BYTES = 64 << 20
"""No file is read beyond this, whatever the vehicle says (docs/threats.md B.6-89)."""
WINDOW_BYTES = 512 << 10
"""Nothing is taken that lies farther behind the first gap: two bursts of the longest kind."""
WIDE_GAP_BLOCKS = 64
"""A longer gap is asked for as a burst again, though ArduPilot's then repeats what follows it."""
MAX_SILENT_BURSTS = 20
MAX_WAITS, SESSION_WAIT_S = 4, 3.3
"""ArduPilot gives the session of another station away after 3 s without a request of anybody."""
MIN_BYTES, PACE_S = 300, 30.0
"""Who brings less in this time would keep us for ever."""


class Sink(Protocol):
    """Where the bytes go."""

    def write(self, offset: int, data: bytes) -> None:
        """Put `data` there. Raises OSError."""
        ...


class MemorySink:
    """Bytes in memory."""

    def __init__(self) -> None:
        """Empty."""
        self.data = bytearray()

    def write(self, offset: int, data: bytes) -> None:
        """See `Sink`. Gaps are zeros, and as long as the reader's window at most."""
        if offset > len(self.data):
            self.data.extend(bytes(offset - len(self.data)))
        self.data[offset : offset + len(data)] = data


def check_path(path: str) -> str:
    """Why no vehicle is asked for that path, or "". PX4's simulator leaves its directory by "..", so we do not ask."""
    raw = path.encode("utf-8", "replace")
    if not path or len(raw) > 230 or not path.isprintable():
        return "not a path: empty, too long, or with characters that cannot be seen"
    return "a path with .. is never asked for" if ".." in path.split("/") else ""


class FtpReader:
    """Reads one file within a dialogue. `on_end` is told once: "" or why not."""

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
        """`ranges`: what the sink holds already."""
        self._dialogue = dialogue
        self._path = path
        self._sink = sink
        self._on_end = on_end
        self._now = now
        self._most = min(max_bytes, MAX_BYTES)
        self.ranges = ranges if ranges is not None else ByteRanges()
        self.announced = 0
        """What the vehicle says the size is; 0 if it is not plausible. For showing only."""
        self.nak = 0
        """The vehicle's own code where it refused."""
        self._end: int | None = None
        self._asked_at = 0
        self._near_end = False
        """A burst reported the end of the file: the rest, if there is any, is asked for by reads."""
        self._no_burst = False
        self._open = self.over = False
        self._silent = self._waits = self._wrong = 0
        self._mark_s, self._mark_held = now(), 0
        dialogue.on_burst = self._on_packet

    def begin(self) -> None:
        """Reset the session, which somebody may have left open, and start."""
        self._dialogue.ask(Op.RESET, lambda reply: self.fail("no answer") if reply is None else self.start())

    def start(self) -> None:
        """Open the file; the session has been reset."""
        why = check_path(self._path)
        if why:
            self._finish(why)
            return
        path = self._path.encode()
        self._dialogue.new_session()
        self._dialogue.ask(Op.OPEN_READ, self._on_open, data=path)

    def tick(self) -> None:
        """Repeat what is not answered; give up on who dribbles."""
        self._dialogue.tick()
        now = self._now()
        if not self.over and now - self._mark_s >= PACE_S:
            if self._open and self.ranges.held - self._mark_held < MIN_BYTES:
                self.fail(f"only {self.ranges.held - self._mark_held} bytes in {PACE_S:.0f} s")
            self._mark_s, self._mark_held = now, self.ranges.held

    def fail(self, why: str) -> None:
        """It ends here; the vehicle's session is closed without waiting."""
        if not self.over:
            if self._open:
                self._dialogue.terminate_quietly()
            self._finish(why)

    def abort(self) -> None:
        """Nobody wants it any more: close the session, tell nobody."""
        self.over = True
        self._dialogue.terminate_quietly()

    # ---------------------------------------------------------------- opening and closing

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
            self.announced = size if size <= self._most else 0
            self._open = True
            self._mark_s, self._mark_held = self._now(), self.ranges.held
            self._next()

    def _finish(self, error: str) -> None:
        if not self.over:
            self.over, self._open = True, False
            self._dialogue.on_burst = None
            self._on_end(error)

    # ---------------------------------------------------------------- what is missing

    def _next(self) -> None:
        """Ask for the first gap, or close if there is none."""
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
        self._asked_at = start
        burst = wide and not self._no_burst
        self._dialogue.ask(
            Op.BURST if burst else Op.READ,
            self._on_burst_over if burst else self._on_read,
            offset=start,
            size=self._dialogue.block,  # ArduPilot's @PARAM: always the same on one handle
        )

    def _on_packet(self, packet: Packet) -> None:
        """One packet of a burst."""
        if self._open and packet.data and self._store(packet.offset, packet.data):
            self._silent = 0

    def _on_burst_over(self, reply: Packet | None) -> None:
        if reply is None:
            self._silent += 1
            if self._silent >= MAX_SILENT_BURSTS:
                self.fail("no answer")
                return
        elif reply.nak == Nak.UNKNOWN_COMMAND:
            self._no_burst = True
        elif reply.nak == Nak.EOF:
            self._near_end = True
            if reply.offset > self._asked_at and reply.offset >= self.ranges.end:
                self._end = reply.offset  # ArduPilot says where; elsewhere a read has to tell
        elif reply.nak:
            self.fail(reply.why)
            return
        self._next()

    def _on_read(self, reply: Packet | None) -> None:
        if reply is None:
            self.fail("no answer")
        elif reply.nak == Nak.EOF or (not reply.nak and not reply.data):
            if self.ranges.end > self._asked_at:
                self.fail("it changed while it was read")
                return
            self._end = self._asked_at
            self._next()
        elif reply.nak:
            self.fail(reply.why)
        elif reply.offset != self._asked_at:
            self._wrong += 1
            if self._wrong > MAX_SILENT_BURSTS:
                self.fail("answers are for other places of the file")
            else:
                self._next()
        elif self._store(reply.offset, reply.data):
            self._near_end = self._near_end and self._end is not None
            self._next()

    def _store(self, offset: int, data: bytes) -> bool:
        """Keep some bytes; False if they were not taken."""
        start, _ = self.ranges.first_gap()
        if offset + len(data) > self._most and offset <= start + WINDOW_BYTES:
            self.fail(f"larger than {self._most} bytes: not read on")
            return False
        if offset > start + WINDOW_BYTES:
            self._dialogue.ignored["file data far beyond what was asked"] += 1
            return False
        if self._end is not None and offset + len(data) > self._end:
            self._end, self._near_end = None, False  # there is more than it said
        if self.ranges.add(offset, offset + len(data)):
            try:
                self._sink.write(offset, data)
            except OSError as error:
                self.fail(f"cannot be written here: {error.strerror or error}")
                return False
        return True

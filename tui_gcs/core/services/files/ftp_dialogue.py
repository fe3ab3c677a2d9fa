"""One dialogue with a vehicle's file server: one request at a time, repeated until it is answered.

`FtpReader`, `FtpWriter` and the other users ask; this class numbers, repeats, matches answers and measures round trips.
Reference: docs/autopilots.md "Files by MAVFTP" of both autopilots.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from random import Random

from tui_gcs.core.services.files.ftp_codec import DATA_BYTES, SLOW_DATA_BYTES, Op, Packet, pack, unpack
from tui_gcs.core.uplink.rtt_estimator import RttEstimator

MAX_TRIES = 20
"""How often one request is sent (docs/threats.md C.4: reads are repeated like stops)."""
FIRST_TRIES = 11
"""The same while the vehicle has not answered anything yet: ten retries."""
MAX_BURST = 1024
"""The most packets of one burst; ArduPilot ends a burst after 500."""
GROWING_TRIES, SLOWER_TRIES = 4, 8
"""Up to the first number of copies, waits grow. From the second on the link is assumed to have become slower."""
MAX_REACH = 0x4000
"""A packet whose number is this far behind is not recognised any more: numbers have 16 bits."""
BURST_PATIENCE = 2
"""How many times longer than for an answer silence must last within a burst: a repeated burst sends everything
again."""
IN_SESSION = frozenset({Op.READ, Op.WRITE, Op.BURST, Op.TERMINATE})
OPENING = frozenset({Op.OPEN_READ, Op.CREATE})

OnReply = Callable[[Packet | None], None]
"""Called with the answer; None if there was none."""


@dataclass
class _Pending:
    op: int
    seq: int
    session: int
    size: int
    offset: int
    data: bytes
    on_reply: OnReply
    tries: int
    sent: int = 0
    first_s: float = 0.0
    due_s: float = 0.0


class FtpDialogue:
    """Sends requests and matches answers; readers and writers decide what to ask."""

    def __init__(
        self,
        send: Callable[[list[int]], bool],
        now: Callable[[], float],
        random: Random,
        *,
        slow: bool = False,
        first_tries: int = FIRST_TRIES,
        ignored: Counter[str] | None = None,
    ) -> None:
        """Create a dialogue with a random session id.

        Args:
            send: Sends a payload to the vehicle. It returns False if that was refused for good.
            now: Station time in seconds.
            random: Source of the session id and of the first sequence number.
            slow: Whether the link is a telemetry radio.
            first_tries: How often the first request is sent while nothing is answered.
            ignored: Counts packets that belong to no request, by reason.
        """
        self._send = send
        self._now = now
        self.block = SLOW_DATA_BYTES if slow else DATA_BYTES
        # Random, because ArduPilot lets any station that guesses the id read on, or end, in our name. PX4 replaces it
        # by its own, always 0, in the answer to an open.
        self.session = random.randint(1, 255)
        self._seq = random.randrange(1 << 16)
        self._burst_from: int | None = None
        """Sequence number of the first burst request of this session: its packets are accepted as long as the session
        lasts."""
        self._pending: _Pending | None = None
        self._first_tries = first_tries
        self.round_trip = RttEstimator(slow=slow)
        self.answered = False
        self.closed = False
        self.on_burst: Callable[[Packet], None] | None = None
        """Called with every packet of a burst of this session, whenever it comes."""
        self.ignored = ignored if ignored is not None else Counter()

    def ask(
        self, op: Op, on_reply: OnReply, *, offset: int = 0, size: int | None = None, data: bytes = b"", tries: int = 0
    ) -> None:
        """Send a request and repeat it. `on_reply` is called once. A request that is still open is dropped.

        For `Op.BURST`, `on_reply` gets what ended the burst: its last packet, a NAK, or None for silence; the packets
        go to `on_burst`. A burst is not repeated here, because only the caller knows what is still missing.
        """
        session = self.session
        most = tries or MAX_TRIES
        length = len(data) if size is None else size
        self._pending = _Pending(op, self._seq, session, length, offset, data, on_reply, most)
        if op == Op.BURST and (self._burst_from is None or (self._seq - self._burst_from) & 0xFFFF > MAX_REACH):
            self._burst_from = self._seq if self._burst_from is None else (self._seq - MAX_REACH) & 0xFFFF
        self._repeat(self._pending)

    def wait(self, seconds: float, then: Callable[[], None]) -> None:
        """Send nothing for `seconds`, then call `then`."""
        self._pending = _Pending(0, self._seq, 0, 0, 0, b"", lambda _: then(), 0, due_s=self._now() + seconds)

    def skip(self) -> None:
        """Jump ahead with the sequence number: answers may be under way that will never be seen."""
        # The server repeats its last answer if a request's number is that answer's number less one. After a burst whose
        # last packets were lost, a new request could have just that number and would never be carried out.
        self._seq = (self._seq + MAX_BURST) & 0xFFFF

    def new_session(self) -> None:
        """The file was closed: packets of its bursts are old from now on."""
        self._burst_from = None

    def terminate_quietly(self) -> None:
        """Send TERMINATE without waiting for the answer."""
        self._pending = None
        self.skip()
        self._send(pack(self._seq, self.session, Op.TERMINATE, 0, 0))

    def close(self) -> None:
        """End the dialogue: nothing is received or sent any more."""
        self._pending, self.closed, self.on_burst = None, True, None

    def tick(self) -> None:
        """Repeat the open request when it is due, and give up in the end."""
        pending, now = self._pending, self._now()
        if pending is None or now < pending.due_s:
            return
        most = pending.tries if self.answered else min(pending.tries, self._first_tries)
        if pending.sent >= most or pending.op == Op.BURST:
            self._end(None)
        else:
            # After so many losses the link itself is probably slower than it was measured.
            if pending.sent >= SLOWER_TRIES:
                self.round_trip.add_loss()
            self._repeat(pending)

    def _repeat(self, pending: _Pending) -> None:
        now = self._now()
        pending.first_s = pending.first_s or now
        pending.sent += 1
        patience = BURST_PATIENCE if pending.op == Op.BURST else 1
        pending.due_s = now + patience * self.round_trip.wait_after(min(pending.sent, GROWING_TRIES))
        frame = pack(pending.seq, pending.session, pending.op, pending.size, pending.offset, pending.data)
        if not self._send(frame):
            self._end(None)

    def on_packet(self, payload: bytes) -> None:
        """Take a packet of the vehicle."""
        packet = unpack(payload)
        if packet.op not in (Op.ACK, Op.NAK):
            self.ignored["file request from a vehicle"] += 1
        elif packet.answers == Op.BURST and self._of_a_burst(packet):
            self._on_burst_packet(packet)
        else:
            self._on_answer(packet)

    def _of_a_burst(self, packet: Packet) -> bool:
        if self._burst_from is None or packet.session != self.session:
            return False
        reach = (self._seq - self._burst_from) & 0xFFFF
        return 0 < (packet.seq - self._burst_from) & 0xFFFF <= reach + MAX_BURST

    def _on_burst_packet(self, packet: Packet) -> None:
        """Take any packet of a burst; its end counts only while a burst is waited for."""
        pending = self._pending
        self.answered = True
        waiting = pending is not None and pending.op == Op.BURST
        # Answers to a burst count on (+1, +2, …), and the next request continues from the last one received
        # (docs/autopilots.md "Files by MAVFTP of ArduCopter").
        if waiting and 0 <= (packet.seq - self._seq) & 0xFFFF < MAX_BURST:
            self._seq = packet.seq
        if packet.op == Op.ACK:
            if waiting and pending is not None:
                if pending.sent == 1 and packet.seq == (pending.seq + 1) & 0xFFFF:
                    self.round_trip.add_sample(self._now() - pending.first_s)
                pending.due_s = self._now() + BURST_PATIENCE * self.round_trip.wait_s
            if self.on_burst is not None:
                self.on_burst(packet)
            pending = self._pending  # the callback may have asked something else
            if packet.complete and pending is not None and pending.op == Op.BURST:
                self._end(packet)
        elif pending is not None and not waiting and packet.seq == (pending.seq + 1) & 0xFFFF:
            self._renumber(pending)
        elif waiting:
            self._end(packet)
        else:
            self.ignored["file answer: end of an old burst"] += 1

    def _on_answer(self, packet: Packet) -> None:
        pending = self._pending
        if pending is None or not pending.op:
            self.ignored["file answer not requested"] += 1
        elif packet.seq != (pending.seq + 1) & 0xFFFF:
            self.ignored["file answer with an old or wrong number"] += 1
        elif packet.answers != pending.op:
            self._renumber(pending)
        # All stations share one session: an answer for another station's session id is not ours.
        elif pending.op in IN_SESSION and packet.session != pending.session:
            self.ignored["file answer of another session"] += 1
        else:
            self.answered = True
            # Of several copies it is not known which one was answered.
            if pending.sent == 1:
                self.round_trip.add_sample(self._now() - pending.first_s)
            self._seq = packet.seq
            # PX4 replaces the session id by its own.
            if pending.op in OPENING and packet.op == Op.ACK:
                self.session = packet.session
            self._end(packet)

    def _renumber(self, pending: _Pending) -> None:
        """Ask under another number: the server took the request for a repetition of the one before."""
        self.ignored["file answer repeated"] += 1
        if pending.sent >= pending.tries:
            return
        self.skip()
        pending.seq = self._seq
        self._repeat(pending)

    def _end(self, packet: Packet | None) -> None:
        pending, self._pending = self._pending, None
        if pending is None:
            return
        if packet is None:
            self.skip()
        else:
            self._seq = (self._seq + 1) & 0xFFFF
        pending.on_reply(packet)

"""How long a loaded station takes: from a request on the bus to the frame on the wire, from a question to its answer.

Both are measured at the socket of a vehicle that is played here. Where the system stamps arriving datagrams (Linux),
its stamp is used, so that it does not matter when this process gets its turn.
"""

import contextlib
import math
import random
import select
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator

from tests.bench.row import NotMeasured, Row
from tests.bench.sender import answers, is_question
from tests.bench.station import LiveStation
from tests.bench.stream import Datagram, frame, frames_of, stream
from tests.rigs.console_pty import PtyConsole
from tui_gcs.core.protocol import common as m

SO_TIMESTAMPNS = 35
"""Linux, asm-generic/socket.h; Python's socket module has no name for it."""
QUIET_S, REQUESTS, KEYS = 15.0, 150, 100
ASK_GAP_S = 0.06
"""A station answers the same vehicle every 20 ms at most; PX4 asks every 100 ms."""
TIMESYNC, SET_POSITION_TARGET = b"\x6f\x00\x00", b"\x56\x00\x00"
PROBE = 1
"""Its system id: one that the scenario has in a team, so that it may be commanded."""


def latencies(station: LiveStation, vehicles: int) -> Iterator[Row]:
    """Milliseconds; the load comes from elsewhere."""
    with probing(station.port, 160.0) as probe:
        station.until(lambda status: status.heard == vehicles, 15, f"{vehicles} vehicles heard")
        time.sleep(4)  # until all have been asked who they are
        quiet = probe.answers_of(lambda: time.sleep(QUIET_S))
        keys = list(key_delays_ms(probe, KEYS))
        holds: list[float] = []
        under_way = probe.answers_of(lambda: holds.extend(hold_delays_ms(station, probe, REQUESTS)))
    yield Row("bus request to frame on the wire: p50", percentile(holds, 50), "ms")
    yield Row("bus request to frame on the wire: p99", percentile(holds, 99), "ms", 10)
    yield Row("key of HOLD ALL to frame on the wire: p50", percentile(keys, 50), "ms")
    yield Row("key of HOLD ALL to frame on the wire: p99", percentile(keys, 99), "ms", 30)
    yield Row("TIMESYNC to its answer: p50", percentile(quiet, 50), "ms")
    yield Row("TIMESYNC to its answer: p99", percentile(quiet, 99), "ms", 10)
    yield Row("TIMESYNC to its answer, commands under way: p50", percentile(under_way, 50), "ms")
    yield Row("TIMESYNC to its answer, commands under way: p99", percentile(under_way, 99), "ms", 3)
    yield Row("TIMESYNC not answered", sum(map(math.isinf, quiet + under_way)), "", 0)


def hold_delays_ms(station: LiveStation, probe: "Probe", count: int) -> Iterator[float]:
    """Ask for a hold again and again. Each takes the place of the one before, which therefore is never repeated."""
    chance = random.Random(1)
    for _ in range(count):
        asked_ns = time.time_ns()
        reply = station.ask(m.Hold(vehicles=(PROBE,)))
        if not reply.ok:
            raise NotMeasured(f"hold refused: {reply.text} {reply.results}")
        time.sleep(chance.uniform(0.06, 0.14))
        came = [ns for ns, raw in list(probe.heard) if ns > asked_ns and raw[7:10] == SET_POSITION_TARGET]
        yield (came[0] - asked_ns) / 1e6 if came else math.inf


def key_delays_ms(probe: "Probe", count: int) -> Iterator[float]:
    """Type `!h` in a console of 120x40 again and again; milliseconds from the `h` to the frame for the vehicle."""
    chance = random.Random(2)
    console = PtyConsole(["--live"], module="tests.bench.console_child")
    try:
        console.read(6.0)
        for _ in range(count):
            console.press(b"!")
            console.read(chance.uniform(0.3, 0.5))
            pressed_ns = time.time_ns()
            console.press(b"h")
            console.read(0.5)
            came = [ns for ns, raw in list(probe.heard) if ns > pressed_ns and raw[7:10] == SET_POSITION_TARGET]
            # Also a vehicle whose hold was confirmed gets a new one, because each press is a stop of its own.
            yield (came[0] - pressed_ns) / 1e6 if came else math.inf
    finally:
        console.kill()
        console.end()


def percentile(values: list[float], percent: float) -> float:
    if not values:
        raise NotMeasured("nothing came")
    return sorted(values)[math.ceil(len(values) * percent / 100) - 1]


class Probe:
    """Vehicle 1 of the stream, in a thread. It asks for the time again and again, and notes when everything arrived."""

    def __init__(self, port: int, seconds: float) -> None:
        self.heard: list[tuple[int, bytes]] = []
        """(Unix nanoseconds, raw frame) of all the station sent."""
        self.asked_ns: list[int] = []
        """When it asked for the time; the same number is in the question."""
        self._due = [without_questions(sent) for sent in stream(PROBE, seconds) if sent.vehicle == PROBE - 1]
        self._newest = self._due[0].data
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        with contextlib.suppress(OSError):
            self._udp.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
        self._udp.connect(("127.0.0.1", port))
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def close(self) -> None:
        self._end.set()
        self._thread.join()
        self._udp.close()

    def answers_of(self, what: Callable[[], object]) -> list[float]:
        """Milliseconds to the answer of each question asked while `what` ran; infinite without."""
        first = len(self.asked_ns)
        what()
        asked = self.asked_ns[first:]
        time.sleep(0.2)
        came = {int.from_bytes(raw[18:26], "little"): ns for ns, raw in list(self.heard) if raw[7:10] == TIMESYNC}
        return [(came[ns] - ns) / 1e6 if ns in came else math.inf for ns in asked]

    def _run(self) -> None:
        began_s, at, next_s = time.monotonic(), 0, 0.0
        while not self._end.is_set() and at < len(self._due):
            now_s = time.monotonic() - began_s
            while at < len(self._due) and self._due[at].t_s <= now_s:
                self._send(self._due[at].data)
                at += 1
            if now_s >= next_s:
                next_s = now_s + ASK_GAP_S
                self._ask()
            soon_s = min(next_s, self._due[at].t_s if at < len(self._due) else math.inf)
            if select.select([self._udp], [], [], max(0.0, soon_s - now_s))[0]:
                self._take()

    def _ask(self) -> None:
        seq = list(frames_of(self._newest))[-1][4]
        now_ns = time.time_ns()
        self.asked_ns.append(now_ns)
        with contextlib.suppress(OSError):
            self._udp.send(frame(PROBE, seq, "TIMESYNC", {"tc1": 0, "ts1": now_ns}))

    def _send(self, data: bytes) -> None:
        if data:
            self._newest = data
            with contextlib.suppress(OSError):
                self._udp.send(data)

    def _take(self) -> None:
        try:
            data, extra, _, _ = self._udp.recvmsg(2048, 64)
        except OSError:
            return
        arrived_ns = time.time_ns()
        for _, kind, stamp in extra:
            if kind == SO_TIMESTAMPNS:
                seconds, nanoseconds = struct.unpack("@ll", stamp)
                arrived_ns = seconds * 1_000_000_000 + nanoseconds
        self.heard.append((arrived_ns, data))
        if is_question(data):
            self._udp.send(answers(PROBE, data, self._newest)[0])


def without_questions(sent: Datagram) -> Datagram:
    """The stream's own TIMESYNC left out: a station answers each vehicle 50 times a second at most."""
    return sent._replace(data=b"".join(raw for raw in frames_of(sent.data) if raw[7:10] != TIMESYNC))


@contextlib.contextmanager
def probing(port: int, seconds: float) -> Iterator[Probe]:
    probe = Probe(port, seconds)
    try:
        yield probe
    finally:
        probe.close()

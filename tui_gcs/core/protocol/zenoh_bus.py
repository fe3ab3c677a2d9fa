"""The bus between processes: Zenoh over a Unix socket in a directory that only its owner can enter.

The station serves (Zenoh mode "router", so that consoles and workers also reach each other through it), all others
connect. Nothing listens on the network, and scouting is off.
"""

import contextlib
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import zenoh
from zenoh.handlers import Callback

from tui_gcs.core.protocol.bus import BusError, Closable, OnAlive, OnAnswer, OnQuestion, OnSample, Registration

CONNECT_TIMEOUT_MS = 2000
RETRY = "{ period_init_ms: 200, period_max_ms: 200, period_increase_factor: 1 }"
"""When a lost connection is tried again: on a socket of this machine a try costs next to nothing."""


def serve(socket: Path) -> "ZenohBus":
    """Open the station's end. Raises `BusError` if the socket cannot be made."""
    return ZenohBus(_open("router", {"listen/endpoints": _endpoints(socket)}, f"listen on {socket}"))


def connect(socket: Path) -> "ZenohBus":
    """Join a station's bus; after a restart of the station the session is back by itself. Raises `BusError`."""
    settings = {
        "connect/endpoints": _endpoints(socket),
        "connect/timeout_ms": str(CONNECT_TIMEOUT_MS),
        "connect/exit_on_failure": "true",
    }
    return ZenohBus(_open("client", settings, f"connect to {socket}"))


def connect_later(socket: Path) -> "ZenohBus":
    """Join a station's bus as soon as there is one: returns at once, so that a console can paint meanwhile."""
    settings = {
        "connect/endpoints": _endpoints(socket),
        "connect/timeout_ms": "-1",
        "connect/exit_on_failure": "false",
        "listen/endpoints": "[]",
        "open/return_conditions/connect_scouted": "false",
    }
    return ZenohBus(_open("peer", settings, f"connect to {socket}"))


def _is_over(until: bytes) -> bool:
    """Whether the asker has got the answer that the station is silent: the request must not be carried out after that.

    `until` is a time of this machine's monotonic clock; a question without one (a stop) is never over.
    """
    with contextlib.suppress(ValueError):
        return time.monotonic() > float(until)
    return False


def _nothing() -> None:
    """What is no question needs no end."""


def _endpoints(socket: Path) -> str:
    return f'["unixsock-stream/{socket}"]'


def _open(mode: str, settings: dict[str, str], what: str) -> zenoh.Session:
    config = zenoh.Config()
    config.insert_json5("mode", f'"{mode}"')
    # Scouting would find other stations on the network, and be found by anybody there.
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("scouting/gossip/enabled", "false")
    # Zenoh would pass on whatever is large by shared memory: 20 MB more in each process, and a kill -9 leaves it there.
    config.insert_json5("transport/shared_memory/enabled", "false")
    # Zenoh waits 1 s, then 2 s, then 4 s: consoles were blind for 3.1 s (and up to 7.6 s) after a station's restart.
    config.insert_json5("connect/retry", RETRY)
    for key, value in settings.items():
        config.insert_json5(key, value)
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        why = str(error).partition("\n")[0][:200]
        raise BusError(f"cannot {what}: {why}") from None


class ZenohBus:
    """See `core.bus.Bus`. Callbacks run on Zenoh's threads; `QueuedBus` brings them to one."""

    def __init__(self, session: zenoh.Session) -> None:
        self.session = session
        self._publishers: dict[str, Any] = {}
        self._lock = threading.Lock()
        self._held: list[Closable] = []

    def publish(self, key: str, payload: bytes) -> None:
        """Never waits: with a stalled subscriber samples are dropped (docs/architecture.md)."""
        with self._lock:
            publisher = self._publishers.get(key)
            if publisher is None:
                # Measured with a subscriber that was stopped for 5 s: the longest put took 10 ms with DROP, 1.5 s with
                # BLOCK, which would stall every vehicle.
                drop = zenoh.CongestionControl.DROP
                publisher = self._publishers[key] = self.session.declare_publisher(key, congestion_control=drop)
        publisher.put(payload)

    def subscribe(self, key: str, on_sample: OnSample) -> Closable:
        """See `Bus.subscribe`."""

        def handle(sample: Any) -> None:
            sent_to, data = str(sample.key_expr), sample.payload.to_bytes()
            self._deliver(lambda: on_sample(sent_to, data))

        return self._hold(self.session.declare_subscriber(key, handle))

    def begin(
        self, key: str, payload: bytes, on_answer: OnAnswer, timeout_s: float = 2.0, *, late: bool = False
    ) -> None:
        """See `Bus.begin`. Never blocks, also if the station stands still: then the question is dropped."""
        # The deadline travels along, both sides share one machine's monotonic clock: a request that is read too late
        # must not be carried out after its asker gave up.
        until = None if late else str(time.monotonic() + timeout_s).encode()
        answers: list[bytes] = []

        def take(answer: Any) -> None:
            if answer.ok is not None and not answers:
                answers.append(answer.ok.payload.to_bytes())

        # Called when no more answers come, also after the time is up.
        handler = Callback(take, lambda: on_answer(answers[0] if answers else None), indirect=False)
        drop = zenoh.CongestionControl.DROP
        try:
            self.session.get(
                key, handler, payload=payload, timeout=timeout_s, attachment=until, congestion_control=drop
            )
        except zenoh.ZError:
            on_answer(None)

    def ask(self, key: str, payload: bytes, timeout_s: float = 2.0) -> bytes:
        """See `Bus.ask`."""
        answers: SimpleQueue[bytes | None] = SimpleQueue()
        self.begin(key, payload, answers.put, timeout_s)
        answer = answers.get()
        if answer is None:
            raise BusError(f"the station did not answer within {timeout_s:.0f} s")
        return answer

    def answer(self, key: str, on_question: OnQuestion) -> Closable:
        """See `Bus.answer`."""

        def handle(query: Any) -> None:
            payload = query.payload.to_bytes() if query.payload is not None else b""
            until = query.attachment.to_bytes() if query.attachment is not None else b""
            key_asked = str(query.key_expr)

            def reply(data: bytes) -> None:
                query.reply(key_asked, data)
                query.drop()

            self._deliver(partial(on_question, key_asked, payload, reply), until, query.drop)

        # Not by a thread of Python's in between: a stop must not wait for one more thread to be woken.
        return self._hold(self.session.declare_queryable(key, Callback(handle, indirect=False)))

    def alive(self, key: str) -> Closable:
        """See `Bus.alive`: gone within half a second of `kill -9`."""
        return self._hold(self.session.liveliness().declare_token(key))

    def watch(self, key: str, on_alive: OnAlive) -> Closable:
        """See `Bus.watch`."""

        def handle(sample: Any) -> None:
            seen, present = str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT
            self._deliver(lambda: on_alive(seen, present))

        return self._hold(self.session.liveliness().declare_subscriber(key, handle, history=True))

    def close(self) -> None:
        """Leave; a Python process that exits with an open session can hang."""
        self._held.clear()
        with contextlib.suppress(zenoh.ZError):
            self.session.close()  # type: ignore[no-untyped-call]

    def _hold(self, thing: Any) -> Closable:
        """Keep a reference: Zenoh undeclares what is garbage collected."""

        def undeclare() -> None:
            with contextlib.suppress(zenoh.ZError):
                thing.undeclare()

        self._held.append(Registration(undeclare))
        return self._held[-1]

    def _deliver(self, call: Callable[[], None], until: bytes = b"", drop: Callable[[], None] = _nothing) -> None:
        """Run a callback here and now, on a thread of Zenoh's; or `drop` it if it came later than `until`."""
        (drop if _is_over(until) else call)()


@dataclass(frozen=True)
class Arrival:
    """What came over the bus, and waits for its owner's thread."""

    call: Callable[[], None]
    until: bytes
    """Until when its asker waits, see `_is_over`."""
    drop: Callable[[], None]
    """Called instead when that time has passed."""


class QueuedBus(ZenohBus):
    """A bus whose callbacks run where `run_pending` is called: on the owner's one thread."""

    def __init__(self, bus: ZenohBus, wake: Callable[[], None]) -> None:
        """Take over the session of `bus`; `wake` is called from any thread when something waits."""
        super().__init__(bus.session)
        self._wake = wake
        self._pending: deque[Arrival] = deque()

    def run_pending(self) -> int:
        """Run what arrived; how much that was."""
        # Only what waits now: handlers may add more, and the loop must get its turn.
        count = len(self._pending)
        for _ in range(count):
            arrival = self._pending.popleft()
            (arrival.drop if _is_over(arrival.until) else arrival.call)()
        return count

    def _deliver(self, call: Callable[[], None], until: bytes = b"", drop: Callable[[], None] = _nothing) -> None:
        """Have the owner's thread run the callback, or `drop` it."""
        self._pending.append(Arrival(call, until, drop))
        self._wake()

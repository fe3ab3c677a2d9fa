"""Receiving: frames of all links go to the fleet, into the telemetry log and to other stations.

The process calls it as often as it likes; each call reads a bounded number of bytes, so a flood on one link starves no
other.
"""

from collections.abc import Callable

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.forward.forwarder import Forwarder
from tui_gcs.core.links import Link
from tui_gcs.core.mavlink.signing import for_log
from tui_gcs.core.protocol.common import EventClass
from tui_gcs.core.records.event_log import ERROR, NOTICE, WARNING, EventLog
from tui_gcs.core.records.tlog_writer import TlogWriter
from tui_gcs.core.signing.trust import SigningRegistry

MAX_BYTES = 256 * 1024
"""Bytes of all links together that one `receive` reads; the rest stays where it is."""


class Reception:
    """Receives from all links of a station."""

    def __init__(
        self,
        links: dict[str, Link],
        fleet: VehicleRegistry,
        recorder: TlogWriter,
        forwarder: Forwarder,
        trust: SigningRegistry,
        clock: Clock,
        events: EventLog,
    ) -> None:
        self._links = links
        self._fleet = fleet
        self._recorder = recorder
        self._forwarder = forwarder
        self._trust = trust
        self._clock = clock
        self._events = events
        self._first = 0
        """The index of the link that is read first: it changes, so that no link always comes after a flooded one."""
        self._down: set[str] = set()
        self._kernel_drops = dict.fromkeys(links, 0)
        self._next_look_s = clock.now()
        self.faults = 0
        """Counts how often a link went down."""

    def receive(self, may_go_on: Callable[[], bool] = lambda: True) -> int:
        """Take what has arrived; returns the number of datagrams, or of pieces of a stream.

        `may_go_on` is called before each link but the first: a process has only so much time.
        """
        now = self._clock.now()
        wall_s = self._clock.steady_wall()
        count = size = 0
        links = list(self._links.items())
        for number in range(self._first, self._first + len(links)):
            # One flooded link must not delay the others: the next call begins with the link that was left out.
            if number > self._first and (size > MAX_BYTES or not may_go_on()):
                self._first = number % len(links)
                break
            name, link = links[number % len(links)]
            before = link.bytes_in
            batch = link.receive()
            if batch:
                count += len(batch)
                size += link.bytes_in - before
                intake = self._fleet.intakes[link.spec.network]
                taken = intake.chunks(name, batch, now) if link.stream else intake.datagrams(name, batch, now)
                if taken:
                    self._forwarder.feed(link.spec.network, name, taken)
                    if self._trust.has_keys:  # signatures of real keys do not belong into logs (docs/threats.md A.1)
                        taken = [for_log(raw) for raw in taken]
                    self._recorder.write_many(wall_s, taken)
            # Reported on a change only: a cable that is unplugged would otherwise fill the journal.
            if bool(link.error) != (name in self._down) and not link.is_closed:
                self._report(name, link.error)
        if now >= self._next_look_s:
            self._next_look_s = now + 1.0
            self._look_at_drops()
        return count

    def _report(self, name: str, error: str) -> None:
        if error:
            self._down.add(name)
            self.faults += 1
            self._events.report(EventClass.CONNECTION, f"link {name}", error, ERROR)
        else:
            self._down.discard(name)
            self._events.report(EventClass.CONNECTION, f"link {name}", "works again", NOTICE)

    def _look_at_drops(self) -> None:
        """Report datagrams that the operating system dropped because they were not read in time."""
        for name, link in self._links.items():
            drops = link.kernel_drops
            if drops > self._kernel_drops.get(name, 0):
                text = f"overload: the system dropped datagrams before we read them ({drops} so far)"
                self._events.report(EventClass.CONNECTION, f"link {name}", text, WARNING, every_s=10)
                self._kernel_drops[name] = drops

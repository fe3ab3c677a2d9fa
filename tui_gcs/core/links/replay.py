"""Replay link: plays a telemetry log as if its vehicles were there now."""

import math

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.links.base import MAX_DATAGRAMS_PER_RECEIVE, Link
from tui_gcs.core.links.spec import LinkError, LinkSpec
from tui_gcs.core.mavlink.sources import Address
from tui_gcs.core.records.tlog_reader import TlogError, read_tlog


class ReplayLink(Link):
    """The frames of one file at their recorded pace; frames to send are refused."""

    def __init__(self, spec: LinkSpec, clock: Clock) -> None:
        """Begin with the file's first frame at the first `receive`.

        Raises:
            LinkError: the file cannot be read or holds no telemetry.
        """
        super().__init__(spec)
        self._clock = clock
        self._frames = read_tlog(spec.place)
        self._began_s = math.nan
        try:
            self._next_s, frame = next(self._frames)
        except TlogError as error:
            raise LinkError(f"{spec.name}: {error}") from None
        self._first_s = self._next_s
        self._next: bytes | None = frame.raw

    def receive(self) -> list[tuple[bytes, Address]]:
        """See `Link.receive`."""
        now = self._clock.now()
        if math.isnan(self._began_s):
            self._began_s = now
        due_s = self._first_s + (now - self._began_s) + 1e-6
        datagrams: list[tuple[bytes, Address]] = []
        while self._next is not None and self._next_s <= due_s and len(datagrams) < MAX_DATAGRAMS_PER_RECEIVE:
            datagrams.append((self._next, self.spec.place))
            self.bytes_in += len(self._next)
            self._advance()
        return datagrams

    def send(self, data: bytes, to: Address) -> None:
        """Count the frame as refused: there is no receiver."""
        self.send_refused += 1

    def close(self) -> None:
        """See `Link.close`."""
        self._next = None
        self.error = "closed"

    def _advance(self) -> None:
        try:
            self._next_s, frame = next(self._frames)
        except StopIteration:
            self._next, self.error = None, f"end of {self.spec.place}"
        except TlogError as error:
            self._next, self.error = None, str(error)
        else:
            self._next = frame.raw

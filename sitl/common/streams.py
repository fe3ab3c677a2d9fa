"""When each message of a link is due. Rates are exact: the next due time is the last one plus the interval."""

from collections.abc import Mapping

OFF = 0
NEVER_US = 1 << 62
MIN_INTERVAL_MS = 3
"""ArduPilot sends at most 0.8 messages per 400 Hz loop: it refuses an interval of 2500 µs."""


class Streams:
    """Intervals of one link. An interval that was requested for a message goes before that of its stream."""

    def __init__(self, groups: Mapping[int, tuple[str, ...]], defaults_ms: Mapping[str, int] | None = None) -> None:
        """`groups` are the streams of REQUEST_DATA_STREAM, `defaults_ms` the intervals without any request."""
        self._groups = groups
        self._defaults_ms = defaults_ms or {}
        self._stream_ms: dict[str, int] = {}
        self._asked_ms: dict[str, int] = {}
        self._due_us: dict[str, int] = {}
        self._next_us: int | None = None
        self._once: list[str] = []

    def interval_ms(self, name: str) -> int:
        """Return the interval in force; OFF if the message is not sent."""
        return self._asked_ms.get(name, self._stream_ms.get(name, OFF))

    def default_ms(self, name: str) -> int:
        """Return the interval without any request; OFF for a message that is sent on request only."""
        return self._defaults_ms.get(name, OFF)

    def send_once(self, *names: str) -> None:
        """Make messages due once, at the next tick and before all others."""
        self._once += names

    def ask(self, name: str, interval_ms: int | None, now_us: int) -> None:
        """Set the interval of one message; None returns to its stream's rate."""
        if interval_ms is None:
            self._asked_ms.pop(name, None)
        else:
            self._asked_ms[name] = interval_ms
        self._schedule(name, now_us)

    def ask_stream(self, stream: int, rate_hz: int, now_us: int) -> None:
        """Set the rate of a stream as REQUEST_DATA_STREAM does; stream 0 is all, rate 0 is off."""
        interval_ms = max(1000 // rate_hz, MIN_INTERVAL_MS) if rate_hz > 0 else OFF
        for number, names in self._groups.items():
            for name in names if stream in (0, number) else ():
                self._stream_ms[name] = interval_ms
                self._schedule(name, now_us)

    def _schedule(self, name: str, now_us: int) -> None:
        interval_ms = self.interval_ms(name)
        if interval_ms == OFF:
            self._due_us.pop(name, None)
        else:
            self._due_us[name] = now_us + interval_ms * 1000
        self._next_us = min(self._due_us.values(), default=None)

    def start_defaults(self, first_us: int) -> None:
        """Begin to send all messages that need no request, at first at `first_us`."""
        for name, interval_ms in self._defaults_ms.items():
            self.start(name, interval_ms, first_us)

    def start(self, name: str, interval_ms: int, first_us: int) -> None:
        """Begin to send one message without a request, at first at `first_us`."""
        self._asked_ms[name] = interval_ms
        self._due_us[name] = first_us
        self._next_us = min(self._due_us.values())

    def due(self, now_us: int) -> list[str]:
        """Return the names of the messages to be sent now, one entry per message."""
        names: list[str] = []
        if self._once:
            names, self._once = self._once, []
        if self._next_us is None or now_us < self._next_us:
            return names
        soonest = NEVER_US
        for name, at in self._due_us.items():
            if at <= now_us:
                interval_us = self.interval_ms(name) * 1000
                # A tick may be longer than an interval: the message is sent as often as it was due.
                while at <= now_us:
                    names.append(name)
                    at += interval_us
                self._due_us[name] = at
            if at < soonest:
                soonest = at
        self._next_us = soonest
        return names

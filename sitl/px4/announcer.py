"""What PX4 reports in words: STATUSTEXTs, and the EVENTs that contain the same for newer stations."""

from collections import deque
from collections.abc import Callable

from sitl.common.autopilot import Handler
from sitl.common.platform import Part, Platform
from sitl.common.states import MavSeverity
from sitl.links.wire import ReceivedFrame
from sitl.px4.events import UNAVAILABLE, EventLog

HEARTBEAT_TIMEOUT_US = 2_500_000
"""A link is alive this long after a ground station's heartbeat."""
TEXT_KEPT_US = 5_000_000
"""A text that no station could hear is dropped after this time."""
# Texts are kept for a station that is not heard yet; those older than 5 s are dropped when it comes.
MAX_TEXTS = 50
LEVELS_INFO, LEVELS_CRITICAL = 0x66, 0x62
"""log_levels of an EVENT: severity in the vehicle's log (low four bits) and for stations (high four bits)."""


class Announcer(Part):
    """Sends texts and events; a text waits for a ground station's heartbeat, an event does not."""

    def __init__(self, platform: Platform) -> None:
        super().__init__(platform)
        self.log = EventLog()
        self._texts: deque[tuple[int, MavSeverity, str]] = deque(maxlen=MAX_TEXTS)
        self._text_id = 0
        self.on_text: Callable[[MavSeverity, str], None] | None = None
        """What writes texts into the vehicle's log, whether or not a station hears them."""

    def handlers(self) -> dict[str, Handler]:
        """Return the handlers of this service."""
        return {"REQUEST_EVENT": self._resend_events}

    @property
    def gcs_alive(self) -> bool:
        """Whether heartbeats of a ground station arrive."""
        last_heard_us = self._state.gcs_last_heard_us
        return last_heard_us is not None and self._clock.now_us - last_heard_us <= HEARTBEAT_TIMEOUT_US

    def hear_gcs(self) -> None:
        """Take a ground station's heartbeat, and send the texts that waited for it."""
        self._state.gcs_last_heard_us = self._clock.now_us
        while self._texts:
            at_us, severity, text = self._texts.popleft()
            # An old text would be taken for news by a station that has just connected.
            if self._clock.now_us - at_us <= TEXT_KEPT_US:
                self._send_text(severity, text)

    def text(self, severity: MavSeverity, text: str) -> None:
        """Send a STATUSTEXT, or keep it until a ground station is alive."""
        # Texts go only to a link with a live heartbeat of a station; EVENTs and telemetry are sent regardless
        # (docs/autopilots.md "Wire of PX4").
        if self.on_text is not None:
            self.on_text(severity, text)
        if self.gcs_alive:
            self._send_text(severity, text)
        else:
            self._texts.append((self._clock.now_us, severity, text))

    def _send_text(self, severity: MavSeverity, text: str) -> None:
        self._outbox.send_chunks(severity, text.encode("ascii"), self._text_id)
        self._text_id = (self._text_id + 1) & 0xFFFF

    def event(self, name: str, *arguments: float, levels: int = LEVELS_INFO) -> None:
        """Send the EVENT of this name in the metadata."""
        self._outbox.send("EVENT", **self.log.add(name, arguments, levels, self._clock.boot_ms))

    def announce(self, text: str, event: str, *arguments: float, levels: int = LEVELS_INFO) -> None:
        """Send a text and the EVENT with the same content."""
        self._announce(MavSeverity.INFO, text, event, arguments, levels)

    def alert(self, text: str, event: str, *arguments: float, levels: int = LEVELS_CRITICAL) -> None:
        """Send a text of severity CRITICAL, and the EVENT with the same content: a refusal or a failsafe."""
        self._announce(MavSeverity.CRITICAL, text, event, arguments, levels)

    def _announce(
        self, severity: MavSeverity, text: str, event: str, arguments: tuple[float, ...], levels: int
    ) -> None:
        # The tab at the end of the text asks stations that understand events not to show the text as well.
        self.text(severity, f"{text}\t")
        self.event(event, *arguments, levels=levels)

    def _resend_events(self, frame: ReceivedFrame) -> None:
        first, last = frame.fields["first_sequence"], frame.fields["last_sequence"]
        for step in range(min((last - first) & 0xFFFF, 0xFF) + 1):
            sequence = (first + step) & 0xFFFF
            kept = self.log.get(sequence)
            if kept is not None:
                to = {"destination_system": frame.system, "destination_component": frame.component}
                self._outbox.send("EVENT", **to, **kept)
            else:
                missing = {"sequence": sequence, "sequence_oldest_available": self.log.oldest, "reason": UNAVAILABLE}
                self._outbox.reply(frame, "RESPONSE_EVENT_ERROR", **missing)

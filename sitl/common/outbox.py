"""Time and output of one vehicle: a clock in simulated microseconds, and the frames that are ready to be sent."""

from collections.abc import Callable
from typing import Any, Protocol

from sitl.common.command import Command
from sitl.common.states import MavSeverity
from sitl.links.signing import Signer
from sitl.links.wire import Encoder

Fields = dict[str, Any]
"""Field values of one message by name."""

CHUNK_BYTES = 50
"""Length of the text in one STATUSTEXT."""


class Sender(Protocol):
    """Whatever names the component to which an answer goes: a received message, a command, a transfer."""

    @property
    def system(self) -> int:
        """System id of the component."""

    @property
    def component(self) -> int:
        """Component id within the system."""


class VehicleClock:
    """Simulated time of one vehicle in integer microseconds. Nothing in the simulator reads a real clock."""

    def __init__(self) -> None:
        self.now_us = 0
        self.power_on_us = 0
        self.elapsed_us = 0
        """Time between the previous tick and this one."""

    def power_on(self, now_us: int) -> None:
        """Start to count `boot_ms` from now."""
        self.now_us = self.power_on_us = now_us
        self.elapsed_us = 0

    def advance(self, now_us: int) -> None:
        """Begin the tick of `now_us`."""
        self.elapsed_us = now_us - self.now_us
        self.now_us = now_us

    @property
    def since_power_on_us(self) -> int:
        """Microseconds since power-on, as TIMESYNC and `time_usec` report them."""
        return self.now_us - self.power_on_us

    @property
    def boot_ms(self) -> int:
        """Milliseconds since power-on, as `time_boot_ms` reports them."""
        return (self.now_us - self.power_on_us) // 1000


class Outbox:
    """Encodes and signs the frames of one vehicle and keeps them until the fleet is drained."""

    def __init__(self, system_id: int, signer: Signer, clock: VehicleClock) -> None:
        self.signer = signer
        self.datagrams: list[bytes] = []
        self.on_text: Callable[[str], None] | None = None
        """Receives every text that is sent, for the vehicle's log."""
        self.silent = False
        """The link is dead: frames are counted and signed, and nothing leaves."""
        self._encoder = Encoder(system_id)
        self._clock = clock
        self._held: list[tuple[str, Fields]] | None = None
        """Messages that wait for an acknowledgement; None while nothing has to wait."""
        self._text_id = 0

    def power_on(self) -> None:
        """Begin new sequence numbers of frames and of long texts."""
        self._encoder.sequence = 0
        self._text_id = 0
        self.signer.power_on(self._clock.now_us)

    def send(self, name: str, **fields: Any) -> None:
        """Queue one message, or hold it back."""
        if self._held is not None:
            self._held.append((name, fields))
            return
        # Encoded and signed also while silent: sequence numbers and signature times go on as in a vehicle out of range.
        frame = self.signer.sign(self._encoder.frame(name, fields), self._clock.now_us)
        if not self.silent:
            self.datagrams.append(frame)

    def send_plain(self, datagrams: tuple[bytes, ...]) -> None:
        """Queue datagrams that are not MAVLink, such as the plain text of a boot."""
        if not self.silent:
            self.datagrams.extend(datagrams)

    def hold_back(self) -> None:
        """Keep the messages that follow until `take_held`: a command's messages come after its acknowledgement."""
        self._held = []

    def take_held(self) -> list[tuple[str, Fields]]:
        """End `hold_back` and return the messages that were kept; empty without one."""
        held, self._held = self._held or [], None
        return held

    def send_all(self, messages: list[tuple[str, Fields]]) -> None:
        """Queue messages that were held back."""
        for name, fields in messages:
            self.send(name, **fields)

    def reply(self, to: Sender, name: str, **fields: Any) -> None:
        """Queue one message that is addressed to a component, or hold it back."""
        self.send(name, target_system=to.system, target_component=to.component, **fields)

    def answer(self, command: Command, result: int) -> None:
        """Queue the COMMAND_ACK of a command."""
        self.reply(command, "COMMAND_ACK", command=command.number, result=int(result))

    def text(self, severity: MavSeverity, text: str) -> None:
        """Queue a STATUSTEXT; a long text goes in chunks of one id."""
        if self.on_text is not None:
            self.on_text(text)
        raw = text.encode("ascii")
        if len(raw) <= CHUNK_BYTES:
            self.send("STATUSTEXT", severity=int(severity), text=raw)
            return
        self._text_id = self._text_id % 0xFFFF + 1
        self.send_chunks(severity, raw, self._text_id)

    def send_chunks(self, severity: MavSeverity, raw: bytes, text_id: int) -> None:
        """Queue a text as STATUSTEXTs of one id."""
        for number, start in enumerate(range(0, len(raw), CHUNK_BYTES)):
            chunk = raw[start : start + CHUNK_BYTES]
            self.send("STATUSTEXT", severity=int(severity), text=chunk, id=text_id, chunk_seq=number)

"""A vehicle that is switched on and never ticks: its message services with a clock that the test moves."""

import math
from collections.abc import Callable
from typing import Any

from sitl.ardupilot.copter import ArduCopter
from sitl.common.autopilot import Autopilot, BootTiming
from sitl.common.missions import Item, item_of
from sitl.common.platform import Identity
from sitl.common.vehicle_spec import VehicleSpec
from sitl.links.wire import Encoder, cut
from sitl.physics.point_masses import PointMasses
from sitl.px4.events import event_kinds
from sitl.px4.multicopter import Px4

HOME = (47.397742, 8.545594, 488.0)


class Bench:
    """A vehicle of system id 1 and a station that sends and hears."""

    def __init__(self, autopilot: Any, system: int = 255) -> None:
        kind: type[Autopilot] = Px4 if autopilot == "px4" else ArduCopter
        spec = VehicleSpec(1, *HOME, autopilot=autopilot)
        identity = Identity(bytes(8), "0" * 32)
        self.ap = kind(0, spec, PointMasses([spec]), timing=BootTiming(0, 0), identity=identity)
        self.platform = self.ap.platform
        self.platform.logs.files.clear()
        self.platform.state.gcs_last_heard_us = 0
        self.station = Encoder(system, 190)
        self.heard: list[tuple[float, str, dict[str, Any]]] = []

    def say(self, name: str, system: int | None = None, **fields: Any) -> None:
        """One message to the vehicle; what it answers at once is in `heard` then."""
        encoder = self.station if system is None else Encoder(system, 190)
        fields = {"target_system": 1, "target_component": 1, **fields}
        self.ap.receive(encoder.frame(name, fields))
        self._listen()

    def ask(self, name: str, **fields: Any) -> list[tuple[str, dict[str, Any]]]:
        """What comes back at once."""
        since = len(self.heard)
        self.say(name, **fields)
        return [(said, values) for _, said, values in self.heard[since:]]

    def run(self, seconds: float, tick_s: float = 0.005) -> None:
        for _ in range(math.ceil(seconds / tick_s - 1e-9)):
            clock = self.platform.clock
            clock.advance(clock.now_us + round(tick_s * 1e6))
            if isinstance(self.ap, Px4):
                self.platform.state.gcs_last_heard_us = clock.now_us  # its texts wait for a station otherwise
            self.platform.tasks.run(clock.now_us)
            self._listen()

    # Plans

    def upload(self, kind: int, items: list[Item], answer: Callable[[int], bool] = lambda seq: True) -> int | None:
        """The result of an upload whose requests are answered at once where `answer` says so."""
        self.forget()
        self.say("MISSION_COUNT", count=len(items), mission_type=kind)
        asked = -1
        while not self.of("MISSION_ACK"):
            requests = self.of("MISSION_REQUEST") + self.of("MISSION_REQUEST_INT")
            seq = requests[-1]["seq"]
            if seq == asked or not answer(seq):
                return None
            asked = seq
            self.say("MISSION_ITEM_INT", mission_type=kind, **items[seq].fields(seq))
        return int(self.last("MISSION_ACK")["type"])

    def download(self, kind: int) -> list[Item]:
        self.forget()
        self.say("MISSION_REQUEST_LIST", mission_type=kind)
        for seq in range(self.last("MISSION_COUNT")["count"]):
            self.say("MISSION_REQUEST_INT", mission_type=kind, seq=seq)
        self.say("MISSION_ACK", mission_type=kind, type=0)
        return [item_of(fields) for fields in self.of("MISSION_ITEM_INT")]

    def _listen(self) -> None:
        outbox, now_s = self.platform.outbox, self.platform.clock.now_us / 1e6
        for datagram in outbox.datagrams:
            self.heard += [(now_s, frame.name, frame.fields) for frame in cut(datagram)]
        outbox.datagrams = []

    def of(self, name: str) -> list[dict[str, Any]]:
        return [fields for _, said, fields in self.heard if said == name]

    def last(self, name: str) -> dict[str, Any]:
        return self.of(name)[-1]

    def texts(self) -> list[str]:
        return [text_of(fields) for fields in self.of("STATUSTEXT")]

    def events(self) -> list[str]:
        names = {kind.id: name for name, kind in event_kinds().items()}
        return [names[fields["id"]] for fields in self.of("EVENT")]

    def forget(self) -> None:
        self.heard = []


def text_of(fields: dict[str, Any]) -> str:
    return fields["text"].split(b"\0", 1)[0].decode()

"""One vehicle's stores without its flight: messages in through the endpoint, what it sends by name, a clock by hand."""

import math
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

from sitl.common.dialogue_state import Stores
from sitl.common.logs import Logs
from sitl.common.missions import Item, Plans, item_of
from sitl.common.parameters import ParameterTable
from sitl.common.states import Severity
from sitl.common.tasks import Tasks
from sitl.links import endpoint
from sitl.links.signing import Signer, SigningSpec
from sitl.links.wire import Encoder, cut
from sitl.px4.events import EventLog, kinds

HOME = (47.397742, 8.545594, 488.0)


class Ground:
    """A flat earth around HOME."""

    M_PER_DEG = 111_319.5

    def to_geodetic(self, _: int, x_m: float, y_m: float) -> tuple[float, float]:
        return HOME[0] + y_m / self.M_PER_DEG, HOME[1] + x_m / (self.M_PER_DEG * math.cos(math.radians(HOME[0])))

    def to_local(self, _: int, lat_deg: float, lon_deg: float) -> tuple[float, float]:
        east = (lon_deg - HOME[1]) * self.M_PER_DEG * math.cos(math.radians(HOME[0]))
        return east, (lat_deg - HOME[0]) * self.M_PER_DEG


class Vehicle:
    """What the stores need of an autopilot: the attributes of `sitl.common.autopilot.Autopilot` without the rest."""

    def __init__(self, autopilot: str, system_id: int = 1) -> None:
        self.spec = SimpleNamespace(autopilot=autopilot, system_id=system_id, ground_amsl_m=HOME[2])
        self.params = ParameterTable(system_id, autopilot)
        self.tasks = Tasks()
        self.signer = Signer(SigningSpec(), px4=False)
        self.encoder = Encoder(system_id)
        self.now_us = self.power_on_us = 0
        self.armed = False
        self.mode = 0
        self.plans, self.stores = Plans(), Stores()
        self.index, self.home_m = 0, (0.0, 0.0, 0.0)
        self.vehicles = Ground()
        self.log = EventLog()
        self.logs, self.files = Logs(autopilot), None
        self.gcs_heard_us: int | None = 0
        self.out: list[bytes] = []

    @property
    def boot_ms(self) -> int:
        return self.now_us // 1000

    def send(self, name: str, **fields: Any) -> None:
        self.out.append(self.encoder.frame(name, fields))

    def text(self, severity: Severity, text: str) -> None:
        self.send("STATUSTEXT", severity=int(severity), text=text.encode())

    def acknowledge(self, command: int, result: int, system: int, component: int) -> None:
        self.send("COMMAND_ACK", command=command, result=int(result), target_system=system, target_component=component)

    def event(self, name: str, *arguments: float, levels: int = 0x66) -> None:
        self.send("EVENT", **self.log.add(name, arguments, levels, self.now_us // 1000))

    def tell(self, text: str, event: str, *arguments: float, severity: int = 6, levels: int | None = None) -> None:
        self.text(Severity(severity), f"{text}\t")
        self.event(event, *arguments, levels=levels or 0x66)

    def banner(self) -> None:
        for text in ("ArduCopter V4.7.0-dev (cef8bcef)", "0" * 32, "Frame: QUAD/PLUS"):
            self.text(Severity.INFO, text)


class Bench:
    """The vehicle and a station that says and hears."""

    def __init__(self, autopilot: str, system: int = 255) -> None:
        self.ap: Any = Vehicle(autopilot)
        self.station = Encoder(system, 190)
        self.heard: list[tuple[float, str, dict[str, Any]]] = []

    def say(self, name: str, system: int | None = None, **fields: Any) -> None:
        """One message to the vehicle; what it answers at once is in `heard` then."""
        encoder = self.station if system is None else Encoder(system, 190)
        fields = {"target_system": 1, "target_component": 1, **fields}
        endpoint.receive(self.ap, encoder.frame(name, fields))
        self._listen()

    def ask(self, name: str, **fields: Any) -> list[tuple[str, dict[str, Any]]]:
        """What comes back at once."""
        since = len(self.heard)
        self.say(name, **fields)
        return [(said, values) for _, said, values in self.heard[since:]]

    def run(self, seconds: float, tick_s: float = 0.005) -> None:
        for _ in range(math.ceil(seconds / tick_s - 1e-9)):
            self.ap.now_us += round(tick_s * 1e6)
            self.ap.tasks.run(self.ap.now_us)
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
        for datagram in self.ap.out:
            self.heard += [(self.ap.now_us / 1e6, frame.name, frame.fields) for frame in cut(datagram)]
        self.ap.out = []

    def of(self, name: str) -> list[dict[str, Any]]:
        return [fields for _, said, fields in self.heard if said == name]

    def last(self, name: str) -> dict[str, Any]:
        return self.of(name)[-1]

    def texts(self) -> list[str]:
        return [text_of(fields) for fields in self.of("STATUSTEXT")]

    def events(self) -> list[str]:
        names = {kind.id: name for name, kind in kinds().items()}
        return [names[fields["id"]] for fields in self.of("EVENT")]

    def forget(self) -> None:
        self.heard = []


def text_of(fields: dict[str, Any]) -> str:
    return fields["text"].split(b"\0", 1)[0].decode()

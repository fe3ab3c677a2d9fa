"""One vehicle's stores without its flight: messages in through the endpoint, what it sends by name, a clock by hand."""

import math
from types import SimpleNamespace
from typing import Any

from sitl import endpoint
from sitl.modes import Severity
from sitl.parameters import ParameterTable
from sitl.signing import Signer, SigningSpec
from sitl.tasks import Tasks
from sitl.wire import Encoder, cut

HOME = (47.397742, 8.545594, 488.0)


class Vehicle:
    """What the stores need of an autopilot: the attributes of `sitl.autopilot.Autopilot` without the rest."""

    def __init__(self, autopilot: str, system_id: int = 1) -> None:
        self.spec = SimpleNamespace(autopilot=autopilot, system_id=system_id, ground_amsl_m=HOME[2])
        self.params = ParameterTable(system_id, autopilot)
        self.tasks = Tasks()
        self.signer = Signer(SigningSpec(), px4=False)
        self.encoder = Encoder(system_id)
        self.now_us = self.power_on_us = 0
        self.armed = False
        self.mode = 0
        self.out: list[bytes] = []

    def send(self, name: str, **fields: Any) -> None:
        self.out.append(self.encoder.frame(name, fields))

    def text(self, severity: Severity, text: str) -> None:
        self.send("STATUSTEXT", severity=int(severity), text=text.encode())

    def acknowledge(self, command: int, result: int, system: int, component: int) -> None:
        self.send("COMMAND_ACK", command=command, result=int(result), target_system=system, target_component=component)

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

    def forget(self) -> None:
        self.heard = []


def text_of(fields: dict[str, Any]) -> str:
    return fields["text"].split(b"\0", 1)[0].decode()

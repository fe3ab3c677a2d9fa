"""The one door: every frame to a vehicle leaves here, addressed to one named vehicle, recorded, and journalled.

Actions are one journal line each; set-points, which are many, one summary line a second and vehicle.
"""

from collections import Counter
from typing import Any

from tui_gcs.core.clock import Clock
from tui_gcs.core.events import ALERT, EventLog
from tui_gcs.core.fleet import Fleet
from tui_gcs.core.guard import Guard
from tui_gcs.core.journal import Journal
from tui_gcs.core.links import Link
from tui_gcs.core.messages import EventClass, Freshness, Kind
from tui_gcs.core.recorder import TlogWriter
from tui_gcs.core.vehicle import Vehicle
from tui_gcs.core.wire.encode import Encoder

HOUSEKEEPING = frozenset({"HEARTBEAT", "COMMAND_LONG:511", "COMMAND_LONG:512"})
"""What may go to a vehicle that has not proven which kind it is: our heartbeat, interval and information requests."""


class Door:
    """Sends to vehicles, and nobody else does."""

    def __init__(
        self,
        links: dict[str, Link],
        fleet: Fleet,
        guard: Guard,
        encoder: Encoder,
        recorder: TlogWriter,
        journal: Journal,
        clock: Clock,
        events: EventLog,
        kind: Kind,
        token: str,
    ) -> None:
        """`token` is what our own simulator's vehicles prove themselves with; used only when `kind` is SIM."""
        self._links = links
        self._fleet = fleet
        self._guard = guard
        self._encoder = encoder
        self._recorder = recorder
        self._journal = journal
        self._clock = clock
        self._events = events
        self._kind = kind
        self._token = token
        self._setpoints: Counter[int] = Counter()
        self._summary_s = clock.now()
        self.sent = 0
        self.refused: Counter[str] = Counter()

    def is_ours(self, vehicle: Vehicle) -> bool:
        """SIM: only vehicles that carry this run's token; without a token (`--kind sim`) and in LIVE every vehicle."""
        if self._kind is not Kind.SIM or not self._token:
            return True
        return vehicle.identified and vehicle.firmware_token == self._token

    def heartbeat(self) -> None:
        """Our 1 Hz heartbeat, to every vehicle heard: once per address it is heard from."""
        frame = self._encoder.encode(
            "HEARTBEAT", type=6, autopilot=8, base_mode=0, custom_mode=0, system_status=4, mavlink_version=3
        )
        targets = {(vehicle.link, vehicle.address) for vehicle in self._fleet.vehicles.values()}
        for link, address in sorted(targets, key=str):
            self._links[link].send(frame, address)
        if targets:
            self._recorder.write(self._clock.wall(), frame)
            self.sent += 1

    def action(self, vehicle_id: int, what: str, name: str, **fields: Any) -> None:
        """Have the guard judge an action, journal it, send it. `what` is the operator's word for it."""
        vehicle = self._fleet.vehicles.get(vehicle_id)
        lost = vehicle is not None and vehicle.freshness(self._clock.now()) is Freshness.LOST
        verdict = self._guard.judge_action(what, lost=lost)
        if not verdict.ok:
            self._refuse(vehicle_id, name, verdict.text)
            return
        self._journal.write(
            {"action": what, "vehicle": vehicle_id, "message": name, "wall_s": self._clock.wall()} | _numbers(fields)
        )
        self._send(vehicle_id, name, fields)

    def setpoint(self, vehicle_id: int, **fields: Any) -> None:
        """Send a SET_POSITION_TARGET_GLOBAL_INT that the guard has passed (or that is a hold or a return)."""
        self._setpoints[vehicle_id] += 1
        self._send(vehicle_id, "SET_POSITION_TARGET_GLOBAL_INT", fields)

    def ask(self, vehicle_id: int, name: str, **fields: Any) -> None:
        """Send a request for information or message rates."""
        self._send(vehicle_id, name, fields)

    def tick(self) -> None:
        """Write the set-point summary when it is due."""
        now = self._clock.now()
        if now - self._summary_s >= 1.0:
            self._summary_s = now
            if self._setpoints:
                counts = {str(k): v for k, v in sorted(self._setpoints.items())}
                self._journal.write({"setpoints": counts, "wall_s": self._clock.wall()})
                self._setpoints.clear()

    def _send(self, vehicle_id: int, name: str, fields: dict[str, Any]) -> None:
        vehicle = self._fleet.vehicles.get(vehicle_id)
        if vehicle is None or vehicle_id == 0:
            self._refuse(vehicle_id, name, "unknown vehicle")
            return
        purpose = f"{name}:{fields['command']}" if "command" in fields else name
        if purpose not in HOUSEKEEPING and not self.is_ours(vehicle):
            self._refuse(vehicle_id, name, "not one of our simulated vehicles")
            return
        frame = self._encoder.encode(name, target_system=vehicle.id, target_component=vehicle.component, **fields)
        self._recorder.write(self._clock.wall(), frame)
        self._links[vehicle.link].send(frame, vehicle.address)
        self.sent += 1

    def _refuse(self, vehicle_id: int, name: str, why: str) -> None:
        """Nothing that was meant for a vehicle is lost silently."""
        self.refused[why] += 1
        text = f"{name} NOT SENT: {why}"
        self._events.say(EventClass.PROCESSING, f"vehicle {vehicle_id}", text, ALERT, every_s=5)


def _numbers(fields: dict[str, Any]) -> dict[str, float]:
    return {key: value for key, value in fields.items() if isinstance(value, (int, float)) and value}

"""The uplink: every frame to a vehicle leaves here, addressed to one named vehicle, recorded and journalled.

Actions are one journal line each; set-points and parts of transfers, which are many, one summary line a second.
"""

from collections import Counter
from collections.abc import Iterator
from typing import Any

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.fleet.identity.path import Path
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.guard import STARTS, STOPS, Guard
from tui_gcs.core.links import Link
from tui_gcs.core.mavlink import dialect
from tui_gcs.core.mavlink.encode import Encoder
from tui_gcs.core.mavlink.signing import SigningKey, ticks
from tui_gcs.core.mavlink.sources import Address, Source
from tui_gcs.core.protocol.common import EventClass, Freshness, RunKind
from tui_gcs.core.records.event_log import ALERT, EventLog
from tui_gcs.core.records.journal import Journal
from tui_gcs.core.records.tlog_writer import TlogWriter
from tui_gcs.core.signing.trust import SigningRegistry

ALLOWED_TO_UNPROVEN = frozenset({"HEARTBEAT", "COMMAND_LONG:511", "COMMAND_LONG:512", "TIMESYNC", "PING"})
"""What may go to a vehicle that has not proven which kind of run it belongs to: heartbeat, answers, requests for
information."""

NO_MORE_PARAMETERS = {f"param{i}": 0 for i in range(2, 8)}
HEARTBEATS_AT_ONCE = 40
"""Heartbeats sent before the rest of the station has its turn."""
HEARTBEAT_ID = b"\x00\x00\x00"


class Uplink:
    """Sends to vehicles; nothing else does."""

    def __init__(
        self,
        links: dict[str, Link],
        fleet: VehicleRegistry,
        guard: Guard,
        encoder: Encoder,
        recorder: TlogWriter,
        journal: Journal,
        clock: Clock,
        events: EventLog,
        kind: RunKind,
        token: str,
        trust: SigningRegistry,
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
        self._trust = trust
        self._setpoints: Counter[int] = Counter()
        self._parts: Counter[tuple[int, str]] = Counter()
        self._summary_s = clock.now()
        self.sent = 0
        self.refused: Counter[str] = Counter()

    def is_ours(self, vehicle: Vehicle) -> bool:
        """Whether this station may command the vehicle.

        In SIM only vehicles that carry this run's token; without a token (`--kind sim`) and in LIVE every vehicle.
        """
        if self._kind is not RunKind.SIM or not self._token:
            return True
        return vehicle.identity.identified and vehicle.identity.firmware_token == self._token

    def heartbeat(self) -> Iterator[None]:
        """Send our 1 Hz heartbeat once to every address that vehicles are heard from, and to configured partners.

        Vehicles with a key get it signed, each by itself. It never goes over a high-latency link. The generator yields
        after some addresses, because a big fleet's heartbeats take some milliseconds.
        """
        # Autopilots watch this heartbeat: its loss triggers their ground station failsafe.
        frame = self.our_heartbeat()
        signed: list[tuple[Vehicle, Path]] = []
        targets = {(link.name, partner) for link in self._links.values() for partner in link.partners}
        for vehicle in self._fleet.vehicles.values():
            for path in vehicle.used_paths():
                if vehicle.identity.keyed:
                    signed.append((vehicle, path))
                else:
                    targets.add((path.source.link, path.source.address))
        if targets or signed:
            self._recorder.write(self._clock.steady_wall(), frame)
        for number, (vehicle, path) in enumerate(signed, 1):
            self._put(path.source.link, path.source.address, self._trust.signed(vehicle, frame))
            if number % HEARTBEATS_AT_ONCE == 0:
                yield
        for number, (link, address) in enumerate(sorted(targets, key=str), 1):
            self._put(link, address, frame)
            if number % HEARTBEATS_AT_ONCE == 0:
                yield
        yield

    def our_heartbeat(self) -> bytes:
        """Our heartbeat, unsigned: MAV_TYPE_GCS, no autopilot, active."""
        return self._encoder.encode(
            "HEARTBEAT", type=6, autopilot=8, base_mode=0, custom_mode=0, system_status=4, mavlink_version=3
        )

    def send_time(self, source: Source, heartbeat: bytes) -> None:
        """Send a signed heartbeat to a source that holds our key and is behind in time.

        See `SigningRegistry.due_time_frames`.
        """
        self._put(source.link, source.address, heartbeat)

    def action(self, vehicle_id: int, what: str, name: str, **fields: Any) -> str:
        """Have the guard judge an action, journal it, send it; "" or why not. `what` is the operator's word."""
        vehicle = self._fleet.vehicles.get(vehicle_id)
        why = (self._why_not(vehicle, what) if vehicle is not None else "") or self._why_no_target(
            vehicle, name, fields
        )
        # What is refused is not journalled as sent.
        if why:
            return self._refuse(vehicle_id, name, why)
        self._journal.write(
            {"action": what, "vehicle": vehicle_id, "message": name, "wall_s": self._clock.wall()} | _numbers(fields)
        )
        return self._send(vehicle_id, name, fields, every_path=what in STOPS)

    def foreign(self, vehicle_id: int, raw: bytes, what: str, source: str) -> str:
        """Pass on another station's frame, unchanged, if the guard lets it. Returns "" or why not.

        It is journalled with its source.

        The frame keeps its sender, so one for a vehicle with a key cannot be signed here: it is refused.
        """
        vehicle = self._fleet.vehicles.get(vehicle_id)
        if vehicle is None:
            return "unknown vehicle"
        why = self._why_not(vehicle, what)
        if not why and not self.is_ours(vehicle):
            why = "not one of our simulated vehicles"
        if not why and vehicle.identity.keyed:
            why = "the vehicle takes signed frames only, and another station's are not signed for it"
        entry = {"foreign": what, "source": source, "vehicle": vehicle_id, "wall_s": self._clock.wall()}
        self._journal.write(entry | ({"refused": why} if why else {}))
        if why:
            self.refused[why] += 1
            return why
        # A foreign frame is recorded as it goes out, with its own sender.
        self._recorder.write(self._clock.steady_wall(), raw)
        self._put_to(vehicle, raw, every_path=what in STOPS)
        return ""

    def give_key(self, vehicle: Vehicle, key: SigningKey) -> str:
        """Send `key` with SETUP_SIGNING to one vehicle; "" or why not.

        It is never recorded, and journalled by name only.

        The caller has checked that the link is secure and the vehicle disarmed, and that the operator has confirmed it.
        """
        why = self._why_not(vehicle, "provision key")
        if why or not self.is_ours(vehicle):
            return why or "not one of our simulated vehicles"
        self._journal.write(
            {"action": "provision key", "vehicle": vehicle.id, "key": key.name, "fingerprint": key.fingerprint}
        )
        frame = self._encoder.encode(
            "SETUP_SIGNING",
            target_system=vehicle.system,
            target_component=vehicle.component,
            secret_key=list(key.secret),
            initial_timestamp=ticks(self._clock.wall()),
        )
        self._put(vehicle.link, vehicle.address, self._trust.signed(vehicle, frame))
        return ""

    def setpoint(self, vehicle_id: int, **fields: Any) -> None:
        """Send a SET_POSITION_TARGET_GLOBAL_INT that the guard has passed (or that is a hold or a return)."""
        vehicle = self._fleet.vehicles.get(vehicle_id)
        if vehicle is not None and vehicle.why_not_commanded:
            self._refuse(vehicle_id, "set-point", vehicle.why_not_commanded)
            return
        if not self._send(vehicle_id, "SET_POSITION_TARGET_GLOBAL_INT", fields):
            self._setpoints[vehicle_id] += 1

    def transfer(self, vehicle_id: int, what: str, name: str, **fields: Any) -> bool:
        """Send a part of a transfer whose beginning was an `action` (plan items, file blocks); whether it left.

        The guard judges every part; the journal gets one line a second with their number.
        """
        vehicle = self._fleet.vehicles.get(vehicle_id)
        why = self._why_not(vehicle, what) if vehicle is not None else ""
        if why:
            self._refuse(vehicle_id, name, why)
            return False
        if self._send(vehicle_id, name, fields):
            return False
        self._parts[(vehicle_id, what)] += 1
        return True

    def ask(self, vehicle_id: int, name: str, **fields: Any) -> str:
        """Send a request for information or message rates; "" or why not."""
        return self._send(vehicle_id, name, fields)

    def tick(self) -> None:
        """Journal the summary of set-points and transfers when it is due."""
        now = self._clock.now()
        if now - self._summary_s >= 1.0:
            self._summary_s = now
            if self._setpoints:
                counts = {str(k): v for k, v in sorted(self._setpoints.items())}
                self._journal.write({"setpoints": counts, "wall_s": self._clock.wall()})
                self._setpoints.clear()
            for (vehicle, what), parts in sorted(self._parts.items()):
                self._journal.write({"action": what, "vehicle": vehicle, "parts": parts, "wall_s": self._clock.wall()})
            self._parts.clear()

    def ask_path(self, vehicle: Vehicle, path: Path, message: int) -> None:
        """Request one message on a path, to find out whether this vehicle answers there.

        Satellite paths are never asked.
        """
        if self._links[path.source.link].spec.high_latency:
            return
        vehicle.identity.version_requested_s = self._clock.now()
        frame = self._encode(
            vehicle, "COMMAND_LONG", {"command": 512, "confirmation": 0, "param1": message} | NO_MORE_PARAMETERS
        )
        self._recorder.write(self._clock.steady_wall(), frame)
        self._put(path.source.link, path.source.address, self._trust.signed(vehicle, frame))

    def _why_not(self, vehicle: Vehicle, what: str) -> str:
        """Why an action on `vehicle` must not leave, or ""."""
        lost = vehicle.freshness(self._clock.now()) is Freshness.LOST
        verdict = self._guard.judge_action(what, lost=lost)
        if not verdict.ok:
            return verdict.text
        if what in STOPS:
            return ""
        return vehicle.why_not_commanded or (
            vehicle.why_not_started if what in STARTS and not vehicle.telemetry.airborne else ""
        )

    def _why_no_target(self, vehicle: Vehicle | None, name: str, fields: dict[str, Any]) -> str:
        """Why there is no vehicle to which this may be sent, or ""."""
        if vehicle is None or vehicle.system == 0:
            return "unknown vehicle"
        purpose = f"{name}:{fields['command']}" if "command" in fields else name
        return "" if purpose in ALLOWED_TO_UNPROVEN or self.is_ours(vehicle) else "not one of our simulated vehicles"

    def _send(self, vehicle_id: int, name: str, fields: dict[str, Any], *, every_path: bool = False) -> str:
        """Put a message on the wire; "" or why not."""
        vehicle = self._fleet.vehicles.get(vehicle_id)
        why = self._why_no_target(vehicle, name, fields)
        if vehicle is None or why:
            return self._refuse(vehicle_id, name, why)
        frame = self._encode(vehicle, name, fields)
        self._recorder.write(self._clock.steady_wall(), frame)
        self._put_to(vehicle, self._trust.signed(vehicle, frame), every_path=every_path)
        return ""

    def _put_to(self, vehicle: Vehicle, frame: bytes, *, every_path: bool) -> None:
        """Send over the path in use; `every_path` over all of them."""
        # A stop goes over all paths: the one in use may have lost its way up without showing it.
        for path in vehicle.stop_paths(self._clock.now()) if every_path else (vehicle.path,):
            self._put(path.source.link, path.source.address, frame)

    def _encode(self, vehicle: Vehicle, name: str, fields: dict[str, Any]) -> bytes:
        """Encode for the vehicle's autopilot, unless `fields` name another component of it (a camera, a gimbal)."""
        layout = dialect.layout_named(name)
        if layout is not None and layout.target_system_at >= 0:
            # Never to system 0: an order to all systems would reach vehicles of other teams.
            fields = {"target_component": vehicle.component} | fields | {"target_system": vehicle.system}
        return self._encoder.encode(name, **fields)

    def _put(self, link: str, address: Address, frame: bytes) -> None:
        if self._links[link].spec.high_latency and frame[7:10] == HEARTBEAT_ID:
            return
        self._links[link].send(frame, address)
        self.sent += 1

    def _refuse(self, vehicle_id: int, name: str, why: str) -> str:
        """Count and report a frame that was not sent: nothing meant for a vehicle is lost silently. Returns `why`."""
        self.refused[why] += 1
        text = f"{name} NOT SENT: {why}"
        self._events.report(EventClass.PROCESSING, f"vehicle {vehicle_id}", text, ALERT, every_s=5)
        return why


def _numbers(fields: dict[str, Any]) -> dict[str, float]:
    return {key: value for key, value in fields.items() if isinstance(value, (int, float)) and value}

"""The uplink: every frame to a vehicle leaves here, addressed to one named vehicle, recorded and journalled.

Nothing leaves without a permission, which is a value: the guard's verdict, a stop reason, or the name of a question
that changes nothing. Orders, stops by set-point among them, are one journal line each; other set-points and parts of
transfers, which are many, one summary line a second. A stop goes over every path.
"""

from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.fleet.fleet import VehicleRegistry
from tui_gcs.core.fleet.identity.path import Path
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.guard.guard import Guard
from tui_gcs.core.guard.permission import (
    Order,
    OrderClass,
    Permission,
    Question,
    SetpointPermission,
    StopReason,
    Verdict,
)
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
from tui_gcs.core.uplink.questions import HEARTBEAT, question

ALLOWED_TO_UNPROVEN = frozenset({"HEARTBEAT", "COMMAND_LONG:511", "COMMAND_LONG:512", "TIMESYNC", "PING"})
"""What may go to a vehicle that has not proven which kind of run it belongs to: heartbeat, answers, requests for
information."""

NO_MORE_PARAMETERS = {f"param{i}": 0 for i in range(2, 8)}
HEARTBEATS_AT_ONCE = 40
"""Heartbeats sent before the rest of the station has its turn."""
SETPOINT = "SET_POSITION_TARGET_GLOBAL_INT"
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
        self._stop_places: dict[int, tuple[StopReason, dict[str, Any]]] = {}
        """By vehicle: the stop by set-point that was journalled last."""
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
            self._put([(path.source.link, path.source.address)], self._trust.signed(vehicle, frame), HEARTBEAT)
            if number % HEARTBEATS_AT_ONCE == 0:
                yield
        for number, (link, address) in enumerate(sorted(targets, key=str), 1):
            self._put([(link, address)], frame, HEARTBEAT)
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
        self._put([(source.link, source.address)], heartbeat, HEARTBEAT)

    def action(self, vehicle_id: int, order: Order, name: str, **fields: Any) -> str:
        """Have the guard judge an order, journal it, send it as the message `name`; "" or why not."""
        vehicle = self._fleet.vehicles.get(vehicle_id)
        permission = self._permission(vehicle, order) if vehicle is not None else ""
        why = permission if isinstance(permission, str) else ""
        why = why or self._why_no_target(vehicle, name, fields)
        # What is refused is not journalled as sent.
        if vehicle is None or isinstance(permission, str) or why:
            return self._refuse(vehicle_id, name, why)
        self._journal_order(vehicle_id, order, name, fields)
        self._put(self._ways(vehicle, permission), self._frame(vehicle, name, fields), permission)
        return ""

    def foreign(self, vehicle_id: int, raw: bytes, order: Order) -> str:
        """Pass on another station's frame, unchanged, if the guard lets it. Returns "" or why not.

        It is journalled with its source as the one that ordered it.

        The frame keeps its sender, so one for a vehicle with a key cannot be signed here: it is refused.
        """
        vehicle = self._fleet.vehicles.get(vehicle_id)
        if vehicle is None:
            return "unknown vehicle"
        permission = self._permission(vehicle, order)
        why = permission if isinstance(permission, str) else ""
        if not why and not self.is_ours(vehicle):
            why = "not one of our simulated vehicles"
        if not why and vehicle.identity.keyed:
            why = "the vehicle takes signed frames only, and another station's are not signed for it"
        entry = {"foreign": order.what, "source": order.by, "vehicle": vehicle_id, "wall_s": self._clock.wall()}
        self._journal.write(entry | ({"refused": why} if why else {}))
        if why or isinstance(permission, str):
            self.refused[why] += 1
            return why
        # A foreign frame is recorded as it goes out, with its own sender.
        self._recorder.write(self._clock.steady_wall(), raw)
        self._put(self._ways(vehicle, permission), raw, permission)
        return ""

    def give_key(self, vehicle: Vehicle, key: SigningKey) -> str:
        """Send `key` with SETUP_SIGNING to one vehicle; "" or why not.

        It is never recorded, and journalled by name only.

        The caller has checked that the link is secure and the vehicle disarmed, and that the operator has confirmed it.
        """
        permission = self._permission(vehicle, Order("provision key"))
        if isinstance(permission, str) or not self.is_ours(vehicle):
            return permission if isinstance(permission, str) else "not one of our simulated vehicles"
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
        self._put([(vehicle.link, vehicle.address)], self._trust.signed(vehicle, frame), permission)
        return ""

    def setpoint(self, vehicle_id: int, permission: SetpointPermission, **fields: Any) -> None:
        """Send a SET_POSITION_TARGET_GLOBAL_INT with the guard's verdict on its course, or with a stop reason.

        A stop is journalled whenever its reason or its place is new.
        """
        vehicle = self._fleet.vehicles.get(vehicle_id)
        why = self._why_no_target(vehicle, SETPOINT, fields)
        if vehicle is not None and not why:
            why = vehicle.why_not_commanded
        if isinstance(permission, Verdict) and not permission.ok:
            why = f"vetoed: {permission.text}"
        if vehicle is None or why:
            self._refuse(vehicle_id, "set-point", why)
            return
        self._put(self._ways(vehicle, permission), self._frame(vehicle, SETPOINT, fields), permission)
        self._setpoints[vehicle_id] += 1
        if not isinstance(permission, StopReason):
            self._stop_places.pop(vehicle_id, None)
        elif self._stop_places.get(vehicle_id) != (permission, fields):
            self._stop_places[vehicle_id] = permission, fields
            order = Order(permission.what, OrderClass.STOP, permission.by)
            self._journal_order(vehicle_id, order, SETPOINT, fields)

    def transfer(self, vehicle_id: int, what: str, name: str, **fields: Any) -> bool:
        """Send a part of a transfer whose beginning was an `action` (plan items, file blocks); whether it left.

        The guard judges every part; the journal gets one line a second with their number.
        """
        vehicle = self._fleet.vehicles.get(vehicle_id)
        permission = self._permission(vehicle, Order(what)) if vehicle is not None else "unknown vehicle"
        if isinstance(permission, str):
            self._refuse(vehicle_id, name, permission)
            return False
        if self._send(vehicle_id, permission, name, fields):
            return False
        self._parts[(vehicle_id, what)] += 1
        return True

    def ask(self, vehicle_id: int, name: str, **fields: Any) -> str:
        """Send a request for information or message rates; "" or why not. What could move a vehicle is refused."""
        permission = question(name, fields)
        if permission is None:
            return self._refuse(vehicle_id, name, "no question: it would change the vehicle")
        return self._send(vehicle_id, permission, name, fields)

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
        fields = {"command": 512, "confirmation": 0, "param1": message} | NO_MORE_PARAMETERS
        frame = self._frame(vehicle, "COMMAND_LONG", fields)
        self._put([(path.source.link, path.source.address)], frame, Question("COMMAND_LONG"))

    def ask_time(self, vehicle: Vehicle, path: Path, ts1: int) -> None:
        """Request the vehicle's time on one path: the answer shows that our frames arrive there, and how soon."""
        frame = self._frame(vehicle, "TIMESYNC", {"tc1": 0, "ts1": ts1})
        self._put([(path.source.link, path.source.address)], frame, Question("TIMESYNC"))

    def _permission(self, vehicle: Vehicle, order: Order) -> Permission | str:
        """The permission of an order to `vehicle`, or why it must not leave."""
        lost = vehicle.freshness(self._clock.now()) is Freshness.LOST
        verdict = self._guard.judge_action(order, lost=lost)
        if not verdict.ok:
            return verdict.text
        if order.order_class is OrderClass.STOP:
            return StopReason(order.what, order.by)
        starts = order.order_class is OrderClass.START and not vehicle.telemetry.airborne
        return vehicle.why_not_commanded or (vehicle.why_not_started if starts else "") or verdict

    def _journal_order(self, vehicle_id: int, order: Order, name: str, fields: dict[str, Any]) -> None:
        entry = {"action": order.what, "class": order.order_class.value, "by": order.by, "vehicle": vehicle_id}
        self._journal.write(entry | {"message": name, "wall_s": self._clock.wall()} | _numbers(fields))

    def _why_no_target(self, vehicle: Vehicle | None, name: str, fields: dict[str, Any]) -> str:
        """Why there is no vehicle to which this may be sent, or ""."""
        if vehicle is None or vehicle.system == 0:
            return "unknown vehicle"
        purpose = f"{name}:{fields['command']}" if "command" in fields else name
        return "" if purpose in ALLOWED_TO_UNPROVEN or self.is_ours(vehicle) else "not one of our simulated vehicles"

    def _send(self, vehicle_id: int, permission: Permission, name: str, fields: dict[str, Any]) -> str:
        """Put a message on the wire; "" or why not."""
        vehicle = self._fleet.vehicles.get(vehicle_id)
        why = self._why_no_target(vehicle, name, fields)
        if vehicle is None or why:
            return self._refuse(vehicle_id, name, why)
        self._put(self._ways(vehicle, permission), self._frame(vehicle, name, fields), permission)
        return ""

    def _ways(self, vehicle: Vehicle, permission: Permission) -> list[tuple[str, Address]]:
        """Link and address of the path in use; of all of them for a stop."""
        # The path in use may have lost its way up without showing it.
        stops = isinstance(permission, StopReason)
        paths = vehicle.stop_paths(self._clock.now()) if stops else (vehicle.path,)
        return [(path.source.link, path.source.address) for path in paths]

    def _frame(self, vehicle: Vehicle, name: str, fields: dict[str, Any]) -> bytes:
        """Encode, record and sign a message for the vehicle.

        It is for its autopilot, unless `fields` name another component of it (a camera, a gimbal).
        """
        layout = dialect.layout_named(name)
        if layout is not None and layout.target_system_at >= 0:
            # Never to system 0: an order to all systems would reach vehicles of other teams.
            fields = {"target_component": vehicle.component} | fields | {"target_system": vehicle.system}
        frame = self._encoder.encode(name, **fields)
        self._recorder.write(self._clock.steady_wall(), frame)
        return self._trust.signed(vehicle, frame)

    def _put(self, ways: Iterable[tuple[str, Address]], frame: bytes, permission: Permission) -> None:
        """Send a frame over each way. This is the only call of `Link.send` to vehicles.

        `permission` is not read here. It is an argument so that no caller can send without having one.
        """
        for link, address in ways:
            if self._links[link].spec.high_latency and frame[7:10] == HEARTBEAT_ID:
                continue
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

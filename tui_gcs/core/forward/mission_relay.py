"""Uploads of other stations: collected and checked as a whole, and only then handed to the vehicle.

A mission that is refused halfway would leave its first items on board, where ArduPilot cuts the old mission at the
announcement. So the station answers an announcement in the vehicle's place and requests the items itself. Once all of
them are checked, it sends the vehicle the announcement and each requested item, unchanged. The vehicle's own
MISSION_ACK ends the upload for both.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

from tui_gcs.core.base.clock import Clock
from tui_gcs.core.firmware.foreign_command_policy import foreign_command_policy
from tui_gcs.core.fleet.vehicle import Vehicle
from tui_gcs.core.forward.foreign_missions import ForeignMission
from tui_gcs.core.forward.mission_rules import mission_step_of, require_no_mission
from tui_gcs.core.forward.ports import Port
from tui_gcs.core.forward.request_checks import (
    MISSION_CANCELLED,
    MISSION_DENIED,
    MISSION_INVALID_SEQUENCE,
    ForeignRefusal,
    ForeignRequest,
)
from tui_gcs.core.mavlink.dialect import MavlinkMessage
from tui_gcs.core.mavlink.sources import Address

REPEAT_S = 1.0
"""A request or announcement is repeated after this long without an answer, as ArduPilot does.

While the vehicle is busy with the items, the last one is requested again and again: QGroundControl ends an upload when
nothing comes for 1.5 s.
"""
GIVE_UP_S = 8.0
"""An upload ends when the side that has to answer is silent this long, as ArduPilot's does."""
VEHICLE_FRAMES = frozenset({40, 47, 51})
"""MISSION_REQUEST, MISSION_ACK, MISSION_REQUEST_INT."""


@dataclass
class MissionUpload:
    """One upload of another station to one vehicle."""

    port: Port
    address: Address
    station: str
    """Address, system and component of the station, in words."""
    vehicle: Vehicle
    kind: int
    """MAV_MISSION_TYPE."""
    announcement: bytes
    """Its MISSION_COUNT, unchanged."""
    sender: tuple[int, int]
    """Its system and component."""
    mission: ForeignMission
    last_heard_s: float
    """When the side that has to answer did so last: the station while items are collected, then the vehicle."""
    asked_s: float
    items: list[bytes] = field(default_factory=list)
    """The frames of the checked items, unchanged."""
    requested: int | None = None
    """The item that the vehicle requested last; None while it has not answered the announcement."""

    @property
    def under_way(self) -> str:
        """Why no other upload to the vehicle may begin now."""
        return f"an upload of {self.port.link.name} {self.station} is under way"

    @property
    def is_complete(self) -> bool:
        """Whether all items were collected, so that the vehicle has its turn."""
        return len(self.items) == self.mission.count


class MissionRelay:
    """The uploads under way, at most one for each vehicle."""

    def __init__(
        self,
        clock: Clock,
        send: Callable[[MissionUpload, bytes, str], str],
        end: Callable[[MissionUpload, int, str], None],
    ) -> None:
        """`send` hands a frame to the vehicle, as what, and returns why not.

        `end` answers the station with a MAV_MISSION_RESULT and the reason.
        """
        self._clock = clock
        self._send = send
        self._end = end
        self._uploads: dict[int, MissionUpload] = {}

    @property
    def is_busy(self) -> bool:
        """Whether an upload is under way."""
        return bool(self._uploads)

    def collected(self, vehicle: Vehicle, message: MavlinkMessage) -> ForeignMission | None:
        """What was collected of the upload to which an item belongs, None if there is no such upload."""
        upload = self._of(vehicle, message)
        return upload.mission if upload is not None and upload.kind == message.fields.get("mission_type") else None

    def announce(self, request: ForeignRequest, port: Port, address: Address, station: str, raw: bytes) -> str:
        """Begin to collect an upload of one item or more; "" or why not."""
        vehicle, message, now = request.vehicle, request.message, request.now
        sender = (message.system, message.component)
        other = self._uploads.get(vehicle.id)
        # A second announcement of the same sender begins anew, as autopilots do; another sender has to wait.
        if other is not None and (other.is_complete or other.sender != sender):
            return other.under_way
        mission = ForeignMission(sender, message.fields["count"])
        kind = message.fields["mission_type"]
        upload = MissionUpload(port, address, station, vehicle, kind, raw, sender, mission, now, now)
        self._uploads[vehicle.id] = upload
        self._request_item(upload)
        return ""

    def add(self, request: ForeignRequest, raw: bytes) -> str:
        """Keep an item that passed the rules, or drop it if it came before. Returns why the whole may not go, or ""."""
        upload = self._uploads[request.vehicle.id]
        if request.fields["seq"] < len(upload.items):
            return ""
        upload.mission.steps.append(mission_step_of(request))
        upload.items.append(raw)
        upload.last_heard_s = request.now
        if not upload.is_complete:
            self._request_item(upload)
            return ""
        return self._announce_to_vehicle(upload)

    def busy(self, vehicle: Vehicle) -> str:
        """Why nothing else may change the mission of `vehicle` just now, or ""."""
        upload = self._uploads.get(vehicle.id)
        return upload.under_way if upload is not None and upload.is_complete else ""

    def cancel(self, vehicle: Vehicle, message: MavlinkMessage) -> None:
        """Forget the items of the sender of `message`: one was refused, or it ends its upload.

        What is being handed to the vehicle already is handed over to the end.
        """
        upload = self._of(vehicle, message)
        if upload is not None and not upload.is_complete:
            del self._uploads[vehicle.id]

    def drop_collected(self, port: Port) -> None:
        """Forget the items that are being collected from the stations at `port`, which is closed."""
        for upload in list(self._uploads.values()):
            if upload.port is port and not upload.is_complete:
                del self._uploads[upload.vehicle.id]

    def on_vehicle(self, vehicle: Vehicle, message: MavlinkMessage, plan: ForeignMission) -> bool:
        """Take a frame of the mission protocol from the vehicle; whether it was for this relay and not for the station.

        `plan` is what is on board, and is brought up to date.
        """
        upload = self._uploads.get(vehicle.id)
        fields = message.fields
        ours = (
            upload is not None
            and upload.is_complete
            and upload.kind == fields["mission_type"]
            and upload.sender[0] == fields["target_system"]
        )
        if message.name != "MISSION_ACK":
            if ours and upload is not None:
                self._hand_over(upload, fields["seq"])
            return ours
        # ArduPilot answers a repeated item so, and goes on.
        if ours and fields["type"] == MISSION_INVALID_SEQUENCE:
            return True
        accepted = fields["type"] == 0
        if ours and upload is not None:
            del self._uploads[vehicle.id]
            if accepted and upload.kind == 0 and upload.requested == upload.mission.count - 1:
                plan.accept(upload.mission)
                return False
        refused_sender = plan.sender is not None and plan.sender[0] == fields["target_system"]
        if fields["mission_type"] == 0 and (accepted or refused_sender):
            plan.forget()  # another mission is on board now, or a part of one
        return False

    def tick(self) -> None:
        """Repeat what was not answered, and end uploads in which one side is silent."""
        now = self._clock.now()
        for upload in list(self._uploads.values()):
            if now - upload.last_heard_s > GIVE_UP_S:
                del self._uploads[upload.vehicle.id]
                silent = "the vehicle does not answer" if upload.is_complete else "not all items came"
                self._end(upload, MISSION_CANCELLED, f"mission upload: {silent}")
            elif now - upload.asked_s > REPEAT_S:
                self._request_item(upload)
                if upload.is_complete and upload.requested is None:
                    self._send(upload, upload.announcement, "mission upload item")

    def _of(self, vehicle: Vehicle, message: MavlinkMessage) -> MissionUpload | None:
        """The upload of this sender to the vehicle."""
        upload = self._uploads.get(vehicle.id)
        ours = upload is not None and upload.sender == (message.system, message.component)
        return upload if ours else None

    def _request_item(self, upload: MissionUpload) -> None:
        """Request the next item of the station in the vehicle's name, or the last one again to keep it waiting."""
        upload.asked_s = self._clock.now()
        system, component = upload.sender
        old = foreign_command_policy(upload.vehicle).requests_float_items
        upload.port.send_as(
            upload.vehicle,
            upload.address,
            "MISSION_REQUEST" if old else "MISSION_REQUEST_INT",
            target_system=system,
            target_component=component,
            seq=min(len(upload.items), upload.mission.count - 1),
            mission_type=upload.kind,
        )

    def _announce_to_vehicle(self, upload: MissionUpload) -> str:
        """Begin the upload to the vehicle; "" or why not."""
        try:
            # Between the announcement and the last item the vehicle may have begun to fly its old mission.
            if upload.kind == 0:
                require_no_mission(upload.vehicle)
        except ForeignRefusal as refused:
            why = str(refused)
        else:
            why = self._send(upload, upload.announcement, "mission upload")
        if why:
            del self._uploads[upload.vehicle.id]
            self._end(upload, MISSION_DENIED, why)
        return why

    def _hand_over(self, upload: MissionUpload, seq: int) -> None:
        """Send the vehicle the item that it requests."""
        upload.last_heard_s = self._clock.now()
        if seq < len(upload.items):
            upload.requested = seq
            self._send(upload, upload.items[seq], "mission upload item")
